//! The pose of a square from the directions of its corners.

use glam::{DMat3, DQuat, DVec3};

/// Where a square lies, seen from the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Turns the marker's frame (+X right, +Y out of the paper, −Z to the top) into the world.
    pub world_from_marker: DQuat,
    /// Its middle, in the units of its size.
    pub position: DVec3,
    /// Root mean square of the angles between the corners' directions and the pose's, radians.
    pub error: f64,
}

/// Steps of the least squares; four or five do.
const STEPS: usize = 30;

/// The pose of a square of side `size` whose top right, bottom right, bottom left and top left corners are seen in these unit
/// directions, and the best other pose, if there is one. `None` if they are the corners of no square in front.
pub fn pose_from_bearings(bearings: [DVec3; 4], size: f64) -> Option<(Pose, Option<Pose>)> {
    let corners = corners(size);
    let first = refined(&bearings, &corners, initial(&bearings, size)?)?;
    // The other pose of a flat thing far away: its normal mirrored about the line of sight.
    let sight = first.position.normalize();
    let normal = first.world_from_marker * DVec3::Y;
    let mirrored = (sight * (2.0 * normal.dot(sight)) - normal).normalize();
    let turned = DQuat::from_rotation_arc(normal, mirrored) * first.world_from_marker;
    let second = refined(&bearings, &corners, Pose { world_from_marker: turned, ..first });
    let second = second.filter(|s| (s.world_from_marker * DVec3::Y).angle_between(normal) > 1f64.to_radians());
    Some(match second {
        Some(second) if second.error < first.error => (second, Some(first)),
        other => (first, other),
    })
}

/// In the marker's frame.
fn corners(size: f64) -> [DVec3; 4] {
    let s = 0.5 * size;
    [DVec3::new(s, 0.0, -s), DVec3::new(s, 0.0, s), DVec3::new(-s, 0.0, s), DVec3::new(-s, 0.0, -s)]
}

/// From the homography between the square and a picture plane across the mean direction.
fn initial(bearings: &[DVec3; 4], size: f64) -> Option<Pose> {
    let axis = bearings.iter().sum::<DVec3>().try_normalize()?;
    let to_view = DQuat::from_rotation_arc(axis, DVec3::Z);
    let s = 0.5 * size;
    let square = [(s, s), (s, -s), (-s, -s), (-s, s)];
    // h₁…h₈ of (h₁x + h₂y + h₃, h₄x + h₅y + h₆) / (h₇x + h₈y + 1).
    let mut rows = [[0.0f64; 9]; 8];
    for (i, (b, (x, y))) in bearings.iter().zip(square).enumerate() {
        let v = to_view * *b;
        if v.z <= 1e-6 {
            return None;
        }
        let (u, w) = (v.x / v.z, v.y / v.z);
        rows[2 * i] = [x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y, u];
        rows[2 * i + 1] = [0.0, 0.0, 0.0, x, y, 1.0, -w * x, -w * y, w];
    }
    let h = solve(rows)?;
    let (right, up, at) = (DVec3::new(h[0], h[3], h[6]), DVec3::new(h[1], h[4], h[7]), DVec3::new(h[2], h[5], 1.0));
    let scale = 2.0 / (right.length() + up.length());
    let (right, up) = (right.try_normalize()?, up.try_normalize()?);
    let normal = right.cross(up).try_normalize()?;
    let up = normal.cross(right);
    // The frame of the marker: right, out of the paper, away from the top.
    let rotation = DQuat::from_mat3(&DMat3::from_cols(right, normal, -up)).normalize();
    let back = to_view.inverse();
    let pose = Pose { world_from_marker: (back * rotation).normalize(), position: back * (at * scale), error: 0.0 };
    (pose.position.is_finite() && pose.world_from_marker.is_finite()).then_some(pose)
}

