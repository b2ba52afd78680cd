use super::*;
use glam::{Quat, Vec2, Vec3};
use pano_core::image::Image;
use pano_core::sphere;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng, rngs::StdRng};
use std::f32::consts::TAU;

const WIDTH: usize = 512;
const LO: Vec3 = Vec3::new(-2.0, -1.5, -3.0);
const HI: Vec3 = Vec3::new(2.5, 1.2, 2.0);
/// A table's block, in front and to the left.
const TABLE: [Vec3; 2] = [Vec3::new(-1.3, -1.5, -1.9), Vec3::new(-0.2, -0.7, -1.1)];

fn field(distance: impl Fn(Vec3) -> f32) -> DepthField {
    sized(WIDTH, WIDTH / 2, distance)
}

/// Surfaces only, without back faces.
fn sized(w: usize, h: usize, distance: impl Fn(Vec3) -> f32) -> DepthField {
    with_back_faces(w, h, false, distance)
}

pub(super) fn with_back_faces(w: usize, h: usize, back_faces: bool, distance: impl Fn(Vec3) -> f32) -> DepthField {
    let depth = Image::from_fn(w, h, |x, y| {
        distance(sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32)))
    });
    DepthField::new(&depth, &FieldOptions { back_faces, ..FieldOptions::default() })
}

/// Where the line enters and leaves a box.
pub(super) fn span([lo, hi]: [Vec3; 2], origin: Vec3, direction: Vec3) -> Option<(f32, f32)> {
    let (a, b) = ((lo - origin) / direction, (hi - origin) / direction);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    (enter <= leave).then_some((enter, leave))
}

/// Distance to the walls of the box room from inside, and the wall's normal.
fn walls(origin: Vec3, direction: Vec3) -> (f32, Vec3) {
    let t = span([LO, HI], origin, direction).expect("the point lies inside").1;
    let at = origin + direction * t;
    let (low, high) = ((at - LO).abs(), (HI - at).abs());
    let axis = (0..3).min_by(|&a, &b| low[a].min(high[a]).total_cmp(&low[b].min(high[b]))).expect("three axes");
    let mut normal = Vec3::ZERO;
    normal[axis] = if low[axis] < high[axis] { 1.0 } else { -1.0 };
    (t, normal)
}

pub(super) fn room(direction: Vec3) -> f32 {
    walls(Vec3::ZERO, direction).0
}

fn room_with_table(direction: Vec3) -> f32 {
    let table = span(TABLE, Vec3::ZERO, direction).filter(|s| s.0 > 0.0).map_or(f32::INFINITY, |s| s.0);
    table.min(room(direction))
}

/// Distance from inside a sphere, and the normal towards its centre.
pub(super) fn ball(center: Vec3, radius: f32, origin: Vec3, direction: Vec3) -> (f32, Vec3) {
    let to = origin - center;
    let b = to.dot(direction);
    let t = -b + (b * b - to.length_squared() + radius * radius).sqrt();
    (t, (center - origin - direction * t) / radius)
}

fn direction(random: &mut StdRng) -> Vec3 {
    let (y, azimuth) = (random.random_range(-1.0..1.0f32), random.random_range(0.0..TAU));
    let horizontal = (1.0 - y * y).sqrt();
    Vec3::new(horizontal * azimuth.cos(), y, horizontal * azimuth.sin())
}

fn inside(random: &mut StdRng, lo: Vec3, hi: Vec3) -> Vec3 {
    lo + (hi - lo) * Vec3::new(random.random(), random.random(), random.random())
}

/// Whether the point of a wall lies within two texels, seen obliquely, of an edge of the room. There one cell bends around the corner.
fn near_edge(at: Vec3) -> bool {
    // The nearest wall is 1.2 m away, which bounds how obliquely it is seen.
    let margin = 2.0 * TAU / WIDTH as f32 * at.length_squared() / 1.2;
    (0..3).filter(|&k| (at[k] - LO[k]).min(HI[k] - at[k]) < margin).count() > 1
}

