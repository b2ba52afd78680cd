//! The files of a sweep: charts, pictures, and one page that holds them all.

use super::measure::Bench;
use super::record::Record;
use super::{BUDGETS_MS, COMBINATION, Choice, KNOBS, PREPARATIONS, Row, Truth, Verdict, affordable, charts, front};
use crate::pipeline::{Folder, Result};
use base64::{Engine, engine::general_purpose::STANDARD};
use pano_core::{image::RadianceImage, io, progress::Progress};
use std::fmt::Write;

/// Writes everything but `results.csv`, which is there already; returns the names.
pub(super) fn write(
    folder: &Folder,
    bench: &mut Bench<'_>,
    record: &Record,
    truth: &Truth,
    verdict: &Verdict,
    progress: &dyn Progress,
) -> Result<Vec<String>> {
    let mut names = vec!["results.csv".to_owned()];
    let mut save = |name: String, text: &str| -> Result<()> {
        io::write_text(folder.path().join(&name), text)?;
        names.push(name);
        Ok(())
    };
    let combined: Vec<Row> = record.rows().iter().filter(|r| r.series == COMBINATION).cloned().collect();
    let front = front(&combined);
    let overview = charts::error_against_time(record.rows(), verdict.untouched)?;
    save("error-against-time.svg".into(), &overview)?;
    let mut curves = String::new();
    for knob in KNOBS {
        if let Some(svg) = charts::knob_curve(knob, record.rows())? {
            save(format!("knob-{}.svg", knob.name), &svg)?;
            let _ = write!(curves, "<figure>{svg}<figcaption>{}: {}</figcaption></figure>", knob.name, escape(knob.error));
        }
    }
    let mut embed = |image: &RadianceImage, name: String| -> Result<String> {
        let path = folder.path().join(&name);
        io::write_image(&path, image, None)?;
        let bytes = std::fs::read(&path).map_err(|e| {
            pano_core::Error::file(&path, format!("cannot be read back: {e}"), "check that nothing else writes into the folder")
        })?;
        let tag = format!("<img src=\"data:image/png;base64,{}\" alt=\"{name}\">", STANDARD.encode(bytes));
        names.push(name);
        Ok(tag)
    };
    let truth_picture = embed(&bench.shown(&truth.picture()).0, "truth.png".into())?;
    let mut pictures = format!("<figure>{truth_picture}<figcaption>truth</figcaption></figure>");
    let mut shown: Vec<&str> = vec![];
    for row in BUDGETS_MS.iter().filter_map(|&ms| affordable(&front, ms)) {
        if shown.contains(&row.arguments.as_str()) {
            continue;
        }
        shown.push(&row.arguments);
        let Some(choice) = choice_of(bench, row) else { continue };
        let rendered = bench.picture(&choice, 0, progress)?;
        let (plain, map) = bench.shown(&rendered.composite.color);
        let stem = format!("choice-{}", shown.len());
        let (plain, map) = (embed(&plain, format!("{stem}.png"))?, embed(&map, format!("{stem}-error.png"))?);
        let label = format!("{}<br>{:.0} ms, error {:.4}", escape(&row.arguments), row.ms, row.error);
        let _ = write!(
            pictures,
            "<figure>{plain}{map}<figcaption>{label}; right: its error, white from a tenth on</figcaption></figure>"
        );
    }
    let page = PAGE
        .replace("{origin}", &origin(truth))
        .replace("{overview}", &overview)
        .replace("{choices}", &choices(&front))
        .replace("{front}", &table(&front))
        .replace("{verdict}", &escape(&verdict.to_string()))
        .replace("{curves}", &curves)
        .replace("{samples}", &record.rows().iter().find(|r| r.series != COMBINATION).map_or(0, |r| r.samples).to_string())
        .replace("{knobs}", &knobs())
        .replace("{pictures}", &pictures);
    io::write_text(folder.path().join("index.html"), &page)?;
    names.push("index.html".to_owned());
    Ok(names)
}

