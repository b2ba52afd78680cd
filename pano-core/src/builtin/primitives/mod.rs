//! Simple shapes, closed and facing outward unless said otherwise, with smooth normals and texture coordinates.
//!
//! Texture seams and sharp edges have their vertices twice, so a shape is closed by position, not by index. Counts below the
//! least that makes a solid (3 around, 2 along) are raised to it; sizes are positive metres.

use crate::mesh::Mesh;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

#[cfg(test)]
mod tests;

/// Profile edges that meet at more than this stay sharp in [`lathe`]: 35°.
const CREASE_COS: f32 = 0.819;

/// A point of a profile: (distance from the axis, height), outward normal, and v.
struct ProfilePoint {
    at: Vec2,
    normal: Vec2,
    v: f32,
}

/// Turns a profile, given bottom to top for an outside to the right of it, once around the Y axis.
fn revolve(profile: &[ProfilePoint], segments: usize) -> Mesh {
    let segments = segments.max(3);
    let mut mesh = Mesh::default();
    for i in 0..=segments {
        // The last column repeats the first exactly, so that the seam is closed.
        let (sin, cos) = if i == segments { (0.0, 1.0) } else { (TAU * i as f32 / segments as f32).sin_cos() };
        for p in profile {
            mesh.positions.push(Vec3::new(p.at.x * cos, p.at.y, p.at.x * sin));
            mesh.normals.push(Vec3::new(p.normal.x * cos, p.normal.y, p.normal.x * sin).normalize_or(Vec3::Y));
            mesh.uvs.push(Vec2::new(1.0 - i as f32 / segments as f32, p.v));
        }
    }
    let rows = profile.len();
    for i in 0..segments {
        for j in 0..rows - 1 {
            let (low, high) = (profile[j].at, profile[j + 1].at);
            // A crease: the same point twice.
            if low == high {
                continue;
            }
            let [a, b] = [i * rows + j, i * rows + j + 1].map(|v| v as u32);
            let [d, c] = [a, b].map(|v| v + rows as u32);
            if high.x > 0.0 {
                mesh.triangles.push([a, b, c]);
            }
            if low.x > 0.0 {
                mesh.triangles.push([a, c, d]);
            }
        }
    }
    mesh
}

/// A sphere around the origin, of meridians and parallels; v runs from the upper pole (0) to the lower (1).
pub fn uv_sphere(radius: f32, segments: usize, rings: usize) -> Mesh {
    let rings = rings.max(2);
    let profile: Vec<ProfilePoint> = (0..=rings)
        .map(|j| {
            let t = j as f32 / rings as f32;
            let normal = match j {
                0 => Vec2::NEG_Y,
                j if j == rings => Vec2::Y,
                _ => Vec2::from_angle((t - 0.5) * PI),
            };
            ProfilePoint { at: normal * radius, normal, v: 1.0 - t }
        })
        .collect();
    revolve(&profile, segments)
}

/// A sphere around the origin made by splitting the icosahedron's faces in four `subdivisions` times (at most 8):
/// 20 · 4ⁿ nearly equal triangles. Its vertices are shared, so its texture coordinates smear at one meridian.
pub fn icosphere(radius: f32, subdivisions: usize) -> Mesh {
    let g = (1.0 + 5.0f32.sqrt()) / 2.0;
    let mut points: Vec<Vec3> = [(0.0, 1.0, g), (0.0, -1.0, g), (0.0, 1.0, -g), (0.0, -1.0, -g)]
        .iter()
        .flat_map(|&(a, b, c)| [Vec3::new(a, b, c), Vec3::new(b, c, a), Vec3::new(c, a, b)])
        .map(Vec3::normalize)
        .collect();
    // The faces are the triples of neighbours.
    let near = |a: usize, b: usize| points[a].distance(points[b]) < 1.1;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let outward = points[a].dot(points[b].cross(points[c])) > 0.0;
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] }.map(|v| v as u32));
                }
            }
        }
    }
    for _ in 0..subdivisions.min(8) {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh {
        positions: points.iter().map(|p| p * radius).collect(),
        uvs: points
            .iter()
            .map(|p| Vec2::new((1.0 - p.z.atan2(p.x) / TAU).rem_euclid(1.0), p.y.clamp(-1.0, 1.0).acos() / PI))
            .collect(),
        normals: points,
        triangles,
        ..Mesh::default()
    }
}

