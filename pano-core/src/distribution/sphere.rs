//! Directions in proportion to the luminance of an equirectangular picture *as it is looked up*, that is with bilinear
//! interpolation: luminance / pdf is constant up to the variation of sin θ inside a cell, next to a one-texel sun as
//! anywhere else. A table of texel averages is wrong by a large factor there.
//!
//! The cells lie between texel centres; the first and last row of cells reach from the pole to the first row of centres.

use super::Distribution1d;
use crate::{image::Image, sphere};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereSample {
    /// Unit direction.
    pub direction: Vec3,
    /// Its density per steradian.
    pub pdf_solid_angle: f32,
}

/// Distribution over the sphere of directions, proportional to a bilinearly interpolated equirectangular picture.
#[derive(Clone, Debug)]
pub struct SphereDistribution {
    pub(super) luminance: Image<f32>,
    pub(super) rows: Distribution1d,
    pub(super) columns: Vec<Option<Distribution1d>>,
    /// Per cell row: mean sin θ over the sum of all cells, times the factors that make [`Self::pdf`] a multiplication.
    pub(super) row_factor: Vec<f32>,
}

impl SphereDistribution {
    /// From an equirectangular picture of luminance; negative, NaN and infinite values count as 0. `None` if it is black.
    pub fn new(luminance: &Image<f32>) -> Option<Self> {
        let luminance = luminance.map(|l| if l.is_finite() && l > 0.0 { l } else { 0.0 });
        let (w, h) = luminance.size();
        // Mean of sin θ over the cell row's band of θ; cells are uniform in u, so this is their relative solid angle.
        let mean_sin = |row: usize| {
            let (top, bottom) = band(row, h);
            let (a, b) = (f64::from(top) * std::f64::consts::PI, f64::from(bottom) * std::f64::consts::PI);
            2.0 * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin() / (b - a)
        };
        let mut columns = Vec::with_capacity(h + 1);
        let mut row_weights = Vec::with_capacity(h + 1);
        for row in 0..=h {
            let weights: Vec<f32> = (0..w).map(|x| corners(&luminance, x, row).iter().sum::<f32>() * 0.25).collect();
            let column = Distribution1d::new(&weights);
            let (top, bottom) = band(row, h);
            let height = f64::from(bottom - top);
            row_weights.push((column.as_ref().map_or(0.0, Distribution1d::total) / w as f64 * height * mean_sin(row)) as f32);
            columns.push(column);
        }
        let rows = Distribution1d::new(&row_weights)?;
        // p(u, v) = luminance·mean_sin/total; p(ω) = p(u, v) / (2π² sin θ).
        let row_factor = (0..=h)
            .map(|row| (mean_sin(row) / (rows.total() * 2.0 * std::f64::consts::PI * std::f64::consts::PI)) as f32)
            .collect();
        Some(Self { luminance, rows, columns, row_factor })
    }

    /// The direction for `u` in [0, 1)². `None` on the (numerically) empty set where the density vanishes.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<SphereSample> {
        let (w, h) = self.luminance.size();
        let (row, v) = self.rows.sample(u.y);
        let (x, s) = self.columns[row].as_ref()?.sample(u.x);
        let [a, b, c, d] = corners(&self.luminance, x, row);
        // Inside the cell: the marginal of the bilinear density in v, then the conditional in s, both linear.
        let fv = sample_linear(v, a + b, c + d);
        let fs = sample_linear(s, a + (c - a) * fv, b + (d - b) * fv);
        let (top, bottom) = band(row, h);
        let uv = Vec2::new((x as f32 + 0.5 + fs) / w as f32, top + (bottom - top) * fv);
        let direction = sphere::direction_from_uv(uv);
        // As [`Self::pdf`], with what is known already in place of a lookup.
        let (upper, lower) = (a + (b - a) * fs, c + (d - c) * fs);
        let luminance = upper + (lower - upper) * fv;
        let sin_theta = (uv.y * PI).sin().max(MIN_SIN);
        let pdf = luminance * self.row_factor[row] / sin_theta;
        (pdf > 0.0).then_some(SphereSample { direction, pdf_solid_angle: pdf })
    }

    /// Density per steradian of direction `d` (unit).
    #[inline]
    pub fn pdf(&self, d: Vec3) -> f32 {
        let uv = sphere::uv_from_direction(d);
        let row = self.cell_row(uv.y);
        let sin_theta = d.x.hypot(d.z).max(MIN_SIN);
        sphere::bilinear(&self.luminance, uv) * self.row_factor[row] / sin_theta
    }

    #[inline]
    fn cell_row(&self, v: f32) -> usize {
        let h = self.luminance.height();
        ((v * h as f32 + 0.5) as usize).min(h)
    }
}

/// Below this sin θ the density per steradian is held: one direction in 10¹⁰ is so close to a pole.
pub(super) const MIN_SIN: f32 = 1e-5 * PI;

/// v of the upper and lower edge of a row of cells.
#[inline]
fn band(row: usize, h: usize) -> (f32, f32) {
    let edge = |r: f32| (r / h as f32).clamp(0.0, 1.0);
    (edge(row as f32 - 0.5), edge(row as f32 + 0.5))
}

/// Interpolated luminance at the cell's corners: top left, top right, bottom left, bottom right. Cell `x` begins at the
/// centre of column `x`.
#[inline]
fn corners(luminance: &Image<f32>, x: usize, row: usize) -> [f32; 4] {
    let (w, h) = luminance.size();
    let at = |x: isize, y: isize| {
        let (x, y) = sphere::wrap_texel(w, h, x, y);
        luminance.get(x, y)
    };
    let (x, y) = (x as isize, row as isize);
    let line = |y: isize| [at(x, y), at(x + 1, y)];
    let (upper, lower) = (line(y - 1), line(y));
    // The cells at the poles are cut in half: their edge lies midway between a row and its mirror image.
    let middle = [0.5 * (upper[0] + lower[0]), 0.5 * (upper[1] + lower[1])];
    let (upper, lower) = if row == 0 {
        (middle, lower)
    } else if row == h {
        (upper, middle)
    } else {
        (upper, lower)
    };
    [upper[0], upper[1], lower[0], lower[1]]
}

/// Inverts the CDF of the density on [0, 1] that goes linearly from `a` to `b`, both ≥ 0.
#[inline]
fn sample_linear(u: f32, a: f32, b: f32) -> f32 {
    if a + b <= 0.0 {
        return u;
    }
    // u·(a + b)/(a + √…) in place of (√… − a)/(b − a): no cancellation when a ≈ b (pbrt, "SampleLinear").
    let root = (a * a + (b * b - a * a) * u).max(0.0).sqrt();
    let x = u * (a + b) / (a + root);
    if x.is_finite() { x.clamp(0.0, 1.0) } else { 0.0 }
}
