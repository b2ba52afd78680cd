//! What the tests of mr360 and rt2ar share: a plane under uniform light, seen from above, lamps, balls.

use crate::mr360::Lighting;
use crate::objects::{Objects, Placement, PreparedMesh};
use crate::world::{Proxy, ProxyShape, ProxyWorld, Reflectance};
use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::image::RadianceImage;
use pano_core::light::{DirectionalLight, RadianceMaps};
use pano_core::material::Material;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

pub(crate) const SIZE: usize = 48;
/// Radiance of the sky, and colour of the photo.
pub(crate) const SKY: Vec3 = Vec3::new(1.0, 0.8, 0.6);
pub(crate) const PHOTO: Vec3 = Vec3::new(0.5, 0.25, 0.1);

pub(crate) fn plane() -> ProxyWorld {
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(40.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(Vec3::splat(0.5)),
    };
    ProxyWorld::new(Arc::new(RadianceImage::filled(8, 4, SKY)), Quat::IDENTITY, Vec3::Y, &[plane])
}

/// A uniform sky and these lights.
pub(crate) fn under(lights: Vec<DirectionalLight>) -> Lighting {
    let uniform = RadianceImage::filled(8, 4, SKY);
    let maps = RadianceMaps { diffuse: uniform.clone(), glossy: std::array::from_fn(|_| uniform.clone()), mirror: uniform };
    Lighting { maps, lights, pano_from_world: Quat::IDENTITY, capture: Vec3::Y }
}

/// A light of angular radius `degrees` whose irradiance is `strength` times π.
pub(crate) fn lamp(direction: Vec3, degrees: f32, strength: f32) -> DirectionalLight {
    let irradiance = Vec3::splat(PI * strength);
    let solid_angle = TAU * (1.0 - degrees.to_radians().cos());
    DirectionalLight { direction: direction.normalize(), irradiance, solid_angle, intensity: irradiance }
}

pub(crate) fn ball(center: Vec3, radius: f32, material: Material) -> Objects {
    Objects::new(&[Placement {
        mesh: Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 4)).unwrap()),
        world_from_mesh: Affine3A::from_scale_rotation_translation(Vec3::splat(radius), Quat::IDENTITY, center),
        material: Some(material),
    }])
}

pub(crate) fn black() -> Material {
    Material::diffuse(Vec3::ZERO)
}

/// Four by four metres of the plane, seen from high above.
pub(crate) fn from_above() -> Camera {
    Camera {
        position: Vec3::new(0.0, 100.0, 0.0),
        world_from_camera: rotation_from_yaw_pitch(0.0, -90.0),
        projection: Projection::Perspective { vfov: 2.0 * 0.02f32.atan() },
        width: SIZE,
        height: SIZE,
    }
}

/// The pixel that shows the point (x, z) of the plane.
pub(crate) fn pixel(x: f32, z: f32) -> (usize, usize) {
    let at = |c: f32| ((c / 4.0 + 0.5) * SIZE as f32) as usize;
    (at(x), at(z))
}