/// A parallelogram (not closed) with one corner at `corner`, facing `u` × `v`; its texture's left edge runs along `v`, whose
/// end is the texture's top.
pub fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Mesh {
    Mesh {
        positions: vec![corner, corner + u, corner + u + v, corner + v],
        normals: vec![u.cross(v).normalize_or(Vec3::Y); 4],
        uvs: vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A rectangle (not closed) in the XZ plane around the origin, facing +Y; the texture's top lies towards −Z.
pub fn plane(size: Vec2) -> Mesh {
    quad(Vec3::new(-0.5 * size.x, 0.0, 0.5 * size.y), Vec3::X * size.x, Vec3::NEG_Z * size.y)
}

/// A box around the origin, with sharp edges; the texture covers every side once.
pub fn cuboid(size: Vec3) -> Mesh {
    rounded_faces(size, 0.0, 0)
}

/// A box around the origin whose edges are rounded with `radius` (at most half the shortest side) in `steps` ≥ 1 steps per
/// half edge; the texture covers every side once. 12 · (2 · `steps` + 1)² triangles.
pub fn rounded_box(size: Vec3, radius: f32, steps: usize) -> Mesh {
    // Half a side exactly would leave the flat part without width.
    rounded_faces(size, radius.min(0.499 * size.min_element()), steps.max(1))
}

fn rounded_faces(size: Vec3, radius: f32, steps: usize) -> Mesh {
    let half = 0.5 * size;
    let inner = half - radius;
    // Lines of the grid along one axis: the flat part's two ends, and between them and the edge equal angles of the arc,
    // projected from the arc's centre onto the side.
    let line = |i: usize, axis: usize| {
        let arc = |k: usize| match k {
            0 => inner[axis],
            k if k == steps => half[axis],
            k => inner[axis] + radius * (PI / 4.0 * k as f32 / steps as f32).tan(),
        };
        if i <= steps { -arc(steps - i) } else { arc(i - steps - 1) }
    };
    let lines = 2 * steps + 2;
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let first = mesh.positions.len() as u32;
            for j in 0..lines {
                for i in 0..lines {
                    let mut p = Vec3::ZERO;
                    (p[axis], p[a], p[b]) = (sign * half[axis], line(i, a), line(j, b));
                    let core = p.clamp(-inner, inner);
                    let mut normal = Vec3::ZERO;
                    normal[axis] = sign;
                    if radius > 0.0 {
                        normal = (p - core).normalize_or(normal);
                        p = core + normal * radius;
                    }
                    mesh.positions.push(p);
                    mesh.normals.push(normal);
                    mesh.uvs.push(side_uv(axis, sign, p / size + 0.5));
                }
            }
            let n = lines as u32;
            for j in 0..n - 1 {
                for i in 0..n - 1 {
                    let v = first + j * n + i;
                    let [t, s] = [[v, v + 1, v + n + 1], [v, v + n + 1, v + n]];
                    let turn = |[x, y, z]: [u32; 3]| if sign > 0.0 { [x, y, z] } else { [x, z, y] };
                    mesh.triangles.extend([turn(t), turn(s)]);
                }
            }
        }
    }
    mesh
}

/// Texture coordinates on a box's side for `at` in [0, 1]³, upright and unmirrored seen from outside.
fn side_uv(axis: usize, sign: f32, at: Vec3) -> Vec2 {
    let flip = |t: f32, forward: bool| if forward { t } else { 1.0 - t };
    match axis {
        0 => Vec2::new(flip(at.z, sign < 0.0), 1.0 - at.y),
        1 => Vec2::new(at.x, flip(at.z, sign > 0.0)),
        _ => Vec2::new(flip(at.x, sign > 0.0), 1.0 - at.y),
    }
}

/// A cylinder standing on the XZ plane around the Y axis, closed at both ends.
pub fn cylinder(radius: f32, height: f32, segments: usize) -> Mesh {
    lathe(&[Vec2::ZERO, Vec2::new(radius, 0.0), Vec2::new(radius, height), Vec2::new(0.0, height)], segments)
}

