//! The four virtual objects for the table: diffuse, glossy metal, mirror and glass.

use super::{RoomObject, TABLE_TOP};
use crate::builtin::primitives::{lathe, torus, torus_knot, uv_sphere};
use crate::material::Material;
use crate::mesh::Mesh;
use glam::{Affine3A, Quat, Vec2, Vec3};

/// All objects, standing on the table's top.
pub(super) fn all() -> Vec<RoomObject> {
    let object = |name, mesh, material, x: f32, z: f32, yaw| RoomObject {
        name,
        mesh: standing(mesh),
        material,
        position: Vec3::new(x, TABLE_TOP, z),
        yaw,
    };
    vec![
        object("figure", figure(), Material::diffuse(Vec3::new(0.72, 0.34, 0.22)), -0.31, 0.06, 25.0),
        object("knot", knot(), Material::metal(Vec3::new(0.93, 0.66, 0.42), 0.3), 0.03, -0.02, 35.0),
        object("mirror ball", uv_sphere(0.07, 96, 48), Material::metal(Vec3::splat(0.95), 0.0), 0.33, 0.10, 0.0),
        object("glass ball", uv_sphere(0.06, 96, 48), Material::glass(1.5, 0.0), -0.06, 0.25, 0.0),
    ]
}

/// Moved up or down until its lowest point is at y = 0 exactly.
fn standing(mut mesh: Mesh) -> Mesh {
    if let Some((low, _)) = mesh.bounds() {
        mesh.positions.iter_mut().for_each(|p| p.y -= low.y);
    }
    mesh
}

/// A chess-like figure with a ring around its neck, 19 cm high.
fn figure() -> Mesh {
    let mut profile: Vec<Vec2> = [(0.0, 0.0), (0.052, 0.0), (0.055, 0.006), (0.053, 0.014), (0.044, 0.018), (0.042, 0.026)]
        .map(|(r, y)| Vec2::new(r, y))
        .to_vec();
    // A waist, then the head's sphere.
    profile.extend((1..=14).map(|i| {
        let t = i as f32 / 14.0;
        Vec2::new(0.016 + 0.026 * (1.0 - t).powi(2) + 0.006 * (t * 9.0).sin() * t, 0.026 + 0.098 * t)
    }));
    let (center, radius) = (0.152f32, 0.035f32);
    profile.extend((0..=16).map(|i| {
        let angle = -0.9 + (std::f32::consts::FRAC_PI_2 + 0.9) * i as f32 / 16.0;
        let r = if i == 16 { 0.0 } else { radius * angle.cos() };
        Vec2::new(r, center + radius * angle.sin())
    }));
    let mut mesh = lathe(&profile, 64);
    let mut ring = torus(0.032, 0.007, 64, 16);
    ring.transform(&Affine3A::from_translation(Vec3::Y * 0.118));
    mesh.append(&ring);
    mesh
}

/// A trefoil standing upright, 18 cm high.
fn knot() -> Mesh {
    let mut mesh = torus_knot(2, 3, 0.048, 0.016, 240, 24);
    mesh.transform(&Affine3A::from_quat(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2)));
    mesh
}
