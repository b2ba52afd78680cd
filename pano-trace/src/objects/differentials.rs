//! Ray differentials (Igehy 1999, "Tracing ray differentials"): how a ray changes from one side of its pixel to the other,
//! through reflection and refraction, and so what the pixel covers of a surface.
//!
//! *Departures*: normals from a normal map count as constant over the pixel; after scattering in a rough lobe the lobe's width
//! takes the place of narrower differentials, as the samples of the lobe average over it anyway.

use crate::bvh::Ray;
use glam::{Vec2, Vec3};
use pano_core::camera::Camera;

/// How a ray's origin and direction change across its pixel, along x and along y of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Differentials {
    /// Of the origin, metres.
    pub origin: [Vec3; 2],
    /// Of the unit direction.
    pub direction: [Vec3; 2],
}

/// The same of a point where a ray meets a surface: what the pixel covers of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    /// Along the surface, metres.
    pub position: [Vec3; 2],
    /// Of the surface's unit normal.
    pub normal: [Vec3; 2],
    /// Of the unit direction that the ray came along.
    pub direction: [Vec3; 2],
}

/// Least cosine between ray and normal that a footprint grows by: flatter ones are as good as endless.
pub(super) const LEAST_COSINE: f32 = 1e-4;

impl Differentials {
    /// Of the ray through the point `at` of a picture, in pixels; `share` is what the ray stands for of the pixel's width.
    pub fn of_pixel(camera: &Camera, at: Vec2, share: f32) -> Self {
        let across = |step: Vec2| (camera.direction(at + step * 0.5) - camera.direction(at - step * 0.5)) * share;
        Self { origin: [Vec3::ZERO; 2], direction: [across(Vec2::X), across(Vec2::Y)] }
    }

    /// Where `ray`, of these differentials, meets a plane with unit `normal` at the distance `t`.
    pub fn on_plane(&self, ray: &Ray, t: f32, normal: Vec3) -> Neighbours {
        let cos = ray.direction.dot(normal);
        let cos = if cos.abs() < LEAST_COSINE { LEAST_COSINE.copysign(cos) } else { cos };
        let along = |i: usize| {
            let moved = self.origin[i] + self.direction[i] * t;
            moved - ray.direction * (moved.dot(normal) / cos)
        };
        Neighbours { position: [along(0), along(1)], normal: [Vec3::ZERO; 2], direction: self.direction }
    }
}

impl Neighbours {
    /// Of the mirror image of unit `direction` in the surface with unit `normal`.
    pub fn reflected(&self, direction: Vec3, normal: Vec3) -> Differentials {
        let cos = direction.dot(normal);
        self.onward(|i| {
            let change = self.direction[i].dot(normal) + direction.dot(self.normal[i]);
            self.direction[i] - (normal * change + self.normal[i] * cos) * 2.0
        })
    }

    /// Of unit `direction` refracted at the surface with unit `normal` towards where it came from; `eta` is the index behind the
    /// surface over the one in front. Under total internal reflection there is no such ray, and nothing changes.
    pub fn refracted(&self, direction: Vec3, normal: Vec3, eta: f32) -> Differentials {
        let cos = -direction.dot(normal);
        let behind = (1.0 - (1.0 - cos * cos) / (eta * eta)).max(0.0).sqrt().max(LEAST_COSINE);
        self.onward(|i| {
            let change = -(self.direction[i].dot(normal) + direction.dot(self.normal[i]));
            let normal_part = change / eta - cos * change / (eta * eta * behind);
            self.direction[i] / eta + self.normal[i] * (cos / eta - behind) + normal * normal_part
        })
    }

    /// Of unit `direction` in a lobe whose angular width is at least `spread`, radians.
    pub fn scattered(&self, direction: Vec3, spread: f32) -> Differentials {
        let (a, b) = direction.any_orthonormal_pair();
        self.onward(|i| [a, b][i] * spread)
    }

    fn onward(&self, direction: impl Fn(usize) -> Vec3) -> Differentials {
        Differentials { origin: self.position, direction: [direction(0), direction(1)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directions::mirrored;
    use proptest::prelude::*;

    /// The sphere about the origin, hit from outside: distance and normal.
    fn sphere(ray: &Ray) -> (f32, Vec3) {
        let (b, c) = (ray.origin.as_dvec3().dot(ray.direction.as_dvec3()), ray.origin.as_dvec3().length_squared() - 1.0);
        let t = (-b - (b * b - c).sqrt()) as f32;
        (t, ray.at(t).normalize())
    }

    fn bent(direction: Vec3, normal: Vec3, eta: f32) -> Vec3 {
        let cos = -direction.dot(normal);
        direction / eta + normal * (cos / eta - (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt())
    }

    proptest! {
        /// Off a mirror sphere and into a glass one, differentials are the difference of two rays.
        #[test]
        fn differentials_are_differences(x in -0.4f32..0.4, y in -0.4f32..0.4, eta in 1.1f32..2.0) {
            const STEP: f32 = 1e-3;
            let camera = Vec3::new(0.0, 0.0, 4.0);
            let ray_to = |x: f32, y: f32| Ray::new(camera, (Vec3::new(x, y, 0.8) - camera).normalize());
            let (ray, next) = (ray_to(x, y), [ray_to(x + STEP, y), ray_to(x, y + STEP)]);
            let direction = next.map(|r| r.direction - ray.direction);
            let (t, normal) = sphere(&ray);
            let met = next.map(|r| { let (t, n) = sphere(&r); (r.at(t), n, r.direction) });
            let mut here = Differentials { origin: [Vec3::ZERO; 2], direction }.on_plane(&ray, t, normal);
            here.normal = met.map(|m| m.1 - normal);
            let (off, into) = (here.reflected(ray.direction, normal), here.refracted(ray.direction, normal, eta));
            for (i, (p, n, d)) in met.into_iter().enumerate() {
                let near = |found: Vec3, truth: Vec3| found.distance(truth) < 0.03 * truth.length() + 2e-5;
                prop_assert!(near(here.position[i], p - ray.at(t)), "{} {}", here.position[i], p - ray.at(t));
                let (r, s) = (mirrored(d, n) - mirrored(ray.direction, normal), bent(d, n, eta) - bent(ray.direction, normal, eta));
                prop_assert!(near(off.direction[i], r), "{} {r}", off.direction[i]);
                prop_assert!(near(into.direction[i], s), "{} {s}", into.direction[i]);
            }
        }
    }

    #[test]
    fn a_ray_along_the_surface_has_a_finite_footprint() {
        let ray = Ray::new(Vec3::Y * 0.0, Vec3::X);
        let wide = Differentials { origin: [Vec3::ZERO; 2], direction: [Vec3::Y * 0.01, Vec3::Z * 0.01] };
        let here = wide.on_plane(&ray, 2.0, Vec3::Y);
        assert!(here.position.iter().all(|p| p.is_finite()) && here.position[0].length() > 10.0, "{here:?}");
    }
}
