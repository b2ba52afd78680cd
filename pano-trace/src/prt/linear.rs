//! The slow reference: small equal steps along the ray, the field looked up at each.

use super::field::face_from_direction;
use super::{DepthField, FieldHit};
use glam::Vec3;

/// As [`DepthField::march`], by `steps` steps equal in the angle the capture point sees, each crossing refined by
/// bisection. Misses what is thinner than a step, and knows no sides at gaps.
pub fn march_linear(field: &DepthField, origin: Vec3, direction: Vec3, t_max: f32, steps: usize) -> Option<FieldHit> {
    // t(φ) with φ the angle about the capture point, from the foot of the perpendicular.
    let foot = -origin.dot(direction);
    let distance = (origin + direction * foot).length().max(1e-6);
    let angle = |t: f32| ((t - foot) / distance).atan();
    let (begin, end) = (angle(0.0), if t_max.is_finite() { angle(t_max) } else { std::f32::consts::FRAC_PI_2 - 1e-4 });
    let t_at = |k: usize| foot + distance * (begin + (end - begin) * k as f32 / steps as f32).tan();
    // Positive in front of the surface.
    let seen = |t: f32| {
        let p = origin + direction * t;
        let r = p.length();
        (p / r, r)
    };
    let gap = |t: f32| {
        let (d, r) = seen(t);
        1.0 / r - field.inverse_distance(d)
    };
    let (mut t0, mut g0) = (1e-5f32, gap(1e-5));
    for k in 1..=steps {
        let (t1, g1) = (t_at(k).max(t0), gap(t_at(k).max(t0)));
        if (g0 > 0.0) != (g1 > 0.0) {
            let (mut lo, mut hi) = (t0, t1);
            for _ in 0..40 {
                let mid = 0.5 * (lo + hi);
                if (gap(mid) > 0.0) == (g0 > 0.0) { lo = mid } else { hi = mid }
            }
            let t = 0.5 * (lo + hi);
            // A sign change without a zero is a gap the ray passes through, or a crack in one surface.
            let zero = (gap(lo) - gap(hi)).abs() < 1e-3 * (g0.abs() + g1.abs()) + 1e-5;
            if zero || !field.gap_between(seen(lo).0, seen(hi).0) {
                let p = origin + direction * t;
                let (face, at) = face_from_direction(p);
                let (normal, back) = field.side(face, at, direction)?;
                return Some(FieldHit { t, normal, back, at_gap: false, hidden_side: None });
            }
        }
        (t0, g0) = (t1, g1);
    }
    None
}
