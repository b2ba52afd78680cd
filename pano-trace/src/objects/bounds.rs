//! What holds an object: a ball, of which all its light and shadow are told, and boxes, which tell the pixels that may show it.

use super::Placed;
use glam::Vec3;

/// A ball around an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// World position.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}

impl Ball {
    /// The ball in which most of what it changes lies.
    pub(super) fn surroundings(&self) -> Self {
        Self { radius: SURROUNDINGS * self.radius, ..*self }
    }

    /// About the share of the irradiance at a surface point that would come through the ball, [0, 1]: exact for a ball above
    /// the horizon, more than 0 as long as a part of it is above.
    pub fn form_factor(&self, at: Vec3, normal: Vec3) -> f32 {
        let to = self.center - at;
        let distance = to.length().max(self.radius);
        let (sine, facing) = (self.radius / distance, to.dot(normal) / distance);
        // A ball that the horizon cuts counts as if it stood this share of its angle above.
        if facing <= -sine { 0.0 } else { sine * sine * facing.max(0.3 * sine) }
    }
}

/// Largest number of balls that light sampling looks at for each point.
pub const MAX_CLUSTERS: usize = 8;

/// Radii of a ball within which most of what it changes lies.
pub(crate) const SURROUNDINGS: f32 = 2.0;
/// Cells along each axis of the grid over an object whose faces have a box of their own.
const GRID: usize = 3;
/// Beams wider than this, as a tangent, may meet anything.
pub(crate) const WIDEST: f32 = 0.5;

/// The directions within a small angle of an axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    pub(crate) origin: Vec3,
    /// Unit direction.
    pub(crate) axis: Vec3,
    /// Tangent of the angle.
    pub(crate) spread: f32,
}

impl Beam {
    /// Whether it reaches the ball and one of the boxes in it.
    pub(super) fn may_meet(&self, ball: &Ball, boxes: &[[Vec3; 2]]) -> bool {
        let to = ball.center - self.origin;
        let along = to.dot(self.axis);
        let distance = to.length();
        if distance <= ball.radius || self.spread > WIDEST {
            return true;
        }
        // Bounds blown up by what the beam has spread beyond the ball, against the axis.
        let spread = self.spread * (distance + ball.radius);
        let radius = ball.radius + spread;
        if along <= -radius || (to - self.axis * along).length_squared() > radius * radius {
            return false;
        }
        // No direction is exactly along a face, which would be 0/0.
        let inverse = self.axis.map(|d| 1.0 / if d.abs() < 1e-20 { 1e-20 } else { d });
        boxes.iter().any(|[low, high]| {
            let (a, b) = ((*low - spread - self.origin) * inverse, (*high + spread - self.origin) * inverse);
            let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
            leave >= enter.max(0.0)
        })
    }
}

/// The ball about the middle of the box that holds every vertex in use.
pub(super) fn ball_around(placed: &Placed) -> Ball {
    let (lo, hi) = placed.mesh.blas.bounds();
    let center = placed.world_from_mesh.transform_point3(0.5 * (lo + hi));
    let mesh = &placed.mesh.mesh;
    let radius2 = mesh
        .triangles
        .iter()
        .flatten()
        .map(|&v| placed.world_from_mesh.transform_point3(mesh.positions[v as usize]).distance_squared(center))
        .fold(0.0, f32::max);
    // Rounding of the transform must not leave a vertex outside.
    Ball { center, radius: radius2.sqrt() * 1.0001 + 1e-7 }
}

