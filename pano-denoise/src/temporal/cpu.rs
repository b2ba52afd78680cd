//! The accumulation on the CPU, rayon over rows. Sums are `f64`, so that no finite input overflows.

use super::{Guides, History, Params};
use crate::{bright, texel_at, to_f32, to_vec3};
use glam::{DVec3, Vec3};
use pano_core::image::Image;

/// Half the side of the neighbourhood over which frames are compared.
pub(super) const RADIUS: isize = 3;
/// Half the side of the neighbourhood that the history of sharp pixels is clamped to.
pub(super) const SHARP_RADIUS: isize = 2;
/// Standard deviations around the mean of that neighbourhood.
pub(super) const SHARP_REACH: f64 = 1.5;

/// What history knows of the point seen at a pixel.
#[derive(Clone, Copy, Default)]
struct Known {
    value: DVec3,
    /// Of the luminance of one frame's value.
    variance: f64,
    /// The fewest that the texels used have.
    frames: u32,
}

/// Mean, and variance of the luminance, over a neighbourhood of `count` pixels.
#[derive(Clone, Copy)]
struct Statistics {
    mean: DVec3,
    /// Per channel.
    variance: DVec3,
    luminance_variance: f64,
    count: f64,
}

/// See [`super::accumulate`]; arguments are checked there. The history, and the variance of what is in `signal` then.
pub(super) fn accumulate(
    params: &Params,
    guides: &Guides<'_>,
    measured: Option<&Image<f32>>,
    signal: &mut Image<Vec3>,
    past: Option<&History>,
) -> (History, Image<f32>) {
    let (width, height) = signal.size();
    let new = signal.clone();
    let known = Image::par_from_fn(width, height, |x, y| past.and_then(|past| recall(params, guides, past, x, y)));
    let blended = Image::par_from_fn(width, height, |x, y| blend(params, guides, measured, &new, &known, x, y));
    *signal = blended.map(|b| to_vec3(b.value));
    let history = History {
        signal: signal.clone(),
        variance: blended.map(|b| to_f32(b.variance)),
        depth: guides.depth.clone(),
        normal: guides.normal.clone(),
        thing: guides.thing.clone(),
        length: blended.map(|b| b.frames),
    };
    (history, blended.map(|b| to_f32(b.variance * params.remaining(b.frames))))
}

fn blend(
    params: &Params,
    guides: &Guides<'_>,
    measured: Option<&Image<f32>>,
    new: &Image<Vec3>,
    known: &Image<Option<Known>>,
    x: usize,
    y: usize,
) -> Known {
    let value = new.get(x, y);
    let measured = measured.map(|variance| f64::from(variance.get(x, y))).filter(|v| v.is_finite());
    let sampled = |nx, ny| finite(new, nx, ny).filter(|_| guides.level(nx, ny) == 0);
    let Some(old) = known.get(x, y) else {
        if !value.is_finite() {
            return Known::default();
        }
        let spread = || around(params, guides, (x, y), RADIUS, sampled).luminance_variance;
        return Known { value: value.as_dvec3(), variance: measured.unwrap_or_else(spread), frames: 1 };
    };
    let apart = |nx, ny| Some(sampled(nx, ny)? - known.get(nx, ny)?.value);
    let (corrected, spread) = if guides.is_sharp(x, y) {
        let near = around(params, guides, (x, y), SHARP_RADIUS, |nx, ny| finite(new, nx, ny));
        let reach = near.variance.map(f64::sqrt) * SHARP_REACH + near.mean.abs() * 1e-6;
        let value = if near.count > 0.0 { old.value.clamp(near.mean - reach, near.mean + reach) } else { old.value };
        (value, around(params, guides, (x, y), RADIUS, apart).luminance_variance)
    } else {
        let near = around(params, guides, (x, y), RADIUS, apart);
        (old.value + beyond_noise(params, &near, old.variance), near.luminance_variance)
    };
    if !value.is_finite() {
        return Known { value: corrected, ..old };
    }
    let weight = f64::from(params.blend).max(1.0 / f64::from(old.frames + 1));
    // How noisy values are is as well known between samples as at them.
    let worth = weight / f64::from(1u32 << (2 * guides.level(x, y)));
    Known {
        value: corrected + (value.as_dvec3() - corrected) * worth,
        variance: old.variance + (measured.unwrap_or(spread) - old.variance) * weight,
        frames: old.frames.saturating_add(1),
    }
}