#[test]
fn rays_in_a_box_room_meet_the_walls() {
    let (field, mut random) = (field(room), StdRng::seed_from_u64(1));
    for _ in 0..20_000 {
        let (o, d) = (inside(&mut random, LO + 0.05, HI - 0.05), direction(&mut random));
        let (t, normal) = walls(o, d);
        let hit = field.march(o, d, f32::INFINITY).hit().unwrap_or_else(|| panic!("{o} {d} leaves a closed room"));
        assert!((hit.normal.length() - 1.0).abs() < 1e-4 && !hit.back, "{o} {d} {hit:?}");
        // Off the wall, not along the ray, which may graze it. A texel is 12 mrad wide; equirectangular interpolation bends
        // a wall by less than 1/8 of that squared, and a corner is cut off by a texel (5 cm at 4 m).
        let (off, straight) = (((hit.t - t) * d.dot(normal)).abs(), hit.normal.dot(normal));
        if near_edge(o + d * t) || near_edge(o + d * hit.t) {
            assert!(off < 0.05, "{o} {d}: {hit:?}, expected {t}");
        } else {
            assert!(off < 1e-3 && straight > 0.9998, "{o} {d}: {hit:?}, expected {t} {normal}");
            // The segment before it is free.
            assert_eq!(field.march(o, d, hit.t * 0.999).hit(), None, "{o} {d}: {hit:?}");
        }
    }
}

#[test]
fn rays_in_a_sphere_room_meet_the_sphere() {
    let (center, radius) = (Vec3::new(0.5, -0.3, 0.4), 2.0);
    let (field, mut random) = (field(|d| ball(center, radius, Vec3::ZERO, d).0), StdRng::seed_from_u64(2));
    for _ in 0..20_000 {
        let (o, d) = (center + direction(&mut random) * random.random_range(0.0..1.9f32), direction(&mut random));
        let (t, normal) = ball(center, radius, o, d);
        let hit = field.march(o, d, f32::INFINITY).hit().unwrap_or_else(|| panic!("{o} {d} leaves a closed room"));
        let off = ((hit.t - t) * d.dot(normal)).abs();
        assert!(off < 5e-4 && hit.normal.dot(normal) > 0.9998 && !hit.back, "{o} {d}: {hit:?}, expected {t} {normal}");
    }
}

#[test]
fn rays_along_special_lines() {
    let field = field(room);
    let diagonal = Vec3::ONE.normalize();
    for (what, o, d) in [
        ("at the capture point", Vec3::ZERO, Vec3::new(0.3, -0.5, 0.8).normalize()),
        ("through the capture point", Vec3::Z, Vec3::NEG_Z),
        ("through it, obliquely", Vec3::new(-0.6, 0.3, 0.8), Vec3::new(0.6, -0.3, -0.8).normalize()),
        ("past it, 0.1 mm off", Vec3::new(1e-4, 0.0, 1.0), Vec3::NEG_Z),
        ("up the pole axis", Vec3::NEG_Y, Vec3::Y),
        ("down the pole axis", Vec3::Y * 0.5, Vec3::NEG_Y),
        ("away from the capture point, upwards", Vec3::Y * 0.5, Vec3::Y),
        ("beside the pole axis", Vec3::new(1e-3, -1.0, 1e-3), Vec3::Y),
        ("along an edge of the cube", -diagonal, Vec3::new(1.0, 1.0, 0.0).normalize()),
        ("through the cube's corners", -0.5 * diagonal, diagonal),
        ("along the seam", Vec3::new(0.0, 0.5, 1.0), Vec3::new(0.0, -0.2, 1.0).normalize()),
        ("across the seam", Vec3::new(-1.5, 0.2, 1.5), Vec3::X),
    ] {
        let (t, normal) = walls(o, d);
        let hit = field.march(o, d, f32::INFINITY).hit().unwrap_or_else(|| panic!("{what}: nothing met"));
        assert!((hit.t - t).abs() < 2e-3 && hit.normal.dot(normal) > 0.999, "{what}: {hit:?}, expected {t} {normal}");
    }
}

