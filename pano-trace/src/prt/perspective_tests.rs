//! Rays against a perspective picture's depth: closed forms, and brute force over all of its cells.

use super::field::{DepthField, face_from_direction};
use super::{FieldOptions, PerspectiveField};
use glam::{Mat3, Vec2, Vec3};
use pano_core::camera::{Camera, Projection};
use pano_core::image::Image;
use rand::{RngExt, SeedableRng, rngs::StdRng};

const FOCAL: Vec2 = Vec2::new(70.0, 64.0);
const CENTER: Vec2 = Vec2::new(37.3, 29.1);
const SIZE: (usize, usize) = (80, 60);

fn camera() -> Camera {
    Camera {
        position: Vec3::ZERO,
        world_from_camera: glam::Quat::IDENTITY,
        projection: Projection::Pinhole { focal: FOCAL, center: CENTER },
        width: SIZE.0,
        height: SIZE.1,
    }
}

/// From the distance along each pixel's ray.
fn field(distance: impl Fn(Vec3) -> f32) -> (PerspectiveField, Image<f32>) {
    let depth = Image::from_fn(SIZE.0, SIZE.1, |x, y| distance(camera().direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5))));
    (PerspectiveField::new(&depth, FOCAL, CENTER, &FieldOptions::default()), depth)
}

/// A tilted wall: n·x = −h.
const WALL: (Vec3, f32) = (Vec3::new(0.2, 0.3, 0.9), 3.0);

fn wall(origin: Vec3, d: Vec3) -> f32 {
    let n = WALL.0.normalize();
    (-WALL.1 - n.dot(origin)) / n.dot(d)
}

/// The wall, and in front of it a ball, a board and rods.
fn clutter(d: Vec3) -> f32 {
    let mut t = wall(Vec3::ZERO, d);
    let ball = Vec3::new(-0.3, 0.1, -1.6);
    let (b, c) = (ball.dot(d), ball.length_squared() - 0.09);
    if b * b > c {
        t = t.min(b - (b * b - c).sqrt());
    }
    let board = -1.2 / d.z;
    let at = d * board;
    if at.x > 0.15 && at.x < 0.45 && at.y < 0.2 {
        t = t.min(board);
    }
    for x in [-0.55f32, -0.05, 0.55] {
        let rod = -2.0 / d.z;
        if (d.x * rod - x).abs() < 0.025 {
            t = t.min(rod);
        }
    }
    t
}

#[test]
fn a_plane_is_met_exactly_from_anywhere() {
    let (field, _) = field(|d| wall(Vec3::ZERO, d));
    let mut random = StdRng::seed_from_u64(1);
    let mut met = 0;
    for _ in 0..4000 {
        let mut number = || random.random_range(-1.0..1.0f32);
        let origin = Vec3::new(number(), number(), number() - 0.5);
        let d = Vec3::new(number(), number(), number()).normalize();
        let t = wall(origin, d);
        let at = origin + d * t;
        // Only what the picture shows is there; its borders move by the rounding of a pixel's edge.
        let shown = (t > 0.0).then(|| camera().pixel(at)).flatten();
        let inside = |margin: f32| {
            shown.is_some_and(|p| {
                p.cmpgt(Vec2::splat(margin)).all() && p.x < SIZE.0 as f32 - margin && p.y < SIZE.1 as f32 - margin
            })
        };
        match field.march(origin, d, f32::INFINITY) {
            Some(hit) => {
                assert!(inside(-0.02), "{origin} {d}: {hit:?}, not there");
                assert!((hit.t - t).abs() < 1e-3 * (1.0 + t), "{origin} {d}: {} {t}", hit.t);
                let normal = WALL.0.normalize() * -d.dot(WALL.0).signum();
                assert!(hit.normal.dot(normal) > 0.999, "{} {normal}", hit.normal);
                met += 1;
            }
            None => assert!(!inside(0.02), "{origin} {d}: misses at {t}, pixel {shown:?}"),
        }
    }
    assert!(met > 300, "{met} rays have met the wall");
}

#[test]
fn the_picture_s_own_rays_meet_its_depth() {
    let (field, depth) = field(clutter);
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let d = camera().direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            let hit = field.look(d).unwrap();
            assert!((hit.t / depth.get(x, y) - 1.0).abs() < 1e-4, "({x}, {y}): {} {}", hit.t, depth.get(x, y));
            assert!(hit.normal.dot(d) < 0.0);
        }
    }
    for outside in [Vec3::Z, Vec3::X, Vec3::new(-0.6, 0.0, -1.0), Vec3::new(0.0, -0.5, -1.0), Vec3::new(0.0, 0.5, -1.0)] {
        assert_eq!(field.look(outside.normalize()), None, "{outside}");
    }
}

