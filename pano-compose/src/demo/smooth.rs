//! The filter of path-traced pictures: an à-trous filter that knows the noise of every pixel.
//!
//! A picture is traced twice, with half the samples and other random numbers each; half the difference of the two is as noisy
//! as their mean. Pixels of one surface are averaged as far as they differ by no more than that noise, so that what has
//! converged stays as it is: the edges of shadows, mirror images, caustics.

use super::survey::{Guide, neighbour};
use glam::Vec3;
use pano_core::{color::luminance, image::Image, image::RadianceImage};
use rayon::prelude::*;

/// A pixel of a half may be this much brighter than the third brightest of its 24 neighbours. At a few samples a path that
/// finds a lamp by chance stands out more, and texture is divided out before.
const OUTLIER: f32 = 2.0;
/// The same after the first pass: what still stands out then are paths that found lamps in both halves.
const FILTERED_OUTLIER: f32 = 1.15;
/// Differences count as noise up to about this many of its standard deviations. Higher removes more noise and blurs soft
/// shadows; chosen by eye.
const SIGMAS: f32 = 1.5;
/// The B-spline of the à-trous transform.
const SPLINE: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// A pixel's light and what is known of its noise.
#[derive(Clone, Copy, Debug, Default)]
struct Noisy {
    light: Vec3,
    /// Of the luminance.
    variance: f32,
}

/// Smooths light that was traced in two halves. Taps are one pixel apart in the first pass and twice as far in each that
/// follows, up to `coarsest`. Returns the light and the share of it that was lost, most of it outliers that were cut.
pub(super) fn smooth(halves: [RadianceImage; 2], guides: &Image<Guide>, wrap: bool, coarsest: isize) -> (RadianceImage, f64) {
    let before = total(&halves[0]) + total(&halves[1]);
    let [a, b] = halves.map(|half| without_outliers(&half, guides, wrap, OUTLIER));
    let (w, h) = a.size();
    let squares = Image::par_from_fn(w, h, |x, y| (0.5 * luminance(a.get(x, y) - b.get(x, y))).powi(2));
    let mut picture = Image::par_from_fn(w, h, |x, y| {
        // One square is a poor estimate: those around help. A path that found a lamp by chance is told by its own.
        let around = taps((x, y), guides, wrap, 1).map(|(nx, ny, w)| (squares.get(nx, ny) * w, w));
        let (sum, weight) = around.fold((0.0, 0.0), |(s, t), (v, w)| (s + v, t + w));
        let variance = squares.get(x, y).max(if weight > 0.0 { sum / weight } else { 0.0 });
        Noisy { light: 0.5 * (a.get(x, y) + b.get(x, y)), variance }
    });
    for step in std::iter::successors(Some(1), |step| Some(2 * step)).take_while(|step| *step <= coarsest) {
        picture = pass(&picture, guides, wrap, step);
        if step == 1 {
            let light = picture.map(|p| p.light);
            let cut = without_outliers(&light, guides, wrap, FILTERED_OUTLIER);
            picture.data_mut().iter_mut().zip(cut.data()).for_each(|(p, light)| p.light = *light);
        }
    }
    let light = picture.map(|p| p.light);
    let after = 2.0 * total(&light);
    (light, if before > 0.0 { (before - after) / before } else { 0.0 })
}

/// Luminance, summed row by row so that threads do not change it.
fn total(picture: &RadianceImage) -> f64 {
    let rows: Vec<f64> =
        (0..picture.height()).into_par_iter().map(|y| picture.row(y).iter().map(|&p| f64::from(luminance(p))).sum()).collect();
    rows.iter().sum()
}

/// Neighbours of a pixel on the same surface, itself included, and how much they count.
fn taps(
    (x, y): (usize, usize),
    guides: &Image<Guide>,
    wrap: bool,
    step: isize,
) -> impl Iterator<Item = (usize, usize, f32)> + '_ {
    let guide = guides.get(x, y);
    (0..25).filter_map(move |k| {
        let (i, j) = (k % 5, k / 5);
        let (nx, ny) = (x as isize + (i as isize - 2) * step, y as isize + (j as isize - 2) * step);
        let (nx, ny) = neighbour(nx, ny, guides.size(), wrap)?;
        let weight = SPLINE[i] * SPLINE[j] * guide.similarity(&guides.get(nx, ny));
        (weight > 0.0).then_some((nx, ny, weight))
    })
}

fn pass(picture: &Image<Noisy>, guides: &Image<Guide>, wrap: bool, step: isize) -> Image<Noisy> {
    Image::par_from_fn(picture.width(), picture.height(), |x, y| {
        let center = picture.get(x, y);
        let own = luminance(center.light);
        let (mut light, mut variance, mut weights) = (Vec3::ZERO, 0.0, 0.0);
        for (nx, ny, similarity) in taps((x, y), guides, wrap, step) {
            let tap = picture.get(nx, ny);
            let off = luminance(tap.light) - own;
            let noise = SIGMAS * SIGMAS * (center.variance + tap.variance) + 1e-12 * own * own;
            let weight = similarity * if off == 0.0 { 1.0 } else { (-0.5 * off * off / noise).exp() };
            light += tap.light * weight;
            variance += tap.variance * weight * weight;
            weights += weight;
        }
        if weights > 0.0 { Noisy { light: light / weights, variance: variance / (weights * weights) } } else { center }
    })
}

/// The light with every pixel scaled down that is too bright for what is around it.
fn without_outliers(light: &RadianceImage, guides: &Image<Guide>, wrap: bool, outlier: f32) -> RadianceImage {
    let (w, h) = light.size();
    RadianceImage::par_from_fn(w, h, |x, y| {
        let (center, guide) = (light.get(x, y), guides.get(x, y));
        if guide.worth == 0.0 {
            return center;
        }
        // Of the same surface, and of any.
        let mut brightest = [[0.0f32; 3]; 2];
        for k in (0..25).filter(|k| *k != 12) {
            let Some((nx, ny)) = neighbour(x as isize + k % 5 - 2, y as isize + k / 5 - 2, (w, h), wrap) else { continue };
            let (value, same) = (luminance(light.get(nx, ny)), guide.similarity(&guides.get(nx, ny)) > 0.0);
            for values in &mut brightest[usize::from(!same)..] {
                values[2] = values[2].max(value);
                values.sort_unstable_by(|a, b| b.total_cmp(a));
            }
        }
        // What is as thin as a pixel is judged by everything around it.
        let [same, any] = brightest.map(|values| outlier * values[2]);
        let (value, limit) = (luminance(center), if same > 0.0 { same } else { any });
        if limit > 0.0 && value > limit { center * (limit / value) } else { center }
    })
}