#[test]
fn grazing_rays_stay_on_their_side() {
    // 2 mm above the floor, and sinking by 1 mm per metre.
    let field = field(room);
    let o = Vec3::new(-1.5, LO.y + 2e-3, 0.3);
    let along = field.march(o, Vec3::X, f32::INFINITY).hit().unwrap();
    assert!((along.t - 4.0).abs() < 0.05, "{along:?}");
    let sinking = field.march(o, Vec3::new(1.0, -1e-3, 0.0).normalize(), f32::INFINITY).hit().unwrap();
    assert!((sinking.t - 2.0).abs() < 0.3 && sinking.normal.y > 0.999, "{sinking:?}");
}

#[test]
fn walls_are_met_from_outside_on_their_back() {
    let field = field(room);
    let (o, d) = (Vec3::new(6.0, 0.1, 0.2), Vec3::NEG_X);
    let hit = field.march(o, d, f32::INFINITY).hit().unwrap();
    assert!(hit.back && (hit.t - 3.5).abs() < 1e-3 && hit.normal.dot(Vec3::X) > 0.999, "{hit:?}");
    assert_eq!(field.march(o, Vec3::X, f32::INFINITY).hit(), None);
    assert_eq!(field.march(o, Vec3::Y, f32::INFINITY).hit(), None);
}

/// Both look the field up, one cell by cell, the other in small equal steps of angle. They may differ where a ray meets the
/// rim of a gap, whose half cell is thinner than a step, or two surfaces within a step.
#[test]
fn hierarchical_marching_equals_linear_marching() {
    let (field, mut random) = (field(room_with_table), StdRng::seed_from_u64(3));
    let (mut apart, n) = (Vec::new(), 3000);
    for _ in 0..n {
        let (o, d) = (inside(&mut random, LO + 0.05, HI - 0.05), direction(&mut random));
        let (a, b) = (field.march(o, d, f32::INFINITY).hit(), march_linear(&field, o, d, f32::INFINITY, 4000));
        let same = match (&a, &b) {
            (None, None) => true,
            (Some(a), Some(b)) => (a.t - b.t).abs() < 1e-3 * (1.0 + a.t) && a.back == b.back,
            _ => false,
        };
        if !same {
            let at_gap = a.is_some_and(|h| h.at_gap) || b.is_some_and(|h| h.at_gap);
            assert!(at_gap, "{o} {d}: {a:?} {b:?}");
            apart.push((o, d, a, b));
        }
    }
    assert!(apart.len() * 100 <= n, "{} of {n} differ, such as {:?}", apart.len(), apart[0]);
}

/// A tray half a centimetre thick on the floor is no gap: its rim, however it lies, does not bend the floor
/// (a single cell there leans by 15°).
#[test]
fn small_steps_turn_no_normal() {
    for yaw in [0.0f32, 0.5] {
        let turn = Quat::from_rotation_y(yaw);
        let field = field(|d| {
            let at = turn * (d * (-1.495 / d.y));
            if d.y < 0.0 && (at.x - 0.4).abs() < 0.3 && (at.z + 0.5).abs() < 0.2 { -1.495 / d.y } else { room(d) }
        });
        let mut random = StdRng::seed_from_u64(7);
        for _ in 0..2000 {
            let at = turn.inverse() * inside(&mut random, Vec3::new(0.0, LO.y, -0.9), Vec3::new(0.8, LO.y, -0.1));
            let d = (at - Vec3::new(0.0, 0.2, 0.3)).normalize();
            let hit = field.march(Vec3::new(0.0, 0.2, 0.3), d, f32::INFINITY).hit().unwrap();
            let normal = field.smooth_normal(at, d, &hit);
            assert!(normal.y > 0.995 && !hit.back, "{yaw} {d}: {normal} {hit:?}");
        }
    }
}

