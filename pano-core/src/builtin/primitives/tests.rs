//! Every shape is closed, of the right topology, faces outward and has the volume of its formula.

use super::*;
use std::collections::HashMap;

/// (vertices − edges + faces by position, signed volume), after checking that every edge has two faces, one each way.
fn topology(name: &str, mesh: &Mesh) -> (i64, f32) {
    mesh.validate().unwrap();
    let mut ids = HashMap::new();
    let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
    let mut volume = 0.0;
    for t in &mesh.triangles {
        let p = t.map(|v| mesh.positions[v as usize]);
        let v = p.map(|p| {
            let n = ids.len();
            // −0 and 0 are the same place.
            *ids.entry((p + 0.0).to_array().map(|x| (x * 1e5).round() as i64)).or_insert(n)
        });
        for k in 0..3 {
            assert_ne!(v[k], v[(k + 1) % 3], "{name}: a face without area");
            *edges.entry((v[k], v[(k + 1) % 3])).or_default() += 1;
        }
        volume += p[0].dot(p[1].cross(p[2])) / 6.0;
        let geometric = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
        for v in t {
            let n = mesh.normals[*v as usize];
            assert!((n.length() - 1.0).abs() < 1e-4 && n.dot(geometric) > 0.3, "{name}: normal {n} on a face {geometric}");
        }
    }
    for (&(a, b), &count) in &edges {
        assert!(count == 1 && edges.get(&(b, a)) == Some(&1), "{name}: an open or doubled edge");
    }
    (ids.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64, volume)
}

#[test]
fn shapes_are_closed_outward_and_of_the_right_volume() {
    let vase = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.4, 1.0), (0.4, 0.1), (0.0, 0.1)].map(|(r, y)| Vec2::new(r, y));
    let square = [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|(r, y)| Vec2::new(r, y));
    let r = 0.1;
    // Box, plus slabs on its sides, quarter cylinders on its edges, eighths of a sphere on its corners.
    let rounded = 0.8 * 1.8 * 2.8
        + 2.0 * r * (0.8 * 1.8 + 1.8 * 2.8 + 0.8 * 2.8)
        + PI * r * r * (0.8 + 1.8 + 2.8)
        + 4.0 / 3.0 * PI * r * r * r;
    let knot_length = (0..4096)
        .map(|i| {
            let at = |i: usize| {
                let t = TAU * i as f32 / 4096.0;
                let r = 1.0 + 0.5 * (3.0 * t).cos();
                Vec3::new(r * (2.0 * t).cos(), 0.5 * (3.0 * t).sin(), -r * (2.0 * t).sin())
            };
            at(i).distance(at(i + 1))
        })
        .sum::<f32>();
    for (name, mesh, euler, volume, tolerance) in [
        ("uv sphere", uv_sphere(1.5, 64, 32), 2, 4.0 / 3.0 * PI * 3.375, 0.01),
        ("icosphere", icosphere(0.5, 4), 2, PI / 6.0, 0.01),
        ("cuboid", cuboid(Vec3::new(1.0, 2.0, 3.0)), 2, 6.0, 1e-5),
        ("rounded box", rounded_box(Vec3::new(1.0, 2.0, 3.0), r, 4), 2, rounded, 1e-3),
        ("cylinder", cylinder(0.5, 2.0, 64), 2, 0.5 * PI, 0.01),
        ("torus", torus(1.0, 0.25, 64, 32), 0, 2.0 * PI * PI / 16.0, 0.02),
        ("vase", lathe(&vase, 96), 2, PI * (0.25 - 0.16 * 0.9), 0.01),
        ("square ring", lathe(&square, 96), 0, 3.0 * PI, 0.01),
        ("torus knot", torus_knot(2, 3, 1.0, 0.1, 400, 24), 0, PI * 0.01 * knot_length, 0.03),
    ] {
        let (characteristic, v) = topology(name, &mesh);
        assert_eq!(characteristic, euler, "{name}");
        assert!((v / volume - 1.0).abs() < tolerance, "{name}: {v} for {volume}");
        assert!(mesh.uvs.iter().all(|t| t.min_element() >= -1e-4 && t.max_element() <= 1.0001), "{name}");
    }
}

#[test]
fn counts_and_radii_too_small_still_make_a_solid() {
    for (name, mesh) in [
        ("sphere", uv_sphere(1.0, 0, 0)),
        ("torus", torus(1.0, 0.2, 0, 0)),
        ("cylinder", cylinder(1.0, 1.0, 0)),
        ("box", rounded_box(Vec3::ONE, 9.0, 0)),
    ] {
        let (mut mesh, name) = (mesh, name);
        // So coarse that smooth normals lean far off their faces: only closedness is asked.
        mesh.normals = mesh.flat().normals;
        mesh.positions = mesh.flat().positions;
        mesh.uvs = mesh.flat().uvs;
        mesh.triangles = (0..mesh.positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        assert!(topology(name, &mesh).1 > 0.0);
    }
    assert!(lathe(&[Vec2::ONE], 8).triangles.is_empty());
}

#[test]
fn planes_face_up_with_the_texture_upright() {
    let mesh = plane(Vec2::new(2.0, 4.0));
    assert_eq!(mesh.flat().normals, [Vec3::Y; 6]);
    let top_left = mesh.uvs.iter().position(|t| *t == Vec2::ZERO).unwrap();
    assert_eq!(mesh.positions[top_left], Vec3::new(-1.0, 0.0, -2.0));
}

#[test]
fn box_textures_are_upright_and_unmirrored_on_every_side() {
    let mesh = cuboid(Vec3::ONE);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.uvs[v as usize]);
        // With v down, counter-clockwise in space is clockwise in (u, v).
        assert!((b - a).perp_dot(c - a) < 0.0);
    }
}

#[test]
fn icosphere_uvs_follow_the_uv_spheres() {
    let sphere = uv_sphere(1.0, 64, 32);
    for (p, t) in icosphere(1.0, 2).positions.iter().zip(&icosphere(1.0, 2).uvs) {
        let i = (0..sphere.positions.len())
            .min_by(|&a, &b| sphere.positions[a].distance(*p).total_cmp(&sphere.positions[b].distance(*p)))
            .unwrap();
        let du = (sphere.uvs[i].x - t.x).abs();
        // At the poles u says nothing, and at the seam 0 is 1.
        assert!(p.y.abs() > 0.95 || du.min(1.0 - du) < 0.05, "{p}: {t} {}", sphere.uvs[i]);
        assert!((sphere.uvs[i].y - t.y).abs() < 0.05);
    }
}
