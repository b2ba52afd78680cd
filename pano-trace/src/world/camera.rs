//! What a depth camera has captured: a perspective picture with depth, beside whatever else is known of the place.

use super::captured::{AT_CAPTURE, LEAVE};
use super::{Environment, LightSample, RealHit, RealWorld};
use crate::bvh::Ray;
use crate::prt::{FieldOptions, PerspectiveField, PerspectiveHit};
use glam::{Quat, Vec2, Vec3};
use pano_core::{Error, Result, camera::Camera, image::Image, image::RadianceImage, sphere::resample};
use std::sync::Arc;

/// A perspective picture with depth as a world of rays; what the camera does not see is black and far away.
#[derive(Clone, Debug)]
pub struct CameraWorld {
    radiance: Arc<RadianceImage>,
    camera: Camera,
    field: PerspectiveField,
    /// What infinity shows: nothing.
    nothing: RadianceImage,
}

impl CameraWorld {
    /// From the picture of a perspective `camera` and its depth: distance along the ray at each pixel's centre, in metres, not
    /// finite where nothing is.
    ///
    /// # Errors
    /// [`Error::Argument`] if the pictures are not of the camera's size or the camera is a panorama.
    pub fn new(radiance: Arc<RadianceImage>, depth: &Image<f32>, camera: Camera, options: &FieldOptions) -> Result<Self> {
        let size = (camera.width, camera.height);
        for (what, other) in [("picture", radiance.size()), ("depth", depth.size())] {
            if other != size {
                return Err(Error::argument(format!("the {what} has {other:?} pixels, its camera {size:?}")));
            }
        }
        let Some((focal, center)) = camera.intrinsics() else {
            return Err(Error::argument("a depth camera is perspective, not a panorama"));
        };
        let field = PerspectiveField::new(depth, focal, center, options);
        Ok(Self { radiance, camera, field, nothing: RadianceImage::filled(2, 1, Vec3::ZERO) })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The surface on the ray.
    fn nearest(&self, ray: &Ray) -> Option<PerspectiveHit> {
        let turn = self.camera.world_from_camera.inverse();
        let (origin, direction) = (turn * (ray.origin - self.camera.position), turn * ray.direction);
        if origin.length_squared() < AT_CAPTURE * AT_CAPTURE {
            self.field.look(direction).filter(|hit| hit.t < ray.t_max)
        } else {
            self.field.march(origin, direction, ray.t_max)
        }
    }

    /// What the picture shows of a point; across a gap the nearest pixel's, never a mixture of front and back.
    fn shown(&self, position: Vec3, at_gap: bool) -> Option<Vec3> {
        let to = position - self.camera.position;
        if !at_gap {
            return resample::look_up_view(&self.radiance, &self.camera, to);
        }
        let at = self.camera.pixel(to)?.clamp(Vec2::ZERO, Vec2::new(self.camera.width as f32, self.camera.height as f32) - 1.0);
        Some(self.radiance.get(at.x as usize, at.y as usize))
    }
}

impl RealWorld for CameraWorld {
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        let PerspectiveHit { t, normal, at_gap } = self.nearest(ray)?;
        let position = ray.at(t);
        let normal = self.camera.world_from_camera * normal;
        let radiance = Some(self.shown(position, at_gap).unwrap_or(Vec3::ZERO));
        Some(RealHit { t, position, normal, facet: normal, surface: 0, radiance })
    }

    fn blocks(&self, ray: &Ray) -> bool {
        self.nearest(ray).is_some()
    }

    fn infinity(&self, _direction: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    fn reflectance(&self, _hit: &RealHit) -> Vec3 {
        Vec3::ZERO
    }

    fn sample_light(&self, _from: Vec3, _u: Vec2) -> Option<LightSample> {
        None
    }

    fn light_pdf(&self, _from: Vec3, _direction: Vec3, _behind: Option<&RealHit>) -> f32 {
        0.0
    }

    fn reach(&self, ray: &Ray, _sample: &LightSample) -> Option<Option<RealHit>> {
        (!self.blocks(ray)).then_some(None)
    }

    fn environment(&self) -> Environment<'_> {
        Environment { radiance: &self.nothing, light: None, pano_from_world: Quat::IDENTITY }
    }

    fn sees_itself(&self) -> bool {
        true
    }

    fn leave(&self, hit: &RealHit) -> Vec3 {
        hit.position + hit.normal * (LEAVE * (hit.position - self.camera.position).length())
    }
}
