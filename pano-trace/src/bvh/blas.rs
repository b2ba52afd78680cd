//! The BVH of one mesh.

use super::Ray;
use glam::{Vec2, Vec3, Vec3A};
use obvhs::{
    BvhBuildParams, cwbvh::CwBvh, cwbvh::builder::build_cwbvh_from_tris, ray::RayHit, rt_triangle::RtTriangle, triangle::Triangle,
};
use std::collections::HashSet;

/// Where a ray met a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance along the ray in units of its direction's length.
    pub t: f32,
    /// Index of the face in the mesh.
    pub triangle: u32,
    /// Weights of the face's second and third vertex.
    pub barycentric: Vec2,
}

/// A mesh, ready for rays in its own space.
#[derive(Clone)]
pub struct Blas {
    pub(super) bvh: CwBvh,
    /// In the order of the BVH's leaves.
    pub(super) triangles: Vec<RtTriangle>,
    bounds: (Vec3, Vec3),
}

impl std::fmt::Debug for Blas {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Blas").field("triangles", &self.triangles.len()).field("bounds", &self.bounds).finish()
    }
}

/// Indices of the faces that have an area, each place once. The builder joins nearest neighbours, and of boxes in one place all
/// are equally near: its time would grow with the square of their number.
fn distinct(triangles: &[Triangle]) -> Vec<u32> {
    let has_area = |t: &Triangle| (t.v1 - t.v0).cross(t.v2 - t.v0) != Vec3A::ZERO;
    let place = |t: &Triangle| {
        let mut corners = [t.v0, t.v1, t.v2].map(|v| v.to_array().map(f32::to_bits));
        corners.sort_unstable();
        corners
    };
    let mut seen = HashSet::with_capacity(triangles.len());
    let count = triangles.len() as u32;
    (0..count).filter(|&i| has_area(&triangles[i as usize]) && seen.insert(place(&triangles[i as usize]))).collect()
}

impl Blas {
    /// Builds the BVH of `triangles` over `positions`. Faces without area are never hit; of faces with the same corners the first
    /// stands for all.
    ///
    /// # Panics
    /// If a face names a vertex that is not there; [`pano_core::mesh::Mesh::validate`] finds this out.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let tris: Vec<Triangle> = triangles
            .iter()
            .map(|t| {
                let [v0, v1, v2] = t.map(|v| Vec3A::from(positions[v as usize]));
                Triangle { v0, v1, v2 }
            })
            .collect();
        let kept = distinct(&tris);
        let different: Vec<Triangle> = kept.iter().map(|&i| tris[i as usize]).collect();
        let mut bvh = build_cwbvh_from_tris(&different, BvhBuildParams::medium_build(), &mut std::time::Duration::default());
        bvh.primitive_indices.iter_mut().for_each(|i| *i = kept[*i as usize]);
        let ordered = bvh.primitive_indices.iter().map(|&i| RtTriangle::from(&tris[i as usize])).collect();
        let bounds = tris
            .iter()
            .flat_map(|t| [t.v0, t.v1, t.v2])
            .fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        Self { bvh, triangles: ordered, bounds: (bounds.0.into(), bounds.1.into()) }
    }

    /// Smallest and largest corner.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// The nearest face along the ray, whose direction may have any length.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<TriangleHit> {
        self.intersect_beyond(ray, 0.0)
    }

    /// The nearest face along the ray from `t_min` on.
    #[inline]
    pub fn intersect_beyond(&self, ray: &Ray, t_min: f32) -> Option<TriangleHit> {
        let ray = to_obvhs(ray, t_min);
        let mut hit = RayHit::none();
        if !self.bvh.ray_traverse(ray, &mut hit, |ray, id| intersect(&self.triangles[id], ray)) {
            return None;
        }
        let barycentric = self.triangles[hit.primitive_id as usize].compute_barycentric(&ray);
        Some(TriangleHit { t: hit.t, triangle: self.bvh.primitive_indices[hit.primitive_id as usize], barycentric })
    }

    /// Whether any face lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        !self.bvh.ray_traverse_miss(to_obvhs(ray, 0.0), |ray, id| intersect(&self.triangles[id], ray))
    }
}

/// Möller & Trumbore; infinite for a miss. `obvhs`' own tests sign bits, to which −0 is outside: a ray exactly through the edge
/// between two faces passes both.
#[inline(always)]
pub(super) fn intersect(triangle: &RtTriangle, ray: &obvhs::ray::Ray) -> f32 {
    let c = triangle.v0 - ray.origin;
    let r = ray.direction.cross(c);
    let inverse = 1.0 / triangle.ng.dot(ray.direction);
    let (u, v) = (r.dot(triangle.e2) * inverse, r.dot(triangle.e1) * inverse);
    let t = triangle.ng.dot(c) * inverse;
    // Comparisons with NaN, from rays in the plane of the face, are false.
    let hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t >= ray.tmin) & (t <= ray.tmax);
    if hit { t } else { f32::INFINITY }
}

/// As `obvhs` wants its rays. Its traversal expects finite boxes and directions; an infinite end is allowed.
#[inline]
pub(super) fn to_obvhs(ray: &Ray, t_min: f32) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), t_min, ray.t_max)
}
