//! The two passes of Algorithm 1.

use super::{Frame, Params, Reach, ScreenObjects, UpdatedWorld};
use crate::bsdf::concentric_disc;
use crate::bvh::{InstanceHit, Ray};
use crate::tracer::{First, Lights, Scene, TraceParams, Tracer, Walk};
use crate::world::{LightSample, RealHit, RealWorld, mirror_ray};
use glam::{UVec2, Vec2, Vec3};
use pano_core::{color::luminance, image::Image, progress::Progress, random::Sampler, random::Stream};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;

/// What the first pass finds. All pictures have the view's size.
#[derive(Clone, Debug)]
pub struct RealEstimate {
    /// Share of the pixel's samples that show a real surface.
    pub share: Image<f32>,
    /// E_R, premultiplied by `share`.
    pub irradiance: Image<Vec3>,
    /// E_RV − E_R, premultiplied by `share`.
    pub change: Image<Vec3>,
    /// Variance of the luminance of the mean of E_R, without the premultiplication; 0 where there are less than two samples.
    pub irradiance_variance: Image<f32>,
    /// The same of the change.
    pub change_variance: Image<f32>,
    /// What the world without objects shows in the direction of mirror reflection, by up to four rays a pixel.
    pub mirror: Image<Vec3>,
    /// What the world shows in the direction of mirror reflection, premultiplied by `share`, of the samples for which an
    /// object comes before it; and the same for what is seen with the object there. Both 0 elsewhere.
    pub mirrored: Image<Vec3>,
    /// See `mirrored`.
    pub mirrored_mixed: Image<Vec3>,
    /// d(p) of eq. 3: whether a ray of the pixel met an object.
    pub touched: Image<bool>,
    /// Rays traced.
    pub rays: u64,
}

/// What the second pass finds. All pictures have the view's size.
#[derive(Clone, Debug)]
pub struct VirtualEstimate {
    /// Share of the pixel's samples that show an object.
    pub coverage: Image<f32>,
    /// Radiance of the objects, premultiplied by `coverage`.
    pub radiance: Image<Vec3>,
    /// Variance of the luminance of the mean, without the premultiplication; 0 where there are less than two samples.
    pub variance: Image<f32>,
    /// Rays traced.
    pub rays: u64,
}

/// Rays by which a pixel finds what it would mirror.
pub(super) const MIRROR_RAYS: u32 = 4;
/// Of the samples that measure the irradiance one in so many is left at least.
pub(super) const MOST_THINNING: u32 = 4;

/// Sum, sum of squared luminance, and number of samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments {
    pub(super) sum: Vec3,
    pub(super) squares: f32,
    pub(super) count: u32,
}

impl Moments {
    fn add(&mut self, value: Vec3) {
        // A sample that rounding made NaN or infinite counts as black.
        let value = if value.is_finite() { value } else { Vec3::ZERO };
        self.sum += value;
        self.squares += luminance(value).powi(2);
        self.count += 1;
    }

    fn share(&self, all: u32) -> f32 {
        self.count as f32 / all as f32
    }

    fn variance_of_mean(&self) -> f32 {
        if self.count < 2 {
            return 0.0;
        }
        let n = self.count as f32;
        let mean = luminance(self.sum) / n;
        ((self.squares / n - mean * mean).max(0.0) / (n - 1.0)).min(f32::MAX)
    }
}

/// What the samples of a pixel of the first pass come to.
#[derive(Clone, Copy, Debug)]
pub(super) struct RealPixel {
    pub(super) real: Moments,
    pub(super) change: Moments,
    pub(super) mirror: Vec3,
    pub(super) mirror_rays: u32,
    pub(super) mirrored: Vec3,
    pub(super) mirrored_mixed: Vec3,
    pub(super) touched: bool,
    pub(super) samples: u32,
}

impl Default for RealPixel {
    fn default() -> Self {
        Self {
            real: Moments::default(),
            change: Moments::default(),
            mirror: Vec3::ZERO,
            mirror_rays: 0,
            mirrored: Vec3::ZERO,
            mirrored_mixed: Vec3::ZERO,
            touched: false,
            samples: 1,
        }
    }
}

