//! A whole frame: pixels, samples, layers.

use super::adaptive::{self, Noise};
use super::influence::{Lights, NO_SAMPLES, Thinned, least_of_neighbours};
use super::path::{First, Scene};
use super::{Method, TraceParams, Tracer, Walk};
use crate::bvh::Ray;
use crate::objects::{Beam, Objects};
use crate::world::{RealHit, RealWorld};
use glam::{UVec2, Vec2, Vec3};
use pano_core::camera::{Camera, Projection};
use pano_core::{image::Image, layers::TracedLayers, progress::Progress, random::Sampler, random::Stream};
use rayon::prelude::*;

/// A frame to trace.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The view.
    pub camera: &'a Camera,
    /// The virtual objects.
    pub objects: &'a Objects,
    /// Which random numbers.
    pub stream: Stream,
}

/// A traced frame.
#[derive(Clone, Debug)]
pub struct Traced {
    /// Its layers.
    pub layers: TracedLayers,
    /// Rays it took, shadow rays included.
    pub rays: u64,
    /// Samples that came out NaN or infinite and count as 0; none are expected.
    pub discarded: u64,
    /// What adaptive sampling did, where it was asked for.
    pub sampling: Option<Sampling>,
}

/// How a frame was sampled.
#[derive(Clone, Debug)]
pub struct Sampling {
    /// Samples a pixel, on average.
    pub samples: f32,
    /// Standard error of every pixel's luminance before any filter: an estimate from its samples and its neighbours', and an
    /// upper bound where stratification helps.
    pub error: Image<f32>,
}

impl Sampling {
    /// Of pixels that were so noisy and took so many samples.
    pub(super) fn of(noise: &[Noise], samples: &[u32], camera: &Camera) -> Self {
        let wrap = camera.projection == Projection::Panorama;
        let mean = samples.iter().map(|n| f64::from(*n)).sum::<f64>() / samples.len() as f64;
        Self { samples: mean as f32, error: adaptive::error_map(noise, samples, camera.width, wrap) }
    }
}

/// What a pixel comes to.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pixel {
    pub(crate) object: Vec3,
    pub(crate) coverage: f32,
    pub(crate) delta: Vec3,
    pub(crate) depth: f32,
    pub(crate) normal: Vec3,
    pub(crate) albedo: Vec3,
}

/// Traces a frame on the CPU, rows in parallel; the result does not depend on the number of threads. `None` if
/// `progress` cancels.
pub fn render<W: RealWorld>(frame: &Frame<'_>, world: &W, params: &TraceParams, progress: &dyn Progress) -> Option<Traced> {
    let camera = frame.camera;
    let tracer = Tracer { objects: frame.objects, world, params };
    let lights = Lights::of(world, camera.position, params.samples);
    let begun = pixels(camera, progress, |at| tracer.start(frame, at, &lights))?;
    let thinning: Vec<u32> = begun.iter().map(|b| b.thinning).collect();
    let thinning = least_of_neighbours(&thinning, camera.width, camera.projection == Projection::Panorama);
    let started = |at: UVec2| {
        let index = at.y as usize * camera.width + at.x as usize;
        // Where noise is to be measured, there are enough samples for that.
        let least = if params.error_target.is_some() { adaptive::PILOT.min(params.samples) } else { 0 };
        let thinned = Thinned::of(begun[index].scene, params.samples, thinning[index], least);
        let mut pixel = Started { begun: begun[index], thinned, ..Started::default() };
        let first = if params.error_target.is_some() { least } else { thinned.samples };
        tracer.sample_until(frame, at, first, &mut pixel);
        pixel
    };
    let (finished, sampling): (Vec<Finished>, _) = match params.error_target {
        None => (pixels(camera, progress, |at| started(at).finish())?, None),
        Some(target) => {
            let mut pixels = pixels(camera, progress, started)?;
            let sampling = tracer.refine(frame, &mut pixels, target, progress)?;
            (pixels.iter().map(Started::finish).collect(), Some(sampling))
        }
    };
    let layers = layers(camera, finished.iter().map(|p| &p.pixel));
    let (rays, discarded) = (finished.iter().map(|p| p.rays).sum(), finished.iter().map(|p| p.discarded).sum());
    Some(Traced { layers, rays, discarded, sampling })
}

/// A pixel before its first sample.
#[derive(Clone, Copy, Default)]
struct Begun {
    guides: Pixel,
    scene: Scene,
    /// One sample in how many its centre asks for.
    thinning: u32,
}

/// A pixel under way.
#[derive(Default)]
struct Started {
    begun: Begun,
    /// What it takes at most.
    thinned: Thinned,
    samples: u32,
    covered: u32,
    object: Vec3,
    delta: Vec3,
    noise: Noise,
    rays: u64,
    discarded: u64,
}

