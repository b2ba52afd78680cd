//! The BVH of all instances.

use super::{Blas, Ray, TriangleHit, blas::to_obvhs};
use glam::{Affine3A, Vec3, Vec3A};
use obvhs::{BvhBuildParams, aabb::Aabb, cwbvh::CwBvh, cwbvh::builder::build_cwbvh, ray::RayHit};
use std::sync::Arc;

/// Where a ray met an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceHit {
    /// Index of the instance in the order they were given.
    pub instance: u32,
    /// Where on its mesh.
    pub hit: TriangleHit,
}

#[derive(Clone, Debug)]
struct Instance {
    blas: Arc<Blas>,
    mesh_from_world: Affine3A,
}

/// Instances of meshes, placed in the world.
#[derive(Clone, Debug)]
pub struct Tlas {
    instances: Vec<Instance>,
    bvh: CwBvh,
}

impl Tlas {
    /// Places each mesh by its `world_from_mesh`, which must be invertible.
    pub fn build(instances: impl IntoIterator<Item = (Arc<Blas>, Affine3A)>) -> Self {
        let mut boxes = Vec::new();
        let instances: Vec<Instance> = instances
            .into_iter()
            .map(|(blas, world_from_mesh)| {
                let (lo, hi) = blas.bounds();
                let corner = |i: u32| {
                    let pick = |bit: u32, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
                    world_from_mesh.transform_point3a(Vec3A::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z)))
                };
                let (lo, hi) =
                    (0..8).map(corner).fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
                // The slab test of a flat box divides 0 by 0 for rays in its plane: no box is thinner than a few ulps.
                let pad = Vec3A::splat((lo.abs().max(hi.abs()).max_element() * 1e-6).max(1e-9));
                boxes.push(Aabb::new(lo - pad, hi + pad));
                Instance { blas, mesh_from_world: world_from_mesh.inverse() }
            })
            .collect();
        let bvh = build_cwbvh(&boxes, BvhBuildParams::fast_build(), &mut std::time::Duration::default());
        Self { instances, bvh }
    }

    /// Whether nothing is placed.
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// The nearest face along the ray.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<InstanceHit> {
        if self.is_empty() {
            return None;
        }
        let mut nearest = None;
        let mut unused = RayHit::none();
        self.bvh.ray_traverse(to_obvhs(ray), &mut unused, |clipped, id| {
            let instance = self.bvh.primitive_indices[id];
            match self.instances[instance as usize].intersect(ray, clipped.tmax) {
                Some(hit) => {
                    nearest = Some(InstanceHit { instance, hit });
                    hit.t
                }
                None => f32::INFINITY,
            }
        });
        nearest
    }

    /// Whether any face lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        !self.is_empty()
            && !self.bvh.ray_traverse_miss(to_obvhs(ray), |_, id| {
                let instance = &self.instances[self.bvh.primitive_indices[id] as usize];
                if instance.blas.occluded(&instance.to_mesh(ray, ray.t_max)) { 0.0 } else { f32::INFINITY }
            })
    }
}

impl Instance {
    /// The ray in mesh space. Its direction is not normalised, so that distances stay those of the world.
    #[inline]
    fn to_mesh(&self, ray: &Ray, t_max: f32) -> Ray {
        Ray {
            origin: Vec3::from(self.mesh_from_world.transform_point3a(ray.origin.into())),
            direction: Vec3::from(self.mesh_from_world.transform_vector3a(ray.direction.into())),
            t_max,
        }
    }

    #[inline]
    fn intersect(&self, ray: &Ray, t_max: f32) -> Option<TriangleHit> {
        self.blas.intersect(&self.to_mesh(ray, t_max)).filter(|h| h.t < t_max)
    }
}
