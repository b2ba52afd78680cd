//! What is assumed behind the captured surface.

use super::tests::{ball, room, span, with_back_faces};
use super::*;
use glam::{Quat, Vec3};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// The direction of the point that a hit on a back face is made of.
fn back_face(hit: FieldHit) -> Vec3 {
    match hit.hidden_side {
        Some(HiddenSide::BackFace(q)) => q,
        other => panic!("no back face: {other:?}"),
    }
}

/// A box turned about the vertical: the faces behind its slanted rims stand upright along them, and do not lean with the ray.
#[test]
fn faces_along_slanted_rims_stand_upright() {
    let turn = Quat::from_rotation_y(0.6);
    // Seen from 1 m above its top of 0.8 × 0.8 m.
    let top = |d: Vec3| {
        let at = turn.inverse() * (d / -d.y);
        if d.y < 0.0 && at.x.abs() < 0.4 && at.z.abs() < 0.4 {
            (d / d.y).length()
        } else {
            ball(Vec3::ZERO, 3.0, Vec3::ZERO, d).0
        }
    };
    let field = with_back_faces(1024, 512, true, top);
    let mut met = 0;
    for k in 0..40 {
        let (along, height) = (0.5 * (k as f32 / 20.0 - 1.0), -1.15);
        // Towards the face at +x of the box, from aside.
        let (o, d) = (turn * Vec3::new(1.2, height, along + 0.4), turn * Vec3::new(-1.0, 0.0, -0.5).normalize());
        if let Answer::BackFace(hit) = field.march(o, d, f32::INFINITY)
            && matches!(hit.hidden_side, Some(HiddenSide::BackFace(_)))
        {
            let at = turn.inverse() * (o + d * hit.t);
            // At its corners the rim turns.
            if at.z.abs() > 0.3 {
                continue;
            }
            assert!((at.x - 0.4).abs() < 0.02, "{at}");
            assert!((turn.inverse() * hit.normal).x > 0.99, "{hit:?}");
            met += 1;
        }
    }
    assert!(met > 15, "{met}");
}

/// The camera hangs 1 m above a table top of 0.8 × 0.8 m, the floor 1 m farther below. A ray that passes under the top's edge
/// meets the face that the box has there, perpendicular to the top, and takes the colour as far from the edge on top as it
/// has met the face below the edge.
#[test]
fn back_faces_mirror_the_front() {
    let table = |d: Vec3| {
        let at = d / -d.y;
        if d.y < 0.0 && at.x.abs() < 0.4 && at.z.abs() < 0.4 { at.length() } else { walls_below(d) }
    };
    // A floor 2 m below, in a room of 6 × 6 m.
    fn walls_below(d: Vec3) -> f32 {
        span([Vec3::new(-3.0, -2.0, -3.0), Vec3::new(3.0, 1.0, 3.0)], Vec3::ZERO, d).expect("inside").1
    }
    let field = with_back_faces(1024, 512, true, table);
    let mut met = 0;
    for (height, z) in [(-1.1, 0.0), (-1.2, 0.1), (-1.35, -0.2), (-1.3, 0.3)] {
        for side in [-1.0, 1.0] {
            let hit = field.march(Vec3::new(1.2 * side, height, z), Vec3::NEG_X * side, f32::INFINITY);
            let Answer::BackFace(face) = hit else { panic!("{height} {z}: {hit:?}") };
            // The plane of ray and eye meets the edge at the same share of its height as the ray's point above the face.
            assert!((face.t - 0.8).abs() < 0.03, "{height} {z}: {face:?}");
            assert!(face.normal.x * side > 0.95, "{face:?}");
            let q = back_face(face);
            let on_top = q / -q.y;
            let depth = 0.4 - on_top.x * side;
            assert!((depth - (-1.0 - height)).abs() < 0.05, "{height} {z}: {on_top}");
            met += 1;
        }
    }
    assert_eq!(met, 8);
    // Deeper below the edge than the top is long there is no face: the floor goes on under the table, and is met first anyway.
    let floor = field.march(Vec3::new(1.2, -1.9, 0.0), Vec3::new(-1.0, -0.1, 0.0).normalize(), f32::INFINITY);
    assert!(floor.hit().is_some_and(|hit| hit.normal.y > 0.99), "{floor:?}");
    // Without back faces the ray passes under the table and meets the opposite wall.
    let open = with_back_faces(1024, 512, false, table).march(Vec3::new(1.2, -1.2, 0.1), Vec3::NEG_X, f32::INFINITY);
    let Answer::Surface(wall) = open else { panic!("{open:?}") };
    assert!((wall.t - 4.2).abs() < 1e-2, "{wall:?}");
}

