//! The accumulation on the CPU, rayon over rows. Sums are `f64`, so that no finite input overflows.

use super::{Guides, History, Params};
use crate::{bright, texel_at, to_f32, to_vec3};
use glam::{DVec2, DVec3, Vec3};
use pano_core::image::Image;

/// Half the side of the neighbourhood over which frames are compared.
pub(super) const RADIUS: isize = 3;
/// Half the side of the neighbourhood to whose range history is clamped where it is sharp or doubted.
pub(super) const RANGE_RADIUS: isize = 2;
/// Fewer pixels alike around, as at edges, do not tell noise from change: history is not corrected, and blended as if it moved.
pub(super) const LONELY: f64 = 4.0;
/// Farthest that a point may have moved, in pixels, to count as still: what rounding makes of places in large frames.
pub(super) const STILL: f64 = 1e-3;

/// What history knows of the point seen at a pixel.
#[derive(Clone, Copy, Default)]
struct Known {
    value: DVec3,
    /// Of the luminance of one frame's value.
    variance: f64,
    /// As many as the mean of which would be as noisy; the fewest that the texels used have.
    frames: f64,
}

/// Mean, and variance of the luminance, over a neighbourhood of `count` pixels.
#[derive(Clone, Copy)]
struct Statistics {
    mean: DVec3,
    variance: f64,
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
        frames: blended.map(|b| to_f32(b.frames)),
    };
    (history, blended.map(|b| to_f32(b.variance / b.frames.max(1.0))))
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
    let worth = 1.0 / f64::from(1u32 << (2 * guides.level(x, y)));
    let Some(old) = known.get(x, y) else {
        if !value.is_finite() {
            return Known::default();
        }
        let spread = || Statistics::around(params, guides, (x, y), sampled).variance;
        return Known { value: value.as_dvec3(), variance: measured.unwrap_or_else(spread), frames: worth };
    };
    let near = Statistics::around(params, guides, (x, y), |nx, ny| Some(sampled(nx, ny)? - known.get(nx, ny)?.value));
    let (corrected, doubt) = if guides.is_sharp(x, y) {
        let (low, high) = range(params, guides, new, (x, y), None);
        (if low.cmple(high).all() { old.value.clamp(low, high) } else { old.value }, 0.0)
    } else {
        let doubt = near.beyond_noise(params, old.variance);
        if doubt == 0.0 {
            (old.value, doubt)
        } else {
            // What a lamp beside it has lost must not make a dark pixel negative.
            let (low, high) = range(params, guides, new, (x, y), Some(old.value));
            ((old.value + near.mean * doubt).clamp(low, high), doubt)
        }
    };
    if !value.is_finite() {
        return Known { value: corrected, ..old };
    }
    let blend = params.blend_of(is_still(guides, x, y) && near.count >= LONELY);
    // What is doubted is as a pixel that moves.
    let frames = old.frames.min((old.frames * (1.0 - doubt)).max(1.0 / f64::from(params.blend)));
    let weight = (blend * worth).max(worth / (frames + worth));
    // How noisy values are is as well known between samples as at them.
    let learned = weight / worth;
    Known {
        value: corrected + (value.as_dvec3() - corrected) * weight,
        variance: old.variance + (measured.unwrap_or(near.variance) - old.variance) * learned.min(1.0),
        frames: 1.0 / ((1.0 - weight).powi(2) / frames + weight * weight / worth),
    }
}

/// Whether the point seen is where it was.
fn is_still(guides: &Guides<'_>, x: usize, y: usize) -> bool {
    let moved = guides.previous.get(x, y).as_dvec2() - DVec2::new(x as f64, y as f64) - 0.5;
    moved.abs().max_element() <= STILL
}

/// Least and greatest of the new values around and `old`; infinite and the wrong way round if there are none.
fn range(params: &Params, guides: &Guides<'_>, new: &Image<Vec3>, at: (usize, usize), old: Option<DVec3>) -> (DVec3, DVec3) {
    let values = alike(params, guides, at, RANGE_RADIUS).filter_map(|(x, y)| finite(new, x, y)).chain(old);
    values.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
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
    let (mut sum, mut variance, mut weights, mut frames) = (DVec3::ZERO, 0.0, 0.0, f64::INFINITY);
    for (dx, dy, weight) in
        [(0, 0, (1.0 - f.x) * (1.0 - f.y)), (1, 0, f.x * (1.0 - f.y)), (0, 1, (1.0 - f.x) * f.y), (1, 1, f.x * f.y)]
    {
        let texel = texel_at(past.signal.size(), base.x as isize + dx, base.y as isize + dy, params.wrap);
        let Some((tx, ty)) = texel.filter(|_| weight > 0.0) else { continue };
        if past.frames.get(tx, ty) == 0.0
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
        frames = frames.min(f64::from(past.frames.get(tx, ty)));
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

/// The pixels within `radius` that show the same thing, turned the same way.
fn alike(params: &Params, guides: &Guides<'_>, (x, y): (usize, usize), radius: isize) -> impl Iterator<Item = (usize, usize)> {
    let (thing, normal) = (guides.thing.get(x, y), guides.normal.get(x, y));
    (-radius..=radius)
        .flat_map(move |dy| (-radius..=radius).map(move |dx| (x as isize + dx, y as isize + dy)))
        .filter_map(|(nx, ny)| texel_at(guides.thing.size(), nx, ny, params.wrap))
        .filter(move |&(nx, ny)| {
            guides.thing.get(nx, ny) == thing && same_normal(guides.normal.get(nx, ny), normal, params.normal)
        })
}

impl Statistics {
    /// Of what `value` has for the pixels alike within [`RADIUS`].
    fn around(params: &Params, guides: &Guides<'_>, at: (usize, usize), value: impl Fn(usize, usize) -> Option<DVec3>) -> Self {
        let (mut sum, mut squares, mut count) = (DVec3::ZERO, 0.0, 0.0);
        for value in alike(params, guides, at, RADIUS).filter_map(|(x, y)| value(x, y)) {
            (sum, squares, count) = (sum + value, squares + bright(value).powi(2), count + 1.0);
        }
        if count == 0.0 {
            return Self { mean: sum, variance: 0.0, count };
        }
        let mean = sum / count;
        // Few values tell how large they are, and not how far apart.
        let center = if count < LONELY { 0.0 } else { bright(mean) };
        Self { mean, variance: (squares / count - center * center).max(0.0), count }
    }

    /// The share of the mean difference that noise does not explain, `variance` being what history knows of it.
    fn beyond_noise(&self, params: &Params, variance: f64) -> f64 {
        let off = bright(self.mean).abs();
        if self.count == 0.0 || params.clamp.is_infinite() || off == 0.0 {
            return 0.0;
        }
        let error = (self.variance.max(variance) / self.count).sqrt();
        (1.0 - f64::from(params.clamp) * error / off).max(0.0)
    }
}
