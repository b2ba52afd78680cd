//! Bilinear lookups that wrap in u and step over the poles.

use crate::image::Image;
use glam::Vec2;
use std::ops::{Add, Mul};

/// One of the four texels of a bilinear lookup.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tap {
    /// Column of the texel.
    pub x: usize,
    /// Row of the texel.
    pub y: usize,
    /// Its weight, in [0, 1]; the four weights sum to 1.
    pub weight: f32,
}

/// Column `x` and row `y`, both possibly outside by one, as a texel of the sphere: x wraps; above and below a pole the
/// picture continues on the other side (u + ½, v mirrored).
#[inline]
pub fn wrap_texel(width: usize, height: usize, x: isize, y: isize) -> (usize, usize) {
    let (w, h) = (width as isize, height as isize);
    let (x, y) = if y < 0 {
        (x + w / 2, -1 - y)
    } else if y >= h {
        (x + w / 2, 2 * h - 1 - y)
    } else {
        (x, y)
    };
    (x.rem_euclid(w) as usize, y.clamp(0, h - 1) as usize)
}

/// The four texels, with their weights, that a bilinear lookup at (u, v) reads. u wraps; v is clamped to [0, 1].
#[inline]
pub fn bilinear_taps(width: usize, height: usize, uv: Vec2) -> [Tap; 4] {
    let x = uv.x * width as f32 - 0.5;
    let y = uv.y.clamp(0.0, 1.0) * height as f32 - 0.5;
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (x0, y0) = (x0 as isize, y0 as isize);
    let tap = |dx: isize, dy: isize, weight: f32| {
        let (x, y) = wrap_texel(width, height, x0 + dx, y0 + dy);
        Tap { x, y, weight }
    };
    [tap(0, 0, (1.0 - fx) * (1.0 - fy)), tap(1, 0, fx * (1.0 - fy)), tap(0, 1, (1.0 - fx) * fy), tap(1, 1, fx * fy)]
}

/// Bilinear lookup at (u, v) in an equirectangular picture.
#[inline]
pub fn bilinear<T>(image: &Image<T>, uv: Vec2) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    bilinear_of(image.size(), uv, |x, y| image.get(x, y))
}

/// The same in a picture whose texels `texel` tells.
#[inline]
pub fn bilinear_of<T>((width, height): (usize, usize), uv: Vec2, texel: impl Fn(usize, usize) -> T) -> T
where
    T: Add<Output = T> + Mul<f32, Output = T>,
{
    let [a, b, c, d] = bilinear_taps(width, height, uv);
    let read = |t: Tap| texel(t.x, t.y) * t.weight;
    (read(a) + read(b)) + (read(c) + read(d))
}
