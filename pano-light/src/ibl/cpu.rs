//! Convolution by lookups; rayon over rows.

use super::kernel::{Kernel, SAMPLES};
use super::pyramid::Pyramid;
use super::{DIFFUSE_SIZE, GLOSSY_SIZES};
use glam::{Vec2, Vec3, Vec3A};
use pano_core::image::{Image, RadianceImage};
use pano_core::light::{GLOSSY_ROUGHNESS, RadianceMaps};
use pano_core::sphere;
use rayon::prelude::*;

/// See [`super::radiance_maps`].
pub(super) fn radiance_maps(panorama: &RadianceImage) -> RadianceMaps {
    let pyramid = Pyramid::new(panorama);
    let glossy = |i: usize| convolved(&pyramid, Kernel::Glossy(GLOSSY_ROUGHNESS[i]), GLOSSY_SIZES[i]);
    RadianceMaps {
        diffuse: convolved(&pyramid, Kernel::Diffuse, DIFFUSE_SIZE),
        glossy: std::array::from_fn(glossy),
        mirror: panorama.clone(),
    }
}

/// The panorama seen through `kernel`. The lookups of one row's pixels differ by a turn about the pole only, so that directions
/// are worked out once a row.
fn convolved(pyramid: &Pyramid, kernel: Kernel, (width, height): (usize, usize)) -> RadianceImage {
    let samples = kernel.samples();
    let levels = samples.map(|s| pyramid.level(s.solid_angle));
    let mut map = RadianceImage::filled(width, height, Vec3::ZERO);
    map.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let axis = sphere::direction_from_uv(Vec2::new(0.5 / width as f32, (y as f32 + 0.5) / height as f32));
        let (a, b) = axis.any_orthonormal_pair();
        let mut sums = vec![Vec3A::ZERO; width];
        for (sample, level) in samples.iter().zip(levels) {
            let ((sin_t, cos_t), (sin_p, cos_p)) = (sample.theta.sin_cos(), sample.phi.sin_cos());
            let uv = sphere::uv_from_direction(axis * cos_t + (a * cos_p + b * sin_p) * sin_t);
            add_row(level, uv, &mut sums);
        }
        for (out, sum) in row.iter_mut().zip(sums) {
            *out = Vec3::from(sum) / SAMPLES as f32;
        }
    });
    map
}

/// Adds to each of `sums` what `level` shows at `uv`, u growing by one turn in all. Bilinear; rows beyond the poles are those of
/// the pole, which [`Pyramid`] has made all but uniform.
fn add_row(level: &Image<Vec3A>, uv: Vec2, sums: &mut [Vec3A]) {
    let (w, h) = level.size();
    let y = (uv.y * h as f32 - 0.5).clamp(0.0, (h - 1) as f32);
    let (y0, fy) = (y as usize, y.fract());
    let (upper, lower) = (level.row(y0), level.row((y0 + 1).min(h - 1)));
    let stride = w as f32 / sums.len() as f32;
    // The two rows become one, in which each sum needs two pixels. Twice around: `start` is less than one turn.
    let row: Vec<Vec3A> = upper.iter().zip(lower).map(|(u, l)| *u * (1.0 - fy) + *l * fy).collect();
    let row = [&row[..], &row[..], &row[..1]].concat();
    let start = (uv.x * w as f32 - 0.5).rem_euclid(w as f32);
    for (x, sum) in sums.iter_mut().enumerate() {
        let at = start + x as f32 * stride;
        // Rounding may make a full turn of a start just below 0.
        let x0 = (at as usize).min(2 * w - 1);
        let fx = at - x0 as f32;
        *sum += row[x0] + (row[x0 + 1] - row[x0]) * fx;
    }
}
