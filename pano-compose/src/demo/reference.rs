//! Path tracing of known geometry: what the demo photographs, and the truth it compares with.

use super::smooth::smooth;
use super::survey::Survey;
use crate::pipeline::{Error, Result};
use glam::{Quat, Vec2, Vec3};
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    progress::Progress,
    random::Stream,
};
use pano_trace::bvh::Ray;
use pano_trace::objects::Objects;
use pano_trace::tracer::{self, TraceParams};
use pano_trace::world::ProxyWorld;
use std::sync::Arc;

/// A path-traced picture.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// Radiance, filtered.
    pub(super) radiance: RadianceImage,
    /// Rays it took, shadow rays included.
    pub(super) rays: u64,
    /// Share of its light that the filter lost, most of it outliers that were cut.
    pub(super) lost_light: f64,
}

/// How a reference is traced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quality {
    /// Samples a pixel in each of two halves.
    pub(super) samples: u32,
    /// Scattering events after the camera.
    pub(super) bounces: u32,
    /// Pixels between the taps of the widest filter.
    pub(super) coarsest: isize,
    /// The halves' random numbers, which must differ.
    pub(super) streams: [Stream; 2],
}

/// Path-traces `everything`, which closes the camera in (what escapes is black), and filters the noise.
///
/// Light is filtered apart from texture and edges, which stay sharp; see [`Survey`].
pub(super) fn trace(everything: &Objects, camera: &Camera, quality: &Quality, progress: &dyn Progress) -> Result<Reference> {
    let darkness = Arc::new(RadianceImage::filled(2, 1, Vec3::ZERO));
    let nothing = ProxyWorld::new(darkness, Quat::IDENTITY, camera.position, &[]);
    let params = TraceParams { samples: quality.samples, bounces: quality.bounces, ..TraceParams::default() };
    let trace = |stream: Stream| {
        tracer::render(&tracer::Frame { camera, objects: everything, stream }, &nothing, &params, progress)
            .ok_or(Error::Cancelled)
    };
    let [a, b] = [trace(quality.streams[0])?, trace(quality.streams[1])?];
    let survey = Survey::new(everything, camera, quality);
    let mut halves = [a.layers.object, b.layers.object];
    halves.iter_mut().enumerate().for_each(|(i, half)| survey.remove_texture(half, i));
    let (light, lost_light) = smooth(halves, survey.guides(), camera.projection == Projection::Panorama, quality.coarsest);
    Ok(Reference { radiance: survey.add_texture(&light), rays: a.rays + b.rays, lost_light })
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