/// First pass: the pixels of real surfaces. E_R is that of the world itself; E_RV sees it as far as it is `updated` by an
/// earlier pass. Pixels where `wanted` is false are left at 0 and show no share. `None` if `progress` cancels.
pub fn trace_real<W: RealWorld>(
    frame: &Frame<'_>,
    world: &UpdatedWorld<'_, W>,
    params: &Params,
    screen: Option<&ScreenObjects>,
    wanted: impl Fn(usize, usize) -> bool + Sync,
    progress: &dyn Progress,
) -> Option<RealEstimate> {
    let (w, h) = (frame.camera.width, frame.camera.height);
    let trace_params = trace_params(params);
    let tracer = Tracer { objects: frame.objects, world, params: &trace_params };
    let lights = Lights::of(world, frame.camera.position, params.samples);
    let pass = Pass { frame, world, tracer: &tracer, lights, params, screen };
    let rows = rows(w, h, "real pixels", progress, |x, y, rays| {
        if wanted(x, y) { pass.real_pixel(UVec2::new(x as u32, y as u32), rays) } else { RealPixel::default() }
    })?;
    let rays = rows.iter().map(|r| r.1).sum();
    let pixels = Image::from_vec(w, h, rows.into_iter().flat_map(|r| r.0).collect()).ok()?;
    Some(RealEstimate::of(&pixels, rays))
}

impl RealEstimate {
    /// What all samples come to.
    pub(super) fn of(pixels: &Image<RealPixel>, rays: u64) -> Self {
        Self {
            share: pixels.map(|p| p.real.share(p.samples)),
            irradiance: pixels.map(|p| p.real.sum / p.samples as f32),
            change: pixels.map(|p| p.change.sum / p.samples as f32),
            irradiance_variance: pixels.map(|p| p.real.variance_of_mean()),
            change_variance: pixels.map(|p| p.change.variance_of_mean()),
            mirror: pixels.map(|p| p.mirror / p.mirror_rays.max(1) as f32),
            mirrored: pixels.map(|p| p.mirrored / p.samples as f32),
            mirrored_mixed: pixels.map(|p| p.mirrored_mixed / p.samples as f32),
            touched: pixels.map(|p| p.touched),
            rays,
        }
    }
}

/// Second pass: the pixels of objects, in a `world` that the first pass has updated. `None` if `progress` cancels.
pub fn trace_virtual<W: RealWorld>(
    frame: &Frame<'_>,
    world: &UpdatedWorld<'_, W>,
    params: &Params,
    progress: &dyn Progress,
) -> Option<VirtualEstimate> {
    let (w, h) = (frame.camera.width, frame.camera.height);
    let trace_params = trace_params(params);
    let tracer = Tracer { objects: frame.objects, world, params: &trace_params };
    let pass = Pass { frame, world, tracer: &tracer, lights: Lights::default(), params, screen: None };
    let rows = rows(w, h, "virtual pixels", progress, |x, y, rays| pass.virtual_pixel(UVec2::new(x as u32, y as u32), rays))?;
    let rays = rows.iter().map(|r| r.1).sum();
    let pixels = Image::from_vec(w, h, rows.into_iter().flat_map(|r| r.0).collect()).ok()?;
    Some(VirtualEstimate::of(&pixels, params.samples, rays))
}

impl VirtualEstimate {
    /// What all `samples` of each pixel come to.
    pub(super) fn of(pixels: &Image<Moments>, samples: u32, rays: u64) -> Self {
        Self {
            coverage: pixels.map(|p| p.share(samples)),
            radiance: pixels.map(|p| p.sum / samples as f32),
            variance: pixels.map(|p| p.variance_of_mean()),
            rays,
        }
    }
}

pub(super) fn trace_params(params: &Params) -> TraceParams {
    // The updated panorama already shows what the objects change: no second order on top.
    TraceParams { samples: params.samples, bounces: params.bounces, second_order: false, ..TraceParams::default() }
}

