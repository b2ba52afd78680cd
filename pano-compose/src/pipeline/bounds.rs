//! What the traced layers can be: light is not negative. Noise is bounded before it is filtered, which would spread what sticks
//! out.

use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use rayon::prelude::*;

/// Sets changes that would leave less than no light to the photo's share of the pixel. Noise is what makes them: filtered as they
/// are, one such pixel blackens those around it. Takes noise's share of deep shadows, which falls with the samples.
pub(super) fn leave_no_less_than_black(layers: &mut TracedLayers, photo: &RadianceImage) {
    let shares = layers.coverage.data();
    for ((delta, photo), coverage) in layers.delta.data_mut().iter_mut().zip(photo.data()).zip(shares) {
        *delta = delta.max(photo.max(Vec3::ZERO) * (coverage - 1.0));
    }
}

/// Objects show surfaces with their change, of which each path has one estimate: where few paths meet a deep shadow, their sum may
/// be less than no light. Such pixels get what the darkest of their neighbours shows, or nothing.
pub(super) fn objects_are_not_darker_than_black(layers: &mut TracedLayers) {
    let (w, h) = layers.object.size();
    let bounded = Image::par_from_fn(w, h, |x, y| {
        let (object, coverage) = (layers.object.get(x, y), layers.coverage.get(x, y));
        if luminance(object) >= 0.0 {
            return object.max(Vec3::ZERO);
        }
        let mut darkest: Option<Vec3> = None;
        for j in y.saturating_sub(1)..(y + 2).min(h) {
            for i in x.saturating_sub(1)..(x + 2).min(w) {
                let (other, share) = (layers.object.get(i, j), layers.coverage.get(i, j));
                let shown = other.max(Vec3::ZERO) / share;
                if share > 0.0 && luminance(other) >= 0.0 && darkest.is_none_or(|d| luminance(shown) < luminance(d)) {
                    darkest = Some(shown);
                }
            }
        }
        darkest.map_or(Vec3::ZERO, |shown| shown * coverage)
    });
    layers.object = bounded;
}

/// A pixel's change may be this many times that of its neighbours, as a share of the photo…
const STANDS_OUT: f32 = 3.0;
/// …and more than this.
const INVISIBLE: f32 = 0.02;
/// Pixels to each side over which the rest is spread, less and less outwards.
const SPREAD: usize = 7;
/// Surfaces are the same as far as cosine of the normals and quotient of the distances are nearer to 1 than this.
const ALIKE: f32 = 0.1;