/// Least squares of the angles.
fn refined(bearings: &[DVec3; 4], corners: &[DVec3; 4], start: Pose) -> Option<Pose> {
    let residuals = |p: &Pose| {
        let off = |(b, c): (&DVec3, &DVec3)| ((p.world_from_marker * *c + p.position).normalize_or_zero() - *b).to_array();
        Some(bearings.iter().zip(corners).flat_map(off).collect::<Vec<f64>>())
    };
    let (mut pose, left) = least_squares(start, [1e-6; 6], residuals)?;
    pose.error = (left / 4.0).sqrt();
    // A marker is seen from its printed side.
    let faces = (pose.world_from_marker * DVec3::Y).dot(pose.position) < 0.0;
    (faces && pose.error.is_finite()).then_some(pose)
}

/// Least squares (Gauss and Newton, with Levenberg's damping): the pose near `start` with the smallest sum of squares of the
/// `residuals`, and that sum. Derivatives are differences over `steps`, of turns about the world's axes in radians, then of
/// the position in units of the distance. `None` if the start has none.
pub(super) fn least_squares(start: Pose, steps: [f64; 6], residuals: impl Fn(&Pose) -> Option<Vec<f64>>) -> Option<(Pose, f64)> {
    let cost = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>();
    // Lengths count in units of the distance, as angles do.
    let scale = start.position.length();
    let moved = |p: &Pose, d: &[f64; 6]| Pose {
        world_from_marker: (DQuat::from_scaled_axis(DVec3::new(d[0], d[1], d[2])) * p.world_from_marker).normalize(),
        position: p.position + DVec3::new(d[3], d[4], d[5]) * scale,
        ..*p
    };
    let (mut pose, mut here, mut damping) = (start, residuals(&start)?, 1e-6);
    for _ in 0..STEPS {
        let mut columns: [Vec<f64>; 6] = Default::default();
        for (k, column) in columns.iter_mut().enumerate() {
            let mut d = [0.0; 6];
            d[k] = steps[k];
            let (more, less) = (residuals(&moved(&pose, &d))?, residuals(&moved(&pose, &d.map(|v| -v)))?);
            *column = more.iter().zip(&less).map(|(m, l)| (m - l) / (2.0 * steps[k])).collect();
        }
        let mut rows = [[0.0f64; 7]; 6];
        for i in 0..6 {
            for j in 0..6 {
                rows[i][j] = columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum();
            }
            rows[i][i] *= 1.0 + damping;
            rows[i][6] = -columns[i].iter().zip(&here).map(|(a, b)| a * b).sum::<f64>();
        }
        let Some(step) = solve(rows) else { break };
        let next = moved(&pose, &step);
        let there = residuals(&next)?;
        if cost(&there) < cost(&here) {
            let done = cost(&here) - cost(&there) < 1e-12 * cost(&here);
            (pose, here, damping) = (next, there, damping * 0.1);
            if done {
                break;
            }
        } else {
            damping *= 10.0;
        }
    }
    Some((pose, cost(&here)))
}

/// Solves N equations, each N coefficients and a right side; `None` if they do not determine it.
pub(super) fn solve<const N: usize, const M: usize>(mut rows: [[f64; M]; N]) -> Option<[f64; N]> {
    for i in 0..N {
        let pivot = (i..N).max_by(|&a, &b| rows[a][i].abs().total_cmp(&rows[b][i].abs()))?;
        rows.swap(i, pivot);
        if rows[i][i].abs() < 1e-300 {
            return None;
        }
        for k in i + 1..N {
            let pivot = rows[i];
            let factor = rows[k][i] / pivot[i];
            rows[k][i..].iter_mut().zip(&pivot[i..]).for_each(|(value, from)| *value -= factor * from);
        }
    }
    let mut x = [0.0; N];
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|j| rows[i][j] * x[j]).sum();
        x[i] = (rows[i][M - 1] - known) / rows[i][i];
    }
    Some(x)
}