/// A ring around the Y axis, centred on the origin: `major` is the radius of the tube's centre line, `minor` the tube's.
pub fn torus(major: f32, minor: f32, segments: usize, sides: usize) -> Mesh {
    let sides = sides.max(3);
    let profile: Vec<ProfilePoint> = (0..=sides)
        .map(|j| {
            let t = j as f32 / sides as f32;
            let normal = Vec2::from_angle(if j == sides { 0.0 } else { t * TAU });
            ProfilePoint { at: Vec2::new(major, 0.0) + normal * minor, normal, v: 1.0 - t }
        })
        .collect();
    revolve(&profile, segments)
}

/// Turns a profile of points (distance from the Y axis ≥ 0, height) around the Y axis. The outside lies to the right of the
/// profile's direction, so an outline runs from its lowest point on the axis upwards. The solid is closed if the profile
/// starts and ends on the axis, or ends where it starts. Bends above 35° stay sharp.
pub fn lathe(profile: &[Vec2], segments: usize) -> Mesh {
    let mut points: Vec<Vec2> = profile.iter().map(|p| p.max(Vec2::new(0.0, f32::NEG_INFINITY))).collect();
    points.dedup();
    if points.len() < 2 {
        return Mesh::default();
    }
    let closed = points[0] == points[points.len() - 1];
    let edges: Vec<Vec2> = points.windows(2).map(|w| (w[1] - w[0]).normalize()).collect();
    let right = |edge: Vec2| Vec2::new(edge.y, -edge.x);
    let total: f32 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
    let mut out = Vec::with_capacity(points.len() * 2);
    let mut length = 0.0;
    for (j, &at) in points.iter().enumerate() {
        if j > 0 {
            length += at.distance(points[j - 1]);
        }
        let v = 1.0 - length / total;
        let before = if j > 0 { Some(edges[j - 1]) } else { edges.last().copied().filter(|_| closed) };
        let after = if j < edges.len() { Some(edges[j]) } else { edges.first().copied().filter(|_| closed) };
        match (before, after) {
            (Some(b), Some(a)) if at.x > 0.0 && b.dot(a) > CREASE_COS => {
                out.push(ProfilePoint { at, normal: right(b + a).normalize(), v });
            }
            _ => {
                let ends = [(j > 0).then_some(before).flatten(), (j < edges.len()).then_some(after).flatten()];
                for edge in ends.into_iter().flatten() {
                    // A smooth cap meets the axis at a right angle.
                    let on_axis = at.x == 0.0 && right(edge).y.abs() > CREASE_COS;
                    let normal = if on_axis { Vec2::new(0.0, right(edge).y.signum()) } else { right(edge) };
                    out.push(ProfilePoint { at, normal, v });
                }
            }
        }
    }
    revolve(&out, segments)
}

/// A tube of radius `minor` along the (p, q) torus knot that winds `p` times around the Y axis and `q` times around the ring
/// of radius `major` and half thickness `0.5 · major`. Centred on the origin; `p` and `q` coprime.
pub fn torus_knot(p: u32, q: u32, major: f32, minor: f32, segments: usize, sides: usize) -> Mesh {
    let (segments, sides) = (segments.max(3), sides.max(3));
    let center = |i: usize| {
        let t = TAU * (i % segments) as f32 / segments as f32;
        let r = major * (1.0 + 0.5 * (q as f32 * t).cos());
        Vec3::new(r * (p as f32 * t).cos(), 0.5 * major * (q as f32 * t).sin(), -r * (p as f32 * t).sin())
    };
    let mut mesh = Mesh::default();
    for column in 0..=segments {
        let i = column % segments;
        let c = center(i);
        let tangent = (center(i + 1) - center(i + segments - 1)).normalize_or(Vec3::X);
        // The frame is fixed by the place (its second axis leans towards the knot's own axis), so it closes up by itself.
        let side = tangent.cross(Vec3::Y).try_normalize().unwrap_or(Vec3::X);
        let up = side.cross(tangent);
        for j in 0..=sides {
            let (sin, cos) = (TAU * (j % sides) as f32 / sides as f32).sin_cos();
            let normal = side * cos + up * sin;
            mesh.positions.push(c + normal * minor);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(column as f32 / segments as f32, j as f32 / sides as f32));
        }
    }
    let n = sides as u32 + 1;
    for i in 0..segments as u32 {
        for j in 0..sides as u32 {
            let v = i * n + j;
            mesh.triangles.extend([[v, v + n, v + n + 1], [v, v + n + 1, v + 1]]);
        }
    }
    mesh
}
