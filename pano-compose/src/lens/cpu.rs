//! The effects on the CPU, rayon over rows.

use super::shapes::{DIAGONALS, GLARE_THRESHOLD, NOTHING, RayPass, SUCCESSIVE, bloom_shape};
use super::{Params, bright};
use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::RadianceImage;
use rayon::prelude::*;

/// Spreads light in `picture`; tells how much, in luminance.
pub(super) fn apply(params: &Params, photo: &RadianceImage, picture: &mut RadianceImage) -> f64 {
    let taken = |threshold: f32, share: f32| {
        RadianceImage::par_from_fn(picture.width(), picture.height(), |x, y| {
            let here = bright(picture.get(x, y), threshold);
            // What the photo shines by itself went through a lens already.
            let own = if params.everything { Vec3::ZERO } else { bright(photo.get(x, y), threshold) };
            (here - own).max(Vec3::ZERO) * share
        })
    };
    let parts = [
        (params.bloom > 0.0).then(|| taken(params.threshold, params.bloom)).map(|light| (bloom(params, &light), light)),
        (params.glare > 0.0)
            .then(|| taken(params.threshold * GLARE_THRESHOLD, params.glare))
            .map(|light| (glare(params, &light), light)),
    ];
    let mut sum = 0.0;
    for (spread, light) in parts.into_iter().flatten() {
        sum += light.data().iter().map(|&p| f64::from(luminance(p))).sum::<f64>();
        let pairs = spread.data().par_iter().zip(light.data());
        picture.data_mut().par_iter_mut().zip(pairs).for_each(|(out, (spread, light))| {
            if *spread != Vec3::ZERO || *light != Vec3::ZERO {
                *out = (*out - *light + *spread).max(Vec3::ZERO).min(Vec3::splat(f32::MAX));
            }
        });
    }
    sum
}

/// Successive Gaussian filters over a reduced map, looked up bilinearly.
fn bloom(params: &Params, light: &RadianceImage) -> RadianceImage {
    let (w, h) = light.size();
    let (k, kernel) = bloom_shape(params, (w, h));
    let (rw, rh) = (w.div_ceil(k), h.div_ceil(k));
    let mut map = RadianceImage::par_from_fn(rw, rh, |x, y| {
        let pixels = (0..k * k).map(|i| (x * k + i % k, y * k + i / k)).filter(|&(x, y)| x < w && y < h);
        pixels.map(|(x, y)| light.get(x, y)).sum::<Vec3>() / (k * k) as f32
    });
    for _ in 0..SUCCESSIVE {
        map = blurred(&map, &kernel, (1, 0), params.wrap);
        map = blurred(&map, &kernel, (0, 1), params.wrap);
    }
    if k == 1 {
        return map;
    }
    RadianceImage::par_from_fn(w, h, |x, y| {
        let at = |i: usize| (i as f32 + 0.5) / k as f32 - 0.5;
        let (gx, gy) = (at(x), at(y));
        let (x0, y0) = (gx.floor(), gy.floor());
        let column = |i: isize| if params.wrap { i.rem_euclid(rw as isize) } else { i.clamp(0, rw as isize - 1) } as usize;
        let row = |j: isize| j.clamp(0, rh as isize - 1) as usize;
        let pick = |i: isize, j: isize| map.get(column(x0 as isize + i), row(y0 as isize + j));
        let (fx, fy) = (gx - x0, gy - y0);
        let value = pick(0, 0).lerp(pick(1, 0), fx).lerp(pick(0, 1).lerp(pick(1, 1), fx), fy);
        if value.max_element() > NOTHING { value } else { Vec3::ZERO }
    })
}

/// One filter along one axis; what it carries over the frame is lost.
fn blurred(map: &RadianceImage, kernel: &[f32], (dx, dy): (isize, isize), wrap: bool) -> RadianceImage {
    let (w, h) = (map.width() as isize, map.height() as isize);
    let tap = |x: isize, y: isize| {
        let x = if wrap { x.rem_euclid(w) } else { x };
        if (0..w).contains(&x) && (0..h).contains(&y) { map.get(x as usize, y as usize) } else { Vec3::ZERO }
    };
    RadianceImage::par_from_fn(map.width(), map.height(), |x, y| {
        let (x, y) = (x as isize, y as isize);
        let mut sum = tap(x, y) * kernel[0];
        for (i, weight) in kernel.iter().enumerate().skip(1) {
            let i = i as isize;
            sum += (tap(x + i * dx, y + i * dy) + tap(x - i * dx, y - i * dy)) * *weight;
        }
        sum
    })
}

/// Radial rays along the four diagonals, each a quarter of the light.
fn glare(params: &Params, light: &RadianceImage) -> RadianceImage {
    let (w, h) = light.size();
    let mut sum = RadianceImage::filled(w, h, Vec3::ZERO);
    for (sx, sy) in DIAGONALS {
        let mut ray = light.clone();
        for RayPass { step, weights } in RayPass::all(params) {
            let before = ray;
            ray = RadianceImage::par_from_fn(w, h, |x, y| {
                let mut value = Vec3::ZERO;
                for (s, weight) in weights.iter().enumerate() {
                    // Equation 1, with a pair of signs.
                    let (tx, ty) = (x as i32 + sx * step * s as i32, y as i32 + sy * step * s as i32);
                    let tx = if params.wrap { tx.rem_euclid(w as i32) } else { tx };
                    if (0..w as i32).contains(&tx) && (0..h as i32).contains(&ty) {
                        value += before.get(tx as usize, ty as usize) * *weight;
                    }
                }
                value
            });
        }
        sum.data_mut().iter_mut().zip(ray.data()).for_each(|(sum, ray)| *sum += *ray / DIAGONALS.len() as f32);
    }
    sum
}