/// Every pixel of every row with the number of rays each row took, rows in parallel; `None` if `progress` cancels.
fn rows<T: Send>(
    width: usize,
    height: usize,
    name: &'static str,
    progress: &dyn Progress,
    pixel: impl Fn(usize, usize, &mut u64) -> T + Sync,
) -> Option<Vec<(Vec<T>, u64)>> {
    progress.begin(name, height as u64);
    let rows = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut rays = 0;
            let row = if progress.cancelled() { Vec::new() } else { (0..width).map(|x| pixel(x, y, &mut rays)).collect() };
            progress.advance(1);
            (row, rays)
        })
        .collect();
    (!progress.cancelled()).then_some(rows)
}

struct Pass<'a, W> {
    frame: &'a Frame<'a>,
    world: &'a UpdatedWorld<'a, W>,
    tracer: &'a Tracer<'a, UpdatedWorld<'a, W>>,
    lights: Lights,
    params: &'a Params,
    screen: Option<&'a ScreenObjects>,
}

impl<W: RealWorld> Pass<'_, W> {
    fn real_pixel(&self, at: UVec2, rays: &mut u64) -> RealPixel {
        let center = Ray::new(self.frame.camera.position, self.frame.camera.direction(at.as_vec2() + 0.5));
        // Where objects take little of the light, fewer samples leave as little noise in the picture; some of them measure the
        // irradiance, which is a layer of its own.
        let thinning = match self.world.surface(&center) {
            Some(hit) => self.tracer.thinning(&First::Real(hit), center.direction, &self.lights).min(MOST_THINNING),
            None => 1,
        };
        let mut pixel = RealPixel { samples: self.params.samples.div_ceil(thinning), ..RealPixel::default() };
        for index in 0..pixel.samples {
            let (mut walk, ray, pick, first) = self.aim(at, index, pixel.samples, |first| matches!(first, First::Real(_)));
            if let First::Real(hit) = first {
                let hit = self.world.shown_surface(hit, ray.direction, pick);
                let (real, change, touched) = self.irradiance(&hit, &mut walk);
                pixel.real.add(real);
                pixel.change.add(change);
                pixel.touched |= touched;
                if pixel.mirror_rays < MIRROR_RAYS {
                    walk.rays += 1;
                    pixel.mirror += self.world.mirrored(&hit, ray.direction);
                    pixel.mirror_rays += 1;
                }
                if let Some((before, after)) = self.mirror(&hit, ray.direction, &mut walk) {
                    pixel.mirrored += before;
                    pixel.mirrored_mixed += after;
                }
            }
            *rays += walk.rays;
        }
        pixel
    }

    /// Moments of the objects' radiance over the pixel's samples that show one.
    fn virtual_pixel(&self, at: UVec2, rays: &mut u64) -> Moments {
        let mut seen = Moments::default();
        if !self.tracer.may_see_objects(self.frame.camera, at.as_vec2()) {
            return seen;
        }
        for index in 0..self.params.samples {
            let (mut walk, ray, _, first) = self.aim(at, index, self.params.samples, |f| matches!(f, First::Object(_)));
            if let First::Object(hit) = first {
                seen.add(self.sent_back(ray, hit, self.params.bounces, &mut walk));
            }
            *rays += walk.rays;
        }
        seen
    }

    /// A camera ray of sample `index` of `samples`, what it meets, and a number left over; the first that is `wanted` of
    /// those allowed, or the last.
    fn aim(&self, at: UVec2, index: u32, samples: u32, wanted: impl Fn(&First) -> bool) -> (Walk, Ray, f32, First) {
        let mut attempt = 0;
        let mut rays = 0;
        loop {
            // Frames go on where the one before ended: what history adds up is stratified as the samples of one frame are.
            // Attempts are streams of their own, or they would repeat the next frames' samples.
            let stream = Stream { frame: attempt, ..self.frame.stream };
            let sampler = Sampler::new(at, self.frame.stream.frame.wrapping_mul(samples).wrapping_add(index), stream);
            let mut walk = Walk { sampler, rays };
            let [jx, jy, pick, _] = walk.sampler.next_4d();
            let direction = self.frame.camera.direction(at.as_vec2() + Vec2::new(jx, jy));
            let ray = Ray::new(self.frame.camera.position, direction);
            let first = self.tracer.first(&ray, Scene::Mixed, &mut walk);
            attempt += 1;
            if wanted(&first) || attempt >= self.params.attempts {
                return (walk, ray, pick, first);
            }
            rays = walk.rays;
        }
    }

    /// Radiance that an object sends back along `ray`.
    fn sent_back(&self, ray: Ray, hit: InstanceHit, bounces: u32, walk: &mut Walk) -> Vec3 {
        self.tracer.radiance(ray, First::Object(hit), None, bounces, Scene::Mixed, walk)
    }

    /// One estimate of E_R and of E_RV − E_R at a real point, along one ray.
    fn irradiance(&self, hit: &RealHit, walk: &mut Walk) -> (Vec3, Vec3, bool) {
        let from = self.world.leave(hit);
        let u = walk.sampler.next_4d();
        let light: Option<LightSample> = if u[2] < 0.5 {
            match self.world.sample_light(from, Vec2::new(u[0], u[1])) {
                Some(sample) => Some(sample),
                // In a black world nothing can be found this way.
                None => return (Vec3::ZERO, Vec3::ZERO, false),
            }
        } else {
            None
        };
        let direction = match &light {
            Some(sample) => sample.direction,
            None => {
                let disc = concentric_disc(Vec2::new(u[0], u[1]));
                let (t, b) = hit.normal.any_orthonormal_pair();
                t * disc.x + b * disc.y + hit.normal * (1.0 - disc.length_squared()).max(0.0).sqrt()
            }
        };
        let cos = direction.dot(hit.normal);
        if cos <= 0.0 {
            return (Vec3::ZERO, Vec3::ZERO, false);
        }
        let ray = Ray::new(from, direction);
        walk.rays += 1;
        let behind = match &light {
            Some(sample) => match self.world.original().reach(&ray, sample) {
                Some(behind) => behind,
                None => return (Vec3::ZERO, Vec3::ZERO, false),
            },
            None => self.world.original().hit(&ray),
        };
        let pdf = 0.5 * (cos * FRAC_1_PI + self.world.light_pdf(from, direction, behind.as_ref()));
        let (radiance, updated) = match &behind {
            None => (self.world.infinity(direction), self.world.infinity(direction)),
            Some(real) => self.world.radiance(real, direction),
        };
        let weight = cos / pdf;
        let object = self.meet_object(&ray.up_to(behind.as_ref().map_or(f32::INFINITY, |b| b.t)), walk);
        let e_r = radiance * weight;
        let mixed = match object {
            Some(object) => self.sent_back(ray, object, self.params.bounces.saturating_sub(1), walk),
            None => updated,
        };
        (e_r, (mixed - radiance) * weight, object.is_some())
    }

    /// What a mirror at a real point would show along `direction` without and with the objects, if an object comes first.
    fn mirror(&self, hit: &RealHit, direction: Vec3, walk: &mut Walk) -> Option<(Vec3, Vec3)> {
        let ray = mirror_ray(self.world, hit, direction);
        let object = self.meet_object(&ray, walk)?;
        let behind = self.world.original().hit(&ray);
        if behind.is_some_and(|real| real.t < object.hit.t) {
            return None;
        }
        let before = self.world.arriving(ray.direction, behind.as_ref());
        let after = self.sent_back(ray, object, self.params.bounces.saturating_sub(1), walk);
        (before.is_finite() && after.is_finite()).then_some((before, after))
    }

    fn meet_object(&self, ray: &Ray, walk: &mut Walk) -> Option<InstanceHit> {
        walk.rays += 1;
        match (self.params.reach, self.screen) {
            (Reach::Screen, Some(screen)) => {
                let hit = self.frame.objects.intersect(ray)?;
                screen.shows(ray, &hit).then_some(hit)
            }
            _ => self.frame.objects.intersect(ray),
        }
    }
}