/// The part of the mean difference that noise does not explain, `variance` being what history knows of it.
fn beyond_noise(params: &Params, near: &Statistics, variance: f64) -> DVec3 {
    let off = bright(near.mean).abs();
    if near.count == 0.0 || params.clamp.is_infinite() || off == 0.0 {
        return DVec3::ZERO;
    }
    let error = (near.luminance_variance.max(variance) / near.count).sqrt();
    near.mean * (1.0 - f64::from(params.clamp) * error / off).max(0.0)
}

fn finite(image: &Image<Vec3>, x: usize, y: usize) -> Option<DVec3> {
    Some(image.get(x, y)).filter(|v| v.is_finite()).map(|v| v.as_dvec3())
}

/// What history knows of the point seen at `(x, y)`.
fn recall(params: &Params, guides: &Guides<'_>, past: &History, x: usize, y: usize) -> Option<Known> {
    let at = guides.previous.get(x, y) - 0.5;
    if !at.is_finite() || at.abs().max_element() > 1e6 {
        return None;
    }
    let (base, f) = (at.floor(), at - at.floor());
    let (mut sum, mut variance, mut weights, mut frames) = (DVec3::ZERO, 0.0, 0.0, u32::MAX);
    for (dx, dy, weight) in
        [(0, 0, (1.0 - f.x) * (1.0 - f.y)), (1, 0, f.x * (1.0 - f.y)), (0, 1, (1.0 - f.x) * f.y), (1, 1, f.x * f.y)]
    {
        let texel = texel_at(past.signal.size(), base.x as isize + dx, base.y as isize + dy, params.wrap);
        let Some((tx, ty)) = texel.filter(|_| weight > 0.0) else { continue };
        if past.length.get(tx, ty) == 0
            || past.thing.get(tx, ty) != guides.thing.get(x, y)
            || !same_depth(guides.previous_depth.get(x, y), past.depth.get(tx, ty), params.depth)
            || !same_normal(guides.normal.get(x, y), past.normal.get(tx, ty), params.normal)
        {
            continue;
        }
        let weight = f64::from(weight);
        sum += past.signal.get(tx, ty).as_dvec3() * weight;
        variance += f64::from(past.variance.get(tx, ty)) * weight;
        weights += weight;
        frames = frames.min(past.length.get(tx, ty));
    }
    // Less than a hundredth of a texel is a corner that only rounding touches.
    (weights > 0.01).then(|| Known { value: sum / weights, variance: variance / weights, frames })
}

fn same_depth(a: f32, b: f32, tolerance: f32) -> bool {
    match (a.is_finite(), b.is_finite()) {
        (true, true) => (a - b).abs() <= tolerance * a.abs().max(b.abs()),
        (a, b) => a == b,
    }
}

fn same_normal(a: Vec3, b: Vec3, least: f32) -> bool {
    a == b || a.dot(b) >= least
}

/// Statistics of what `value` has for the pixels within `radius` that show the same thing, turned the same way.
fn around(
    params: &Params,
    guides: &Guides<'_>,
    (x, y): (usize, usize),
    radius: isize,
    value: impl Fn(usize, usize) -> Option<DVec3>,
) -> Statistics {
    let (thing, normal) = (guides.thing.get(x, y), guides.normal.get(x, y));
    let (mut sum, mut squares, mut bright_squares, mut count) = (DVec3::ZERO, DVec3::ZERO, 0.0, 0.0);
    for (dx, dy) in (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy))) {
        let Some((nx, ny)) = texel_at(guides.thing.size(), x as isize + dx, y as isize + dy, params.wrap) else { continue };
        if guides.thing.get(nx, ny) != thing || !same_normal(guides.normal.get(nx, ny), normal, params.normal) {
            continue;
        }
        if let Some(value) = value(nx, ny) {
            let luminance = bright(value);
            (sum, squares, count) = (sum + value, squares + value * value, count + 1.0);
            bright_squares += luminance * luminance;
        }
    }
    if count == 0.0 {
        return Statistics { mean: sum, variance: sum, luminance_variance: 0.0, count };
    }
    let mean = sum / count;
    let variance = (squares / count - mean * mean).max(DVec3::ZERO);
    Statistics { mean, variance, luminance_variance: (bright_squares / count - bright(mean).powi(2)).max(0.0), count }
}
