//! What each pixel of a path-traced picture shows: its texture, whether it lies within one surface, and how pixels on edges
//! are put together from the light of the surfaces that meet there.

use super::reference::Quality;
use glam::{UVec2, Vec2, Vec3};
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    random::{Sampler, Stream},
    sphere,
};
use pano_trace::bvh::Ray;
use pano_trace::objects::Objects;

/// Primary rays a pixel and half of the samples.
const RAYS: u32 = 4;
/// Least albedo that light is divided by: darker surfaces keep their texture in the light.
const LEAST_ALBEDO: Vec3 = Vec3::splat(0.04);
/// Surfaces are one if their normals are no farther apart than this cosine (20°), …
const SAME_NORMAL: f32 = 0.94;
/// … and if points lie in each other's planes up to this share of the distance.
const SAME_PLANE: f32 = 0.004;
/// What the light of a pixel on an edge counts for its neighbours, of which those within a surface count 1.
const MIXTURE_WORTH: f32 = 1e-4;

/// What the filter knows of a pixel: the point at its centre, and how much its light is worth to its neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Guide {
    position: Vec3,
    normal: Vec3,
    distance: f32,
    /// 1 within a surface, hardly anything on an edge, where light is a mixture, and 0 where something shines or nothing is.
    pub(super) worth: f32,
}

impl Guide {
    /// How much the light of `other` counts where this is: [0, 1], 0 across surfaces.
    pub(super) fn similarity(&self, other: &Guide) -> f32 {
        let cos = self.normal.dot(other.normal);
        if self.worth == 0.0 || other.worth == 0.0 || cos <= SAME_NORMAL {
            return 0.0;
        }
        let off = (other.position - self.position).dot(self.normal) / (SAME_PLANE * self.distance);
        // 1 for equal normals, 0 at the bound.
        let turned = (cos - SAME_NORMAL) / (1.0 - SAME_NORMAL);
        other.worth * turned * (1.0 - off * off).max(0.0)
    }

    /// The same for putting an edge together, where the two faces that a narrow rounded edge joins stand in for it if there
    /// is nothing better.
    fn kinship(&self, other: &Guide) -> f32 {
        let off = (other.position - self.position).dot(self.normal) / (SAME_PLANE * self.distance);
        let rim = self.normal.dot(other.normal).max(0.0).powi(4) / (1.0 + off * off);
        self.similarity(other) + 1e-3 * rim * other.worth
    }
}

/// A point that a primary ray shows.
#[derive(Clone, Copy, Debug)]
struct Seen {
    guide: Guide,
    albedo: Vec3,
    emission: Vec3,
}

/// The texture of one pixel: mean albedos, 1 where something shines.
#[derive(Clone, Copy, Debug, Default)]
struct Texture {
    /// At the positions of the tracer's own samples, in both halves.
    traced: [Vec3; 2],
    /// Of all rays.
    mean: Vec3,
}

/// All pixels of a view.
pub(super) struct Survey<'a> {
    everything: &'a Objects,
    camera: &'a Camera,
    streams: [Stream; 2],
    textures: Image<Texture>,
    guides: Image<Guide>,
}

impl<'a> Survey<'a> {
    /// Looks at every pixel through the positions that the tracer samples first, in both halves.
    pub(super) fn new(everything: &'a Objects, camera: &'a Camera, quality: &Quality) -> Self {
        let (w, h) = (camera.width, camera.height);
        let nothing = Image::filled(1, 1, Guide::default());
        let textures = Image::filled(1, 1, Texture::default());
        let mut survey = Self { everything, camera, streams: quality.streams, textures, guides: nothing };
        let pixels = Image::par_from_fn(w, h, |x, y| survey.look(x, y, quality.samples));
        (survey.textures, survey.guides) = (pixels.map(|p| p.0), pixels.map(|p| p.1));
        survey
    }

    /// What the filter knows of each pixel.
    pub(super) fn guides(&self) -> &Image<Guide> {
        &self.guides
    }

