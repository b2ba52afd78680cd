//! Irradiance of the captured surfaces, from which their reflectance follows: ρ = π·L/E.

use super::{CapturedOptions, CapturedWorld};
use crate::bsdf::concentric_disc;
use crate::bvh::Ray;
use crate::world::RealWorld;
use glam::{UVec2, Vec2, Vec3};
use pano_core::{image::Image, progress::Progress, random::Sampler, random::Stream, sphere};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

#[derive(Clone, Copy, Debug, Default)]
struct Texel {
    irradiance: Vec3,
    /// Panorama frame, relative to the capture point; zero where nothing is.
    position: Vec3,
    normal: Vec3,
}

/// Irradiance at the surfaces the panorama sees, on a coarse equirectangular grid.
#[derive(Clone, Debug)]
pub(super) struct IrradianceMap {
    texels: Image<Texel>,
}

impl IrradianceMap {
    pub(super) fn new(world: &CapturedWorld, options: &CapturedOptions, progress: &dyn Progress) -> Option<Self> {
        let w = options.irradiance_width.max(2);
        let h = (w / 2).max(1);
        progress.begin("irradiance", h as u64);
        let mut texels = Image::filled(w, h, Texel::default());
        texels.data_mut().par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            if progress.cancelled() {
                return;
            }
            for (x, texel) in row.iter_mut().enumerate() {
                *texel = measure(world, (x, y), (w, h), options.irradiance_samples);
            }
            progress.advance(1);
        });
        if progress.cancelled() {
            return None;
        }
        let mut map = Self { texels };
        for step in [1, 2] {
            map = map.smoothed(step);
        }
        Some(map)
    }

    /// Irradiance at `position` (panorama frame) on a surface with `normal`.
    pub(super) fn look(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let uv = sphere::uv_from_direction(position);
        let taps = sphere::bilinear_taps(self.texels.width(), self.texels.height(), uv);
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for tap in taps {
            let texel = self.texels.get(tap.x, tap.y);
            let weight = tap.weight * similarity(position, normal, &texel) + tap.weight * 1e-6;
            if texel.position != Vec3::ZERO {
                sum += texel.irradiance * weight;
                weights += weight;
            }
        }
        if weights > 0.0 { sum / weights } else { Vec3::ZERO }
    }

    /// One pass of a 5×5 B-spline filter with holes of `step`, over texels of the same surface only. It removes the noise
    /// of the samples; shadows already in the scene get softer by as much.
    fn smoothed(&self, step: isize) -> Self {
        const SPLINE: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];
        let (w, h) = self.texels.size();
        let texels = Image::par_from_fn(w, h, |x, y| {
            let center = self.texels.get(x, y);
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            for (j, wy) in SPLINE.iter().enumerate() {
                for (i, wx) in SPLINE.iter().enumerate() {
                    let (tx, ty) =
                        sphere::wrap_texel(w, h, x as isize + (i as isize - 2) * step, y as isize + (j as isize - 2) * step);
                    let texel = self.texels.get(tx, ty);
                    let weight = wx * wy * similarity(center.position, center.normal, &texel);
                    sum += texel.irradiance * weight;
                    weights += weight;
                }
            }
            if weights > 0.0 { Texel { irradiance: sum / weights, ..center } } else { center }
        });
        Self { texels }
    }
}

/// 1 for a texel in the plane through `position`, falling to 0 off it (2 % of the distance) and for turned normals.
fn similarity(position: Vec3, normal: Vec3, texel: &Texel) -> f32 {
    if texel.position == Vec3::ZERO {
        return 0.0;
    }
    let off = normal.dot(texel.position - position) / (0.02 * position.length());
    (-off * off).exp() * normal.dot(texel.normal).max(0.0).powi(8)
}

/// Irradiance at one texel: cosine and light sampling, joined by the balance heuristic.
fn measure(world: &CapturedWorld, (x, y): (usize, usize), (w, h): (usize, usize), samples: u32) -> Texel {
    let direction = sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
    let Some(hit) = world.look(direction) else { return Texel::default() };
    let from = world.leave(&hit);
    let (tangent, bitangent) = hit.normal.any_orthonormal_pair();
    let arriving = |d: Vec3, light: Option<&super::LightSample>| {
        let cos = d.dot(hit.normal);
        if cos <= 0.0 {
            return Vec3::ZERO;
        }
        let ray = Ray::new(from, d);
        let reached = match light {
            Some(sample) => world.reach(&ray, sample),
            None => Some(world.hit(&ray)),
        };
        let Some(behind) = reached else { return Vec3::ZERO };
        let radiance = behind.as_ref().and_then(|b| b.radiance).unwrap_or_else(|| world.infinity(d));
        radiance * (cos / (cos * FRAC_1_PI + world.light_pdf(from, d, behind.as_ref())))
    };
    let mut sum = Vec3::ZERO;
    for i in 0..samples {
        // A stream of its own: frame number −1 is no frame.
        let mut sampler = Sampler::new(UVec2::new(x as u32, y as u32), i, Stream { frame: u32::MAX, seed: 0 });
        let u = sampler.next_4d();
        let disc = concentric_disc(Vec2::new(u[0], u[1]));
        let up = (1.0 - disc.length_squared()).max(0.0).sqrt();
        sum += arriving(tangent * disc.x + bitangent * disc.y + hit.normal * up, None);
        if let Some(sample) = world.sample_light(from, Vec2::new(u[2], u[3])) {
            sum += arriving(sample.direction, Some(&sample));
        }
    }
    let turn = world.world_from_pano.inverse();
    Texel { irradiance: sum / samples.max(1) as f32, position: world.to_pano(hit.position), normal: turn * hit.normal }
}
