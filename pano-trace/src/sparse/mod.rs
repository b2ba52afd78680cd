//! Sparse tracing (IPRT paper, "Sparse Tracing Acceleration"): neighbours on a plane receive about the same light, so that
//! one in four or sixteen of them is traced and the others are interpolated.
//!
//! A pixel's weight (eq. 3) is 1 where an object has touched its light lately, else the largest difference of normals or
//! positions within 5×5 pixels; two thresholds (eq. 4) make three levels of it: every pixel, every second column and row,
//! every fourth.
//!
//! *Departure*: Algorithm 2 as printed weighs by distance, so that the farthest sample counts most; here the weight is the
//! inverse distance.

#[cfg(feature = "gpu")]
pub mod gpu;

use glam::Vec3;
use pano_core::image::Image;

/// When a pixel is traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// δ₁: below this weight one pixel in 16 is traced. Lower traces more. Default .3 (the paper's).
    pub delta1: f32,
    /// δ₂: below this weight one pixel in 4 is traced, ≥ δ₁. Lower traces more. Default .5 (the paper's).
    pub delta2: f32,
    /// σ_p: weight of a metre between neighbours, 1/m. Higher traces more. Default 10 (the paper's).
    pub sigma_position: f32,
    /// Frames for which a pixel stays active after an object touched its light. Default 10 (the paper's).
    pub active_frames: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self { delta1: 0.3, delta2: 0.5, sigma_position: 10.0, active_frames: 10 }
    }
}

/// Half the side of Ω, the neighbourhood of eq. 3.
const RADIUS: isize = 2;

/// The level of every pixel (eq. 3 and 4): 0, 1 or 2. `active` counts the frames that a pixel stays active (d(p) = 1 if above
/// 0). Pictures have one size; nothing wraps, as levels are laid out on a grid of the frame.
pub fn levels(params: &Params, position: &Image<Vec3>, normal: &Image<Vec3>, active: &Image<u32>) -> Image<u8> {
    let (w, h) = position.size();
    Image::par_from_fn(w, h, |x, y| {
        let weight = if active.get(x, y) > 0 { 1.0 } else { roughness(params, position, normal, x, y) };
        match weight {
            weight if weight >= params.delta2 => 0,
            weight if weight >= params.delta1 => 1,
            _ => 2,
        }
    })
}

/// The second case of eq. 3.
fn roughness(params: &Params, position: &Image<Vec3>, normal: &Image<Vec3>, x: usize, y: usize) -> f32 {
    let (w, h) = position.size();
    let (p, n) = (position.get(x, y), normal.get(x, y));
    let mut weight = 0.0f32;
    for (dx, dy) in (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy))) {
        let (qx, qy) = (x as isize + dx, y as isize + dy);
        if (0..w as isize).contains(&qx) && (0..h as isize).contains(&qy) {
            let (qx, qy) = (qx as usize, qy as usize);
            let apart = params.sigma_position * p.distance(position.get(qx, qy));
            weight = weight.max(n.distance(normal.get(qx, qy))).max(apart);
        }
    }
    weight.min(1.0)
}

/// Whether a pixel of a level is traced: its coordinates are multiples of 1, 2 or 4.
#[inline]
pub fn is_traced(level: u8, x: usize, y: usize) -> bool {
    let mask = (1 << level) - 1;
    x & mask == 0 && y & mask == 0
}

/// Counts down the frames that pixels stay active, and starts anew where an object has touched their light. Pixels that were
/// not traced ask the nearest traced ones to the upper left, whose ray stood for theirs.
pub fn update_activity(params: &Params, levels: &Image<u8>, touched: &Image<bool>, active: &mut Image<u32>) {
    let (w, h) = levels.size();
    *active = Image::from_fn(w, h, |x, y| {
        let mask = (1usize << levels.get(x, y)) - 1;
        if touched.get(x & !mask, y & !mask) { params.active_frames } else { active.get(x, y).saturating_sub(1) }
    });
}

/// Algorithm 2: fills the pixels that were not traced from up to four traced neighbours, by inverse distance. Signals are
/// premultiplied by `share`; neighbours without a share do not count, and a filled pixel has share 1. Pixels for which
/// `wanted` is false stay as they are.
pub fn interpolate(
    levels: &Image<u8>,
    wanted: impl Fn(usize, usize) -> bool,
    share: &mut Image<f32>,
    signals: &mut [&mut Image<Vec3>],
) {
    let (w, h) = levels.size();
    let known = share.clone();
    let traced = |x: usize, y: usize| x < w && y < h && is_traced(levels.get(x, y), x, y) && known.get(x, y) > 0.0;
    for y in 0..h {
        for x in 0..w {
            let level = levels.get(x, y);
            if is_traced(level, x, y) || !wanted(x, y) {
                continue;
            }
            let mut taps = [(0, 0, 0.0f32); 4];
            for (tap, (ox, oy)) in taps.iter_mut().zip([(0, 0), (0, 1), (1, 0), (1, 1)]) {
                let corner = |step: usize| (step * (x / step + ox), step * (y / step + oy));
                let fine = corner(1 << level);
                // A neighbour of a coarser level may not have been traced; those of the coarsest grid all are.
                let (ax, ay) = if traced(fine.0, fine.1) { fine } else { corner(4) };
                if traced(ax, ay) {
                    let (dx, dy) = (ax as f32 - x as f32, ay as f32 - y as f32);
                    *tap = (ax, ay, 1.0 / dx.hypot(dy).max(1e-3));
                }
            }
            let shares: f32 = taps.iter().filter(|t| t.2 > 0.0).map(|t| t.2 * known.get(t.0, t.1)).sum();
            if shares <= 0.0 {
                continue;
            }
            for signal in signals.iter_mut() {
                let sum: Vec3 = taps.iter().filter(|t| t.2 > 0.0).map(|t| signal.get(t.0, t.1) * t.2).sum();
                signal.set(x, y, sum / shares);
            }
            share.set(x, y, 1.0);
        }
    }
}

#[cfg(test)]
mod tests;