/// Joins the pair of balls with the smallest common ball until few are left.
pub(super) fn clustered(balls: &[Ball]) -> Vec<Ball> {
    let mut balls = balls.to_vec();
    while balls.len() > MAX_CLUSTERS {
        let pairs = (0..balls.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let Some((i, j, joined)) =
            pairs.map(|(i, j)| (i, j, join(balls[i], balls[j]))).min_by(|a, b| a.2.radius.total_cmp(&b.2.radius))
        else {
            break;
        };
        balls[j] = joined;
        balls.swap_remove(i);
    }
    balls
}

/// The smallest ball around two.
fn join(a: Ball, b: Ball) -> Ball {
    let distance = a.center.distance(b.center);
    if distance + b.radius <= a.radius {
        return a;
    }
    if distance + a.radius <= b.radius {
        return b;
    }
    let radius = 0.5 * (distance + a.radius + b.radius) * 1.0001;
    Ball { center: a.center + (b.center - a.center) * ((radius - a.radius) / distance), radius }
}

/// Boxes that hold its faces: one for those in each cell of a grid over the object.
pub(super) fn boxes_around(placed: &Placed) -> Vec<[Vec3; 2]> {
    const NOTHING: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let grown = |[low, high]: [Vec3; 2], p: Vec3| [low.min(p), high.max(p)];
    let faces = || {
        let corners = |triangle: u32| placed.corners(triangle).map(|p| placed.world_from_mesh.transform_point3(p));
        (0..placed.mesh.mesh.triangles.len() as u32).map(corners)
    };
    let [low, high] = faces().flatten().fold(NOTHING, grown);
    let scale = GRID as f32 / (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
    let mut cells = [NOTHING; GRID * GRID * GRID];
    for corners in faces() {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let cell = ((middle - low) * scale).as_uvec3().min(glam::UVec3::splat(GRID as u32 - 1)).as_usizevec3();
        let held = &mut cells[(cell.z * GRID + cell.y) * GRID + cell.x];
        *held = corners.into_iter().fold(*held, grown);
    }
    // Rounding of the transform must not leave a vertex outside.
    let margin = |[low, high]: [Vec3; 2]| 1e-4 * (high - low) + 1e-6 * low.abs().max(high.abs()) + 1e-7;
    cells.into_iter().filter(|c| c[0].x <= c[1].x).map(|c| [c[0] - margin(c), c[1] + margin(c)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::objects::{Objects, Placement, PreparedMesh};
    use glam::{Affine3A, EulerRot, Quat, Vec2};
    use pano_core::builtin::primitives;
    use proptest::prelude::*;
    use std::sync::Arc;

    fn vec3(within: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(within).prop_map(Vec3::from_array)
    }

    proptest! {
        /// A pixel in which a point of an object shows must ask for objects, however the object stands and wherever the viewer is.
        #[test]
        fn a_beam_that_holds_a_point_of_an_object_may_meet_it(
            scale in vec3(0.01..3.0), mirrored in any::<bool>(), turn in vec3(-3.0..3.0), at in vec3(-5.0..5.0), origin in vec3(-8.0..8.0),
            face in any::<prop::sample::Index>(), on in prop::array::uniform2(0.0f32..1.0),
            spread in (-5.0f32..-0.4).prop_map(|e| 10f32.powf(e)), off in prop::array::uniform2(-0.7f32..0.7),
        ) {
            let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
            let scale = if mirrored { scale * Vec3::new(-1.0, 1.0, 1.0) } else { scale };
            let turn = Quat::from_euler(EulerRot::XYZ, turn.x, turn.y, turn.z);
            let world_from_mesh = Affine3A::from_scale_rotation_translation(scale, turn, at);
            let objects = Objects::new(&[Placement { mesh: mesh.clone(), world_from_mesh, material: None }]);
            let triangles = &mesh.mesh().triangles;
            let [a, b, c] = triangles[face.index(triangles.len())].map(|v| mesh.mesh().positions[v as usize]);
            let (root, v) = (on[0].sqrt(), on[1]);
            let point = world_from_mesh.transform_point3(a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v));
            let Some(towards) = (point - origin).try_normalize() else { return Ok(()) };
            let (t, u) = towards.any_orthonormal_pair();
            let off = Vec2::from_array(off) * spread;
            let axis = (towards + t * off.x + u * off.y).normalize();
            let beam = Beam { origin, axis, spread };
            prop_assert!(objects.may_be_in(&beam));
        }
    }

    /// What the boxes are for: beside a bent thing, inside its ball, nothing is looked for.
    #[test]
    fn a_beam_through_the_ball_beside_the_faces_meets_nothing() {
        let mut mesh = primitives::icosphere(0.1, 2);
        let others = mesh.positions.len() as u32;
        mesh.positions.extend(mesh.positions.clone().into_iter().map(|p| p + Vec3::X * 4.0));
        mesh.triangles.extend(mesh.triangles.clone().into_iter().map(|t| t.map(|v| v + others)));
        mesh.normals.clear();
        mesh.uvs.clear();
        let mesh = Arc::new(PreparedMesh::new(mesh).unwrap());
        let objects = Objects::new(&[Placement { mesh, world_from_mesh: Affine3A::IDENTITY, material: None }]);
        let beam = |x: f32| Beam { origin: Vec3::new(x, 0.0, 10.0), axis: Vec3::NEG_Z, spread: 1e-3 };
        assert!(objects.may_be_in(&beam(0.0)) && objects.may_be_in(&beam(4.0)));
        assert!(!objects.may_be_in(&beam(2.0)) && objects.balls()[0].center.distance(Vec3::X * 2.0) < 1e-3);
    }
}
