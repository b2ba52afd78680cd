//! Back-face aware tracing (BASSRT; IPRT paper, "Back-Face Aware Screen Space Ray Tracing"): what a ray meets that passes
//! behind the front layer at a depth gap.
//!
//! The hidden back face is assumed to mirror the front: perpendicular to the front layer's tangent at its end g₁, in the
//! plane of ray and eye, and as long. The paper draws that face as a straight line and maps a hit on it back by equal length
//! along the tangent and then along the line of sight. *Departure*: the back face here is the front layer itself turned by
//! a quarter about g₁, which is the same for a flat front and needs no tangent: at the round edge of a cushion the tangent
//! is the line of sight, whatever lies beyond. It is turned about the rim of the front layer, as the gaps around g₁ show it:
//! in the plane of ray and eye alone, faces along oblique rims would lean. The ray meets the face where the ray, turned back,
//! meets the front layer from behind; that point is q. Length needs no rule of its own: past the end of the front layer
//! nothing is met.
//!
//! *Addition*: the layer behind goes on as a plane behind the front one until the ray comes back in sight. Without that a
//! ceiling has a hole behind every lamp. Its colour there is that of g₂.
//!
//! Infinity is no layer: between a window frame and the sky light passes.

use super::{DepthField, FieldHit, HiddenSide};
use glam::{Quat, Vec3};

/// A ray crossing the gap beside a front layer, going behind it. Positions are relative to the capture point e.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// g₁: the end of the front layer, on the line from e to where the ray crosses.
    pub(super) edge: Vec3,
    /// Unit tangent of the front layer's rim at g₁.
    pub(super) rim: Vec3,
    /// The plane of the layer behind at g₂: p with p·x = 1.
    pub(super) back: Vec3,
    /// Direction of a sample of the layer behind, next to g₂.
    pub(super) back_sample: Vec3,
    /// How far along the ray it crosses, metres.
    pub(super) t: f32,
}

impl DepthField {
    /// Where the ray meets the assumed back face; it names the direction of q. `None` where it does not: parallel to
    /// it, diverging from it, past its end, or not nearer than `t_max`.
    pub(super) fn back_face(&self, origin: Vec3, direction: Vec3, entry: &Entry, t_max: f32) -> Option<FieldHit> {
        let outward = entry.edge.normalize();
        let inward = direction - outward * direction.dot(outward);
        // The quarter turn about the rim that takes the back face to the front: outward to inward.
        let turn = Quat::from_axis_angle(entry.rim, std::f32::consts::FRAC_PI_2);
        let turn = if (turn * outward).dot(inward) < 0.0 { turn.inverse() } else { turn };
        let start = entry.edge + turn * (origin + direction * entry.t - entry.edge);
        let turned = turn * direction;
        let hit = self.march_surfaces(start, turned, t_max - entry.t).hit().filter(|hit| hit.back)?;
        let q = (start + turned * hit.t).try_normalize()?;
        let normal = turn.inverse() * self.smooth_normal(q, turned, &hit);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(FieldHit { t: entry.t + hit.t, normal, back: false, at_gap: false, hidden_side: Some(HiddenSide::BackFace(q)) })
    }

    /// Where the ray meets the layer behind, continued as a plane behind the front one.
    pub(super) fn back_layer(&self, origin: Vec3, direction: Vec3, entry: &Entry) -> Option<FieldHit> {
        let approach = entry.back.dot(direction);
        let t = (1.0 - entry.back.dot(origin)) / approach;
        let normal = -entry.back.try_normalize()?;
        (approach > 0.0 && t > entry.t && t.is_finite()).then_some(FieldHit {
            t,
            normal,
            back: false,
            at_gap: false,
            hidden_side: Some(HiddenSide::BackLayer(entry.back_sample)),
        })
    }
}
