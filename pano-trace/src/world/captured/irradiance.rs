//! Irradiance of the captured surfaces, from which their reflectance follows: ρ = π·L/E.

use super::{Back, CapturedOptions, CapturedWorld};
use crate::bsdf::concentric_disc;
use crate::bvh::Ray;
use crate::objects::Ball;
use crate::world::{RealHit, RealWorld};
use glam::{UVec2, Vec2, Vec3};
use pano_core::{image::Image, progress::Progress, random::Sampler, random::Stream, sphere};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

#[derive(Clone, Copy, Debug, Default)]
struct Texel {
    irradiance: Vec3,
    /// Panorama frame, relative to the capture point.
    position: Vec3,
    normal: Vec3,
    measured: bool,
}

/// Irradiance at the surfaces the panorama sees: a coarse equirectangular grid everywhere, and a fine one where the objects
/// can change something worth seeing.
#[derive(Clone, Debug)]
pub(super) struct IrradianceMap {
    coarse: Image<Texel>,
    fine: Image<Texel>,
}

/// Numbers of a texel on the GPU.
#[cfg(feature = "gpu")]
pub(super) const TEXEL_WORDS: u32 = 10;

/// Columns of the fine grid for one of the coarse one.
const REFINEMENT: usize = 4;
/// The share of its irradiance that an object can take from a surface, from which on the fine grid is measured.
const INFLUENCE: f32 = 1e-2;

impl IrradianceMap {
    /// A coarse map, in which back faces are as bright as the map tells that `world` already has.
    pub(super) fn coarse(world: &CapturedWorld, width: usize, samples: u32, progress: &dyn Progress) -> Option<Self> {
        let coarse = measure_grid(world, (width / REFINEMENT).max(2), samples, progress, |_| true)?;
        Some(Self { coarse, fine: Image::filled(2, 1, Texel::default()) })
    }

    /// The same with what is fine, near `balls`.
    pub(super) fn refined(
        self,
        world: &CapturedWorld,
        balls: &[Ball],
        options: &CapturedOptions,
        progress: &dyn Progress,
    ) -> Option<Self> {
        let fine = measure_grid(world, options.irradiance_width.max(2), options.irradiance_samples, progress, |hit| {
            balls.iter().map(|ball| ball.form_factor(hit.position, hit.normal)).sum::<f32>() > INFLUENCE
        })?;
        Some(Self { fine, ..self })
    }

    /// Adds the fine and the coarse grid for a shader: where each begins, and its size.
    #[cfg(feature = "gpu")]
    pub(super) fn pack(&self, words: &mut pano_core::gpu::Words) -> [(u32, [u32; 2]); 2] {
        [&self.fine, &self.coarse].map(|grid| {
            let at = words.at();
            for texel in grid.data() {
                [texel.irradiance, texel.position, texel.normal].into_iter().for_each(|v| words.vec3(v));
                words.word(u32::from(texel.measured));
            }
            (at, [grid.width() as u32, grid.height() as u32])
        })
    }

    /// Irradiance at `position` (panorama frame) on a surface with `normal`.
    pub(super) fn look(&self, position: Vec3, normal: Vec3) -> Vec3 {
        for grid in [&self.fine, &self.coarse] {
            if let Some(irradiance) = look_in(grid, position, normal, 1e-2) {
                return irradiance;
            }
        }
        // Nothing alike nearby: whatever is there.
        look_in(&self.coarse, position, normal, 0.0).unwrap_or(Vec3::ZERO)
    }
}

/// Mean of the measured texels around `position` that are alike by more than `least`, widening the search once.
fn look_in(grid: &Image<Texel>, position: Vec3, normal: Vec3, least: f32) -> Option<Vec3> {
    let (w, h) = grid.size();
    let uv = sphere::uv_from_direction(position);
    let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
    for tap in sphere::bilinear_taps(w, h, uv) {
        let texel = grid.get(tap.x, tap.y);
        let weight = tap.weight * similarity(position, normal, &texel);
        sum += texel.irradiance * weight;
        weights += weight;
    }
    if weights <= least {
        let (x, y) = ((uv.x * w as f32) as isize, (uv.y * h as f32) as isize);
        for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))) {
            let (tx, ty) = sphere::wrap_texel(w, h, x + dx, y + dy);
            let texel = grid.get(tx, ty);
            // Where likeness is not asked for, any measured texel counts.
            let alike = if least > 0.0 { similarity(position, normal, &texel) } else { f32::from(u8::from(texel.measured)) };
            sum += texel.irradiance * alike;
            weights += alike;
        }
    }
    (weights > least).then(|| sum / weights)
}

