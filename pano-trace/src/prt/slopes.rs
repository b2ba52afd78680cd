//! Which way the captured surface faces, and where its rims run, from the samples around: a single cell of depth says little.

use super::answer::FieldHit;
use super::field::{DepthField, Face, face_axes, face_from_direction};
use glam::{IVec2, Vec2, Vec3};

/// Samples on either side of one that its surface's slope is read from. A step of the panorama's depth spreads over two or
/// three of the steps between the cube's samples, which must be fewer than half.
pub(super) const SLOPE_REACH: usize = 4;

/// Pairs to put in order, one after another, that sort eight numbers (Batcher's odd-even merge sort).
pub(super) const SORTING_NETWORK: [[u32; 2]; 19] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [1, 2],
    [5, 6],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
    [2, 4],
    [3, 5],
    [1, 2],
    [3, 4],
    [5, 6],
];

/// By how much the slopes of neighbouring cells may differ for their surface to count as even: about its angle in radians.
pub(super) const EVEN: f32 = 0.01;

/// Samples on either side of one that tell the direction of a gap: enough to see through the steps of a slanted line.
pub(super) const RIM_REACH: i32 = 8;

impl DepthField {
    /// Unit normal of the surface at `at` in [−1, 1]² of a face as a ray along `direction` meets it, and whether that is its back.
    pub(super) fn side(&self, face: usize, at: Vec2, direction: Vec3) -> Option<(Vec3, bool)> {
        let (_, plane) = self.faces[face].patch(self.n, at);
        let toward = -(face_axes(face) * plane).try_normalize()?;
        let back = toward.dot(direction) > 0.0;
        Some((if back { -toward } else { toward }, back))
    }

    /// Unit normal by the slopes around, which the noise and the steps of depth do not turn, at a hit in direction `at` by a
    /// ray along `direction`; the hit's own where the slopes around would show the ray the other side.
    pub fn smooth_normal(&self, at: Vec3, direction: Vec3, hit: &FieldHit) -> Vec3 {
        let (face, at) = face_from_direction(at);
        let patch = self.faces[face].patch(self.n, at);
        let smooth = (face_axes(face) * self.faces[face].smooth_plane(self.n, at, patch)).try_normalize();
        let toward_ray = smooth.map(|s| if hit.back { s } else { -s }).filter(|s| s.dot(direction) <= 0.0);
        toward_ray.unwrap_or(hit.normal)
    }
}

impl Face {
    /// The plane of the surface about a sample, with the slopes around, as (a, b, c) with inverse depth = a·x + b·y + c for x, y
    /// in [−1, 1].
    pub(super) fn sample_plane(&self, n: usize, i: usize, j: usize) -> Vec3 {
        let per_unit = 0.5 * n as f32;
        let at = Vec2::new(i as f32, j as f32) / per_unit - 1.0;
        let slopes = self.slopes(n, i, j) * per_unit;
        slopes.extend(self.inverse[j * (n + 1) + i] - slopes.dot(at))
    }

    /// Unit direction, in cells, across a gap between a sample on the `front` layer and one `behind`: to where the samples
    /// within [`RIM_REACH`] that are nearer to the front layer lie on the average.
    pub(super) fn toward_front(&self, n: usize, front: (usize, usize), behind: (usize, usize)) -> Vec2 {
        let at = |i: i32, j: i32| self.inverse[j as usize * (n + 1) + i as usize];
        let (front, behind) = (IVec2::new(front.0 as i32, front.1 as i32), IVec2::new(behind.0 as i32, behind.1 as i32));
        let (near, far) = (at(front.x, front.y), at(behind.x, behind.y));
        let inside = |p: IVec2| p.cmpge(IVec2::ZERO).all() && p.cmple(IVec2::splat(n as i32)).all();
        let mut toward = Vec2::ZERO;
        for off in (-RIM_REACH..=RIM_REACH).flat_map(|y| (-RIM_REACH..=RIM_REACH).map(move |x| IVec2::new(x, y))) {
            let p = front + off;
            // A disc about the middle, without what the border of the face takes from the other side of it.
            let from_middle = (p * 2 - front - behind).as_vec2() * 0.5;
            let weight = 1.0 - from_middle.length_squared() / (RIM_REACH * RIM_REACH) as f32;
            if weight > 0.0 && inside(p) && inside(front + behind - p) {
                toward += from_middle * weight * ((2.0 * at(p.x, p.y) - near - far) / (near - far)).clamp(-1.0, 1.0);
            }
        }
        // Layers as crooked as that leave the step between the two samples.
        toward.try_normalize().unwrap_or((front - behind).as_vec2().normalize_or(Vec2::X))
    }