#[test]
fn rays_can_run_out_of_steps() {
    let depth = Image::from_fn(WIDTH, WIDTH / 2, |_, _| 2.0);
    let field = DepthField::new(&depth, &FieldOptions { max_steps: 3, ..FieldOptions::default() });
    assert_eq!(field.march(Vec3::new(0.5, 0.0, 0.0), Vec3::Y, f32::INFINITY), Answer::OutOfSteps);
}

/// A plate hangs before a wall: seen from the capture point the wall behind it is hidden, and nothing connects the two.
#[test]
fn rays_pass_behind_a_floating_plate() {
    let plate = |d: Vec3| {
        let t = -1.0 / d.z;
        let at = d * t;
        if d.z < 0.0 && at.x.abs() < 0.4 && at.y.abs() < 0.4 { t } else { room(d) }
    };
    let field = field(plate);
    // The ray crosses the whole shadow of the plate, 1 m behind it.
    let behind = field.march(Vec3::new(-1.5, 0.1, -2.0), Vec3::X, f32::INFINITY).hit().unwrap();
    assert!((behind.t - 4.0).abs() < 2e-3 && !behind.back, "{behind:?}");
    // From behind it is met on its back; from before, on its front.
    let back = field.march(Vec3::new(0.1, 0.0, -2.0), Vec3::Z, f32::INFINITY).hit().unwrap();
    assert!(back.back && (back.t - 1.0).abs() < 2e-3 && back.normal.z < -0.999, "{back:?}");
    let front = field.march(Vec3::new(0.1, 0.3, 1.0), Vec3::NEG_Z, f32::INFINITY).hit().unwrap();
    assert!(!front.back && (front.t - 2.0).abs() < 2e-3 && front.normal.z > 0.999, "{front:?}");
    // Past its rim by two texels (2.5 cm) the wall is met.
    let past = field.march(Vec3::new(0.0, 0.0, 0.1), Vec3::new(1.275, 0.0, -3.1).normalize(), f32::INFINITY).hit().unwrap();
    assert!((past.t - Vec2::new(1.275, 3.1).length()).abs() < 2e-3, "{past:?}");
    // Straight into its shadow, past its rim: the wall there was never seen, and infinity is behind it.
    let shadow = field.march(Vec3::new(-1.5, 0.0, -1.1), Vec3::new(1.5, 0.0, -1.9).normalize(), f32::INFINITY).hit();
    assert_eq!(shadow, None);
}

#[test]
fn where_nothing_is_rays_go_on() {
    // A window in the wall at −Z.
    let open = |d: Vec3| {
        let at = d * room(d);
        if at.z < LO.z + 1e-3 && at.x.abs() < 1.0 && at.y.abs() < 0.6 { f32::INFINITY } else { room(d) }
    };
    let field = field(open);
    for o in [Vec3::ZERO, Vec3::new(0.5, -0.3, 1.0)] {
        assert_eq!(field.march(o, (Vec3::new(0.1, 0.2, -3.0) - o).normalize(), f32::INFINITY).hit(), None);
        let beside = (Vec3::new(1.3, 0.2, -3.0) - o).normalize();
        assert!((field.march(o, beside, f32::INFINITY).hit().unwrap().t - walls(o, beside).0).abs() < 5e-3);
    }
    assert_eq!(field.look(Vec3::NEG_Z).0, 0.0);
}

#[test]
fn pictures_of_any_size_are_a_surface() {
    for (w, h) in [(1, 1), (2, 1), (1, 2), (3, 2), (37, 19), (64, 1)] {
        let field = sized(w, h, |_| 2.0);
        for d in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.3, 0.9, -0.2).normalize()] {
            let o = Vec3::new(0.2, -0.1, 0.3);
            let (t, normal) = ball(Vec3::ZERO, 2.0, o, d);
            // The cube has at least 16 cells a side, each 1/16 rad: cells sag by 1/512.
            let hit = field.march(o, d, f32::INFINITY).hit().unwrap();
            assert!((hit.t - t).abs() < 0.01 && hit.normal.dot(normal) > 0.99, "{w}×{h}: {hit:?}, expected {t}");
        }
    }
}

