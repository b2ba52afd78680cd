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
pub(super) struct Instance {
    pub(super) blas: Arc<Blas>,
    pub(super) mesh_from_world: Affine3A,
    /// In the world.
    pub(super) bounds: Aabb,
}

/// Instances of meshes, placed in the world.
#[derive(Clone, Debug)]
pub struct Tlas {
    pub(super) instances: Vec<Instance>,
    /// `None` for few instances, whose boxes are looked at one by one.
    bvh: Option<CwBvh>,
}

/// Up to this many boxes are tested one by one, which costs less than a wide node: measured with one, three and six.
const FEW: usize = 4;

impl Tlas {
    /// Places each mesh by its `world_from_mesh`, which must be invertible.
    pub fn build(instances: impl IntoIterator<Item = (Arc<Blas>, Affine3A)>) -> Self {
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
                Instance { blas, mesh_from_world: world_from_mesh.inverse(), bounds: Aabb::new(lo - pad, hi + pad) }
            })
            .collect();
        let bvh = (instances.len() > FEW).then(|| {
            let boxes: Vec<Aabb> = instances.iter().map(|i| i.bounds).collect();
            build_cwbvh(&boxes, BvhBuildParams::fast_build(), &mut std::time::Duration::default())
        });
        Self { instances, bvh }
    }

    /// Whether nothing is placed.
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// The nearest face along the ray.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<InstanceHit> {
        self.intersect_beyond(ray, 0.0)
    }

    /// The nearest face along the ray from `t_min` on.
    #[inline]
    pub fn intersect_beyond(&self, ray: &Ray, t_min: f32) -> Option<InstanceHit> {
        let mut nearest = None;
        let Some(bvh) = &self.bvh else {
            let mut t_max = ray.t_max;
            let slabs = to_obvhs(ray, t_min);
            for (i, instance) in self.instances.iter().enumerate() {
                if instance.bounds.intersect_ray(&slabs) < t_max
                    && let Some(hit) = instance.intersect(ray, t_min, t_max)
                {
                    t_max = hit.t;
                    nearest = Some(InstanceHit { instance: i as u32, hit });
                }
            }
            return nearest;
        };
        bvh.ray_traverse(to_obvhs(ray, t_min), &mut RayHit::none(), |clipped, id| {
            let instance = bvh.primitive_indices[id];
            match self.instances[instance as usize].intersect(ray, t_min, clipped.tmax) {
                Some(hit) => {
                    nearest = Some(InstanceHit { instance, hit });
                    hit.t
                }
                None => f32::INFINITY,
            }
        });
        nearest
    }

    /// Names the instances whose boxes lie on the ray from `t_min` on.
    #[inline]
    pub(super) fn each_on(&self, ray: &Ray, t_min: f32, mut met: impl FnMut(u32)) {
        let slabs = to_obvhs(ray, t_min);
        match &self.bvh {
            None => {
                let on =
                    |(i, instance): (usize, &Instance)| (instance.bounds.intersect_ray(&slabs) < ray.t_max).then_some(i as u32);
                self.instances.iter().enumerate().filter_map(on).for_each(met);
            }
            Some(bvh) => bvh.ray_traverse_anyhit(slabs, |_, id| met(bvh.primitive_indices[id])),
        }
    }

    /// Whether any face lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_by(ray, |_| true)
    }

    /// Whether any face of the instances that `counts` says yes to lies on the ray.
    #[inline]
    pub fn occluded_by(&self, ray: &Ray, counts: impl Fn(u32) -> bool) -> bool {
        let occludes = |i: u32| {
            let instance = &self.instances[i as usize];
            counts(i) && instance.blas.occluded(&instance.to_mesh(ray, ray.t_max))
        };
        match &self.bvh {
            None => {
                let slabs = to_obvhs(ray, 0.0);
                let meets =
                    |(i, instance): (usize, &Instance)| instance.bounds.intersect_ray(&slabs) < ray.t_max && occludes(i as u32);
                self.instances.iter().enumerate().any(meets)
            }
            Some(bvh) => {
                !bvh.ray_traverse_miss(
                    to_obvhs(ray, 0.0),
                    |_, id| {
                        if occludes(bvh.primitive_indices[id]) { 0.0 } else { f32::INFINITY }
                    },
                )
            }
        }
    }
}

impl Instance {
    /// The ray in mesh space. Its direction is not normalised, so that distances stay those of the world.
    #[inline]
    pub(super) fn to_mesh(&self, ray: &Ray, t_max: f32) -> Ray {
        Ray {
            origin: Vec3::from(self.mesh_from_world.transform_point3a(ray.origin.into())),
            direction: Vec3::from(self.mesh_from_world.transform_vector3a(ray.direction.into())),
            t_max,
        }
    }

    #[inline]
    fn intersect(&self, ray: &Ray, t_min: f32, t_max: f32) -> Option<TriangleHit> {
        self.blas.intersect_beyond(&self.to_mesh(ray, t_max), t_min).filter(|h| h.t < t_max)
    }
}
