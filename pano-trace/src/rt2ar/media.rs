//! The bodies that a ray is in.

use crate::bsdf::dielectric;
use crate::objects::{Absorption, Body};
use glam::Vec3;

/// A body that a ray has entered.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Medium {
    instance: u32,
    ior: f32,
    absorption: Absorption,
}

/// Bodies within bodies that are told apart; what is entered beyond is passed as if it were its surroundings.
pub(super) const MAX_NESTED: usize = 8;

/// The stack of bodies that a ray is in, the one entered last on top: that one's index and absorption count. Where bodies
/// overlap, the one entered last wins until it is left; leaving one below the top changes nothing on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Media {
    inside: [Medium; MAX_NESTED],
    len: usize,
}

impl Default for Media {
    /// Air.
    fn default() -> Self {
        Self { inside: [Medium { instance: 0, ior: 1.0, absorption: Absorption::NONE }; MAX_NESTED], len: 0 }
    }
}

impl Media {
    /// The refractive index here.
    pub(super) fn ior(&self) -> f32 {
        self.top().map_or(1.0, |medium| medium.ior)
    }

    /// What is left of light after `t` metres here.
    pub(super) fn transmittance(&self, t: f32) -> Vec3 {
        self.top().map_or(Vec3::ONE, |medium| medium.absorption.transmittance(t))
    }

    /// The media beyond the surface of a body's `instance`, met from its `outside` or from within, and the index there over the
    /// index here.
    pub(super) fn beyond(&self, instance: u32, body: &Body, outside: bool) -> (Self, f32) {
        let mut beyond = *self;
        let here = if outside {
            let here = self.ior();
            if self.len == MAX_NESTED {
                return (beyond, 1.0);
            }
            beyond.inside[self.len] = Medium { instance, ior: body.ior, absorption: body.absorption };
            beyond.len += 1;
            here
        } else {
            match self.inside[..self.len].iter().rposition(|medium| medium.instance == instance) {
                Some(i) => {
                    beyond.inside.copy_within(i + 1..self.len, i);
                    beyond.len -= 1;
                    self.ior()
                }
                // The ray began in it.
                None => body.ior,
            }
        };
        (beyond, beyond.ior() / here)
    }

    fn top(&self) -> Option<&Medium> {
        self.inside[..self.len].last()
    }
}

/// The direction of unit `direction` refracted at a surface with unit `normal` towards where it came from; `eta` is the index
/// behind the surface over the one in front. `None` under total internal reflection. With an index of 1 the direction is
/// returned as it is, to the bit.
pub(super) fn refracted(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    if eta == 1.0 {
        return Some(direction);
    }
    let cos = -direction.dot(normal);
    let sin2 = (1.0 - cos * cos).max(0.0) / (eta * eta);
    (sin2 < 1.0).then(|| (direction / eta + normal * (cos / eta - (1.0 - sin2).sqrt())).normalize())
}

/// Share of the light that a clear surface reflects at this cosine; of a sheet both faces together, with all reflections
/// between them.
pub(super) fn reflectance(body: &Body, cos: f32, eta: f32) -> f32 {
    if body.thin {
        let face = dielectric(cos, body.ior);
        return 2.0 * face / (1.0 + face);
    }
    if eta == 1.0 { 0.0 } else { dielectric(cos, eta) }
}