    /// The plane through `at` in [−1, 1]² and the surface there, which [`Self::patch`] has found, with the slopes that it has
    /// around: those of the cell's corners, blended where no gap divides it.
    pub(super) fn smooth_plane(&self, n: usize, at: Vec2, (w, plane): (f32, Vec3)) -> Vec3 {
        let per_unit = 0.5 * n as f32;
        let g = ((at + 1.0) * per_unit).clamp(Vec2::ZERO, Vec2::splat(n as f32));
        let (i, j) = ((g.x as usize).min(n - 1), (g.y as usize).min(n - 1));
        if self.is_even(n, i, j, EVEN * w / per_unit) {
            return plane;
        }
        let f = g - Vec2::new(i as f32, j as f32);
        let slopes = if self.gap[j * n + i] {
            self.slopes(n, i + usize::from(f.x >= 0.5), j + usize::from(f.y >= 0.5))
        } else {
            let row = |j: usize| self.slopes(n, i, j).lerp(self.slopes(n, i + 1, j), f.x);
            row(j).lerp(row(j + 1), f.y)
        } * per_unit;
        slopes.extend(w - slopes.dot(at))
    }

    /// Whether the steps along each axis of a cell and of those before and after it are alike within `tolerance`.
    fn is_even(&self, n: usize, i: usize, j: usize, tolerance: f32) -> bool {
        if i == 0 || j == 0 || i + 2 > n || j + 2 > n {
            return false;
        }
        let even = |start: usize, stride: usize, across: usize| {
            let step = |k: usize| self.inverse[k + stride] - self.inverse[k];
            let middle = step(start);
            [start - stride, start + stride, start + across].into_iter().all(|k| (step(k) - middle).abs() <= tolerance)
        };
        let k = j * (n + 1) + i;
        even(k, 1, n + 1) && even(k, n + 1, 1)
    }

    /// How inverse depth changes per cell at a sample: the medians of the steps within [`SLOPE_REACH`] samples on this side of
    /// any gap. A step too small for a gap, such as a tray on a table, turns no normal.
    fn slopes(&self, n: usize, i: usize, j: usize) -> Vec2 {
        let right = |k: usize| {
            let c = j * (n + 1) + k;
            (!self.gap_right[j * n + k]).then(|| self.inverse[c + 1] - self.inverse[c])
        };
        let below = |k: usize| {
            let c = k * (n + 1) + i;
            (!self.gap_below[c]).then(|| self.inverse[c + n + 1] - self.inverse[c])
        };
        Vec2::new(median_step(i, n, right), median_step(j, n, below))
    }
}

/// Median of the steps around sample `k` of `n` + 1, up to the first gap (`None`) on either side; 0 if there is none.
fn median_step(k: usize, n: usize, step: impl Fn(usize) -> Option<f32>) -> f32 {
    // What is missing is thought half below and half above all.
    let mut steps = [f32::INFINITY; 2 * SLOPE_REACH];
    let mut count = 0;
    // As many on one side as on the other, or curved surfaces would turn at the border.
    let reach = SLOPE_REACH.min(k.min(n - k)).max(1);
    let before = (k.saturating_sub(reach)..k).rev().map_while(&step);
    let after = (k..(k + reach).min(n)).map_while(&step);
    for value in before.chain(after) {
        steps[count] = value;
        count += 1;
    }
    if count == 0 {
        return 0.0;
    }
    let missing = steps.len() - count;
    steps[count..count + missing / 2].fill(f32::NEG_INFINITY);
    for [a, b] in SORTING_NETWORK {
        let (a, b) = (a as usize, b as usize);
        let (x, y) = (steps[a], steps[b]);
        (steps[a], steps[b]) = if y < x { (y, x) } else { (x, y) };
    }
    let middle = steps.len() / 2;
    if count % 2 == 1 { steps[middle - 1] } else { 0.5 * (steps[middle - 1] + steps[middle]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn medians_are_those_of_sorted_steps(steps in prop::collection::vec(prop::option::weighted(0.9, -1.0f32..1.0), 1..20), k in 0usize..20) {
            let n = steps.len();
            let k = k.min(n);
            let reach = SLOPE_REACH.min(k.min(n - k)).max(1);
            let before = steps[..k].iter().rev().take(reach).map_while(|s| *s);
            let after = steps[k..].iter().take(reach).map_while(|s| *s);
            let mut sorted: Vec<f32> = before.chain(after).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            let m = sorted.len();
            let expected = if m == 0 { 0.0 } else { 0.5 * (sorted[(m - 1) / 2] + sorted[m / 2]) };
            prop_assert_eq!(median_step(k, n, |i| steps[i]), expected);
        }
    }
}
