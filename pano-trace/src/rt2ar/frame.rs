//! A whole frame: pixels, then those again that their neighbours cast doubt on.

use super::lights::{Pattern, SphericalLight};
use super::shade::Shader;
use super::shadow::{Real, Verdicts};
use super::trail::{Path, Trail};
use super::{Lighting, MAX_SHADOW_SAMPLES, PROBES, Params, Shadow};
use crate::bvh::Ray;
use crate::objects::Differentials;
use crate::tracer::{First, Frame, Pixel, TraceParams, Traced, Tracer, around, layers, pixels};
use crate::world::RealWorld;
use glam::{UVec2, Vec2, Vec3};
use pano_core::camera::Camera;
use pano_core::color::luminance;
use pano_core::image::Image;
use pano_core::progress::Progress;
use pano_core::random::Sampler;
use rayon::prelude::*;
use std::convert::Infallible;

/// Most lights that are traced, and most shadow layers. Detection keeps the strongest that give 90 % of the light; behind the
/// sixteenth of them no shadow is seen.
pub(super) const MAX_LIGHTS: usize = 16;

/// Points of a light for which a glossy surface is asked how it responds: a highlight is as round as it gets.
const RESPONSES: u32 = 12;

/// A frame, with its shadows.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Its layers.
    pub traced: Traced,
    /// Per light the share of it that reaches what the pixel shows, [0, 1]; 0 on surfaces of objects that face away, 1 where
    /// nothing is.
    pub shadows: Vec<Image<f32>>,
    /// Pixels that show a penumbra: samples of one light have disagreed there.
    pub penumbra: Image<bool>,
    /// Rays towards lights, of those in [`Traced::rays`].
    pub shadow_rays: u64,
    /// Pixels that got all samples because a neighbour had found a penumbra or another answer.
    pub doubted: u64,
}

/// Traces a frame on the CPU, rows in parallel; the result does not depend on the number of threads. `lights` are
/// [`super::place_lights`]'. `None` if `progress` cancels.
pub fn render<W: RealWorld>(
    frame: &Frame<'_>,
    world: &W,
    lighting: &Lighting,
    lights: &[SphericalLight],
    params: &Params<'_>,
    progress: &dyn Progress,
) -> Option<Rendered> {
    let camera = frame.camera;
    let lights = &lights[..lights.len().min(MAX_LIGHTS)];
    // The tracer is asked for first hits only.
    let trace = TraceParams { samples: params.samples, ..TraceParams::default() };
    let (patterns, response) = patterns(params);
    let tracer = Tracer { objects: frame.objects, world, params: &trace };
    let brightest = brightest(lighting);
    let shader = Shader { tracer, lighting, lights, patterns, response, brightest, params };
    let centers = pixels(camera, progress, |at| shader.center(frame, at))?;
    let size = (camera.width, camera.height);
    let mut traced = pixels(camera, progress, |at| {
        let center = &centers[index(at, camera.width)];
        let untouched = is_untouched(index(at, size.0), size, params, |i| centers[i].quiet);
        if untouched { center.unchanged(lights.len()) } else { shader.pixel(frame, at, center, false) }
    })?;
    let redo = |&i: &usize| {
        let at = UVec2::new((i % camera.width) as u32, (i / camera.width) as u32);
        if progress.cancelled() { None } else { Some(shader.pixel(frame, at, &centers[i], true)) }
    };
    let Ok(doubted) = settle_doubts(&mut traced, size, params, |again| Ok::<_, Infallible>(again.par_iter().map(redo).collect()));
    Some(Rendered::of(camera, &traced, lights.len(), doubted?))
}

/// The points of each light that are sampled, [`Pattern::ladder`], and those for which surfaces are asked how they respond.
pub(super) fn patterns(params: &Params<'_>) -> (Vec<Pattern>, Pattern) {
    let samples = if params.shadow == Shadow::Hard { 1 } else { params.shadow_samples.clamp(1, MAX_SHADOW_SAMPLES) };
    (Pattern::ladder(samples, probes(params)), Pattern::new(samples.min(RESPONSES), PROBES[0]))
}

/// [`Params::probes`], as many as there may be.
pub(super) fn probes(params: &Params<'_>) -> u32 {
    params.probes.clamp(PROBES[0], PROBES[1])
}

