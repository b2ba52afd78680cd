//! The real world as rays see it: surfaces that receive and block light, and what infinity shows.
//!
//! Three worlds exist: [`ProxyWorld`], known geometry under an environment at infinity (DPT's local scene, RT²AR's ghosts);
//! [`CapturedWorld`], the radiance field that a panorama with depth has captured; and [`CameraWorld`], what a depth camera has
//! seen. A [`LayeredWorld`] is several of them together.

mod camera;
pub(crate) mod captured;
#[cfg(feature = "gpu")]
pub(crate) mod gpu;
mod layered;
mod proxy;
#[cfg(test)]
mod tests;

pub use camera::CameraWorld;
pub use captured::{CapturedOptions, CapturedWorld};
pub use layered::LayeredWorld;
pub use proxy::{Proxy, ProxyShape, ProxyWorld, Reflectance};

use crate::bvh::Ray;
use crate::directions::mirrored;
use glam::{Quat, Vec2, Vec3};
use pano_core::{distribution::SphereDistribution, image::RadianceImage, sphere};

/// Where a ray met a real surface.
#[derive(Clone, Copy, Debug)]
pub struct RealHit {
    /// Distance in metres.
    pub t: f32,
    /// World position.
    pub position: Vec3,
    /// Unit normal on the side the ray came from, by which light is received and mirrored.
    pub normal: Vec3,
    /// The same, of the surface just there: densities per area go by it. A captured surface's steps of depth turn it.
    pub facet: Vec3,
    /// Which of the world's surfaces; the index of the proxy.
    pub surface: u32,
    /// The radiance that leaves towards the ray's origin, if it is known: a captured surface carries all its light, and a
    /// path ends there. Of proxies it is not known, and the path goes on.
    pub radiance: Option<Vec3>,
}

/// A direction in which light may come.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction.
    pub direction: Vec3,
    /// What the sample was aimed at.
    pub target: LightTarget,
}

/// What a light sample is aimed at: it counts only if that is what lies there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightTarget {
    /// Infinity.
    Infinity,
    /// The surface at that point.
    Surface(Vec3),
    /// Whatever comes first.
    Anything,
}

/// A panorama seen as light from infinity.
#[derive(Clone, Copy, Debug)]
pub struct Environment<'a> {
    /// Equirectangular radiance.
    pub radiance: &'a RadianceImage,
    /// Its directions in proportion to luminance; `None` if it is black.
    pub light: Option<&'a SphereDistribution>,
    /// Turns the world into the panorama's frame.
    pub pano_from_world: Quat,
}

impl Environment<'_> {
    /// Radiance from world direction `d`.
    #[inline]
    pub fn look(&self, d: Vec3) -> Vec3 {
        sphere::bilinear(self.radiance, sphere::uv_from_direction(self.pano_from_world * d))
    }

    /// Density per steradian of [`Self::sample`] finding world direction `d`.
    #[inline]
    pub fn pdf(&self, d: Vec3) -> f32 {
        self.light.map_or(0.0, |light| light.pdf(self.pano_from_world * d))
    }

    /// A world direction in proportion to luminance.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<Vec3> {
        Some(self.pano_from_world.inverse() * self.light?.sample(u)?.direction)
    }
}

/// What rays can ask the real world.
pub trait RealWorld: std::fmt::Debug + Sync {
    /// The nearest real surface on the ray.
    fn hit(&self, ray: &Ray) -> Option<RealHit>;

    /// The same, of which only the surface is needed: [`RealHit::radiance`] may be left out.
    fn surface(&self, ray: &Ray) -> Option<RealHit> {
        self.hit(ray)
    }

    /// Whether any real surface lies on the ray: [`Self::hit`] finds one.
    fn blocks(&self, ray: &Ray) -> bool {
        self.hit(ray).is_some()
    }

    /// The surface whose change the picture shows at a hit of a camera ray along `direction`: where a picture blends two
    /// surfaces at an edge, one of them, in proportion to its share of the blend (`u` in [0, 1) decides).
    fn shown_surface(&self, hit: RealHit, direction: Vec3, u: f32) -> RealHit {
        let _ = (direction, u);
        hit
    }

    /// Radiance that comes from infinity along `direction` (pointing away from the viewer).
    fn infinity(&self, direction: Vec3) -> Vec3;

    /// Radiance that arrives along `direction` (pointing away from the viewer), on which `first` lies first (`None`: infinity);
    /// 0 from surfaces whose radiance is not known.
    #[inline]
    fn arriving(&self, direction: Vec3, first: Option<&RealHit>) -> Vec3 {
        first.map_or_else(|| self.infinity(direction), |hit| hit.radiance.unwrap_or(Vec3::ZERO))
    }

    /// Diffuse reflectance at a hit.
    fn reflectance(&self, hit: &RealHit) -> Vec3;

    /// The radiance that the picture shows of a hit, where it is the picture that tells what the surface is made of; `None`
    /// for geometry of known reflectance, which is to be shaded.
    fn pictured(&self, hit: &RealHit) -> Option<Vec3> {
        hit.radiance
    }

    /// Radiance at a hit beyond what the largest diffuse reflectance could send out: a lamp's own light, or a mirror image.
    fn beyond_diffuse(&self, hit: &RealHit) -> Vec3 {
        let _ = hit;
        Vec3::ZERO
    }

    /// The radiance that a hit of a ray along `direction` sends back to the ray, which is not the camera's: as the picture shows it, but
    /// for what it mirrors. `None` where the picture tells none.
    fn sent_back(&self, hit: &RealHit, direction: Vec3) -> Option<Vec3> {
        let _ = direction;
        hit.radiance
    }

    /// A direction in proportion to the light expected at `from`. `None` in a black world.
    fn sample_light(&self, from: Vec3, u: Vec2) -> Option<LightSample>;

    /// Density per steradian at `from` of [`Self::sample_light`] finding `direction`, along which the world shows `behind`
    /// (`None`: infinity), counting only samples that reach what they aim at.
    fn light_pdf(&self, from: Vec3, direction: Vec3, behind: Option<&RealHit>) -> f32;

    /// What the world shows along `ray` towards a light sample (`Some(None)`: infinity), or `None` if that is not the light
    /// the sample was aimed at. Its [`RealHit::normal`] may be the facet's.
    fn reach(&self, ray: &Ray, sample: &LightSample) -> Option<Option<RealHit>>;

    /// The panorama as an environment at infinity, whatever else is known of the world.
    fn environment(&self) -> Environment<'_>;

    /// Whether real surfaces can see one another, so that the change of one changes another.
    fn sees_itself(&self) -> bool;

    /// Where a ray that leaves a real surface starts.
    fn leave(&self, hit: &RealHit) -> Vec3;
}

/// Where a mirror at a hit of a ray along `direction` looks.
pub(crate) fn mirror_ray<W: RealWorld>(world: &W, hit: &RealHit, direction: Vec3) -> Ray {
    Ray::new(world.leave(hit), mirrored(direction, hit.normal))
}
