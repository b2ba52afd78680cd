//! Known real geometry under an environment at infinity.

use super::{Environment, LightSample, LightTarget, RealHit, RealWorld};
use crate::bvh::{Ray, Tlas, offset_point};
use crate::objects::PreparedMesh;
use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::{color, distribution::SphereDistribution, image::RadianceImage, sphere};
use std::f32::consts::PI;
use std::sync::Arc;

/// Geometry of a proxy in its own space.
#[derive(Clone, Debug)]
pub enum ProxyShape {
    /// A rectangle of this size (metres, along X and Z) about the origin of the XZ plane. Both sides count.
    Plane(Vec2),
    /// A mesh; its materials do not count.
    Mesh(Arc<PreparedMesh>),
}

/// How much light a proxy reflects, diffusely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reflectance {
    /// The same everywhere, [0, 1] a channel.
    Known(Vec3),
    /// Read off the picture, point by point: ρ = π·L/E with the radiance L seen from the capture point and the unoccluded
    /// irradiance E, at most `cap` (a lamp is not white paint).
    FromPicture {
        /// Largest reflectance; .9 is white paper.
        cap: f32,
    },
}

/// A proxy and where it stands.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Its geometry.
    pub shape: ProxyShape,
    /// Places it.
    pub world_from_local: Affine3A,
    /// Its diffuse reflectance.
    pub reflectance: Reflectance,
}

#[derive(Clone, Debug)]
pub(super) struct Rectangle {
    pub(super) local_from_world: Affine3A,
    /// Unit normal, world.
    pub(super) normal: Vec3,
    pub(super) half: Vec2,
    pub(super) surface: u32,
}

/// Proxies under an environment at infinity.
#[derive(Clone, Debug)]
pub struct ProxyWorld {
    pub(super) rectangles: Vec<Rectangle>,
    pub(super) meshes: Vec<(Arc<PreparedMesh>, Affine3A, u32)>,
    pub(super) reflectances: Vec<Reflectance>,
    pub(super) tlas: Tlas,
    pub(super) environment: Arc<RadianceImage>,
    pub(super) pano_from_world: Quat,
    pub(super) capture: Vec3,
    pub(super) light: Option<SphereDistribution>,
    /// Irradiance by normal, equirectangular in the panorama's frame; only made when a reflectance is read off the picture.
    pub(super) irradiance: Option<RadianceImage>,
}

impl ProxyWorld {
    /// `environment` is an equirectangular picture in Pano's convention, captured at `capture` and turned into the world by
    /// `world_from_pano`.
    pub fn new(environment: Arc<RadianceImage>, world_from_pano: Quat, capture: Vec3, proxies: &[Proxy]) -> Self {
        let light = SphereDistribution::new(&environment.map(color::luminance));
        let mut rectangles = Vec::new();
        let mut meshes = Vec::new();
        for (surface, p) in proxies.iter().enumerate() {
            let surface = surface as u32;
            match &p.shape {
                ProxyShape::Plane(size) => {
                    let local_from_world = p.world_from_local.inverse();
                    // Rows of the inverse are gradients of the local coordinates: that of local y is the normal.
                    let normal = Vec3::from(local_from_world.matrix3.transpose() * glam::Vec3A::Y).normalize();
                    rectangles.push(Rectangle { local_from_world, normal, half: *size * 0.5, surface });
                }
                ProxyShape::Mesh(mesh) => meshes.push((mesh.clone(), p.world_from_local, surface)),
            }
        }
        let tlas = Tlas::build(meshes.iter().map(|(m, place, _)| (m.blas().clone(), *place)));
        let estimate = proxies.iter().any(|p| matches!(p.reflectance, Reflectance::FromPicture { .. }));
        let irradiance = estimate.then(|| irradiance_by_normal(&environment));
        let reflectances = proxies.iter().map(|p| p.reflectance).collect();
        Self {
            rectangles,
            meshes,
            reflectances,
            tlas,
            environment,
            pano_from_world: world_from_pano.inverse(),
            capture,
            light,
            irradiance,
        }
    }

    /// Whether any reflectance is read off the picture.
    pub fn reflects_picture(&self) -> bool {
        self.irradiance.is_some()
    }

    fn nearest(&self, ray: &Ray) -> Option<(f32, Vec3, u32)> {
        let mut best: Option<(f32, Vec3, u32)> = None;
        for r in &self.rectangles {
            if let Some(t) = r.intersect(ray)
                && best.is_none_or(|b| t < b.0)
            {
                best = Some((t, r.normal, r.surface));
            }
        }
        let rest = ray.up_to(best.map_or(ray.t_max, |b| b.0));
        if let Some(h) = self.tlas.intersect(&rest) {
            let (mesh, place, surface) = &self.meshes[h.instance as usize];
            let [a, b, c] =
                mesh.mesh().triangles[h.hit.triangle as usize].map(|v| place.transform_point3(mesh.mesh().positions[v as usize]));
            let normal = (b - a).cross(c - a).try_normalize().unwrap_or(-ray.direction);
            best = Some((h.hit.t, normal, *surface));
        }
        best
    }
}

