//! Several worlds as one: a panorama, ghosts before it, a depth camera that sees a part of it better.

use super::{Environment, LightSample, RealHit, RealWorld};
use crate::bvh::Ray;
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Worlds of which the nearest surface counts. The first one tells what infinity shows and where light comes from.
#[derive(Clone, Debug)]
pub struct LayeredWorld {
    layers: Vec<Arc<dyn RealWorld + Send>>,
    /// Where the pictures were taken.
    eye: Vec3,
}

/// Bits of [`RealHit::surface`] that are the layer's own; the ones above tell the layer.
const OWN_BITS: u32 = 24;
/// How far above a surface a ray starts, as a share of the distance to the eye: two layers that show the same surface differ by
/// their calibration, and one must not shade the other. What is nearer than this to a real surface casts no shadow on it.
const LEAVE: f32 = 5e-3;

impl LayeredWorld {
    /// `base` first, then what stands in it; seen from `eye`.
    pub fn new(base: Arc<dyn RealWorld + Send>, others: impl IntoIterator<Item = Arc<dyn RealWorld + Send>>, eye: Vec3) -> Self {
        Self { layers: std::iter::once(base).chain(others).collect(), eye }
    }

    fn base(&self) -> &dyn RealWorld {
        self.layers[0].as_ref()
    }

    /// The layer that a hit is on, and the hit as that layer knows it.
    fn layer_of(&self, hit: &RealHit) -> (&dyn RealWorld, RealHit) {
        let layer = &self.layers[(hit.surface >> OWN_BITS) as usize];
        (layer.as_ref(), RealHit { surface: hit.surface & ((1 << OWN_BITS) - 1), ..*hit })
    }
}

impl RealWorld for LayeredWorld {
    fn hit(&self, ray: &Ray) -> Option<RealHit> {
        let mut nearest: Option<RealHit> = None;
        // Ties go to what stands in the base.
        for (i, layer) in self.layers.iter().enumerate().rev() {
            if let Some(hit) = layer.hit(&ray.up_to(nearest.map_or(ray.t_max, |n| n.t))) {
                nearest = Some(RealHit { surface: hit.surface | (i as u32) << OWN_BITS, ..hit });
            }
        }
        nearest
    }

    fn blocks(&self, ray: &Ray) -> bool {
        self.layers.iter().any(|layer| layer.blocks(ray))
    }

    fn shown_surface(&self, hit: RealHit, direction: Vec3, u: f32) -> RealHit {
        let (layer, own) = self.layer_of(&hit);
        let shown = layer.shown_surface(own, direction, u);
        RealHit { surface: shown.surface | hit.surface >> OWN_BITS << OWN_BITS, ..shown }
    }

    fn infinity(&self, direction: Vec3) -> Vec3 {
        self.base().infinity(direction)
    }

    fn reflectance(&self, hit: &RealHit) -> Vec3 {
        let (layer, own) = self.layer_of(hit);
        layer.reflectance(&own)
    }

    fn pictured(&self, hit: &RealHit) -> Option<Vec3> {
        let (layer, own) = self.layer_of(hit);
        layer.pictured(&own)
    }

    fn beyond_diffuse(&self, hit: &RealHit) -> Vec3 {
        let (layer, own) = self.layer_of(hit);
        layer.beyond_diffuse(&own)
    }

    fn sent_back(&self, hit: &RealHit, direction: Vec3) -> Option<Vec3> {
        let (layer, own) = self.layer_of(hit);
        layer.sent_back(&own, direction)
    }

    fn sample_light(&self, from: Vec3, u: Vec2) -> Option<LightSample> {
        self.base().sample_light(from, u)
    }

    fn light_pdf(&self, from: Vec3, direction: Vec3, behind: Option<&RealHit>) -> f32 {
        match behind {
            Some(hit) if hit.surface >> OWN_BITS > 0 => 0.0,
            _ => self.base().light_pdf(from, direction, behind),
        }
    }

    fn reach(&self, ray: &Ray, sample: &LightSample) -> Option<Option<RealHit>> {
        let behind = self.base().reach(ray, sample)?;
        let end = ray.up_to(behind.as_ref().map_or(ray.t_max, |hit| hit.t));
        (!self.layers[1..].iter().any(|layer| layer.blocks(&end))).then_some(behind)
    }

    fn environment(&self) -> Environment<'_> {
        self.base().environment()
    }

    fn sees_itself(&self) -> bool {
        true
    }

    fn leave(&self, hit: &RealHit) -> Vec3 {
        let (layer, own) = self.layer_of(hit);
        layer.leave(&own) + hit.normal * (LEAVE * (hit.position - self.eye).length())
    }
}