/// One pass of a 5×5 B-spline filter with holes of `step`, over texels of the same surface only. It removes the noise of the
/// samples; shadows already in the scene get softer by as much.
fn smoothed(grid: &Image<Texel>, step: isize) -> Image<Texel> {
    const SPLINE: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];
    let (w, h) = grid.size();
    Image::par_from_fn(w, h, |x, y| {
        let center = grid.get(x, y);
        if !center.measured {
            return center;
        }
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for (j, wy) in SPLINE.iter().enumerate() {
            for (i, wx) in SPLINE.iter().enumerate() {
                let (tx, ty) =
                    sphere::wrap_texel(w, h, x as isize + (i as isize - 2) * step, y as isize + (j as isize - 2) * step);
                let texel = grid.get(tx, ty);
                let weight = wx * wy * similarity(center.position, center.normal, &texel);
                sum += texel.irradiance * weight;
                weights += weight;
            }
        }
        if weights > 0.0 { Texel { irradiance: sum / weights, ..center } } else { center }
    })
}

/// A grid of `width` columns, filtered; only what is `wanted` is measured. `None` if `progress` cancels.
fn measure_grid(
    world: &CapturedWorld,
    width: usize,
    samples: u32,
    progress: &dyn Progress,
    wanted: impl Fn(&RealHit) -> bool + Sync,
) -> Option<Image<Texel>> {
    progress.begin("irradiance", (width / 2) as u64);
    let size = (width, (width / 2).max(1));
    let mut texels = Image::filled(size.0, size.1, Texel::default());
    texels.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, texel) in row.iter_mut().enumerate() {
            let uv = Vec2::new((x as f32 + 0.5) / size.0 as f32, (y as f32 + 0.5) / size.1 as f32);
            if let Some(hit) = world.look(sphere::direction_from_uv(uv)).filter(&wanted)
                && !progress.cancelled()
            {
                *texel = measure(world, &hit, UVec2::new(x as u32, y as u32), samples);
            }
        }
        progress.advance(1);
    });
    // Holes of 1, 2 and 4 texels: 29 texels wide in all, about 20° of the fine grid.
    let smooth = |grid: Image<Texel>| [1, 2, 4].into_iter().fold(grid, |grid, step| smoothed(&grid, step));
    (!progress.cancelled()).then(|| smooth(texels))
}

/// Less than this is not alike: products that small are no numbers to count on.
pub(super) const LEAST_ALIKE: f32 = 1e-20;

/// 1 for a texel in the plane through `position`, falling to 0 off it (2 % of the distance) and for turned normals.
fn similarity(position: Vec3, normal: Vec3, texel: &Texel) -> f32 {
    if !texel.measured {
        return 0.0;
    }
    let off = normal.dot(texel.position - position) / (0.02 * position.length());
    let alike = (-off * off).exp() * normal.dot(texel.normal).max(0.0).powi(8);
    if alike < LEAST_ALIKE { 0.0 } else { alike }
}

/// Irradiance at one texel.
fn measure(world: &CapturedWorld, hit: &RealHit, at: UVec2, samples: u32) -> Texel {
    let mut sum = Vec3::ZERO;
    // A stream of its own: frame number −1 is no frame.
    let stream = Stream { frame: u32::MAX, seed: world.seed };
    for i in 0..samples {
        sum += estimate(world, hit, Back::Lit, &mut Sampler::new(at, i, stream));
    }
    let turn = world.world_from_pano.inverse();
    Texel {
        irradiance: sum / samples.max(1) as f32,
        position: world.to_pano(hit.position),
        normal: turn * hit.normal,
        measured: true,
    }
}

/// One estimate of the irradiance at `hit`, back faces as bright as told, by a pair of rays: cosine and light sampling, joined by the balance heuristic.
pub(super) fn estimate(world: &CapturedWorld, hit: &RealHit, back: Back, sampler: &mut Sampler) -> Vec3 {
    let from = world.leave(hit);
    let (tangent, bitangent) = hit.normal.any_orthonormal_pair();
    let arriving = |d: Vec3, light: Option<&super::LightSample>| {
        let cos = d.dot(hit.normal);
        if cos <= 0.0 {
            return Vec3::ZERO;
        }
        let ray = Ray::new(from, d);
        let reached = match light {
            Some(sample) => world.reach_by(&ray, sample, back),
            None => Some(world.nearest(&ray).map(|met| world.shining(met, back))),
        };
        let Some(behind) = reached else { return Vec3::ZERO };
        let radiance = behind.as_ref().and_then(|b| b.radiance).unwrap_or_else(|| world.infinity(d));
        radiance * (cos / (cos * FRAC_1_PI + world.light_pdf(from, d, behind.as_ref())))
    };
    let u = sampler.next_4d();
    let disc = concentric_disc(Vec2::new(u[0], u[1]));
    let up = (1.0 - disc.length_squared()).max(0.0).sqrt();
    let by_cosine = arriving(tangent * disc.x + bitangent * disc.y + hit.normal * up, None);
    match world.sample_light(from, Vec2::new(u[2], u[3])) {
        Some(sample) => by_cosine + arriving(sample.direction, Some(&sample)),
        None => by_cosine,
    }
}