/// The largest luminance of what lights a frame that is no light's; more than 0.
pub(super) fn brightest(lighting: &Lighting) -> f32 {
    lighting.maps.mirror.data().iter().map(|&p| luminance(p)).fold(f32::MIN_POSITIVE, f32::max)
}

/// Whether nothing can change at pixel `i` and around it. All samples everywhere is the algorithm without bounds, to compare with.
pub(super) fn is_untouched(i: usize, size: (usize, usize), params: &Params<'_>, quiet: impl Fn(usize) -> bool) -> bool {
    params.shadow != Shadow::Soft && around(i, size, 1, false).all(quiet)
}

/// Traces pixels again, with all samples, until none is in doubt; how many those were. `redo` traces some, or is cancelled.
pub(super) fn settle_doubts<E>(
    traced: &mut [Shaded],
    size: (usize, usize),
    params: &Params<'_>,
    mut redo: impl FnMut(&[usize]) -> Result<Option<Vec<Shaded>>, E>,
) -> Result<Option<u64>, E> {
    let mut doubted = 0;
    if !(params.shadows && params.shadow == Shadow::Adaptive && params.spread) {
        return Ok(Some(doubted));
    }
    let mut thorough = vec![false; traced.len()];
    loop {
        let again = in_doubt(traced, size, &thorough);
        if again.is_empty() {
            return Ok(Some(doubted));
        }
        doubted += again.len() as u64;
        let Some(found) = redo(&again)? else { return Ok(None) };
        for (i, mut pixel) in again.into_iter().zip(found) {
            (pixel.rays, pixel.shadow_rays) = (pixel.rays + traced[i].rays, pixel.shadow_rays + traced[i].shadow_rays);
            thorough[i] = true;
            traced[i] = pixel;
        }
    }
}

impl Rendered {
    /// What the pixels of a frame come to.
    pub(super) fn of(camera: &Camera, traced: &[Shaded], lights: usize, doubted: u64) -> Self {
        let image = |value: &dyn Fn(&Shaded) -> f32| {
            Image::from_fn(camera.width, camera.height, |x, y| value(&traced[y * camera.width + x]))
        };
        let shadows = (0..lights).map(|light| image(&|p| p.shadows[light])).collect();
        let penumbra = Image::from_fn(camera.width, camera.height, |x, y| traced[y * camera.width + x].verdicts.penumbra != 0);
        let layers = layers(camera, traced.iter().map(|p| &p.pixel));
        let total = |of: fn(&Shaded) -> u64| traced.iter().map(of).sum();
        let shadow_rays = total(|p| p.shadow_rays);
        // One look at each pixel's centre comes before all others.
        let rays = traced.len() as u64 + total(|p| p.rays) + shadow_rays;
        let traced = Traced { layers, rays, discarded: total(|p| p.discarded), sampling: None };
        Self { traced, shadows, penumbra, shadow_rays, doubted }
    }
}

/// Pixels, not yet `thorough`, whose probes agreed on a light about which a neighbour knows of a penumbra or of another answer.
fn in_doubt(traced: &[Shaded], size: (usize, usize), thorough: &[bool]) -> Vec<usize> {
    let doubted = |i: usize| {
        let mut neighbours = Verdicts::default();
        around(i, size, 1, false).for_each(|k| neighbours.join(traced[k].verdicts));
        traced[i].verdicts.doubted_by(&neighbours)
    };
    (0..traced.len()).into_par_iter().filter(|&i| !thorough[i] && doubted(i)).collect()
}

fn index(at: UVec2, width: usize) -> usize {
    at.y as usize * width + at.x as usize
}

/// What is seen at a pixel's centre.
#[derive(Default)]
pub(super) struct Center {
    pub(super) guides: Pixel,
    /// Any ray through the pixel may meet an object.
    pub(super) look: bool,
    /// Nothing can change here.
    pub(super) quiet: bool,
    /// The lights that shine on what is here, as bits.
    pub(super) bright: u32,
}

