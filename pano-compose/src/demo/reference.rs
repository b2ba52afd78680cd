//! Path tracing of known geometry: what the demo photographs, and the truth it compares with.

use super::smooth::smooth;
use crate::pipeline::{Error, Result};
use glam::{Quat, UVec2, Vec2, Vec3};
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    progress::Progress,
    random::{Sampler, Stream},
};
use pano_trace::bvh::Ray;
use pano_trace::objects::Objects;
use pano_trace::tracer::{self, TraceParams};
use pano_trace::world::ProxyWorld;
use std::sync::Arc;

/// Least albedo the filter divides by: darker surfaces are filtered with their texture.
const LEAST_ALBEDO: f32 = 0.04;
/// Primary rays per pixel that the mean albedo is made of, at most.
const ALBEDO_SAMPLES: u32 = 16;

/// A path-traced picture.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// Radiance, filtered.
    pub(super) radiance: RadianceImage,
    /// Rays it took, shadow rays included.
    pub(super) rays: u64,
    /// Share of its light that was cut off as outliers.
    pub(super) cut_light: f64,
}

/// How a reference is traced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quality {
    /// Samples a pixel.
    pub(super) samples: u32,
    /// Scattering events after the camera.
    pub(super) bounces: u32,
    /// Which random numbers.
    pub(super) stream: Stream,
}

/// Path-traces `everything`, which closes the camera in (what escapes is black), and filters the noise.
///
/// Light is filtered apart from texture: radiance is divided by the mean albedo of the very sample positions it was traced
/// through, filtered, and multiplied again, so that texture keeps its sharpness.
pub(super) fn trace(everything: &Objects, camera: &Camera, quality: &Quality, progress: &dyn Progress) -> Result<Reference> {
    let darkness = Arc::new(RadianceImage::filled(2, 1, Vec3::ZERO));
    let nothing = ProxyWorld::new(darkness, Quat::IDENTITY, camera.position, &[]);
    let frame = tracer::Frame { camera, objects: everything, stream: quality.stream };
    let params = TraceParams { samples: quality.samples, bounces: quality.bounces, ..TraceParams::default() };
    let traced = tracer::render(&frame, &nothing, &params, progress).ok_or(Error::Cancelled)?;
    let mut layers = traced.layers;

    let texture = mean_albedo(everything, camera, quality);
    let apply = |picture: &mut RadianceImage, f: fn(Vec3, Vec3) -> Vec3| {
        picture.data_mut().iter_mut().zip(texture.data()).for_each(|(p, a)| *p = f(*p, *a));
    };
    apply(&mut layers.object, |p, a| p / a);
    let cut_light = smooth(&mut layers, camera.projection == Projection::Panorama)?;
    apply(&mut layers.object, |p, a| p * a);
    Ok(Reference { radiance: layers.object, rays: traced.rays, cut_light })
}

/// Mean albedo of what each pixel shows, at the positions of the pixel's first samples; at least [`LEAST_ALBEDO`], and 1
/// where something shines or nothing is.
fn mean_albedo(everything: &Objects, camera: &Camera, quality: &Quality) -> RadianceImage {
    let samples = quality.samples.min(ALBEDO_SAMPLES);
    RadianceImage::par_from_fn(camera.width, camera.height, |x, y| {
        let mut sum = Vec3::ZERO;
        for index in 0..samples {
            // The tracer's own jitter.
            let jitter = Sampler::new(UVec2::new(x as u32, y as u32), index, quality.stream).next_2d();
            let ray = Ray::new(camera.position, camera.direction(Vec2::new(x as f32, y as f32) + jitter));
            sum += match everything.intersect(&ray).map(|hit| everything.surface(&ray, &hit)) {
                Some(surface) if surface.emission == Vec3::ZERO => surface.albedo,
                _ => Vec3::ONE,
            };
        }
        (sum / samples as f32).max(Vec3::splat(LEAST_ALBEDO))
    })
}

/// Distance along the ray through each pixel's centre, infinite where `is_opening` says that the hit face is one.
pub(super) fn depth(everything: &Objects, camera: &Camera, is_opening: impl Fn(u32) -> bool + Sync) -> Image<f32> {
    Image::par_from_fn(camera.width, camera.height, |x, y| {
        let ray = Ray::new(camera.position, camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
        match everything.intersect(&ray) {
            Some(hit) if !is_opening(hit.hit.triangle) => hit.hit.t,
            _ => f32::INFINITY,
        }
    })
}