/// Rays parallel to the face, and rays that run away from it, go on.
#[test]
fn rays_that_do_not_meet_the_back_face_go_on() {
    let plate = |d: Vec3| {
        let at = d / -d.z;
        if d.z < 0.0 && at.x.abs() < 0.4 && at.y.abs() < 0.4 { at.length() } else { room(d) }
    };
    let field = with_back_faces(1024, 512, true, plate);
    // The face behind the rim at x = −0.4 is the half plane x = −0.4, z < −1 (seen from the eye at the origin).
    for (what, direction) in [("parallel", Vec3::NEG_Z), ("diverging", Vec3::new(-0.05, 0.0, -1.0).normalize())] {
        // From between the line of sight and the face, in front of the plate's plane to begin with.
        let origin = Vec3::new(-0.43, 0.02, -0.9);
        let answer = field.march(origin, direction, f32::INFINITY);
        let hit = answer.hit().unwrap_or_else(|| panic!("{what}: {answer:?}"));
        assert!((origin + direction * hit.t).z < -2.9, "{what}: {answer:?}");
    }
}

/// The whole scene turned so that a gap lies at the seam, at a pole, or on an edge of the cube gives the same answers.
#[test]
fn back_faces_know_no_seam_and_no_pole() {
    let block = |d: Vec3| span([Vec3::new(-0.4, -0.4, -1.8), Vec3::new(0.4, 0.4, -1.0)], Vec3::ZERO, d);
    let wall = |d: Vec3| ball(Vec3::ZERO, 4.0, Vec3::ZERO, d).0;
    let turned = |turn: Quat| {
        let back = turn.inverse();
        with_back_faces(1024, 512, true, move |d| block(back * d).filter(|s| s.0 > 0.0).map_or(wall(d), |s| s.0))
    };
    let plain = turned(Quat::IDENTITY);
    for turn in [
        Quat::from_rotation_y(std::f32::consts::PI),
        Quat::from_rotation_y(std::f32::consts::PI - 0.38),
        Quat::from_rotation_x(FRAC_PI_2),
        Quat::from_rotation_x(FRAC_PI_2 - 0.38),
        Quat::from_rotation_x(-FRAC_PI_2),
        Quat::from_rotation_y(FRAC_PI_4),
    ] {
        let field = turned(turn);
        for k in 0..20 {
            let height = 0.3 * (k as f32 / 10.0 - 1.0);
            let (o, d) = (Vec3::new(-1.5, height, -1.3), Vec3::new(1.0, 0.1 * height, -0.05).normalize());
            let (a, b) = (plain.march(o, d, f32::INFINITY), field.march(turn * o, turn * d, f32::INFINITY));
            let (Answer::BackFace(a), Answer::BackFace(b)) = (a, b) else { panic!("{turn}: {a:?} {b:?}") };
            assert!((a.t - b.t).abs() < 0.05, "{turn}: {a:?} {b:?}");
            assert!((turn * back_face(a)).distance(back_face(b)) < 0.05, "{turn}: {a:?} {b:?}");
        }
    }
}

/// What lies behind a front layer goes on there: a ceiling behind a lamp has no hole.
#[test]
fn the_layer_behind_goes_on_behind_the_front() {
    let lamp = |d: Vec3| {
        let near = ball(Vec3::new(0.0, 1.0, -1.0), 0.25, Vec3::ZERO, d);
        let to = -Vec3::new(0.0, 1.0, -1.0);
        let disc = to.dot(d).powi(2) - to.length_squared() + 0.25f32.powi(2);
        if disc > 0.0 && near.0 > 0.0 {
            near.0 - 2.0 * disc.sqrt()
        } else {
            span([Vec3::splat(-4.0), Vec3::new(4.0, 2.0, 4.0)], Vec3::ZERO, d).unwrap().1
        }
    };
    let field = with_back_faces(1024, 512, true, lamp);
    // From under the lamp past it into the part of the ceiling that it hides: (0, 2, −2).
    let o = Vec3::new(0.0, -0.5, -1.6);
    let d = (Vec3::new(0.05, 2.0, -2.0) - o).normalize();
    let Answer::BackFace(hit) = field.march(o, d, f32::INFINITY) else { panic!("{:?}", field.march(o, d, f32::INFINITY)) };
    assert!(((o + d * hit.t).y - 2.0).abs() < 0.02 && hit.normal.y < -0.99, "{hit:?}");
}
