//! Single pixels that stick out of their surroundings: noise that a filter would keep, because it keeps edges.

use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use rayon::prelude::*;

/// A pixel's change may be this many times that of its neighbours, as a share of the photo…
pub(super) const STANDS_OUT: f32 = 3.0;
/// …and more than this.
pub(super) const INVISIBLE: f32 = 0.02;
/// Pixels to each side over which the rest is spread, less and less outwards.
pub(super) const SPREAD: usize = 7;
/// Surfaces are the same as far as cosine of the normals and quotient of the distances are nearer to 1 than this.
pub(super) const ALIKE: f32 = 0.1;
/// Where the photo is darker than this, changes are shares of it.
pub(super) const LEAST_SHOWN: f32 = 1e-6;

/// Pixels around `(x, y)`, itself among them, `radius` to each side, row by row. Columns wrap if `wrap`, each counted once.
pub(super) fn around(
    (w, h): (usize, usize),
    wrap: bool,
    (x, y): (usize, usize),
    radius: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let columns = move |i: usize| match wrap {
        true => Some((x + w * (1 + radius / w) + i - radius) % w),
        false => (x + i).checked_sub(radius).filter(|&x| x < w),
    };
    let rows = y.saturating_sub(radius)..(y + radius + 1).min(h);
    let count = if wrap { (2 * radius + 1).min(w) } else { 2 * radius + 1 };
    rows.flat_map(move |y| (0..count).filter_map(move |i| Some((columns(i)?, y))))
}

/// Whether two pixels show the same surface.
fn alike(layers: &TracedLayers, a: (usize, usize), b: (usize, usize)) -> bool {
    let (near, far) = (layers.depth.get(a.0, a.1), layers.depth.get(b.0, b.1));
    let cosine = layers.normal.get(a.0, a.1).dot(layers.normal.get(b.0, b.1));
    cosine > 1.0 - ALIKE && (near / far - 1.0).abs() < ALIKE
}

/// What changes of real surfaces are shares of: the photo, whose detail is no part of them.
fn shown_before(photo: &RadianceImage, (x, y): (usize, usize)) -> Vec3 {
    photo.get(x, y).max(Vec3::splat(LEAST_SHOWN))
}