impl Started {
    fn finish(&self) -> Finished {
        let share = 1.0 / self.samples.max(1) as f32;
        let pixel = Pixel {
            object: self.object * share,
            delta: self.delta * share,
            coverage: self.covered as f32 * share,
            ..self.begun.guides
        };
        Finished { pixel, rays: self.rays, discarded: self.discarded }
    }
}

/// A pixel and what it cost.
#[derive(Clone, Copy, Default)]
struct Finished {
    pixel: Pixel,
    rays: u64,
    discarded: u64,
}

/// What `pixel` makes of every pixel, row-major; rows in parallel. `None` if `progress` cancels.
pub(crate) fn pixels<T: Default + Send>(
    camera: &Camera,
    progress: &dyn Progress,
    pixel: impl Fn(UVec2) -> T + Sync,
) -> Option<Vec<T>> {
    let (w, h) = (camera.width, camera.height);
    progress.begin("trace", h as u64);
    let mut pixels = Vec::new();
    // Each written where it stays: pages of memory cost as much as a ray for each of the pixels in them.
    let all = (0..w * h).into_par_iter().with_min_len(w).map(|i| {
        let (x, y) = (i % w, i / w);
        if x == 0 {
            progress.advance(1);
        }
        if progress.cancelled() { T::default() } else { pixel(UVec2::new(x as u32, y as u32)) }
    });
    all.collect_into_vec(&mut pixels);
    (!progress.cancelled()).then_some(pixels)
}

/// Indices of pixel `i` and of those within `radius` rows and columns, row by row; columns wrap if `wrap`.
pub(crate) fn around(i: usize, (w, h): (usize, usize), radius: usize, wrap: bool) -> impl Iterator<Item = usize> {
    let (x, y) = ((i % w) as i64, i / w);
    let columns = move || {
        let reach = radius as i64;
        (x - reach..=x + reach)
            .map(move |x| if wrap { x.rem_euclid(w as i64) } else { x })
            .filter(move |x| (0..w as i64).contains(x))
    };
    (y.saturating_sub(radius)..(y + radius + 1).min(h)).flat_map(move |y| columns().map(move |x| y * w + x as usize))
}

/// Pixels, row-major, as layers.
pub(crate) fn layers<'a>(camera: &Camera, pixels: impl Iterator<Item = &'a Pixel>) -> TracedLayers {
    let w = camera.width;
    let mut layers = TracedLayers::empty(w, camera.height);
    for (i, p) in pixels.enumerate() {
        let (x, y) = (i % w, i / w);
        layers.object.set(x, y, p.object);
        layers.coverage.set(x, y, p.coverage);
        layers.delta.set(x, y, p.delta);
        layers.depth.set(x, y, p.depth);
        layers.normal.set(x, y, p.normal);
        layers.albedo.set(x, y, p.albedo);
    }
    layers
}

impl<'a, W: RealWorld> Tracer<'a, W> {
    /// What is known of a pixel before its first sample.
    fn start(&self, frame: &Frame<'_>, at: UVec2, lights: &Lights) -> Begun {
        let corner = Vec2::new(at.x as f32, at.y as f32);
        let (guides, center) = self.guides(frame, corner + 0.5);
        // Where no object's bounds reach, no ray looks for one.
        let scene = if self.may_see_objects(frame.camera, corner) { Scene::Mixed } else { Scene::Real };
        let thinning = match self.params.method {
            _ if self.params.everywhere => 1,
            Method::Dpt if self.params.samples == 1 => 1,
            Method::Dpt => self.thinning(&center, frame.camera.direction(corner + 0.5), lights),
            // Changes no real surface.
            Method::Ibl if scene == Scene::Real => NO_SAMPLES,
            Method::Ibl | Method::OnePass | Method::TwoPass => 1,
        };
        Begun { guides, scene, thinning }
    }

    /// Takes samples until the pixel has `until` of them.
    fn sample_until(&self, frame: &Frame<'_>, at: UVec2, until: u32, pixel: &mut Started) {
        for index in pixel.samples..until {
            let mut walk = Walk { sampler: Sampler::new(at, index, frame.stream), rays: 0 };
            let (into_object, value) = self.sample(frame, at, pixel, &mut walk);
            pixel.rays += walk.rays;
            pixel.covered += u32::from(into_object);
            let value = if value.is_finite() {
                value
            } else {
                pixel.discarded += 1;
                Vec3::ZERO
            };
            if self.params.error_target.is_some() {
                pixel.noise.add(value);
            }
            if into_object { pixel.object += value } else { pixel.delta += value }
        }
        pixel.samples = pixel.samples.max(until);
    }