#[test]
fn depths_beyond_reason_are_nothing_or_a_surface() {
    let o = Vec3::new(0.1, 0.2, 0.3);
    for nothing in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let field = sized(32, 16, |_| nothing);
        assert!(field.march(o, Vec3::X, f32::INFINITY).hit().is_none() && field.look(Vec3::X).0 == 0.0, "{nothing}");
    }
    // A micrometre around the capture point: everything else is behind it.
    let tiny = sized(32, 16, |_| 1e-6);
    assert!(tiny.march(o, Vec3::X, f32::INFINITY).hit().is_none());
    assert!((tiny.look(Vec3::X).0 - 1e6).abs() < 1.0);
    // As far as a surface may be. (Loading takes more for infinity.)
    let far = sized(32, 16, |_| 9e8).march(o, Vec3::X, f32::INFINITY).hit().unwrap();
    assert!((far.t / 9e8 - 1.0).abs() < 0.01, "{far:?}");
    // Next to each other: each keeps its own texels.
    let mixed = sized(64, 32, |d| {
        if d.x > 0.5 {
            f32::NAN
        } else if d.x < -0.5 {
            1e-6
        } else {
            3.0
        }
    });
    assert!(mixed.march(Vec3::ZERO, Vec3::X, f32::INFINITY).hit().is_none());
    assert!((mixed.march(o, Vec3::NEG_Z, f32::INFINITY).hit().unwrap().t - ball(Vec3::ZERO, 3.0, o, Vec3::NEG_Z).0).abs() < 0.02);
}

fn depth_value() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => 0.1f32..10.0,
        1 => prop_oneof![Just(0.0), Just(f32::NAN), Just(f32::INFINITY), Just(1e-6), Just(1e9), Just(-2.0)],
        1 => 1e-3f32..1e6,
    ]
}

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -5.0f32..5.0, 1 => Just(0.0), 1 => -1e6f32..1e6, 1 => -1e-6f32..1e-6]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Two hundred rays through random noise take milliseconds; a ray that did not end would not come back at all.
    #[test]
    fn any_ray_on_any_depth_ends_with_a_finite_answer(
        (w, depths) in (1usize..24, 1usize..12).prop_flat_map(|(w, h)| (Just(w), prop::collection::vec(depth_value(), w * h))),
        resolution in 0usize..40,
        rays in prop::collection::vec(((coordinate(), coordinate(), coordinate()), 0u64..u64::MAX), 1..40),
        t_max in prop_oneof![Just(f32::INFINITY), 1e-3f32..20.0],
    ) {
        let depth = Image::from_vec(w, depths.len() / w, depths).unwrap();
        let field = DepthField::new(&depth, &FieldOptions { resolution, ..FieldOptions::default() });
        for (o, seed) in rays {
            let o = Vec3::from(o);
            let d = match seed % 5 {
                0 => [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z][(seed / 5 % 6) as usize],
                1 => -o.try_normalize().unwrap_or(Vec3::Y),
                _ => direction(&mut StdRng::seed_from_u64(seed)),
            };
            let (inverse, plane) = field.look(d);
            prop_assert!(inverse >= 0.0 && inverse.is_finite() && plane.is_finite(), "{d}: {inverse} {plane}");
            if let Some(hit) = field.march(o, d, t_max).hit() {
                prop_assert!(hit.t > 0.0 && hit.t <= t_max && hit.t.is_finite(), "{o} {d}: {hit:?}");
                prop_assert!((hit.normal.length() - 1.0).abs() < 1e-3, "{o} {d}: {hit:?}");
                prop_assert!(hit.normal.dot(d) <= 1e-6, "{o} {d}: {hit:?}");
            }
        }
    }
}