/// Spreads what sticks out of the change of real surfaces (a path that seldom finds a lamp, and then for all the others)
/// over the surface around it: a filter that keeps edges would keep it as it is. All of it counts as a share of the photo, whose
/// detail stays. Columns wrap if `wrap`.
pub(super) fn spread_what_sticks_out(layers: &mut TracedLayers, photo: &RadianceImage, wrap: bool) {
    let (w, h) = layers.delta.size();
    let around = |x: usize, y: usize, radius: usize| around((w, h), wrap, (x, y), radius);
    let shares = Image::par_from_fn(w, h, |x, y| match layers.coverage.get(x, y) > 0.0 {
        true => Vec3::ZERO,
        false => layers.delta.get(x, y) / shown_before(photo, (x, y)),
    });
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
            let real = |at: (usize, usize)| layers.coverage.get(at.0, at.1) == 0.0;
            let here = |&at: &(usize, usize)| at == (x, y) || (real(at) && alike(layers, (x, y), at));
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

/// Pixels that have no more of their kind beside them than this are at corners and gaps, where the filter finds little to average…
pub(super) const FEW: usize = 4;
/// …and those with fewer than this beside them to compare with stay what they are.
pub(super) const ENOUGH: usize = 3;
/// What an object shows at its rim may be this many times what it shows beside it…
pub(super) const AT_RIMS: f32 = 2.0;
/// …and inside no less than this share: lamps in mirrors are bright.
pub(super) const DARK: f32 = 0.5;

/// Takes what the filter had nothing to average with, single pixels at the rims of things, back among their neighbours, which get
/// what it takes away. Where no object covers anything, no change, as a share of the photo, goes beyond all of those beside it; where
/// few of them are of the same surface, it is their median. What objects show at their rims is not far from what they show beside
/// them; inside, single pixels may be right (a lamp in a mirror). Pixels without change keep that. For after the filter; columns wrap
/// if `wrap`.
pub(super) fn nothing_stands_alone(layers: &mut TracedLayers, photo: &RadianceImage, wrap: bool) {
    let (w, h) = layers.delta.size();
    let coverage = |(x, y): (usize, usize)| layers.coverage.get(x, y);
    let few = |at| {
        let same = |&b: &(usize, usize)| b != at && (coverage(b) > 0.0) == (coverage(at) > 0.0) && alike(layers, at, b);
        (coverage(at) > 0.0 && coverage(at) < 1.0) || around((w, h), wrap, at, 1).filter(same).count() <= FEW
    };

    let before = |at| shown_before(photo, at);
    let shares = Neighbours { wrap, layer: &layers.delta, unit: &before, least: -1.0, known: &|at| coverage(at) == 0.0 };
    let delta = shares.settled(|at| match layers.delta.get(at.0, at.1) != Vec3::ZERO && coverage(at) == 0.0 {
        true if few(at) => Bound::Median,
        true => Bound::Within(1.0, 1.0),
        false => Bound::None,
    });
    let covered = |at| Vec3::splat(coverage(at));
    let shown = Neighbours { wrap, layer: &layers.object, unit: &covered, least: 0.0, known: &|at| coverage(at) > 0.0 };
    let object = shown.settled(|at| match coverage(at) > 0.0 {
        true if few(at) => Bound::Within(1.0 / AT_RIMS, AT_RIMS),
        true => Bound::AtLeast(DARK),
        false => Bound::None,
    });
    (layers.delta, layers.object) = (delta, object);
}

/// What a pixel is held to: what those beside it have.
#[derive(Clone, Copy, PartialEq)]
enum Bound {
    None,
    /// This many times the least, each channel for itself.
    AtLeast(f32),
    /// From this many times the least to this many times the most, each channel for itself.
    Within(f32, f32),
    /// The median of them and itself, each channel for itself.
    Median,
}

/// A layer that is to be compared with itself a pixel further on.
struct Neighbours<'a, U, K> {
    wrap: bool,
    layer: &'a Image<Vec3>,
    /// What one is, at a pixel: of the photo, of the object's share.
    unit: &'a U,
    /// The least that a pixel can have, in units: all of the photo's light goes, an object shows none.
    least: f32,
    /// Whether a pixel has something to compare with.
    known: &'a K,
}

