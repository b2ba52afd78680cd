//! The contact sheet: pictures with their names, times and errors, and below each where it is wrong.

use super::numbers::Score;
use super::{Demo, MethodNumbers};
use crate::annotate::text::{self, GLYPH};
use crate::exposure::{encoded, exposed};
use glam::Vec3;
use pano_core::image::RadianceImage;

/// Pictures a row.
const COLUMNS: usize = 3;
/// Pixels between pictures.
const GAP: usize = 8;
/// Display-encoded difference that error maps show as their brightest colour.
const FULL_ERROR: f32 = 0.25;
const PAPER: Vec3 = Vec3::splat(0.012);
const INK: Vec3 = Vec3::splat(0.9);
const FAINT_INK: Vec3 = Vec3::splat(0.3);
/// Colours of error maps from 0 to [`FULL_ERROR`], linear.
const RAMP: [Vec3; 5] = [
    Vec3::ZERO,
    Vec3::new(0.06, 0.01, 0.22),
    Vec3::new(0.55, 0.03, 0.18),
    Vec3::new(0.95, 0.35, 0.02),
    Vec3::new(1.0, 1.0, 0.75),
];

/// A picture, its error map, and what stands above each.
struct Cell {
    title: String,
    note: String,
    picture: RadianceImage,
    error_title: String,
    error: RadianceImage,
}

impl Demo {
    /// The contact sheet, exposed: white is 1.
    pub fn contact_sheet(&self) -> RadianceImage {
        let numbers = &self.numbers;
        let truth = exposed(&self.truth, numbers.white);
        let without = exposed(&self.truth_without, numbers.white);
        let photo = exposed(self.photo(), numbers.white);
        let mut composites = self.composites.iter().zip(&numbers.methods).map(|((_, rendered), row)| {
            let picture = exposed(&rendered.composite.color, numbers.white);
            Cell {
                title: row.method.to_owned(),
                note: method_note(row),
                error_title: format!("{} - truth", row.method),
                error: error_map(&picture, &truth),
                picture,
            }
        });
        let mut cells = vec![Cell {
            title: "photo".into(),
            note: format!("panorama {} x {}", numbers.panorama[0], numbers.panorama[1]),
            error_title: "photo - truth: what the objects change".into(),
            error: error_map(&photo, &truth),
            picture: photo.clone(),
        }];
        cells.extend(composites.next());
        cells.push(Cell {
            title: "truth".into(),
            note: format!("path-traced, {} samples, {}", numbers.truth_samples, seconds(numbers.truth.ms)),
            error_title: format!("photo - truth, empty: {}", score_note(&numbers.photo.view)),
            error: error_map(&photo, &without),
            picture: truth.clone(),
        });
        cells.extend(composites);
        lay_out(&cells)
    }
}

fn method_note(row: &MethodNumbers) -> String {
    format!("{} spp  {}  {}", row.samples, seconds(row.ms), score_note(&row.scores.crop))
}

fn score_note(score: &Score) -> String {
    let ssim = score.ssim.map_or(String::new(), |ssim| format!("SSIM {ssim:.4}  "));
    format!("{ssim}FLIP {:.4}", score.flip)
}

fn seconds(ms: f64) -> String {
    format!("{:.1} s", ms / 1e3)
}

/// Mean absolute difference of the channels, display-encoded, in the colours of [`RAMP`].
fn error_map(a: &RadianceImage, b: &RadianceImage) -> RadianceImage {
    let (a, b) = (encoded(a), encoded(b));
    RadianceImage::from_fn(a.width(), a.height(), |x, y| {
        let difference = (a.get(x, y) - b.get(x, y)).abs().element_sum() / 3.0;
        let t = (difference / FULL_ERROR).min(1.0) * (RAMP.len() - 1) as f32;
        let i = (t as usize).min(RAMP.len() - 2);
        RAMP[i].lerp(RAMP[i + 1], t - i as f32)
    })
}

/// Cells in rows of [`COLUMNS`], each picture above its error map. Lettering grows with the pictures.
fn lay_out(cells: &[Cell]) -> RadianceImage {
    let (w, h) = cells[0].picture.size();
    // A third of the width holds 20 letters of the title, or more.
    let scale = (w / 240).max(1);
    let line = GLYPH * scale + GAP / 2;
    let (row, rows) = (2 * (h + GAP) + 3 * line, cells.len().div_ceil(COLUMNS));
    let mut sheet = RadianceImage::filled(GAP + COLUMNS * (w + GAP), GAP + rows * row, PAPER);
    for (i, cell) in cells.iter().enumerate() {
        let (x, mut y) = (GAP + i % COLUMNS * (w + GAP), GAP + i / COLUMNS * row);
        text::draw(&mut sheet, (x, y), scale, INK, &cell.title);
        y += line;
        text::draw(&mut sheet, (x, y), scale, FAINT_INK, &cell.note);
        y += line;
        paste(&mut sheet, &cell.picture, (x, y));
        y += h + GAP;
        text::draw(&mut sheet, (x, y), scale, FAINT_INK, &cell.error_title);
        paste(&mut sheet, &cell.error, (x, y + line));
    }
    sheet
}

fn paste(sheet: &mut RadianceImage, picture: &RadianceImage, (left, top): (usize, usize)) {
    for y in 0..picture.height() {
        for (x, p) in picture.row(y).iter().enumerate() {
            sheet.set(left + x, top + y, *p);
        }
    }
}