/// The nearest crossing over all cells of the picture, each looked at by itself in small steps: no pyramid, no walk.
fn brute_force(field: &DepthField, o: Vec3, d: Vec3) -> Option<f32> {
    const FACE: usize = 5;
    let (n, face) = (field.n, &field.faces[FACE]);
    let (o, d) = (o.as_dvec3(), d.as_dvec3());
    // Depth is −z; the point at t is seen at (x, −y) / depth on the face.
    let seen = |t: f64| {
        let p = o + d * t;
        (glam::DVec2::new(p.x, -p.y) / -p.z, -1.0 / p.z)
    };
    let mut nearest: Option<f64> = None;
    for cell in 0..n * n {
        let corner = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
        let (x0, x1, y0, y1) = (corner(cell % n), corner(cell % n + 1), corner(cell / n), corner(cell / n + 1));
        // The frustum of the cell: where x − x0·depth and the like are positive.
        let (mut lo, mut hi) = (0.0f64, 1e4f64);
        let mut cut = |at: f64, slope: f64| {
            if slope > 0.0 {
                lo = lo.max(-at / slope);
            } else if slope < 0.0 {
                hi = hi.min(-at / slope);
            } else if at < 0.0 {
                hi = -1.0;
            }
        };
        cut(o.x + x0 * o.z, d.x + x0 * d.z);
        cut(-o.x - x1 * o.z, -d.x - x1 * d.z);
        cut(-o.y + y0 * o.z, -d.y + y0 * d.z);
        cut(o.y - y1 * o.z, d.y - y1 * d.z);
        cut(-o.z - 1e-4, -d.z);
        if lo >= hi || nearest.is_some_and(|t| t <= lo) {
            continue;
        }
        // In equal steps of the picture, which are equal steps of the inverse depth.
        let (w0, w1) = (seen(lo).1, seen(hi).1);
        // In the field's own precision, or a point at the middle of a cell would be in two quarters.
        let quarter = |at: Vec2| {
            let g = (at + 1.0) * (0.5 * n as f32) - Vec2::new((cell % n) as f32, (cell / n) as f32);
            (cell % n + usize::from(g.x >= 0.5), cell / n + usize::from(g.y >= 0.5))
        };
        let above = |t: f64| {
            let (at, inverse) = seen(t);
            let margin = 1e-6 * (x1 - x0);
            let inside =
                at.clamp(glam::DVec2::new(x0 + margin, y0 + margin), glam::DVec2::new(x1 - margin, y1 - margin)).as_vec2();
            (inverse - f64::from(face.patch(n, inside).0), quarter(inside))
        };
        const STEPS: usize = 400;
        let step = |k: usize| {
            let share = k as f64 / STEPS as f64;
            if (w1 - w0).abs() < 1e-9 * w0.abs() {
                return lo + (hi - lo) * share;
            }
            // t at an inverse depth between the ends.
            let w = w0 + (w1 - w0) * share;
            (-1.0 / w - o.z) / d.z
        };
        let mut before = (step(0), above(step(0)));
        for k in 1..=STEPS {
            let here = (step(k), above(step(k)));
            let apart = face.gap[cell] && before.1.1 != here.1.1 && face.gap_between(n, before.1.1, here.1.1);
            if (before.1.0 > 0.0) != (here.1.0 > 0.0) && !apart {
                let t = before.0 + (here.0 - before.0) * (before.1.0 / (before.1.0 - here.1.0)).clamp(0.0, 1.0);
                nearest = Some(nearest.map_or(t, |n: f64| n.min(t)));
                break;
            }
            before = here;
        }
    }
    nearest.map(|t| t as f32)
}

/// The march over the pyramid finds what brute force over all pixels finds, for 99.9 % of random rays through clutter.
#[test]
fn the_march_finds_what_brute_force_finds() {
    let (perspective, _) = field(clutter);
    // The same picture as the march sees it: the test's own map of the frustum.
    let n = perspective.field().n as f32;
    let (scale, shift) = (FOCAL * (2.0 / n), (CENTER + 0.5) * (2.0 / n) - 1.0);
    let map = Mat3::from_cols(Vec3::X * scale.x, Vec3::Y * scale.y, Vec3::new(-shift.x, shift.y, 1.0));
    let mut random = StdRng::seed_from_u64(7);
    let (mut rays, mut met, mut wrong) = (0, 0, 0);
    while rays < 3000 {
        let mut number = |lo: f32, hi: f32| random.random_range(lo..hi);
        let origin = Vec3::new(number(-0.8, 0.8), number(-0.6, 0.6), number(-2.5, 0.3));
        let d = Vec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0)).try_normalize().unwrap_or(Vec3::X);
        rays += 1;
        let found = perspective.march(origin, d, f32::INFINITY).map(|hit| hit.t);
        let truth = brute_force(perspective.field(), map * origin, map * d);
        met += u32::from(truth.is_some());
        let same = match (found, truth) {
            (None, None) => true,
            // The same surface: within the depth of a pixel's slope.
            (Some(a), Some(b)) => (a - b).abs() < 5e-3 * (0.2 + b),
            _ => false,
        };
        if !same {
            println!("{origin} {d}: {found:?} instead of {truth:?}");
            wrong += 1;
        }
    }
    assert!(met > 300, "{met} rays meet something");
    assert!(wrong * 1000 <= rays, "{wrong} of {rays} rays find something else");
}

#[test]
fn degenerate_pictures_are_harmless() {
    for (w, h) in [(1, 1), (2, 1), (1, 3), (5, 2)] {
        for value in [0.0, f32::NAN, f32::INFINITY, 1e-6, 1.0, 1e8] {
            let depth = Image::filled(w, h, value);
            let center = Vec2::new(0.5 * w as f32, 0.5 * h as f32);
            let field = PerspectiveField::new(&depth, Vec2::splat(3.0), center, &FieldOptions::default());
            let mut random = StdRng::seed_from_u64(3);
            for _ in 0..200 {
                let mut number = || random.random_range(-1.0..1.0f32);
                let origin = Vec3::new(number(), number(), number());
                let d = Vec3::new(number(), number(), number()).try_normalize().unwrap_or(Vec3::NEG_Z);
                if let Some(hit) = field.march(origin, d, f32::INFINITY) {
                    assert!(hit.t > 0.0 && hit.t.is_finite() && hit.normal.is_finite(), "{w}×{h} of {value}: {hit:?}");
                }
            }
            let ahead = field.look(Vec3::NEG_Z);
            assert_eq!(ahead.is_some(), value.is_finite() && value > 0.0, "{w}×{h} of {value}");
        }
    }
    assert_eq!(face_from_direction(Vec3::NEG_Z).0, 5);
}
