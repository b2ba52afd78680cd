//! The room is a valid, closed, plausible scene with clear space for its objects.

use super::*;
use crate::camera::{Camera, Projection, rotation_from_yaw_pitch};
use crate::color::luminance;
use crate::material::Texture;
use glam::Affine3A;
use std::sync::LazyLock;

static ROOM: LazyLock<Room> = LazyLock::new(Room::new);

fn placed(object: &RoomObject) -> Mesh {
    let mut mesh = object.mesh.clone();
    mesh.transform(&(Affine3A::from_translation(object.position) * Affine3A::from_rotation_y(object.yaw.to_radians())));
    mesh
}

fn overlap(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> bool {
    a.0.cmplt(b.1).all() && b.0.cmplt(a.1).all()
}

fn bounds_of(mesh: &Mesh, triangle: usize) -> (Vec3, Vec3) {
    let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.positions[v as usize]);
    (a.min(b).min(c), a.max(b).max(c))
}

/// Nearest hit by trying every triangle: distance and index.
fn trace(mesh: &Mesh, origin: Vec3, direction: Vec3) -> Option<(f32, usize)> {
    let hit = |i: usize| {
        let [a, b, c] = mesh.triangles[i].map(|v| mesh.positions[v as usize]);
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let det = e1.dot(p);
        let s = origin - a;
        let q = s.cross(e1);
        let (u, v, t) = (s.dot(p) / det, direction.dot(q) / det, e2.dot(q) / det);
        (u >= -1e-6 && v >= -1e-6 && u + v <= 1.000001 && t > 1e-4).then_some((t, i))
    };
    (0..mesh.triangles.len()).filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))
}

#[test]
fn the_mesh_is_valid_small_and_shaded_the_right_way_round() {
    let mesh = &ROOM.mesh;
    mesh.validate().unwrap();
    assert!(mesh.triangles.len() < 60_000, "{}", mesh.triangles.len());
    assert_eq!((mesh.normals.len(), mesh.uvs.len()), (mesh.positions.len(), mesh.positions.len()));
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize();
        assert!(normal.is_finite() && t.iter().all(|&v| mesh.normals[v as usize].dot(normal) > 0.0), "{a} {b} {c}");
    }
}

#[test]
fn every_direction_ends_on_the_front_of_something_not_too_near() {
    // A spiral over the sphere.
    for i in 0..1500 {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / 1500.0;
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let direction = Vec3::new(cos, 0.0, sin) * (1.0 - y * y).sqrt() + Vec3::Y * y;
        let (distance, i) = trace(&ROOM.mesh, ROOM.capture_position, direction).expect("a leak");
        let [a, b, c] = ROOM.mesh.triangles[i].map(|v| ROOM.mesh.positions[v as usize]);
        assert!((b - a).cross(c - a).dot(direction) < 0.0, "the back of {a} {b} {c}");
        assert!((0.3..6.0).contains(&distance), "{distance}");
    }
}

#[test]
fn colours_are_those_of_real_surfaces() {
    let texture_range = |t: &Texture| {
        t.image().data().iter().fold((1.0f32, 0.0f32), |(l, h), p| (l.min(p.min_element()), h.max(p.max_element())))
    };
    for (i, m) in ROOM.mesh.materials.iter().enumerate() {
        assert!(m.base_color.min_element() >= 0.0 && m.base_color.max_element() <= 1.0, "{i}");
        match &m.base_color_texture {
            Some(t) => {
                assert!(t.image().data().iter().all(|p| p.truncate().max_element() <= 0.85), "{i}");
                let (low, high) = texture_range(t);
                assert!(low >= 0.0 && high <= 1.0, "{i}: {low} {high}");
            }
            None if m.metallic == 0.0 => assert!(m.base_color.max_element() <= 0.85, "{i}: {}", m.base_color),
            None => {}
        }
    }
}

