//! G-buffers: what the centres of the view's pixels see.

use super::Frame;
use crate::bvh::Ray;
use crate::world::{RealHit, RealWorld};
use glam::{Vec2, Vec3};
use pano_core::{camera::Camera, image::Image};

/// What is seen at the centre of each pixel of a view. A camera of [`pano_core::camera::Projection::Panorama`] at the
/// capture point makes the panorama's own.
#[derive(Clone, Debug)]
pub struct GBuffer {
    /// Distance along the ray in metres to the nearest surface, virtual or real; infinite where nothing is.
    pub depth: Image<f32>,
    /// World-space unit normal towards the camera; zero where nothing is. Of real surfaces it comes from the depth, each side
    /// of a gap by itself.
    pub normal: Image<Vec3>,
    /// World position; zero where nothing is.
    pub position: Image<Vec3>,
    /// Base colour of objects, zero elsewhere.
    pub albedo: Image<Vec3>,
    /// Whether the surface is perfectly smooth: what it shows has no noise, and no filter should touch it.
    pub smooth: Image<bool>,
    /// What is seen: 0 for real surfaces and for nothing, n + 1 for the n-th object.
    pub thing: Image<u32>,
}

/// What bilinear depth and the half pixel between centre and point differ by on slanted floors, as a share of the distance.
pub(super) const SHOWN_WITHIN: f32 = 0.02;
/// Points of a pixel at which its coverage is measured: four rows of four.
pub(super) const COVER_POINTS: u32 = 16;

#[derive(Clone, Copy, Default)]
pub(super) struct Texel {
    pub(super) depth: f32,
    pub(super) normal: Vec3,
    pub(super) position: Vec3,
    pub(super) albedo: Vec3,
    pub(super) smooth: bool,
    pub(super) thing: u32,
}

impl GBuffer {
    /// What `frame`'s camera sees of `world` and the objects.
    pub fn new<W: RealWorld>(frame: &Frame<'_>, world: &W) -> Self {
        Self::of(frame.camera, |ray| {
            let object = frame.objects.intersect(ray);
            let real = world.hit(&ray.up_to(object.map_or(ray.t_max, |o| o.hit.t)));
            match (real, object) {
                (Some(real), _) => Texel { depth: real.t, normal: real.normal, position: real.position, ..Texel::default() },
                (None, Some(hit)) => {
                    let surface = frame.objects.surface(ray, &hit);
                    Texel {
                        depth: hit.hit.t,
                        normal: surface.bsdf.normal(),
                        position: surface.position,
                        albedo: surface.albedo,
                        smooth: surface.bsdf.is_specular(),
                        thing: hit.instance + 1,
                    }
                }
                (None, None) => Texel { depth: f32::INFINITY, ..Texel::default() },
            }
        })
    }

    fn of(camera: &Camera, see: impl Fn(&Ray) -> Texel + Sync) -> Self {
        let texels = Image::par_from_fn(camera.width, camera.height, |x, y| {
            see(&Ray::new(camera.position, camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5))))
        });
        Self::from_texels(&texels)
    }

    pub(super) fn from_texels(texels: &Image<Texel>) -> Self {
        Self {
            depth: texels.map(|t| t.depth),
            normal: texels.map(|t| t.normal),
            position: texels.map(|t| t.position),
            albedo: texels.map(|t| t.albedo),
            smooth: texels.map(|t| t.smooth),
            thing: texels.map(|t| t.thing),
        }
    }

    /// Share of each pixel that shows an object, [0, 1]: 4×4 points where the pixel or one of its neighbours shows another
    /// thing, else the centre's answer.
    pub fn coverage<W: RealWorld>(&self, frame: &Frame<'_>, world: &W) -> Image<f32> {
        let (w, h) = self.size();
        Image::par_from_fn(w, h, |x, y| {
            if let Some(coverage) = self.whole(x, y) {
                return coverage;
            }
            let corner = Vec2::new(x as f32, y as f32);
            let hits = (0..COVER_POINTS).filter(|k| {
                let at = corner + (Vec2::new((k % 4) as f32, (k / 4) as f32) + 0.5) / 4.0;
                let ray = Ray::new(frame.camera.position, frame.camera.direction(at));
                frame.objects.intersect(&ray).is_some_and(|hit| !world.blocks(&ray.up_to(hit.hit.t)))
            });
            hits.count() as f32 / COVER_POINTS as f32
        })
    }

    /// The share of a pixel that shows an object where the pixel and all its neighbours show the same thing.
    pub(super) fn whole(&self, x: usize, y: usize) -> Option<f32> {
        let (w, h) = self.size();
        let here = self.thing.get(x, y);
        let around = |k: usize, side: usize| k.saturating_sub(1)..=(k + 1).min(side - 1);
        let same = around(y, h).all(|ny| around(x, w).all(|nx| self.thing.get(nx, ny) == here));
        same.then(|| f32::from(u8::from(here > 0)))
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        self.depth.size()
    }

    /// Whether a real surface is seen at a pixel's centre.
    pub fn shows_real(&self, x: usize, y: usize) -> bool {
        self.thing.get(x, y) == 0 && self.depth.get(x, y).is_finite()
    }

    /// Whether `hit` is what the pixel `(x, y)` shows: a real surface, there within two hundredths of the distance.
    pub fn shows(&self, x: usize, y: usize, hit: &RealHit, camera: &Camera) -> bool {
        let distance = hit.position.distance(camera.position);
        self.shows_real(x, y) && (self.depth.get(x, y) - distance).abs() <= SHOWN_WITHIN * distance
    }
}
