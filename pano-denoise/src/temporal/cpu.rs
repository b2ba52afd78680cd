//! The accumulation on the CPU, rayon over rows. Sums are `f64`, so that no finite input overflows.

use super::{Guides, History, Params};
use crate::to_vec3;
use glam::{DVec3, Vec3};
use pano_core::image::Image;
use pano_core::sphere::wrap_texel;
use rayon::prelude::*;

/// Half the side of the neighbourhood that history is clamped to.
const RADIUS: isize = 2;

/// See [`super::accumulate`]; arguments are checked there.
pub(super) fn accumulate(params: &Params, guides: &Guides<'_>, signal: &mut Image<Vec3>, past: Option<&History>) -> History {
    let (width, height) = signal.size();
    let new = signal.clone();
    let mut length = Image::filled(width, height, 1u32);
    let rows = signal.data_mut().par_chunks_mut(width).zip(length.data_mut().par_chunks_mut(width));
    rows.enumerate().for_each(|(y, (values, lengths))| {
        for x in 0..width {
            let value = new.get(x, y);
            let kept = past.and_then(|past| recall(params, guides, past, x, y));
            let Some((old, frames)) = kept else {
                values[x] = if value.is_finite() { value } else { Vec3::ZERO };
                continue;
            };
            let old = within_neighbourhood(params, guides, &new, old, x, y);
            if !value.is_finite() {
                (values[x], lengths[x]) = (to_vec3(old), frames);
                continue;
            }
            let weight = f64::from(params.blend).max(1.0 / f64::from(frames + 1));
            values[x] = to_vec3(old + (value.as_dvec3() - old) * weight);
            lengths[x] = frames.saturating_add(1);
        }
    });
    History {
        signal: signal.clone(),
        depth: guides.depth.clone(),
        normal: guides.normal.clone(),
        thing: guides.thing.clone(),
        length,
    }
}

/// What history knows of the point seen at `(x, y)`, and the fewest frames that the texels used have.
fn recall(params: &Params, guides: &Guides<'_>, past: &History, x: usize, y: usize) -> Option<(DVec3, u32)> {
    let (width, height) = past.signal.size();
    let at = guides.previous.get(x, y) - 0.5;
    if !at.is_finite() || at.abs().max_element() > 1e6 {
        return None;
    }
    let (base, f) = (at.floor(), at - at.floor());
    let (mut sum, mut weights, mut frames) = (DVec3::ZERO, 0.0, u32::MAX);
    for (dx, dy, weight) in
        [(0, 0, (1.0 - f.x) * (1.0 - f.y)), (1, 0, f.x * (1.0 - f.y)), (0, 1, (1.0 - f.x) * f.y), (1, 1, f.x * f.y)]
    {
        let (tx, ty) = (base.x as isize + dx, base.y as isize + dy);
        let inside = (0..width as isize).contains(&tx) && (0..height as isize).contains(&ty);
        if weight <= 0.0 || !(inside || params.wrap) {
            continue;
        }
        let (tx, ty) = wrap_texel(width, height, tx, ty);
        if past.thing.get(tx, ty) != guides.thing.get(x, y)
            || !same_depth(guides.previous_depth.get(x, y), past.depth.get(tx, ty), params.depth)
            || !same_normal(guides.normal.get(x, y), past.normal.get(tx, ty), params.normal)
        {
            continue;
        }
        sum += past.signal.get(tx, ty).as_dvec3() * f64::from(weight);
        weights += f64::from(weight);
        frames = frames.min(past.length.get(tx, ty));
    }
    // Less than a hundredth of a texel is a corner that only rounding touches.
    (weights > 0.01).then(|| (sum / weights, frames))
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

/// `old`, at most so many standard deviations from the mean of the new values around the pixel that show the same thing.
fn within_neighbourhood(params: &Params, guides: &Guides<'_>, new: &Image<Vec3>, old: DVec3, x: usize, y: usize) -> DVec3 {
    if params.clamp.is_infinite() {
        return old;
    }
    let (width, height) = new.size();
    let (mut sum, mut squares, mut count) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for (dx, dy) in (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy))) {
        let (nx, ny) = (x as isize + dx, y as isize + dy);
        let inside = (0..width as isize).contains(&nx) && (0..height as isize).contains(&ny);
        if !(inside || params.wrap) {
            continue;
        }
        let (nx, ny) = wrap_texel(width, height, nx, ny);
        let value = new.get(nx, ny);
        if value.is_finite() && guides.thing.get(nx, ny) == guides.thing.get(x, y) {
            let value = value.as_dvec3();
            (sum, squares, count) = (sum + value, squares + value * value, count + 1.0);
        }
    }
    if count == 0.0 {
        return old;
    }
    let mean = sum / count;
    let deviation = (squares / count - mean * mean).max(DVec3::ZERO).map(f64::sqrt);
    let reach = deviation * f64::from(params.clamp) + mean.abs() * 1e-6;
    old.clamp(mean - reach, mean + reach)
}
