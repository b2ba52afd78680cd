//! A whole frame.

use super::shade::Shader;
use super::{Lighting, Params};
use crate::bvh::Ray;
use crate::tracer::{First, Frame, Pixel, Scene, TraceParams, Traced, Tracer, Walk, layers, pixels};
use crate::world::RealWorld;
use glam::{UVec2, Vec2, Vec3};
use pano_core::image::Image;
use pano_core::progress::Progress;
use pano_core::random::Sampler;

/// Most lights that are traced, and most shadow layers. Detection keeps the strongest that give 90 % of the light; behind the
/// sixteenth of them no shadow is seen.
pub(super) const MAX_LIGHTS: usize = 16;

/// A frame with the shadows of each light.
#[derive(Clone, Debug)]
pub struct Lit {
    /// Its layers.
    pub traced: Traced,
    /// Per light the share of it that reaches what the pixel shows, [0, 1]; 0 on surfaces that face away, 1 where nothing is.
    pub shadows: Vec<Image<f32>>,
}

/// Traces a frame on the CPU, rows in parallel; the result does not depend on the number of threads. `None` if `progress`
/// cancels.
pub fn render<W: RealWorld>(
    frame: &Frame<'_>,
    world: &W,
    lighting: &Lighting,
    params: &Params<'_>,
    progress: &dyn Progress,
) -> Option<Lit> {
    let camera = frame.camera;
    // The tracer is asked for first hits only.
    let trace = TraceParams { samples: params.samples, ..TraceParams::default() };
    let shader = Shader { tracer: Tracer { objects: frame.objects, world, params: &trace }, lighting, params };
    let traced = pixels(camera, progress, |at| shader.pixel(frame, at))?;
    let shadows = (0..lighting.lights.len().min(MAX_LIGHTS))
        .map(|light| Image::from_fn(camera.width, camera.height, |x, y| traced[y * camera.width + x].shadows[light]))
        .collect();
    let layers = layers(camera, traced.iter().map(|p| &p.pixel));
    let (rays, discarded) = (traced.iter().map(|p| p.rays).sum(), traced.iter().map(|p| p.discarded).sum());
    Some(Lit { traced: Traced { layers, rays, discarded, sampling: None }, shadows })
}

/// Where more light is blocked than the map's mean has, noise can take away too much.
pub(super) fn no_darker_than_black(pixel: Pixel) -> Pixel {
    Pixel { object: pixel.object.max(Vec3::ZERO), ..pixel }
}

/// A pixel and what it cost.
#[derive(Default)]
struct LitPixel {
    pixel: Pixel,
    shadows: [f32; MAX_LIGHTS],
    rays: u64,
    discarded: u64,
}

impl<W: RealWorld> Shader<'_, W> {
    fn pixel(&self, frame: &Frame<'_>, at: UVec2) -> LitPixel {
        let corner = Vec2::new(at.x as f32, at.y as f32);
        let (mut pixel, _) = self.tracer.guides(frame, corner + 0.5);
        let scene = if self.tracer.may_see_objects(frame.camera, corner) { Scene::Mixed } else { Scene::Real };
        let photo = self.params.photo.get(at.x as usize, at.y as usize);
        let (mut object, mut delta, mut covered) = (Vec3::ZERO, Vec3::ZERO, 0u32);
        let (mut reached, mut rays, mut discarded) = ([0u32; MAX_LIGHTS], 0, 0);
        let lights = self.lights().len();
        for index in 0..self.params.samples {
            let mut walk = Walk { sampler: Sampler::new(at, index, frame.stream), rays: 0 };
            let [jx, jy, pick, _] = walk.sampler.next_4d();
            let ray = Ray::new(frame.camera.position, frame.camera.direction(corner + Vec2::new(jx, jy)));
            let (sum, value) = match self.tracer.first(&ray, scene, &mut walk) {
                First::Infinity => {
                    reached[..lights].iter_mut().for_each(|count| *count += 1);
                    (&mut delta, Vec3::ZERO)
                }
                First::Object(hit) => {
                    covered += 1;
                    (&mut object, self.object(&ray, &hit, 0, &mut walk, &mut reached[..lights]))
                }
                First::Real(hit) => {
                    let hit = self.tracer.world.shown_surface(hit, ray.direction, pick);
                    let (relative, mirrored) = self.real(&ray, &hit, &mut walk, &mut reached[..lights]);
                    (&mut delta, photo * relative + mirrored)
                }
            };
            rays += walk.rays;
            if value.is_finite() {
                *sum += value;
            } else {
                discarded += 1;
            }
        }
        let share = 1.0 / self.params.samples as f32;
        pixel.object = object * share;
        pixel.delta = delta * share;
        pixel.coverage = covered as f32 * share;
        LitPixel { pixel: no_darker_than_black(pixel), shadows: reached.map(|count| count as f32 * share), rays, discarded }
    }
}
