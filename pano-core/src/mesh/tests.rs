//! Operations on meshes.

use super::*;
use glam::{Mat3, Quat};

fn tetrahedron() -> Mesh {
    Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..Mesh::default()
    }
}

fn volume(mesh: &Mesh) -> f32 {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn transforming_keeps_outside_outside_and_normals_perpendicular() {
    let matrices = [
        Mat3::from_diagonal(Vec3::new(2.0, -3.0, 0.5)),
        Mat3::from_diagonal(Vec3::new(-1e-15, 2e-15, 3e-15)),
        Mat3::from_quat(Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.4)) * Mat3::from_diagonal(Vec3::new(1.0, 5.0, 2.0)),
    ];
    for m in matrices {
        let mut mesh = tetrahedron().flat();
        let before = volume(&mesh);
        mesh.transform(&Affine3A::from_mat3_translation(m, Vec3::new(1.0, 2.0, 3.0)));
        mesh.transform(&Affine3A::from_translation(Vec3::new(-1.0, -2.0, -3.0)));
        if m.determinant().abs() > 1.0 {
            assert!((volume(&mesh) / (before * m.determinant().abs()) - 1.0).abs() < 1e-4);
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| m.inverse() * mesh.positions[v as usize]);
            if m.determinant().abs() > 1.0 {
                let geometric = (mesh.positions[t[1] as usize] - mesh.positions[t[0] as usize])
                    .cross(mesh.positions[t[2] as usize] - mesh.positions[t[0] as usize]);
                assert!(geometric.normalize().dot(mesh.normals[t[0] as usize]) > 0.9999, "{a} {b} {c}");
            }
            assert!(mesh.normals[t[0] as usize].is_normalized());
        }
    }
}

#[test]
fn a_singular_transform_gives_finite_unit_normals() {
    let mut mesh = tetrahedron().flat();
    mesh.transform(&Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0)));
    mesh.validate().unwrap();
    assert!(mesh.normals.iter().all(|n| n.is_normalized()));
}

#[test]
fn appending_fills_what_one_side_lacks() {
    let bare = tetrahedron();
    let mut full = tetrahedron().flat();
    full.uvs = vec![Vec2::ONE; full.positions.len()];
    full.materials = vec![Material::default(), Material::diffuse(Vec3::X)];
    full.material_ids = vec![1; 4];
    for (first, second) in
        [(&bare, &full), (&full, &bare), (&full, &full), (&bare, &bare), (&Mesh::default(), &full), (&full, &Mesh::default())]
    {
        let mut mesh = first.clone();
        mesh.append(second);
        if mesh.triangles.len() == 8 {
            assert!((volume(&mesh) - 1.0 / 3.0).abs() < 1e-6);
        }
        mesh.validate().unwrap();
        let color =
            |m: &Mesh, i| m.materials.get(m.material_id(i) as usize).map_or(Material::default().base_color, |m| m.base_color);
        let expected =
            (0..first.triangles.len()).map(|i| color(first, i)).chain((0..second.triangles.len()).map(|i| color(second, i)));
        assert!(expected.eq((0..mesh.triangles.len()).map(|i| color(&mesh, i))));
    }
}

#[test]
fn flat_normals_are_the_faces_own() {
    let flat = tetrahedron().flat();
    flat.validate().unwrap();
    assert_eq!(flat.positions.len(), 12);
    assert_eq!(flat.normals[0], Vec3::NEG_Z);
    assert!(flat.normals[11].distance(Vec3::ONE.normalize()) < 1e-6);
}
