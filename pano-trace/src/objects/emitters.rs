//! Shining faces as lights.

use super::Placed;
use crate::bvh::{InstanceHit, Ray};
use glam::Vec3;
use pano_core::{color, distribution::Distribution1d};

/// A point on a shining face.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// World position.
    pub point: Vec3,
    /// Unit direction towards it.
    pub direction: Vec3,
    /// Distance in metres.
    pub distance: f32,
    /// Density per steradian at the point it is seen from.
    pub pdf_solid_angle: f32,
}

#[derive(Clone, Debug)]
struct Face {
    corner: Vec3,
    edges: [Vec3; 2],
    /// Unit, to the side that shines.
    normal: Vec3,
    area: f32,
}

/// All shining faces, picked in proportion to their power (textures left out of account).
#[derive(Clone, Debug, Default)]
pub(super) struct Emitters {
    faces: Vec<Face>,
    pick: Option<Distribution1d>,
    /// Per instance the index in `faces` of its first shining face and, per face of the mesh, the rank among the shining.
    index: Vec<Option<Vec<u32>>>,
}

const NONE: u32 = u32::MAX;

impl Emitters {
    pub(super) fn new(placed: &[Placed]) -> Self {
        let mut emitters = Self::default();
        let mut weights = Vec::new();
        for p in placed {
            if p.materials.iter().all(|m| m.material.emissive == Vec3::ZERO) {
                emitters.index.push(None);
                continue;
            }
            let ids = (0..p.mesh.mesh.triangles.len() as u32)
                .map(|triangle| {
                    let power = color::luminance(p.materials[p.material_index(triangle)].material.emissive);
                    let [a, b, c] = p.corners(triangle).map(|v| p.world_from_mesh.transform_point3(v));
                    let cross = (b - a).cross(c - a) * p.orientation;
                    let area = 0.5 * cross.length();
                    if power <= 0.0 || area <= 0.0 {
                        return NONE;
                    }
                    emitters.faces.push(Face { corner: a, edges: [b - a, c - a], normal: cross.normalize(), area });
                    weights.push(power * area);
                    emitters.faces.len() as u32 - 1
                })
                .collect();
            emitters.index.push(Some(ids));
        }
        emitters.pick = Distribution1d::new(&weights);
        emitters
    }

    /// Per face of an instance's mesh its rank among the shining; `None` if none shines.
    #[cfg(feature = "gpu")]
    pub(super) fn ranks(&self, instance: usize) -> Option<&[u32]> {
        self.index[instance].as_deref()
    }

    /// Adds cumulative probabilities and faces for shaders: where they begin, and how many faces there are.
    #[cfg(feature = "gpu")]
    pub(super) fn pack(&self, words: &mut pano_core::gpu::Words) -> [u32; 2] {
        let at = words.at();
        let Some(pick) = &self.pick else { return [at, 0] };
        words.numbers(pick.cdf().iter().copied());
        for (i, face) in self.faces.iter().enumerate() {
            for v in [face.corner, face.edges[0], face.edges[1], face.normal] {
                words.vec3(v);
            }
            words.number(face.area);
            words.number(pick.probability(i));
        }
        [at, self.faces.len() as u32]
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.pick.is_none()
    }

    pub(super) fn sample(&self, from: Vec3, u: [f32; 4]) -> Option<EmitterSample> {
        let (i, _) = self.pick.as_ref()?.sample(u[2]);
        let face = &self.faces[i];
        let root = u[0].sqrt();
        let point = face.corner + face.edges[0] * (root * (1.0 - u[1])) + face.edges[1] * (root * u[1]);
        let to = point - from;
        let distance = to.length();
        let direction = to / distance;
        let cos = -face.normal.dot(direction);
        if cos <= 1e-6 || !direction.is_finite() {
            return None;
        }
        let pdf = self.pick.as_ref()?.probability(i) / face.area * distance * distance / cos;
        Some(EmitterSample { point, direction, distance, pdf_solid_angle: pdf })
    }

    pub(super) fn pdf(&self, ray: &Ray, hit: &InstanceHit) -> f32 {
        let (Some(pick), Some(Some(ids))) = (&self.pick, self.index.get(hit.instance as usize)) else { return 0.0 };
        let i = ids[hit.hit.triangle as usize];
        if i == NONE {
            return 0.0;
        }
        let face = &self.faces[i as usize];
        let cos = -face.normal.dot(ray.direction);
        if cos <= 1e-6 {
            return 0.0;
        }
        pick.probability(i as usize) / face.area * hit.hit.t * hit.hit.t / cos
    }
}