    /// The second part of adaptive sampling: what the pilots call for. `None` if `progress` cancels.
    fn refine(&self, frame: &Frame<'_>, pixels: &mut [Started], target: f32, progress: &dyn Progress) -> Option<Sampling> {
        let width = frame.camera.width;
        let wrap = frame.camera.projection == Projection::Panorama;
        let noise = |pixels: &[Started]| pixels.iter().map(|p| p.noise).collect::<Vec<_>>();
        let most: Vec<u32> = pixels.iter().map(|p| p.thinned.samples).collect();
        let counts = adaptive::settle(&noise(pixels), &most, target, width, wrap);
        progress.begin("refine", frame.camera.height as u64);
        pixels.par_chunks_mut(width).zip(counts.par_chunks(width)).enumerate().for_each(|(y, (row, counts))| {
            if !progress.cancelled() {
                for (x, (pixel, &until)) in row.iter_mut().zip(counts).enumerate() {
                    self.sample_until(frame, UVec2::new(x as u32, y as u32), until, pixel);
                }
            }
            progress.advance(1);
        });
        let samples: Vec<u32> = pixels.iter().map(|p| p.samples).collect();
        (!progress.cancelled()).then(|| Sampling::of(&noise(pixels), &samples, frame.camera))
    }

    /// Whether any ray through the pixel can meet the bounds of an object.
    pub(crate) fn may_see_objects(&self, camera: &Camera, corner: Vec2) -> bool {
        let axis = camera.direction(corner + 0.5);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|c| camera.direction(corner + c));
        // Rays through a pixel lie within the widest of its corners, to first order; half as much again for safety.
        let spread = 1.5 * corners.iter().map(|d| d.distance(axis)).fold(1e-6, f32::max);
        self.objects.may_be_in(&Beam { origin: camera.position, axis, spread })
    }

    /// Whether a sample shows an object, and its radiance or the change of the real surface it shows.
    fn sample(&self, frame: &Frame<'_>, at: UVec2, pixel: &Started, walk: &mut Walk) -> (bool, Vec3) {
        let nothing = (false, Vec3::ZERO);
        let Thinned { boost, share, .. } = pixel.thinned;
        let [jx, jy, pick, look] = walk.sampler.next_4d();
        if look >= share && pixel.begun.scene == Scene::Real {
            return nothing;
        }
        let corner = Vec2::new(at.x as f32, at.y as f32);
        let ray = Ray::new(frame.camera.position, frame.camera.direction(corner + Vec2::new(jx, jy)));
        let first = self.first(&ray, pixel.begun.scene, walk);
        match first {
            First::Infinity => nothing,
            First::Object(hit) if self.params.method == Method::Ibl => (true, self.image_based(&ray, &hit, walk)),
            First::Object(_) => {
                let bounces = self.params.bounces;
                let radiance = self.radiance(ray, first, None, bounces, Scene::Mixed, walk);
                if self.params.method == Method::TwoPass {
                    // The second pass renders the real scene everywhere; here nothing of it is used.
                    if let Some(hit) = self.world.hit(&ray) {
                        self.outgoing(&hit, bounces, Scene::Real, walk);
                    }
                }
                (true, radiance)
            }
            First::Real(_) if look >= share => nothing,
            First::Real(hit) => {
                let hit = self.world.shown_surface(hit, ray.direction, pick);
                (false, self.change(&hit, ray.direction, boost, walk) / share)
            }
        }
    }

    /// The change of the real surface that a sample shows.
    fn change(&self, hit: &RealHit, direction: Vec3, boost: f32, walk: &mut Walk) -> Vec3 {
        let bounces = self.params.bounces;
        let change = match self.params.method {
            Method::Dpt => self.delta(hit, bounces, boost, walk),
            Method::OnePass => {
                let (mixed, real) = self.one_pass(hit, bounces, walk);
                mixed - real
            }
            Method::TwoPass => self.two_pass(hit, bounces, walk),
            Method::Ibl => return Vec3::ZERO,
        };
        change + self.mirror_change(hit, direction, bounces, walk)
    }

    /// What filters are guided by, and what is there, at the pixel's centre.
    pub(crate) fn guides(&self, frame: &Frame<'_>, center: Vec2) -> (Pixel, First) {
        let ray = Ray::new(frame.camera.position, frame.camera.direction(center));
        let mut walk = Walk { sampler: Sampler::new(UVec2::ZERO, 0, frame.stream), rays: 0 };
        let first = self.first(&ray, Scene::Mixed, &mut walk);
        (self.guides_of(&first, &ray), first)
    }

    /// The same of what `ray` has met.
    pub(crate) fn guides_of(&self, first: &First, ray: &Ray) -> Pixel {
        let (depth, normal, albedo) = match first {
            First::Infinity => (f32::INFINITY, Vec3::ZERO, Vec3::ZERO),
            First::Real(hit) => (hit.t, hit.normal, self.world.reflectance(hit)),
            First::Object(hit) => {
                let surface = self.objects.surface(ray, hit);
                (hit.hit.t, surface.bsdf.normal(), surface.albedo)
            }
        };
        Pixel { object: Vec3::ZERO, coverage: 0.0, delta: Vec3::ZERO, depth, normal, albedo }
    }
}
