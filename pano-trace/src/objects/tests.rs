use super::*;
use glam::Quat;
use pano_core::random::{Sampler, Stream};

/// A unit square in the XZ plane, facing +Y, with uv.
fn square(material: Material) -> Arc<PreparedMesh> {
    let mesh = Mesh {
        positions: vec![
            Vec3::new(-0.5, 0.0, -0.5),
            Vec3::new(0.5, 0.0, -0.5),
            Vec3::new(0.5, 0.0, 0.5),
            Vec3::new(-0.5, 0.0, 0.5),
        ],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        materials: vec![material],
        ..Mesh::default()
    };
    Arc::new(PreparedMesh::new(mesh).unwrap())
}

#[test]
fn placements_scale_turn_and_mirror_normals() {
    let mesh = square(Material::diffuse(Vec3::ONE));
    for (scale, down) in [(Vec3::splat(2.0), false), (Vec3::new(-1.0, 1.0, 1.0), false), (Vec3::new(1.0, -1.0, 1.0), true)] {
        let world_from_mesh = Affine3A::from_scale_rotation_translation(scale, Quat::IDENTITY, Vec3::Y);
        let objects = Objects::new(&[Placement { mesh: mesh.clone(), world_from_mesh, material: None }]);
        let ray = Ray::new(Vec3::new(0.1, 3.0, 0.2), Vec3::NEG_Y);
        let hit = objects.intersect(&ray).unwrap();
        let s = objects.surface(&ray, &hit);
        assert!((hit.hit.t - 2.0).abs() < 1e-5 && s.position.distance(Vec3::new(0.1, 1.0, 0.2)) < 1e-5);
        // Opaque surfaces turn towards the viewer; emission tells the true side.
        assert!(s.bsdf.normal().y > 0.99, "{scale}");
        let lamp =
            Objects::new(&[Placement { mesh: mesh.clone(), world_from_mesh, material: Some(Material::emitter(Vec3::ONE)) }]);
        let lit = lamp.surface(&ray, &hit).emission;
        assert_eq!(lit == Vec3::ZERO, down, "{scale}");
    }
}

/// ∫ over the hemisphere of a lamp's solid angle: E[1/pdf] over samples is the solid angle, and both densities agree.
#[test]
fn emitter_samples_measure_the_solid_angle() {
    let mesh = square(Material::emitter(Vec3::ONE));
    let place = Affine3A::from_rotation_translation(Quat::from_rotation_x(std::f32::consts::PI), Vec3::Y);
    let objects = Objects::new(&[Placement { mesh, world_from_mesh: place, material: None }]);
    assert!(objects.emit());
    let n = 4096;
    let mut sum = 0.0;
    for i in 0..n {
        let u = Sampler::new(glam::UVec2::ZERO, i, Stream::default()).next_4d();
        let s = objects.sample_emitter(Vec3::ZERO, u).unwrap();
        sum += 1.0 / f64::from(s.pdf_solid_angle);
        let ray = Ray::new(Vec3::ZERO, s.direction);
        let pdf = objects.emitter_pdf(&ray, &objects.intersect(&ray).unwrap());
        assert!((pdf / s.pdf_solid_angle - 1.0).abs() < 1e-3, "{pdf} {s:?}");
    }
    // A square of side 1 seen from 1 below its middle: 4 asin(¼/1.25).
    let exact = 4.0 * (0.25f64 / 1.25).asin();
    assert!((sum / f64::from(n) / exact - 1.0).abs() < 2e-3, "{} {exact}", sum / f64::from(n));
}

#[test]
fn balls_hold_their_objects() {
    let mesh = square(Material::default());
    let place =
        Affine3A::from_scale_rotation_translation(Vec3::new(1.0, 2.0, 3.0), Quat::from_rotation_y(0.5), Vec3::new(4.0, 5.0, 6.0));
    let objects = Objects::new(&[Placement { mesh: mesh.clone(), world_from_mesh: place, material: None }]);
    let ball = objects.balls()[0];
    assert!(mesh.mesh().positions.iter().all(|&p| place.transform_point3(p).distance(ball.center) <= ball.radius));
    assert!(ball.center.distance(Vec3::new(4.0, 5.0, 6.0)) < 1e-5);
}

#[test]
fn bodies_absorb_by_beers_law() {
    let glass = Material { attenuation_color: Vec3::new(1.0, 0.25, 0.0), attenuation_distance: 2.0, ..Material::glass(1.5, 0.0) };
    let objects = Objects::new(&[Placement { mesh: square(glass), world_from_mesh: Affine3A::IDENTITY, material: None }]);
    let ray = Ray::new(Vec3::new(0.0, -1.0, 0.0), Vec3::Y);
    let s = objects.surface(&ray, &objects.intersect(&ray).unwrap());
    assert!(s.transmittance.distance(Vec3::new(1.0, 0.5, 0.0)) < 1e-6);
}
