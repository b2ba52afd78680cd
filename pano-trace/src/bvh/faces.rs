//! All faces along a ray, the nearest first: one look into the hierarchy where a ray that goes on behind each face would take
//! one a face.

use super::blas::{intersect, to_obvhs};
use super::{InstanceHit, Ray, Tlas, TriangleHit};
use glam::Vec2;

/// Faces that one look finds: of what a ray passes, a body has two.
const AT_ONCE: usize = 8;

/// The faces along a ray of the instances that count, in order.
#[derive(Debug)]
pub struct Faces<'a, C> {
    tlas: &'a Tlas,
    ray: &'a Ray,
    counts: C,
    found: [InstanceHit; AT_ONCE],
    next: usize,
    len: usize,
    /// There may be others behind these.
    more: bool,
}

impl Tlas {
    /// The faces along the ray of the instances that `counts` says yes to.
    #[inline]
    pub fn faces_among<'a, C: Fn(u32) -> bool>(&'a self, ray: &'a Ray, counts: C) -> Faces<'a, C> {
        let nothing = InstanceHit { instance: 0, hit: TriangleHit { t: f32::INFINITY, triangle: 0, barycentric: Vec2::ZERO } };
        Faces { tlas: self, ray, counts, found: [nothing; AT_ONCE], next: 0, len: 0, more: true }
    }
}

impl<C: Fn(u32) -> bool> Faces<'_, C> {
    /// The nearest from `t_min` on, which must not fall from one call to the next.
    pub fn next_beyond(&mut self, t_min: f32) -> Option<InstanceHit> {
        loop {
            while self.next < self.len {
                let hit = self.found[self.next];
                self.next += 1;
                if hit.hit.t >= t_min {
                    return Some(hit);
                }
            }
            if !self.more {
                return None;
            }
            self.look(t_min);
        }
    }

    /// Finds the nearest few from `t_min` on.
    fn look(&mut self, t_min: f32) {
        (self.next, self.len, self.more) = (0, 0, false);
        let tlas = self.tlas;
        tlas.each_on(self.ray, t_min, |i| {
            if !(self.counts)(i) {
                return;
            }
            let instance = &tlas.instances[i as usize];
            let blas = &instance.blas;
            let ray = to_obvhs(&instance.to_mesh(self.ray, self.ray.t_max), t_min);
            blas.bvh.ray_traverse_anyhit(ray, |ray, id| {
                let t = intersect(&blas.triangles[id], ray);
                if t < self.ray.t_max {
                    let barycentric = blas.triangles[id].compute_barycentric(ray);
                    let hit = TriangleHit { t, triangle: blas.bvh.primitive_indices[id], barycentric };
                    self.insert(InstanceHit { instance: i, hit });
                }
            });
        });
    }

    fn insert(&mut self, hit: InstanceHit) {
        let behind = (0..self.len).rev().take_while(|&k| self.found[k].hit.t > hit.hit.t).count();
        let place = self.len - behind;
        self.more |= self.len == AT_ONCE;
        if place < AT_ONCE {
            self.len = (self.len + 1).min(AT_ONCE);
            self.found.copy_within(place..self.len - 1, place + 1);
            self.found[place] = hit;
        }
    }
}
