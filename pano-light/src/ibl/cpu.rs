//! Convolution by lookups; rayon over rows.

use super::kernel::{Kernel, Lookups};
use super::pyramid::{self, Pyramid};
use super::{DIFFUSE_SIZE, GLOSSY_SIZES};
use glam::{Vec2, Vec3, Vec3A};
use pano_core::image::{Image, RadianceImage};
use pano_core::light::{GLOSSY_ROUGHNESS, RadianceMaps};
use pano_core::sphere;
use rayon::prelude::*;
use std::sync::LazyLock;

/// The lookups of [`Kernel::Diffuse`] and of each glossy map's kernel: the same for every panorama.
pub(super) static LOOKUPS: LazyLock<(Lookups, [Lookups; GLOSSY_ROUGHNESS.len()])> = LazyLock::new(|| {
    let glossy = |roughness| Kernel::Glossy(roughness).samples();
    (Kernel::Diffuse.samples(), GLOSSY_ROUGHNESS.map(glossy))
});

/// See [`super::radiance_maps`].
pub(super) fn radiance_maps(panorama: &RadianceImage) -> RadianceMaps {
    let pyramid = Pyramid::new(panorama);
    let (diffuse, glossy) = &*LOOKUPS;
    RadianceMaps {
        diffuse: convolved(&pyramid, diffuse, DIFFUSE_SIZE),
        glossy: std::array::from_fn(|i| convolved(&pyramid, &glossy[i], GLOSSY_SIZES[i])),
        mirror: panorama.clone(),
    }
}

/// The panorama seen through a kernel. The lookups of one row's pixels differ by a turn about the pole only, so that directions
/// are worked out once a row.
fn convolved(pyramid: &Pyramid, lookups: &Lookups, (width, height): (usize, usize)) -> RadianceImage {
    let mut map = RadianceImage::filled(width, height, Vec3::ZERO);
    map.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let mut sums = vec![Vec3A::ZERO; width];
        let mut mixed = Vec::new();
        for (uv, level) in row_lookups(lookups, (width, height), y) {
            add_row(pyramid.level(level), uv, &mut mixed, &mut sums);
        }
        for (out, sum) in row.iter_mut().zip(sums) {
            *out = Vec3::from(sum) / lookups.len() as f32;
        }
    });
    map
}

/// Where the lookups of the first pixel of row `y` fall, and in which level of the pyramid.
pub(super) fn row_lookups(
    lookups: &Lookups,
    (width, height): (usize, usize),
    y: usize,
) -> impl Iterator<Item = (Vec2, usize)> + '_ {
    let axis = sphere::direction_from_uv(Vec2::new(0.5 / width as f32, (y as f32 + 0.5) / height as f32));
    let (a, b) = axis.any_orthonormal_pair();
    lookups.iter().map(move |sample| {
        let d = sample.direction;
        (sphere::uv_from_direction(a * d.x + b * d.y + axis * d.z), pyramid::level_for(sample.solid_angle))
    })
}

/// Adds to each of `sums` what `level` shows at `uv`, u growing by one turn in all. Bilinear; rows beyond the poles are those of
/// the pole, which [`Pyramid`] has made all but uniform. `mixed` is room to work in.
fn add_row(level: &Image<Vec3A>, uv: Vec2, mixed: &mut Vec<Vec3A>, sums: &mut [Vec3A]) {
    let (w, h) = level.size();
    let y = (uv.y * h as f32 - 0.5).clamp(0.0, (h - 1) as f32);
    let (y0, fy) = (y as usize, y.fract());
    let (upper, lower) = (level.row(y0), level.row((y0 + 1).min(h - 1)));
    // The two rows become one, whose first pixel is its last one's neighbour again.
    mixed.clear();
    mixed.extend(upper.iter().zip(lower).map(|(u, l)| u + (l - u) * fy));
    mixed.push(mixed[0]);
    // Both widths are powers of 2: every `period`th sum looks up the same fraction of a pixel, `step` pixels further.
    let (period, step) = ((sums.len() / w).max(1), (w / sums.len()).max(1));
    let start = (uv.x * w as f32 - 0.5).rem_euclid(w as f32);
    for phase in 0..period {
        let at = start + phase as f32 / period as f32;
        let (mut x, fx) = (at as usize, at.fract());
        for sum in sums[phase..].iter_mut().step_by(period) {
            x &= w - 1;
            *sum += mixed[x] + (mixed[x + 1] - mixed[x]) * fx;
            x += step;
        }
    }
}