impl Center {
    /// A pixel that nothing changes, with so many `lights`.
    pub(super) fn unchanged(&self, lights: usize) -> Shaded {
        let verdicts = Verdicts { bright: self.bright, ..Verdicts::default() };
        let mut shadows = [0.0; MAX_LIGHTS];
        shadows[..lights].fill(1.0);
        Shaded { pixel: self.guides, shadows, verdicts, rays: 0, shadow_rays: 0, discarded: 0 }
    }
}

/// A pixel and what it cost.
#[derive(Default)]
pub(super) struct Shaded {
    pub(super) pixel: Pixel,
    pub(super) shadows: [f32; MAX_LIGHTS],
    pub(super) verdicts: Verdicts,
    pub(super) rays: u64,
    pub(super) shadow_rays: u64,
    pub(super) discarded: u64,
}

impl<W: RealWorld> Shader<'_, W> {
    fn center(&self, frame: &Frame<'_>, at: UVec2) -> Center {
        let corner = Vec2::new(at.x as f32, at.y as f32);
        let look = self.tracer.may_see_objects(frame.camera, corner);
        let ray = Ray::new(frame.camera.position, frame.camera.direction(corner + 0.5));
        let first = self.meet(&ray, Path::primary().media, look, W::surface, &mut 0).first;
        let guides = self.tracer.guides_of(&first, &ray);
        Center { guides, look, quiet: !look && !self.may_change(&first), bright: self.faced(&first) }
    }

    fn pixel(&self, frame: &Frame<'_>, at: UVec2, center: &Center, thorough: bool) -> Shaded {
        let corner = Vec2::new(at.x as f32, at.y as f32);
        let photo = self.params.photo.get(at.x as usize, at.y as usize);
        let (mut object, mut delta, mut covered) = (Vec3::ZERO, Vec3::ZERO, 0u32);
        let mut pixel = center.guides;
        let (mut shadows, mut discarded, mut taken) = ([0.0; MAX_LIGHTS], 0, 0);
        let mut trail = Trail::new(thorough);
        // A ray stands for its share of the pixel's area.
        let width = (self.params.samples as f32).sqrt().recip();
        let filtered = self.params.max_anisotropy > 0 && frame.objects.textured();
        for index in 0..self.params.samples {
            taken += 1;
            trail.walk.sampler = Sampler::new(at, index, frame.stream);
            trail.reached = [0.0; MAX_LIGHTS];
            let [jx, jy, pick, _] = trail.walk.sampler.next_4d();
            let ray = Ray::new(frame.camera.position, frame.camera.direction(corner + Vec2::new(jx, jy)));
            let mut path = Path::primary();
            if filtered {
                path.beam = Some(Differentials::of_pixel(frame.camera, corner + Vec2::new(jx, jy), width));
            }
            let met = self.meet(&ray, path.media, center.look, W::surface, &mut trail.walk.rays);
            path.media = met.media;
            let (sum, value) = match met.first {
                First::Infinity => {
                    trail.reached = [1.0; MAX_LIGHTS];
                    (&mut delta, Vec3::ZERO)
                }
                First::Object(hit) => {
                    covered += 1;
                    (&mut object, met.left * self.object(&ray, &hit, path, &mut trail))
                }
                First::Real(hit) => {
                    trail.reached = [1.0; MAX_LIGHTS];
                    let hit = self.tracer.world.shown_surface(hit, ray.direction, pick);
                    let change = self.change(&ray, &hit, Real::IfObjectsDo, path, &mut trail);
                    (&mut delta, change.of(photo, self.params.reflectance_cap))
                }
            };
            shadows.iter_mut().zip(trail.reached).for_each(|(sum, reached)| *sum += reached);
            if value.is_finite() {
                *sum += value;
            } else {
                discarded += 1;
            }
            // One more look, somewhere else in the pixel, makes sure.
            if center.quiet && index == 0 && value == Vec3::ZERO {
                break;
            }
        }
        let share = 1.0 / taken.max(1) as f32;
        pixel.object = object * share;
        pixel.delta = delta * share;
        pixel.coverage = covered as f32 * share;
        shadows.iter_mut().for_each(|sum| *sum *= share);
        let Trail { walk, shadow_rays, verdicts, .. } = trail;
        Shaded { pixel, shadows, verdicts, rays: walk.rays, shadow_rays, discarded }
    }
}
