//! FLIP (Andersson et al. 2020), by NVIDIA's reference code.

use super::{Mask, check};
use crate::{Error, Result, image::Image};
use glam::Vec3;
use nv_flip::{FlipImageRgb8, flip as reference_flip};
use rayon::prelude::*;

/// The paper's viewing condition: 0.7 m from a 0.7 m wide display with 3840 pixels.
const PIXELS_PER_DEGREE: f32 = 67.0;
/// Rows a piece. Pieces run in parallel and bound the memory the reference code takes.
const BAND: usize = 256;
/// Rows beyond a piece that its filters may see; their radii at 67 pixels a degree are 10 and 9.
const HALO: usize = 12;
/// Pixels a row: a piece with its halo stays below the 2³¹ bytes the reference code can index.
const MAX_WIDTH: usize = 1 << 20;

/// Mean LDR-FLIP error at 67 pixels a degree, in [0, 1], of display-encoded (sRGB) pictures. Values are clamped to [0, 1]
/// and rounded to 8 bits, as the reference code takes them.
///
/// # Errors
/// [`Error::Argument`] if the sizes differ, the mask is empty, or the picture is wider than 2²⁰ pixels.
pub fn flip(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<f64> {
    check(a, b, mask)?;
    if a.width() > MAX_WIDTH {
        return Err(Error::argument(format!("FLIP takes pictures up to {MAX_WIDTH} pixels wide, not {}", a.width())));
    }
    Ok(mean(a, b, mask, BAND))
}

/// The mean error with `band` rows a piece; the pieces' halos make the result independent of `band`.
pub(super) fn mean(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>, band: usize) -> f64 {
    let (w, h) = a.size();
    let piece = |top: usize| {
        let bottom = (top + band).min(h);
        let (from, to) = (top.saturating_sub(HALO), (bottom + HALO).min(h));
        let cut = |image: &Image<Vec3>| {
            let bytes: Vec<u8> = image.data()[from * w..to * w].iter().flat_map(|p| p.to_array().map(quantize)).collect();
            FlipImageRgb8::with_data(w as u32, (to - from) as u32, &bytes)
        };
        let map = reference_flip(cut(a), cut(b), PIXELS_PER_DEGREE).to_vec();
        let rows = map[(top - from) * w..(bottom - from) * w].chunks(w);
        let sums = rows.zip(top..).map(|(row, y)| {
            let counted = row.iter().enumerate().filter(|(x, _)| mask.is_none_or(|m| m.get(*x, y)));
            counted.fold((0.0, 0u64), |(sum, n), (_, &e)| (sum + f64::from(e), n + 1))
        });
        sums.collect::<Vec<(f64, u64)>>()
    };
    // Rows are added in order, so that neither threads nor pieces change the result.
    let rows: Vec<_> = (0..h).step_by(band).collect::<Vec<_>>().into_par_iter().flat_map_iter(piece).collect();
    let (sum, n) = rows.iter().fold((0.0, 0), |(s, n), row| (s + row.0, n + row.1));
    sum / n as f64
}

/// [0, 1] to 8 bits, rounded; NaN becomes 0.
fn quantize(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}