/// Spreads what sticks out of the change of real surfaces (a path that seldom finds a lamp, and then for all the others)
/// over the surface around it: a filter that keeps edges would keep it as it is. All of it counts as a share of the photo, whose
/// detail stays. Columns wrap if `wrap`.
pub(super) fn spread_what_sticks_out(layers: &mut TracedLayers, photo: &RadianceImage, wrap: bool) {
    let (w, h) = layers.delta.size();
    let around = |x: usize, y: usize, radius: usize| {
        let columns = move |i: usize| match wrap {
            true => Some((x + w * (1 + radius / w) + i - radius) % w),
            false => (x + i).checked_sub(radius).filter(|&x| x < w),
        };
        let rows = y.saturating_sub(radius)..(y + radius + 1).min(h);
        rows.flat_map(move |y| (0..(2 * radius + 1).min(w)).filter_map(move |i| Some((columns(i)?, y))))
    };
    let shares = Image::par_from_fn(w, h, |x, y| match layers.coverage.get(x, y) > 0.0 {
        true => Vec3::ZERO,
        false => layers.delta.get(x, y) / photo.get(x, y).max(Vec3::splat(1e-6)),
    });
    let alike = |a: (usize, usize), b: (usize, usize)| {
        let (near, far) = (layers.depth.get(a.0, a.1), layers.depth.get(b.0, b.1));
        let cosine = layers.normal.get(a.0, a.1).dot(layers.normal.get(b.0, b.1));
        layers.coverage.get(b.0, b.1) == 0.0 && cosine > 1.0 - ALIKE && (near / far - 1.0).abs() < ALIKE
    };
    let magnitude = |x: usize, y: usize| luminance(shares.get(x, y)).abs();
    let outliers: Vec<(usize, usize, Vec3)> = (0..w * h)
        .into_par_iter()
        .filter_map(|i| {
            let (x, y) = (i % w, i / w);
            let here = magnitude(x, y);
            let beside = around(x, y, 1).filter(|&at| at != (x, y)).map(|(x, y)| magnitude(x, y)).fold(0.0, f32::max);
            let most = (STANDS_OUT * beside).max(INVISIBLE);
            (here > most && here.is_finite()).then(|| (x, y, shares.get(x, y) * (1.0 - most / here)))
        })
        .collect();
    let weight = |(x, y): (usize, usize), (i, j): (usize, usize)| {
        let (across, down) = (x.abs_diff(i), y.abs_diff(j));
        let across = if wrap { across.min(w - across) } else { across };
        1.0 - (across * across + down * down) as f32 / (2 * (SPREAD + 1).pow(2)) as f32
    };
    let receivers: Vec<Vec<(usize, usize, f32)>> = outliers
        .par_iter()
        .map(|&(x, y, _)| {
            let here = |&at: &(usize, usize)| at == (x, y) || alike((x, y), at);
            around(x, y, SPREAD).filter(here).map(|at| (at.0, at.1, weight((x, y), at))).collect()
        })
        .collect();
    for (&(x, y, excess), receivers) in outliers.iter().zip(&receivers) {
        layers.delta.set(x, y, layers.delta.get(x, y) - excess * photo.get(x, y));
        let all: f32 = receivers.iter().map(|r| r.2).sum();
        for &(i, j, weight) in receivers {
            layers.delta.set(i, j, layers.delta.get(i, j) + excess * photo.get(i, j) * (weight / all));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_takes_no_more_light_than_the_share_of_the_photo_has() {
        let mut layers = TracedLayers::empty(4, 1);
        let photo = RadianceImage::filled(4, 1, Vec3::new(2.0, 1.0, -1.0));
        layers.delta =
            Image::from_fn(4, 1, |x, _| [Vec3::splat(-9.0), Vec3::splat(-0.5), Vec3::splat(9.0), Vec3::splat(-1.0)][x]);
        layers.coverage = Image::from_fn(4, 1, |x, _| [0.0, 0.25, 0.0, 1.0][x]);
        leave_no_less_than_black(&mut layers, &photo);
        let expected = [Vec3::new(-2.0, -1.0, 0.0), Vec3::new(-0.5, -0.5, 0.0), Vec3::splat(9.0), Vec3::ZERO];
        assert_eq!(layers.delta.data(), expected);
    }

    #[test]
    fn objects_darker_than_black_show_what_is_beside_them() {
        let mut layers = TracedLayers::empty(5, 3);
        layers.coverage = Image::from_fn(5, 3, |x, _| [0.0, 0.5, 1.0, 1.0, 1.0][x]);
        layers.object = Image::from_fn(5, 3, |x, y| {
            let noise = [(1, 1), (2, 1), (4, 0), (4, 1), (4, 2), (3, 0), (3, 1), (3, 2)].contains(&(x, y));
            Vec3::splat(layers.coverage.get(x, y)) * if noise { -2.0 } else { 0.25 + 0.25 * x as f32 + y as f32 }
        });
        // Green noise of a pixel that is not dark.
        layers.object.set(2, 2, Vec3::new(9.0, -0.1, 9.0));
        objects_are_not_darker_than_black(&mut layers);
        let at = |x: usize, y: usize| layers.object.get(x, y);
        assert_eq!((at(1, 1), at(2, 1)), (Vec3::splat(0.25), Vec3::splat(0.5)), "half and whole of (1, 0)");
        assert_eq!((at(2, 2), at(4, 1)), (Vec3::new(9.0, 0.0, 9.0), Vec3::ZERO));
        assert_eq!((at(1, 2), at(0, 1)), (Vec3::splat(1.25), Vec3::ZERO));
    }

    /// A floor with an object on its right, seen from above.
    fn floor(w: usize, h: usize) -> (TracedLayers, RadianceImage) {
        let mut layers = TracedLayers::empty(w, h);
        layers.depth = Image::filled(w, h, 2.0);
        layers.normal = Image::filled(w, h, Vec3::Y);
        layers.coverage = Image::from_fn(w, h, |x, _| f32::from(u8::from(x + 2 >= w)));
        (layers, RadianceImage::from_fn(w, h, |x, y| Vec3::splat(if (x + y) % 2 == 0 { 1.0 } else { 0.25 })))
    }

    #[test]
    fn what_sticks_out_is_spread_as_a_share_of_the_photo() {
        let (mut layers, photo) = floor(24, 20);
        layers.delta.set(1, 9, Vec3::splat(-0.9));
        // An edge stays as it is: there are others like it beside each pixel.
        (0..20).for_each(|y| layers.delta.set(15, y, photo.get(15, y) * 0.5));
        let before = layers.delta.clone();
        spread_what_sticks_out(&mut layers, &photo, false);
        let share = |delta: &Image<Vec3>, x, y| delta.get(x, y).y / photo.get(x, y).y;
        let sum = |delta: &Image<Vec3>| (0..24 * 20).map(|i| share(delta, i % 24, i / 24)).sum::<f32>();
        assert!((sum(&layers.delta) - sum(&before)).abs() < 1e-5);
        let largest = (0..20 * 14).map(|i| share(&layers.delta, i % 14, i / 14).abs()).fold(0.0, f32::max);
        assert!(largest < 0.9 / 40.0 + INVISIBLE, "{largest}");
        assert!((0..20).all(|y| (share(&layers.delta, 15, y) - 0.5).abs() < 1e-6));
        assert!((0..20).all(|y| layers.delta.get(22, y) == Vec3::ZERO), "an object is no part of the floor");
    }

    #[test]
    fn over_the_seam_lies_the_other_edge() {
        let (mut layers, photo) = floor(24, 20);
        layers.coverage = Image::filled(24, 20, 0.0);
        layers.delta.set(1, 9, Vec3::splat(0.9));
        let mut flat = layers.clone();
        spread_what_sticks_out(&mut layers, &photo, true);
        spread_what_sticks_out(&mut flat, &photo, false);
        assert!(layers.delta.get(22, 9).y > 0.0 && flat.delta.get(22, 9) == Vec3::ZERO);
        // Fewer columns than are looked at, each counted once.
        let (mut narrow, photo) = floor(3, 3);
        narrow.coverage = Image::filled(3, 3, 0.0);
        narrow.delta.set(0, 0, Vec3::splat(0.9));
        spread_what_sticks_out(&mut narrow, &photo, true);
        let sum: f32 = narrow.delta.data().iter().zip(photo.data()).map(|(d, p)| d.y / p.y).sum();
        assert!((sum - 0.9).abs() < 1e-5, "{sum}");
    }
}