impl Rectangle {
    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<f32> {
        let o = self.local_from_world.transform_point3(ray.origin);
        let d = self.local_from_world.transform_vector3(ray.direction);
        let t = -o.y / d.y;
        let p = Vec2::new(o.x + t * d.x, o.z + t * d.z).abs();
        (t > 0.0 && t < ray.t_max && p.x <= self.half.x && p.y <= self.half.y).then_some(t)
    }
}

impl RealWorld for ProxyWorld {
    #[inline]
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        let (t, normal, surface) = self.nearest(ray)?;
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        Some(RealHit { t, position: ray.at(t), normal, facet: normal, surface, radiance: None })
    }

    #[inline]
    fn blocks(&self, ray: &Ray) -> bool {
        self.rectangles.iter().any(|r| r.intersect(ray).is_some()) || self.tlas.occluded(ray)
    }

    #[inline]
    fn infinity(&self, direction: Vec3) -> Vec3 {
        self.environment().look(direction)
    }

    fn reflectance(&self, hit: &RealHit) -> Vec3 {
        match self.reflectances[hit.surface as usize] {
            Reflectance::Known(rho) => rho,
            Reflectance::FromPicture { cap } => {
                let radiance = self.environment().look(hit.position - self.capture);
                let irradiance = self
                    .irradiance
                    .as_ref()
                    .map_or(Vec3::ZERO, |e| sphere::bilinear(e, sphere::uv_from_direction(self.pano_from_world * hit.normal)));
                reflectance_from(radiance, irradiance, cap)
            }
        }
    }

    fn pictured(&self, hit: &RealHit) -> Option<Vec3> {
        match self.reflectances[hit.surface as usize] {
            Reflectance::Known(_) => None,
            Reflectance::FromPicture { .. } => Some(self.environment().look(hit.position - self.capture)),
        }
    }

    #[inline]
    fn sample_light(&self, _from: Vec3, u: Vec2) -> Option<LightSample> {
        Some(LightSample { direction: self.environment().sample(u)?, target: LightTarget::Infinity })
    }

    #[inline]
    fn light_pdf(&self, _from: Vec3, direction: Vec3, behind: Option<&RealHit>) -> f32 {
        if behind.is_none() { self.environment().pdf(direction) } else { 0.0 }
    }

    #[inline]
    fn reach(&self, ray: &Ray, _sample: &LightSample) -> Option<Option<RealHit>> {
        (!self.blocks(ray)).then_some(None)
    }

    #[inline]
    fn environment(&self) -> Environment<'_> {
        Environment { radiance: &self.environment, light: self.light.as_ref(), pano_from_world: self.pano_from_world }
    }

    fn sees_itself(&self) -> bool {
        self.rectangles.len() + self.meshes.len() > 1 || !self.meshes.is_empty()
    }

    #[inline]
    fn leave(&self, hit: &RealHit) -> Vec3 {
        // Rectangles are met at o + t·d, whose error grows with the distance: farther off than a mesh hit.
        offset_point(hit.position, hit.normal) + hit.normal * (hit.t * 2e-6)
    }
}

/// ρ = π·L/E per channel, within [0, `cap`]; 0 where nothing arrives.
pub(super) fn reflectance_from(radiance: Vec3, irradiance: Vec3, cap: f32) -> Vec3 {
    let one = |l: f32, e: f32| if e > 0.0 { (PI * l / e).clamp(0.0, cap) } else { 0.0 };
    Vec3::new(one(radiance.x, irradiance.x), one(radiance.y, irradiance.y), one(radiance.z, irradiance.z))
}

/// ∫ L(ω)·⟨n, ω⟩⁺ dω for the normals of a 32×16 picture, exactly over the texels of a 64×32 reduction.
fn irradiance_by_normal(environment: &RadianceImage) -> RadianceImage {
    let (w, h) = environment.size();
    let (rw, rh) = (64.min(w), 32.min(h));
    let mut light = vec![(Vec3::ZERO, Vec3::ZERO); rw * rh];
    for y in 0..h {
        let weight = sphere::pixel_solid_angle(w, h, y) as f32;
        for x in 0..w {
            let d = sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
            let cell = &mut light[(y * rh / h) * rw + x * rw / w];
            let l = environment.get(x, y) * weight;
            // Each cell keeps its light and where it comes from on the average.
            cell.0 += l;
            cell.1 += d * color::luminance(l);
        }
    }
    let light: Vec<(Vec3, Vec3)> = light.into_iter().filter_map(|(l, d)| Some((l, d.try_normalize()?))).collect();
    RadianceImage::par_from_fn(32, 16, |x, y| {
        let n = sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / 32.0, (y as f32 + 0.5) / 16.0));
        light.iter().map(|(l, d)| *l * d.dot(n).max(0.0)).sum()
    })
}