#[test]
fn lights_are_few_and_the_window_gives_about_half() {
    let mesh = &ROOM.mesh;
    let (mut count, mut window, mut lamps) = (0, 0.0, 0.0);
    for (i, t) in mesh.triangles.iter().enumerate() {
        let id = mesh.material_id(i);
        let power = luminance(mesh.materials[id as usize].emissive);
        if power > 0.0 {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            count += 1;
            *if ROOM.window_materials.contains(&id) { &mut window } else { &mut lamps } +=
                power * (b - a).cross(c - a).length() / 2.0;
        }
    }
    assert!(count <= 220, "{count}");
    let share = window / (window + lamps);
    assert!((0.45..0.65).contains(&share), "{share} before the window's bars take their part");
    for &id in &ROOM.window_materials {
        // A window that reflects would differ from the sky.
        let m = &mesh.materials[id as usize];
        assert!(m.base_color == Vec3::ZERO && m.specular == 0.0 && m.emissive_texture.is_none());
    }
}

#[test]
fn objects_stand_free_on_the_table() {
    let all: Vec<Mesh> = ROOM.objects.iter().map(placed).collect();
    assert_eq!(all.len(), 4);
    for (object, mesh) in ROOM.objects.iter().zip(&all) {
        object.mesh.validate().unwrap();
        let (low, high) = mesh.bounds().unwrap();
        assert_eq!(object.mesh.bounds().unwrap().0.y, 0.0, "{}", object.name);
        assert_eq!(object.position.y, TABLE_TOP);
        let size = (high - low).max_element();
        assert!((0.1..=0.2).contains(&size), "{}: {size} m", object.name);
        let edge = 0.5 * Vec3::new(TABLE_SIZE.x, 0.0, TABLE_SIZE.y)
            - Vec3::new(low.x, 0.0, low.z).abs().max(Vec3::new(high.x, 0.0, high.z).abs());
        assert!(edge.x > 0.02 && edge.z > 0.02, "{} hangs over the edge", object.name);
        let air = (low - Vec3::new(0.02, -1e-4, 0.02), high + 0.02);
        for i in 0..ROOM.mesh.triangles.len() {
            assert!(!overlap(air, bounds_of(&ROOM.mesh, i)), "{} touches {:?}", object.name, bounds_of(&ROOM.mesh, i));
        }
    }
    for i in 0..4 {
        for j in 0..i {
            assert!(!overlap(all[i].bounds().unwrap(), all[j].bounds().unwrap()), "{i} {j}");
        }
    }
    // The table is where the objects think it is.
    let (distance, _) = trace(&ROOM.mesh, Vec3::new(0.2, 1.0, 0.2), Vec3::NEG_Y).unwrap();
    assert!((1.0 - distance - TABLE_TOP).abs() < 1e-5);
}

#[test]
fn the_view_shows_every_object_unhidden() {
    let camera = Camera {
        position: ROOM.capture_position,
        world_from_camera: rotation_from_yaw_pitch(ROOM.view_yaw, ROOM.view_pitch),
        projection: Projection::Perspective { vfov: ROOM.view_vfov.to_radians() },
        width: 64,
        height: 64,
    };
    let middle = Vec3::Y * TABLE_TOP;
    assert!((ROOM.capture_position.distance(middle) - 1.5).abs() < 0.05, "{}", ROOM.capture_position.distance(middle));
    for object in &ROOM.objects {
        let (low, high) = placed(object).bounds().unwrap();
        let to = 0.5 * (low + high) - ROOM.capture_position;
        let pixel = camera.pixel(to).unwrap();
        assert!(pixel.min_element() > 4.0 && pixel.max_element() < 60.0, "{}: {pixel}", object.name);
        assert!(trace(&ROOM.mesh, ROOM.capture_position, to).unwrap().0 > 1.0, "{} is hidden", object.name);
    }
}

#[test]
fn the_room_is_the_same_every_time() {
    let again = Room::new();
    assert_eq!((&again.mesh.positions, &again.mesh.triangles), (&ROOM.mesh.positions, &ROOM.mesh.triangles));
    let textures = |r: &Room| {
        r.mesh.materials.iter().filter_map(|m| m.base_color_texture.clone()).map(|t| t.image().clone()).collect::<Vec<_>>()
    };
    assert_eq!(textures(&again), textures(&ROOM));
}