fn origin(truth: &Truth) -> String {
    let sure = truth.error.map_or("its own error is not known".into(), |e| format!("its own error is about {e:.4}"));
    format!("{}; {sure}", escape(&truth.origin))
}

/// The choice of a row in combinations.
fn choice_of(bench: &Bench<'_>, row: &Row) -> Option<Choice> {
    let method = *bench.methods().iter().find(|m| m.name() == row.method)?;
    let choice = Choice { samples: row.samples, bounces: row.bounces, denoise: row.denoise, ..bench.default_choice(method) };
    // The preparation is only told by the arguments.
    PREPARATIONS.iter().map(|p| choice.prepared(p)).find(|choice| choice.arguments() == row.arguments)
}

/// What to choose for each budget.
fn choices(front: &[&Row]) -> String {
    let line = |ms: f64| match affordable(front, ms) {
        Some(row) => {
            format!("<tr><td>{}<td><code>{}</code><td>{:.1} ms<td>{:.4}", duration(ms), escape(&row.arguments), row.ms, row.error)
        }
        None => {
            let fastest = front.first().map_or(String::new(), |r| format!("the fastest takes {:.0} ms", r.ms));
            format!("<tr><td>{}<td colspan=3>nothing is this fast here: {fastest}", duration(ms))
        }
    };
    BUDGETS_MS.iter().map(|&ms| line(ms)).collect()
}

fn table(front: &[&Row]) -> String {
    let line = |r: &&Row| {
        format!(
            "<tr><td><code>{}</code><td>{:.1}<td>{:.1}<td>{:.1}<td>{:.1}<td>{:.5} ± {:.5}<td>{:.5}",
            escape(&r.arguments),
            r.ms,
            r.world_ms,
            r.trace_ms,
            r.denoise_ms,
            r.error,
            r.error_se,
            r.noise
        )
    };
    front.iter().map(line).collect()
}

fn knobs() -> String {
    let line = |k: &super::Knob| {
        format!("<tr><td><code>{}</code><td>{}<td>{}<td>{}<td>{}", k.name, k.unit, k.range, k.default, escape(k.error))
    };
    KNOBS.iter().map(line).collect()
}

fn duration(ms: f64) -> String {
    if ms >= 1e3 { format!("{} s", ms / 1e3) } else { format!("{ms} ms") }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

const PAGE: &str = "<!doctype html>
<html lang=\"en\"><meta charset=\"utf-8\"><title>What accuracy costs</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; max-width: 70em; margin: 2em auto; padding: 0 1em; color: #222; background: #fff }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .25em .8em; border-bottom: 1px solid #ddd; text-align: left }
figure { display: inline-block; margin: .5em; vertical-align: top } figure img { max-width: 400px; margin-right: 4px }
figcaption { max-width: 810px; font-size: 13px; color: #555 } svg { max-width: 100%; height: auto }
</style>
<h1>What accuracy costs</h1>
<p>Error: root mean square difference to the truth, display-encoded, over the pixels the objects change. Time: median, from the
prepared scene to the composite; with depth, preparing the captured world is part of it. Truth: {origin}.</p>
{overview}
<h2>What to choose</h2>
<table><tr><th>budget<th>options of <code>pano render</code><th>takes<th>error{choices}</table>
<h2>Pictures</h2>
{pictures}
<h2>The front</h2>
<p>Here {verdict}.</p>
<p>Noise is what changes from seed to seed, of the preparation as of the picture, and falls with samples. The rest of the error
(its square is error² − noise²) is what a choice always gets wrong, and no number of samples mends.</p>
<table><tr><th>options<th>ms<th>world<th>trace<th>filter<th>error<th>of it noise{front}</table>
<h2>One knob at a time</h2>
<p>Time and error relative to the default (black), {samples} samples a pixel; bars: standard error.</p>
{curves}
<h2>All knobs</h2>
<table><tr><th>knob<th>unit<th>range<th>default<th>a cheap value costs{knobs}</table>
</html>
";
