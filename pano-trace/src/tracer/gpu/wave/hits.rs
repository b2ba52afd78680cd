//! Single rays in a captured field.

use super::Held;
use super::follow::{ASKED, Asked, Quest, REAL_EXISTS, REAL_HIDDEN, Told};
use crate::bvh::Ray;
use crate::objects::Objects;
use crate::tracer::gpu::{ASKS, Started};
use crate::tracer::{Frame, TraceParams};
use crate::world::CapturedWorld;
use crate::world::gpu::AT_ANYTHING;
use glam::{Quat, Vec3};
use pano_core::camera::{Camera, Projection};
use pano_core::gpu::{Gpu, GpuResult, Rows};
use pano_core::progress::Silent;
use pano_core::random::Stream;

/// What the GPU tells of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GpuHit {
    /// Distance of the surface in metres; infinite: there is none.
    pub t: f32,
    /// Its world position.
    pub position: Vec3,
    /// Its unit normal, [`crate::world::RealHit::normal`].
    pub normal: Vec3,
    /// Whether it is only assumed.
    pub hidden: bool,
    /// Radiance that arrives along the ray.
    pub radiance: Vec3,
    /// Density per steradian with which light samples find its direction, [`crate::world::RealWorld::light_pdf`].
    pub light_pdf: f32,
}

/// [`crate::world::RealWorld::hit`] of each ray in a captured field.
///
/// # Errors
/// As [`super::render_captured`]; [`pano_core::gpu::GpuError::TooLarge`] as well of more rays than fit a binding.
pub fn captured_hits(gpu: &Gpu, world: &CapturedWorld, rays: &[Ray]) -> GpuResult<Vec<GpuHit>> {
    let camera = Camera {
        position: Vec3::ZERO,
        world_from_camera: Quat::IDENTITY,
        projection: Projection::Panorama,
        width: rays.len(),
        height: 1,
    };
    let objects = Objects::new(&[]);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let held = Held::new(gpu, &frame, world, &TraceParams::default())?;
    let question = |ray: &Ray| {
        let quest = Quest {
            origin: ray.origin,
            // Infinity is no number a shader may count on.
            limit: ray.t_max.min(f32::MAX),
            direction: ray.direction,
            asks: ASKS,
            goal: Vec3::ZERO,
            aimed: AT_ANYTHING,
        };
        Asked::of(quest)
    };
    let asked = gpu.upload_slice(&rays.iter().map(question).collect::<Vec<_>>())?;
    let rows = Rows::all((rays.len(), 1));
    let band = held.band(rows, gpu.buffer::<Started>(rays.len())?, asked)?;
    band.follow(&[], &Silent)?;
    let hit = |Told { position, t, normal, what, light, pdf, .. }: Told| GpuHit {
        t: if what & REAL_EXISTS == 0 { f32::INFINITY } else { t },
        position,
        normal,
        hidden: what & REAL_HIDDEN != 0,
        radiance: light,
        light_pdf: pdf,
    };
    Ok(gpu.read_slice::<Asked>(band.buffer(ASKED), rays.len())?.into_iter().map(|asked| hit(asked.told)).collect())
}
