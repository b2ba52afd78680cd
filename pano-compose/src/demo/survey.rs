//! What each pixel of a path-traced picture shows: its texture, whether it lies within one surface, and how pixels on edges
//! are put together from the light of the surfaces that meet there.

use super::reference::Quality;
use glam::{UVec2, Vec2, Vec3};
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    layers::TracedLayers,
    random::Sampler,
    sphere,
};
use pano_trace::bvh::Ray;
use pano_trace::objects::Objects;
use std::f32::consts::PI;

/// Primary rays a pixel.
const RAYS: u32 = 8;
/// Least albedo that light is divided by: darker surfaces keep their texture in the light.
const LEAST_ALBEDO: f32 = 0.04;
/// Surfaces are one if their normals are no farther apart than this cosine (20°), …
const SAME_NORMAL: f32 = 0.94;
/// … and if points lie in each other's planes up to this share of the distance.
const SAME_PLANE: f32 = 0.004;

/// What the light of a pixel on an edge counts for its neighbours, of which those within a surface count 1.
const MIXTURE_WORTH: f32 = 1e-4;

/// A matte surface sends no more light into any direction than this many times what white paint does.
const MATTE_PEAK: f32 = 2.0;

/// A point that a primary ray shows.
#[derive(Clone, Copy, Debug)]
struct Seen {
    position: Vec3,
    normal: Vec3,
    distance: f32,
    albedo: Vec3,
    emission: Vec3,
    /// Light is reflected evenly enough for a wide filter.
    matte: bool,
}

impl Seen {
    /// Whether two points are of one surface, for the purposes of a filter.
    fn joins(&self, other: &Seen) -> bool {
        let off = (other.position - self.position).dot(self.normal).abs();
        (self.emission == Vec3::ZERO) == (other.emission == Vec3::ZERO)
            && self.normal.dot(other.normal) > SAME_NORMAL
            && off < SAME_PLANE * self.distance
    }

    /// How well the light of `other` stands for the light here, in [0, 1]: by far best within one surface; between the two
    /// faces that a narrow rounded edge joins if there is nothing better.
    fn kinship(&self, other: &Seen) -> f32 {
        let off = (other.position - self.position).dot(self.normal) / (SAME_PLANE * self.distance);
        let rim = self.normal.dot(other.normal).max(0.0).powi(4) / (1.0 + off * off);
        if self.joins(other) { 1.0 } else { 1e-3 * rim }
    }
}

/// What one pixel shows.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    /// Mean albedo at the positions of the tracer's own samples; 1 where something shines.
    traced_albedo: Vec3,
    /// Mean albedo of all rays.
    albedo: Vec3,
    /// All rays meet the surface at the pixel's centre.
    pure: bool,
    /// The centre shows something that shines.
    shines: bool,
    /// The centre shows something matte.
    matte: bool,
}

impl Pixel {
    fn worth(&self) -> f32 {
        if self.pure { 1.0 } else { MIXTURE_WORTH }
    }
}

/// A pixel beside one on an edge.
#[derive(Clone, Copy, Debug)]
struct Neighbour {
    seen: Seen,
    light: Vec3,
    worth: f32,
}

/// All pixels of a view.
pub(super) struct Survey<'a> {
    everything: &'a Objects,
    camera: &'a Camera,
    quality: &'a Quality,
    pixels: Image<Pixel>,
}

impl<'a> Survey<'a> {
    /// Looks at every pixel through the positions that the tracer samples first.
    pub(super) fn new(everything: &'a Objects, camera: &'a Camera, quality: &'a Quality) -> Self {
        let (w, h) = (camera.width, camera.height);
        let mut survey = Self { everything, camera, quality, pixels: Image::filled(1, 1, Pixel::default()) };
        survey.pixels = Image::par_from_fn(w, h, |x, y| survey.look(x, y));
        survey
    }