impl<U: Fn((usize, usize)) -> Vec3 + Sync, K: Fn((usize, usize)) -> bool + Sync> Neighbours<'_, U, K> {
    fn beside(&self, at: (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
        around(self.layer.size(), self.wrap, at, 1).filter(move |&other| other != at && (self.known)(other))
    }

    fn value(&self, at: (usize, usize)) -> Vec3 {
        self.layer.get(at.0, at.1) / (self.unit)(at)
    }

    /// How far a pixel is outside of its bound, if it is.
    fn beyond(&self, at: (usize, usize), bound: Bound) -> Option<Vec3> {
        if bound == Bound::None {
            return None;
        }
        let here = self.value(at);
        let (mut all, mut count) = ([here; 9], 1);
        for (slot, other) in all[1..].iter_mut().zip(self.beside(at)) {
            *slot = self.value(other);
            count += 1;
        }
        let all = &mut all[..count];
        if count <= ENOUGH {
            return None;
        }
        let least = || all[1..].iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let kept = match bound {
            Bound::None => here,
            Bound::AtLeast(share) => here.max(least() * share),
            Bound::Within(down, up) => {
                here.max(least() * down).min(all[1..].iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) * up)
            }
            Bound::Median => Vec3::from_array(std::array::from_fn(|channel| {
                all.sort_unstable_by(|a, b| a[channel].total_cmp(&b[channel]));
                (all[(count - 1) / 2][channel] + all[count / 2][channel]) * 0.5
            })),
        };
        (kept != here && here.is_finite()).then_some(here - kept)
    }

    /// The layer with all pixels within their bounds, and their neighbours with what that takes from them, unless it makes them
    /// less than no light.
    fn settled(&self, bound: impl Fn((usize, usize)) -> Bound + Sync) -> Image<Vec3> {
        let (w, h) = self.layer.size();
        let beyond: Vec<((usize, usize), Vec3)> = (0..w * h)
            .into_par_iter()
            .filter_map(|i| {
                let at = (i % w, i / w);
                Some((at, self.beyond(at, bound(at))?))
            })
            .collect();
        let mut layer = self.layer.clone();
        for (at, excess) in beyond {
            layer.set(at.0, at.1, layer.get(at.0, at.1) - excess * (self.unit)(at));
            let receivers = self.beside(at).count() as f32;
            for other in self.beside(at) {
                let before = layer.get(other.0, other.1);
                let least = before.min((self.unit)(other) * self.least);
                layer.set(other.0, other.1, (before + excess * (self.unit)(other) / receivers).max(least));
            }
        }
        layer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        // Fewer columns than are looked at: without a seam all of them count.
        let (mut strip, photo) = floor(5, 20);
        strip.coverage = Image::filled(5, 20, 0.0);
        strip.delta.set(4, 9, Vec3::splat(0.9));
        spread_what_sticks_out(&mut strip, &photo, false);
        assert!((0..5).all(|x| strip.delta.get(x, 9).y > 0.0), "all columns get a share");
        // Each counted once.
        let (mut narrow, photo) = floor(3, 3);
        narrow.coverage = Image::filled(3, 3, 0.0);
        narrow.delta.set(0, 0, Vec3::splat(0.9));
        spread_what_sticks_out(&mut narrow, &photo, true);
        let sum: f32 = narrow.delta.data().iter().zip(photo.data()).map(|(d, p)| d.y / p.y).sum();
        assert!((sum - 0.9).abs() < 1e-5, "{sum}");
    }

    #[test]
    fn what_no_other_pixel_is_like_goes_back_among_its_neighbours() {
        let (mut layers, photo) = floor(24, 20);
        let share = |layers: &TracedLayers, x, y| layers.delta.get(x, y).y / photo.get(x, y).y;
        let sum = |layers: &TracedLayers| (0..20 * 22).map(|i| share(layers, i % 22, i / 22)).sum::<f32>();
        layers.delta = Image::from_fn(24, 20, |x, y| photo.get(x, y) * if x < 22 { -0.25 } else { 0.0 });
        // Two on the floor, and two on a thin thing above it, one of them beside the object.
        let strays = [(3, 3), (3, 16), (12, 9), (21, 10)];
        strays[2..].iter().for_each(|&(x, y)| layers.depth.set(x, y, 1.0));
        strays.iter().for_each(|&(x, y)| layers.delta.set(x, y, photo.get(x, y) * if y > 9 { 0.75 } else { -1.0 }));
        let before = layers.clone();
        nothing_stands_alone(&mut layers, &photo, false);
        strays.iter().for_each(|&(x, y)| assert!((share(&layers, x, y) + 0.25).abs() < 1e-6, "{x} {y}"));
        assert!((sum(&layers) - sum(&before)).abs() < 1e-4);
        assert_eq!(layers.delta.get(12, 3), before.delta.get(12, 3), "nothing of it is near");
        assert!((0..20).all(|y| layers.delta.get(22, y) == Vec3::ZERO) && layers.object == before.object);
    }

    #[test]
    fn objects_keep_lamps_in_mirrors_but_no_black_dots_and_no_sparks_at_rims() {
        let (mut layers, photo) = floor(24, 20);
        layers.coverage = Image::from_fn(24, 20, |x, _| [0.0, 0.25, 1.0][x.clamp(7, 9) - 7]);
        layers.object = Image::from_fn(24, 20, |x, y| Vec3::splat(layers.coverage.get(x, y)));
        let mut put = |x: usize, y: usize, shown: f32| layers.object.set(x, y, Vec3::splat(shown * layers.coverage.get(x, y)));
        put(15, 3, 40.0);
        put(15, 10, 0.0);
        put(8, 5, 9.0);
        put(8, 14, 0.1);
        let sum = |layers: &TracedLayers| layers.object.data().iter().map(|o| o.y).sum::<f32>();
        let before = layers.clone();
        nothing_stands_alone(&mut layers, &photo, false);
        let shown = |x: usize, y: usize| layers.object.get(x, y).y / layers.coverage.get(x, y);
        assert_eq!(shown(15, 3), 40.0);
        assert_eq!(shown(15, 10), DARK);
        assert!((shown(8, 5) - AT_RIMS).abs() < 1e-6 && (shown(8, 14) - 1.0 / AT_RIMS).abs() < 1e-6);
        assert!((sum(&layers) / sum(&before) - 1.0).abs() < 0.02);
    }
}
