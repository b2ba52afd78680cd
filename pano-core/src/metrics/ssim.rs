//! Structural similarity (Wang et al. 2004) with the Gaussian window of the paper.

use super::{Mask, check};
use crate::{Result, image::Image};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Half the window: 3.5 σ with σ = 1.5, rounded.
const RADIUS: usize = 5;
const WINDOW: usize = 2 * RADIUS + 1;
/// (0.01 · peak)² and (0.03 · peak)², the paper's constants for the peak 1.
const C1: f64 = 1e-4;
const C2: f64 = 9e-4;

/// Mean structural similarity over channels and pixels, at most 1: 11×11 Gaussian window with σ 1.5, population
/// covariance. The outer 5 pixels, whose window leaves the picture, do not count. `None` if nothing is left: the picture
/// is smaller than 11×11, or the mask lies in the border.
///
/// # Errors
/// [`crate::Error::Argument`] if the sizes differ or the mask is empty.
pub fn ssim(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<Option<f64>> {
    check(a, b, mask)?;
    let (w, h) = a.size();
    if w < WINDOW || h < WINDOW {
        return Ok(None);
    }
    let window = window();
    let row = |y: usize| {
        let columns = column_moments(a, b, y, &window);
        let counted = (RADIUS..w - RADIUS).filter(|&x| mask.is_none_or(|m| m.get(x, y)));
        counted.fold((0.0, 0u64), |(sum, n), x| {
            let mut m = Moments::default();
            for (column, &k) in columns[x - RADIUS..=x + RADIUS].iter().zip(&window) {
                m.add(column, k);
            }
            (sum + m.similarity(), n + 1)
        })
    };
    // Rows are added in order, so that threads do not change the result.
    let rows: Vec<(f64, u64)> = (RADIUS..h - RADIUS).into_par_iter().map(row).collect();
    let (sum, n) = rows.iter().fold((0.0, 0), |(s, n), row| (s + row.0, n + row.1));
    Ok((n > 0).then(|| sum / n as f64))
}

/// The window's weights in one direction; they sum to 1.
fn window() -> [f64; WINDOW] {
    let raw: [f64; WINDOW] = std::array::from_fn(|i| {
        let d = (i as f64 - RADIUS as f64) / 1.5;
        (-0.5 * d * d).exp()
    });
    let sum: f64 = raw.iter().sum();
    raw.map(|w| w / sum)
}

/// Windowed means of a, b, a², b² and ab.
#[derive(Clone, Copy, Default)]
struct Moments {
    a: DVec3,
    b: DVec3,
    aa: DVec3,
    bb: DVec3,
    ab: DVec3,
}

impl Moments {
    fn add(&mut self, other: &Self, k: f64) {
        self.a += other.a * k;
        self.b += other.b * k;
        self.aa += other.aa * k;
        self.bb += other.bb * k;
        self.ab += other.ab * k;
    }

    /// The index of this window, mean over channels.
    fn similarity(&self) -> f64 {
        let Self { a, b, aa, bb, ab } = *self;
        let luminance = (2.0 * a * b + C1) / (a * a + b * b + C1);
        let structure = (2.0 * (ab - a * b) + C2) / ((aa - a * a) + (bb - b * b) + C2);
        (luminance * structure).element_sum() / 3.0
    }
}

/// The vertical pass at row `y`, for every column.
fn column_moments(a: &Image<Vec3>, b: &Image<Vec3>, y: usize, window: &[f64; WINDOW]) -> Vec<Moments> {
    let mut columns = vec![Moments::default(); a.width()];
    for (row, &k) in (y - RADIUS..=y + RADIUS).zip(window) {
        for ((m, a), b) in columns.iter_mut().zip(a.row(row)).zip(b.row(row)) {
            let (a, b) = (a.as_dvec3(), b.as_dvec3());
            m.add(&Moments { a, b, aa: a * a, bb: b * b, ab: a * b }, k);
        }
    }
    columns
}
