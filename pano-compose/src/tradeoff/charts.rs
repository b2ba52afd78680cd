//! Charts as SVG.

use super::{COMBINATION, Knob, Row, front};
use crate::pipeline::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Width and height of a chart in SVG units.
const SIZE: (u32, u32) = (860, 520);
const SMALL: (u32, u32) = (420, 300);
/// Told apart also without colour vision (Okabe & Ito).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];

/// Error against time of every combination, a colour a method, with the front as a line; a thin one at the `untouched` photo's error.
pub(super) fn error_against_time(rows: &[Row], untouched: f64) -> Result<String> {
    let rows: Vec<Row> = rows.iter().filter(|r| r.series == COMBINATION).cloned().collect();
    let front: Vec<(f64, f64)> = front(&rows).iter().map(|r| (r.ms, r.error)).collect();
    let mut methods: Vec<&str> = Vec::new();
    for row in &rows {
        if !methods.contains(&row.method.as_str()) {
            methods.push(&row.method);
        }
    }
    draw(SIZE, |area| {
        let (x, y) = (span(rows.iter().map(|r| r.ms)), span(rows.iter().map(|r| r.error)));
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(42)
            .y_label_area_size(64)
            .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc("time, ms")
            .y_desc("error (RMS, white = 1)")
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .draw()?;
        chart
            .draw_series(LineSeries::new(front.iter().copied(), BLACK.stroke_width(2)))?
            .label("front")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK.stroke_width(2)));
        if (y.0..y.1).contains(&untouched) {
            let line = LineSeries::new([(x.0, untouched), (x.1, untouched)], BLACK.mix(0.5).stroke_width(1));
            chart
                .draw_series(line)?
                .label("the photo without objects")
                .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK.mix(0.5).stroke_width(1)));
        }
        for (i, method) in methods.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let of_method = || rows.iter().filter(|r| r.method == *method);
            chart.draw_series(of_method().map(|r| {
                let (low, high) = ((r.error - r.error_se).max(y.0), r.error + r.error_se);
                PathElement::new([(r.ms, low), (r.ms, high)], colour.stroke_width(1))
            }))?;
            // Filled: filtered.
            chart
                .draw_series(of_method().map(|r| {
                    let style = if r.denoise { colour.filled() } else { colour.stroke_width(1) };
                    Circle::new((r.ms, r.error), 4, style)
                }))?
                .label(*method)
                .legend(move |(x, y)| Circle::new((x + 8, y), 4, colour.filled()));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        Ok(())
    })
}

/// The curve of one knob: error and time, both relative to the default's.
pub(super) fn knob_curve(knob: &Knob, rows: &[Row]) -> Result<Option<String>> {
    let swept: Vec<&Row> =
        knob.values.iter().filter_map(|v| rows.iter().find(|r| r.series == knob.name && r.value == *v)).collect();
    let Some(base) = swept.iter().find(|r| r.value == knob.default) else { return Ok(None) };
    let relative: Vec<(f64, f64, f64, bool)> = swept
        .iter()
        .map(|r| (r.ms / base.ms, r.error / base.error, r.error_se / base.error, r.value == knob.default))
        .filter(|p| p.0.is_finite() && p.1.is_finite())
        .collect();
    let chart =
        draw(SMALL, |area| {
            let (_, right) = span(relative.iter().map(|p| p.0));
            let (_, top) = span(relative.iter().map(|p| p.1 + p.2));
            let (x, y) = ((0.0, 1.1 * right), (0.0, 1.1 * top));
            let mut chart = ChartBuilder::on(area)
                .margin(10)
                .caption(knob.name, ("sans-serif", 15))
                .x_label_area_size(36)
                .y_label_area_size(52)
                .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
            chart
                .configure_mesh()
                .x_desc("time / default's")
                .y_desc("error / default's")
                .x_labels(5)
                .y_labels(5)
                .x_label_formatter(&tick)
                .y_label_formatter(&tick)
                .draw()?;
            chart.draw_series(LineSeries::new(relative.iter().map(|p| (p.0, p.1)), COLOURS[0].mix(0.5)))?;
            chart.draw_series(
                relative.iter().map(|p| PathElement::new([(p.0, (p.1 - p.2).max(y.0)), (p.0, p.1 + p.2)], COLOURS[0])),
            )?;
            chart.draw_series(
                relative.iter().map(|p| Circle::new((p.0, p.1), 4, if p.3 { BLACK.filled() } else { COLOURS[0].filled() })),
            )?;
            chart.draw_series(relative.iter().zip(&swept).map(|(p, r)| {
                EmptyElement::at((p.0, p.1)) + Text::new(r.value.clone(), (6, -14), ("sans-serif", 12)).into_dyn()
            }))?;
            Ok(())
        })?;
    Ok(Some(chart))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(size: (u32, u32), paint: impl FnOnce(&Area<'_>) -> Result<(), Box<dyn std::error::Error>>) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let painted =
            area.fill(&WHITE).map_err(Into::into).and_then(|()| paint(&area)).and_then(|()| area.present().map_err(Into::into));
        painted.map_err(|e: Box<dyn std::error::Error>| {
            Error::unsupported(format!("a chart cannot be drawn: {e}"), "report this")
        })?;
    }
    Ok(svg)
}

/// From a little below the smallest to a little above the largest positive value, at least a factor of 2 apart.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.filter(|v| v.is_finite() && *v > 0.0).fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.5, 2.0);
    }
    let middle = (low * high).sqrt();
    ((low / 1.15).min(middle / 2f64.sqrt()), (high * 1.15).max(middle * 2f64.sqrt()))
}

/// Three digits, without zeros at the end.
fn tick(value: &f64) -> String {
    if *value == 0.0 {
        return "0".into();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
