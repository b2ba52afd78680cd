//! The clamp on the CPU: one look at each pixel's neighbours, rayon over rows.

use super::{Clamped, Params};
use crate::{bright, texel_at, to_vec3};
use glam::{DVec3, Vec3};
use pano_core::image::Image;
use rayon::prelude::*;

/// See [`super::clamp`]; arguments are checked there.
pub(super) fn clamp(params: &Params, share: &Image<f32>, signal: &mut Image<Vec3>) -> Clamped {
    let size = signal.size();
    let width = size.0;
    // The magnitude of the luminance without the premultiplication; `None` where the pixel takes no part.
    let bright = |value: Vec3| bright(value.as_dvec3()).abs();
    let luminance: Vec<Option<f64>> = (signal.data().iter().zip(share.data()))
        .map(|(&value, &share)| (share > 0.0 && value.is_finite()).then(|| bright(value) / f64::from(share.min(1.0))))
        .collect();
    let rows: Vec<Clamped> = (signal.data_mut().par_chunks_mut(width).enumerate())
        .map(|(y, row)| {
            let mut clamped = Clamped::default();
            for (x, value) in row.iter_mut().enumerate() {
                let Some(here) = luminance[y * width + x] else { continue };
                let before = bright(*value);
                clamped.before += before;
                let mut greatest: Option<f64> = None;
                for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))).filter(|&d| d != (0, 0)) {
                    let Some((nx, ny)) = texel_at(size, x as isize + dx, y as isize + dy, params.wrap) else { continue };
                    if let Some(other) = luminance[ny * width + nx].filter(|_| (nx, ny) != (x, y)) {
                        greatest = Some(greatest.map_or(other, |g: f64| g.max(other)));
                    }
                }
                let Some(limit) = greatest.map(|g| g * f64::from(params.factor)) else { continue };
                if here > limit {
                    *value = to_vec3(if here > 0.0 { value.as_dvec3() * (limit / here) } else { DVec3::ZERO });
                    clamped.pixels += 1;
                    clamped.energy += before - bright(*value);
                }
            }
            clamped
        })
        .collect();
    rows.iter().fold(Clamped::default(), |sum, row| Clamped {
        pixels: sum.pixels + row.pixels,
        energy: sum.energy + row.energy,
        before: sum.before + row.before,
    })
}