    fn look(&self, x: usize, y: usize) -> Pixel {
        let center = self.seen(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
        let mut sum = Vec3::ZERO;
        let mut pixel = Pixel {
            pure: true,
            shines: center.is_some_and(|c| c.emission != Vec3::ZERO),
            matte: center.is_some_and(|c| c.matte),
            ..Pixel::default()
        };
        for index in 0..RAYS {
            let seen = self.sample(x, y, index);
            sum += seen.map_or(Vec3::ONE, |s| if s.emission == Vec3::ZERO { s.albedo } else { Vec3::ONE });
            pixel.pure &= match (&center, &seen) {
                (Some(center), Some(seen)) => center.joins(seen),
                (None, None) => true,
                _ => false,
            };
            let n = index + 1;
            if n == self.quality.samples.min(RAYS) {
                pixel.traced_albedo = (sum / n as f32).max(Vec3::splat(LEAST_ALBEDO));
            }
        }
        pixel.albedo = (sum / RAYS as f32).max(Vec3::splat(LEAST_ALBEDO));
        pixel
    }

    /// What the tracer's sample `index` of a pixel shows.
    fn sample(&self, x: usize, y: usize, index: u32) -> Option<Seen> {
        let jitter = Sampler::new(UVec2::new(x as u32, y as u32), index, self.quality.stream).next_2d();
        self.seen(Vec2::new(x as f32, y as f32) + jitter)
    }

    fn seen(&self, at: Vec2) -> Option<Seen> {
        let ray = Ray::new(self.camera.position, self.camera.direction(at));
        let hit = self.everything.intersect(&ray)?;
        let s = self.everything.surface(&ray, &hit);
        let (normal, distance) = (s.bsdf.normal(), hit.hit.t);
        // The highest point of the lobe against that of a white matte surface.
        let mirrored = ray.direction - 2.0 * ray.direction.dot(normal) * normal;
        let peak = s.bsdf.eval(mirrored).f_cos.max_element() * PI;
        let matte = !s.bsdf.is_specular() && peak < MATTE_PEAK * mirrored.dot(normal);
        Some(Seen { position: s.position, normal, distance, albedo: s.albedo, emission: s.emission, matte })
    }

    /// Radiance to light: divides by the albedo.
    pub(super) fn remove_texture(&self, radiance: &mut RadianceImage) {
        radiance.data_mut().iter_mut().zip(self.pixels.data()).for_each(|(p, pixel)| *p /= pixel.traced_albedo);
    }

    /// How much each pixel's light is worth to its neighbours: 1 within a surface; hardly anything on an edge, where it is a
    /// mixture.
    pub(super) fn worth(&self) -> Image<f32> {
        self.pixels.map(|p| p.worth())
    }

    /// The same for filters wider than a mirror image's detail: nothing where a surface is glossy.
    pub(super) fn matte_worth(&self) -> Image<f32> {
        self.pixels.map(|p| if p.matte { p.worth() } else { 0.0 })
    }

    /// Light to radiance: multiplies by the albedo; on edges each ray takes the light of the pixels around that lie within
    /// the surface it meets, or of the next best.
    pub(super) fn add_texture(&self, layers: &TracedLayers) -> RadianceImage {
        let light = &layers.object;
        RadianceImage::par_from_fn(light.width(), light.height(), |x, y| {
            let (own, pixel) = (light.get(x, y), self.pixels.get(x, y));
            if pixel.pure {
                return own * pixel.albedo;
            }
            let around = self.neighbours(x, y, layers);
            let mut sum = Vec3::ZERO;
            for index in 0..RAYS {
                sum += match self.sample(x, y, index) {
                    Some(seen) if seen.emission != Vec3::ZERO => seen.emission,
                    Some(seen) => {
                        let weighted = around.iter().flatten().map(|n| (n.light, seen.kinship(&n.seen) * n.worth));
                        let (light, weight) = weighted.fold((Vec3::ZERO, 0.0), |(l, w), (light, k)| (l + light * k, w + k));
                        seen.albedo.max(Vec3::splat(LEAST_ALBEDO)) * if weight > 1e-6 { light / weight } else { own }
                    }
                    None => Vec3::ZERO,
                };
            }
            sum / RAYS as f32
        })
    }

    /// The pixels around that do not shine.
    fn neighbours(&self, x: usize, y: usize, layers: &TracedLayers) -> [Option<Neighbour>; 25] {
        let (w, h) = (self.camera.width, self.camera.height);
        std::array::from_fn(|k| {
            let (nx, ny) = (x as isize + k as isize % 5 - 2, y as isize + k as isize / 5 - 2);
            let (nx, ny) = neighbour(nx, ny, (w, h), self.camera.projection == Projection::Panorama)?;
            let depth = layers.depth.get(nx, ny);
            let pixel = self.pixels.get(nx, ny);
            if pixel.shines || !depth.is_finite() {
                return None;
            }
            let direction = self.camera.direction(Vec2::new(nx as f32 + 0.5, ny as f32 + 0.5));
            let (position, normal) = (self.camera.position + direction * depth, layers.normal.get(nx, ny));
            let seen = Seen { position, normal, distance: depth, albedo: Vec3::ZERO, emission: Vec3::ZERO, matte: true };
            Some(Neighbour { seen, light: layers.object.get(nx, ny), worth: pixel.worth() })
        })
    }
}

/// The pixel at (x, y), which may lie outside a picture of `size`: beyond seam and poles if it wraps, else nowhere.
pub(super) fn neighbour(x: isize, y: isize, (w, h): (usize, usize), wrap: bool) -> Option<(usize, usize)> {
    if wrap {
        return Some(sphere::wrap_texel(w, h, x, y));
    }
    let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
    (x < w && y < h).then_some((x, y))
}