    fn look(&self, x: usize, y: usize, samples: u32) -> (Texture, Guide) {
        let center = self.seen(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
        let mut guide = center.map_or(Guide::default(), |c| c.guide);
        let (mut texture, mut all) = (Texture::default(), Vec3::ZERO);
        for half in 0..2 {
            let mut sum = Vec3::ZERO;
            for index in 0..RAYS {
                let seen = self.sample(x, y, half, index);
                sum += seen.map_or(Vec3::ONE, |s| s.albedo);
                if guide.worth > 0.0 && seen.is_none_or(|s| guide.similarity(&s.guide) == 0.0) {
                    guide.worth = MIXTURE_WORTH;
                }
                if index + 1 == samples.min(RAYS) {
                    texture.traced[half] = (sum / (index + 1) as f32).max(LEAST_ALBEDO);
                }
            }
            all += sum;
        }
        texture.mean = (all / (2 * RAYS) as f32).max(LEAST_ALBEDO);
        (texture, guide)
    }

    /// What the tracer's sample `index` of a pixel shows.
    fn sample(&self, x: usize, y: usize, half: usize, index: u32) -> Option<Seen> {
        let jitter = Sampler::new(UVec2::new(x as u32, y as u32), index, self.streams[half]).next_2d();
        self.seen(Vec2::new(x as f32, y as f32) + jitter)
    }

    fn seen(&self, at: Vec2) -> Option<Seen> {
        let ray = Ray::new(self.camera.position, self.camera.direction(at));
        let hit = self.everything.intersect(&ray)?;
        let s = self.everything.surface(&ray, &hit);
        let shines = s.emission != Vec3::ZERO;
        let worth = if shines { 0.0 } else { 1.0 };
        let guide = Guide { position: s.position, normal: s.bsdf.normal(), distance: hit.hit.t, worth };
        Some(Seen { guide, albedo: if shines { Vec3::ONE } else { s.albedo }, emission: s.emission })
    }

    /// Radiance of one half to light: divides by the albedo.
    pub(super) fn remove_texture(&self, radiance: &mut RadianceImage, half: usize) {
        radiance.data_mut().iter_mut().zip(self.textures.data()).for_each(|(p, t)| *p /= t.traced[half]);
    }

    /// Light to radiance: multiplies by the albedo; on edges each ray takes the light of the pixels around that lie within
    /// the surface it meets, or of the next best.
    pub(super) fn add_texture(&self, light: &RadianceImage) -> RadianceImage {
        let (w, h) = light.size();
        let wrap = self.camera.projection == Projection::Panorama;
        RadianceImage::par_from_fn(w, h, |x, y| {
            let own = light.get(x, y);
            if self.guides.get(x, y).worth == 1.0 {
                return own * self.textures.get(x, y).mean;
            }
            let around: [Option<(Guide, Vec3)>; 25] = std::array::from_fn(|k| {
                let (nx, ny) = neighbour(x as isize + k as isize % 5 - 2, y as isize + k as isize / 5 - 2, (w, h), wrap)?;
                Some((self.guides.get(nx, ny), light.get(nx, ny)))
            });
            let mut sum = Vec3::ZERO;
            for (half, index) in (0..2 * RAYS).map(|i| ((i / RAYS) as usize, i % RAYS)) {
                sum += match self.sample(x, y, half, index) {
                    Some(seen) if seen.guide.worth == 0.0 => seen.emission,
                    Some(seen) => {
                        let weighted = around.iter().flatten().map(|(guide, light)| (*light, seen.guide.kinship(guide)));
                        let (light, weight) = weighted.fold((Vec3::ZERO, 0.0), |(l, w), (light, k)| (l + light * k, w + k));
                        seen.albedo.max(LEAST_ALBEDO) * if weight > 1e-7 { light / weight } else { own }
                    }
                    None => Vec3::ZERO,
                };
            }
            sum / (2 * RAYS) as f32
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
