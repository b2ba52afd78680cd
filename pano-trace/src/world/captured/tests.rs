use super::infinity::what_infinity_shows;
use super::*;
use pano_core::progress::Silent;
use rand::{RngExt, SeedableRng, rngs::StdRng};
use std::f32::consts::{PI, TAU};

pub(super) fn texel_direction(w: usize, h: usize, x: usize, y: usize) -> Vec3 {
    sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32))
}

/// A world of `width` columns from functions of the direction in the panorama's frame.
pub(super) fn world(
    width: usize,
    distance: impl Fn(Vec3) -> f32,
    radiance: impl Fn(Vec3) -> Vec3,
    place: (Quat, Vec3),
    options: &CapturedOptions,
) -> CapturedWorld {
    let (w, h) = (width, width / 2);
    let radiance = RadianceImage::from_fn(w, h, |x, y| radiance(texel_direction(w, h, x, y)));
    let depth = Image::from_fn(w, h, |x, y| distance(texel_direction(w, h, x, y)));
    CapturedWorld::new(Arc::new(radiance), &depth, place.0, place.1, &[], options, &Silent).unwrap()
}

pub(super) fn coarse() -> CapturedOptions {
    CapturedOptions { irradiance_width: 256, irradiance_samples: 16, ..CapturedOptions::default() }
}

pub(super) fn here() -> (Quat, Vec3) {
    (Quat::from_rotation_y(0.7), Vec3::new(1.0, 1.5, -2.0))
}

pub(super) const LO: Vec3 = Vec3::new(-2.0, -1.5, -3.0);
const HI: Vec3 = Vec3::new(2.5, 1.2, 2.0);

pub(super) fn box_room(d: Vec3) -> f32 {
    (Vec3::select(d.cmpgt(Vec3::ZERO), HI, LO) / d).to_array().into_iter().filter(|t| t.is_finite()).fold(f32::INFINITY, f32::min)
}

/// A room lit by a lamp of 0.8 × 0.8 m on the ceiling.
pub(super) fn lamp_room(d: Vec3) -> Vec3 {
    let at = d * box_room(d);
    let lamp = at.y > HI.y - 1e-3 && (at.x - 0.5).abs() < 0.4 && at.z.abs() < 0.4;
    if lamp { Vec3::splat(8.0) } else { Vec3::splat(0.2 + 0.05 * at.x.abs()) }
}

fn direction(random: &mut StdRng) -> Vec3 {
    let (y, azimuth) = (random.random_range(-1.0..1.0f32), random.random_range(0.0..TAU));
    let horizontal = (1.0 - y * y).sqrt();
    Vec3::new(horizontal * azimuth.cos(), y, horizontal * azimuth.sin())
}

/// Another seed measures another irradiance of the same mean, and lights hidden sides by other rays.
#[test]
fn seeds_change_the_noise_of_the_preparation() {
    let with = |seed: u32| world(128, box_room, lamp_room, here(), &CapturedOptions { irradiance_samples: 4, seed, ..coarse() });
    let worlds = [0, 0, 1, 2, 3].map(with);
    let mut random = StdRng::seed_from_u64(5);
    let mut apart = [0.0; 5];
    for _ in 0..200 {
        let ray = Ray::new(worlds[0].capture, direction(&mut random));
        let hit = worlds[0].hit(&ray).unwrap();
        let irradiance = worlds.each_ref().map(|world| world.irradiance(&hit).x);
        (0..5).for_each(|i| apart[i] += (irradiance[i] / irradiance[0] - 1.0) / 200.0);
        assert_eq!(irradiance[0], irradiance[1]);
        assert!(irradiance[2..].iter().all(|e| *e != irradiance[0]), "{irradiance:?}");
    }
    assert!(apart.iter().all(|mean| mean.abs() < 0.05), "{apart:?}");
    let board = |d: Vec3| if d.z < 0.0 && (d / d.z).truncate().abs().max_element() < 0.4 { 1.0 / -d.z } else { box_room(d) };
    let shown = [0, 0, 1].map(|seed| {
        let world = world(512, board, lamp_room, here(), &CapturedOptions { seed, ..coarse() });
        let beside = |i: i32| {
            let ray = Ray::new(here().1 + here().0 * Vec3::new(1.2, i as f32 * 0.01 - 0.2, -1.2), here().0 * Vec3::NEG_X);
            world.hit(&ray).filter(|hit| hit.surface == HIDDEN_SIDE).and_then(|hit| hit.radiance)
        };
        (0..40).filter_map(beside).collect::<Vec<_>>()
    });
    assert!(shown[0].len() > 20 && shown[0] == shown[1] && shown[0].len() == shown[2].len());
    assert!(shown[0].iter().zip(&shown[2]).filter(|(a, b)| a == b).count() < 5);
}

/// Around every point of the inside of a shining sphere there is radiance L: the irradiance is π·L, whatever the place.
#[test]
fn irradiance_in_a_sphere_of_constant_radiance_is_pi_times_it() {
    let radiance = Vec3::new(0.5, 1.0, 2.0);
    for offset in [Vec3::ZERO, Vec3::new(0.6, -0.3, 0.5)] {
        let distance = |d: Vec3| {
            let b = -offset.dot(d);
            -b + (b * b - offset.length_squared() + 4.0).sqrt()
        };
        let world = world(128, distance, |_| radiance, here(), &CapturedOptions { irradiance_samples: 128, ..coarse() });
        let mut random = StdRng::seed_from_u64(1);
        for _ in 0..200 {
            let hit = world.hit(&Ray::new(here().1, direction(&mut random))).unwrap();
            let relative = world.irradiance(&hit) / (radiance * PI);
            // Rays next to the surface see it bent by the interpolation; pairs of samples see the pole's texels unevenly.
            assert!((relative - 1.0).abs().max_element() < 0.01, "{relative} at {}", hit.position);
            assert_eq!(hit.radiance, Some(radiance));
        }
    }
}

/// Half the sphere shines with 1, the other with ρ₀: a texel of the dark half reflects ρ = π·L/E, capped.
#[test]
fn reflectance_is_radiance_over_irradiance_up_to_the_cap() {
    for cap in [0.0, 0.3, 0.9] {
        let options = CapturedOptions { reflectance_cap: cap, ..coarse() };
        // A floor of radiance ¼ under a dome of radiance 1 far away: E = π, ρ = ¼; the dome's own is 1 at least.
        let world = world(
            256,
            |d| if d.y < -0.02 { -1.5 / d.y } else { 75.0 },
            |d| Vec3::splat(if d.y < -0.02 { 0.25 } else { 1.0 }),
            (Quat::IDENTITY, Vec3::ZERO),
            &options,
        );
        let floor = world.hit(&Ray::new(Vec3::ZERO, Vec3::new(0.3, -0.9, 0.2).normalize())).unwrap();
        assert!((world.reflectance(&floor) - 0.25f32.min(cap)).abs().max_element() < 0.01, "{}", world.reflectance(&floor));
        let dome = world.hit(&Ray::new(Vec3::ZERO, Vec3::Y)).unwrap();
        assert_eq!(world.reflectance(&dome), Vec3::splat(cap), "a lamp is not white paint");
    }
}

#[test]
fn a_black_panorama_has_neither_light_nor_reflectance() {
    let world = world(32, box_room, |_| Vec3::ZERO, here(), &coarse());
    let hit = world.hit(&Ray::new(here().1, Vec3::X)).unwrap();
    assert_eq!((world.irradiance(&hit), world.reflectance(&hit)), (Vec3::ZERO, Vec3::ZERO));
    assert!(world.sample_light(here().1, Vec2::splat(0.5)).is_none());
    assert_eq!(world.light_pdf(here().1, Vec3::X, Some(&hit)), 0.0);
}

/// Samples aimed at the lamps of a room from anywhere in it have the density that `light_pdf` states, direction by direction.
/// The room is convex: every aim but those at corners cut by the grid is reached, and the density integrates to 1.
#[test]
fn light_samples_have_the_density_stated() {
    const COLUMNS: usize = 16;
    const ROWS: usize = 8;
    const FINE: usize = 64;
    let (turn, capture) = here();
    let world = world(256, box_room, lamp_room, (turn, capture), &coarse());
    let bin = |d: Vec3| {
        let uv = sphere::uv_from_direction(d);
        ((uv.y * ROWS as f32) as usize).min(ROWS - 1) * COLUMNS + ((uv.x * COLUMNS as f32) as usize).min(COLUMNS - 1)
    };
    for from in [Vec3::new(0.2, -1.0, 0.5), Vec3::new(-1.8, 0.9, -2.5)] {
        let from = capture + turn * from;
        let mut expected = vec![0f64; COLUMNS * ROWS];
        let (w, h) = (COLUMNS * FINE, ROWS * FINE);
        for y in 0..h {
            let weight = sphere::pixel_solid_angle(w, h, y);
            for x in 0..w {
                let d = texel_direction(w, h, x, y);
                let behind = world.hit(&Ray::new(from, d));
                let pdf = world.light_pdf(from, d, behind.as_ref());
                assert!(pdf >= 0.0 && pdf.is_finite());
                expected[bin(d)] += f64::from(pdf) * weight;
            }
        }
        let total: f64 = expected.iter().sum();
        assert!((0.99..1.005).contains(&total), "the density integrates to {total}");
        let (n, mut lost, mut found) = (20_000, 0, vec![0f64; COLUMNS * ROWS]);
        let mut random = StdRng::seed_from_u64(2);
        for _ in 0..n {
            let sample = world.sample_light(from, Vec2::new(random.random(), random.random())).unwrap();
            match world.reach(&Ray::new(from, sample.direction), &sample) {
                Some(behind) => {
                    assert!(world.light_pdf(from, sample.direction, behind.as_ref()) > 0.0);
                    found[bin(sample.direction)] += 1.0;
                }
                None => lost += 1,
            }
        }
        assert!(lost * 100 < n, "{lost} of {n} samples do not reach what they aim at");
        // χ² over the bins with 10 samples or more; the rest pooled. Its mean is the number of bins, its variance twice that.
        // Integration over 64² points a bin is good to 1 %, which adds n·1e-4 = 2.
        let (mut chi2, mut bins, mut rest) = (0.0, 0.0, (0.0, 0.0));
        for (e, f) in expected.iter().map(|e| e * f64::from(n)).zip(&found) {
            if e < 10.0 {
                rest = (rest.0 + e, rest.1 + f);
            } else {
                chi2 += (f - e) * (f - e) / e;
                bins += 1.0;
            }
        }
        chi2 += (rest.1 - rest.0) * (rest.1 - rest.0) / f64::max(rest.0, 1.0);
        assert!(chi2 < bins + 4.0 * f64::sqrt(2.0 * bins) + 10.0, "χ² {chi2} over {bins} bins from {from}");
    }
}

/// The integral of the density of light samples over a grid of directions, and the share of 10 000 samples that reach what they
/// aim at.
pub(super) fn density_and_reached(world: &CapturedWorld, from: Vec3, (w, h): (usize, usize)) -> (f64, f64) {
    let mut total = 0.0;
    for y in 0..h {
        for x in 0..w {
            let d = texel_direction(w, h, x, y);
            let behind = world.hit(&Ray::new(from, d));
            total += f64::from(world.light_pdf(from, d, behind.as_ref())) * sphere::pixel_solid_angle(w, h, y);
        }
    }
    let mut random = StdRng::seed_from_u64(3);
    let n = 10_000;
    let reached = (0..n).filter(|_| {
        let sample = world.sample_light(from, Vec2::new(random.random(), random.random())).unwrap();
        world.reach(&Ray::new(from, sample.direction), &sample).is_some()
    });
    (total, reached.count() as f64 / f64::from(n))
}

/// A floating plate hides light from behind it: samples aimed past it are not reached, and the density there belongs to what
/// lies first, so that the whole stays below 1.
#[test]
fn light_that_is_hidden_is_not_counted() {
    let (turn, capture) = here();
    let plate = |d: Vec3| {
        let at = d / d.z.abs();
        if d.z < 0.0 && at.x.abs() < 0.5 && at.y.abs() < 0.5 { 1.0 / d.z.abs() } else { box_room(d) }
    };
    let world = world(256, plate, lamp_room, (turn, capture), &coarse());
    for from in [Vec3::new(0.1, 0.1, -2.0), Vec3::new(1.5, -1.0, -2.5)] {
        let (total, reached) = density_and_reached(&world, capture + turn * from, (192, 96));
        // 10 000 trials know the share to ±0.5 %; the rim of the plate is integrated to ±1 %.
        assert!((total - reached).abs() < 0.025 && total < 1.0, "density {total}, reached {reached}");
    }
}

#[test]
fn rays_that_leave_a_surface_do_not_meet_it_again() {
    let (turn, capture) = here();
    let world = world(512, box_room, lamp_room, (turn, capture), &coarse());
    let mut random = StdRng::seed_from_u64(4);
    for _ in 0..5000 {
        let hit = world.hit(&Ray::new(capture, direction(&mut random))).unwrap();
        let mut d = direction(&mut random);
        d *= d.dot(hit.normal).signum();
        if d.dot(hit.normal) < 0.02 {
            continue;
        }
        let next = world.hit(&Ray::new(world.leave(&hit), d)).unwrap_or_else(|| panic!("{hit:?} {d}: a closed room"));
        let local = turn.inverse() * (hit.position - capture);
        // In an edge of the room the other wall may be as near as one likes.
        if (local - LO).min(HI - local).to_array().into_iter().filter(|&x| x < 0.1).count() < 2 {
            assert!(next.t > 0.05, "{hit:?} {d}: meets {next:?}");
        }
    }
}

/// A place turned and moved as a whole gives the same answers, turned and moved.
#[test]
fn places_can_be_anywhere() {
    let plain = world(512, box_room, lamp_room, (Quat::IDENTITY, Vec3::ZERO), &coarse());
    let place = (Quat::from_rotation_y(-2.1), Vec3::new(10.0, -3.0, 7.0));
    let moved = world(512, box_room, lamp_room, place, &coarse());
    let mut random = StdRng::seed_from_u64(5);
    for _ in 0..500 {
        let (o, d) = (direction(&mut random), direction(&mut random));
        let (a, b) = (plain.hit(&Ray::new(o, d)).unwrap(), moved.hit(&Ray::new(place.1 + place.0 * o, place.0 * d)).unwrap());
        assert!((a.t - b.t).abs() < 2e-3 * (1.0 + a.t), "{a:?} {b:?}");
        assert!((place.0 * a.position + place.1).distance(b.position) < 1e-2);
        assert!(plain.infinity(d).distance(moved.infinity(place.0 * d)) < 0.05 || plain.infinity(d).x > 0.5);
    }
}

#[test]
fn infinity_is_seen_through_windows_and_never_through_walls() {
    let (w, h) = (32, 16);
    let open = |x: usize, y: usize| (14..18).contains(&x) && (6..9).contains(&y);
    let picture = RadianceImage::from_fn(w, h, |x, y| Vec3::splat(if open(x, y) { 5.0 + x as f32 } else { 0.1 }));
    let depth = Image::from_fn(w, h, |x, y| if open(x, y) { f32::INFINITY } else { 2.0 });
    let shown = |depth: &Image<f32>| what_infinity_shows((w, h), depth).map(|texels| texels.map(|i| picture.data()[i as usize]));
    let shows = shown(&depth).unwrap();
    for y in 0..h {
        for x in 0..w {
            let value = shows.get(x, y).x;
            assert!((19.0..=22.0).contains(&value), "({x}, {y}) shows {value}, a wall");
            if open(x, y) {
                assert_eq!(shows.get(x, y), picture.get(x, y));
            }
        }
    }
    // The nearest texel is taken, over seam and pole as well.
    assert_eq!((shows.get(5, 7).x, shows.get(27, 7).x), (19.0, 22.0));
    let corner = Image::from_fn(w, h, |x, y| if (x, y) == (31, 0) || (x, y) == (16, 15) { 0.0 } else { 1.0 });
    let corner = shown(&corner).unwrap();
    assert_eq!((corner.get(0, 1), corner.get(15, 1)), (picture.get(31, 0), picture.get(31, 0)));
    // Depth of another size is looked at where the texel's centre lies.
    let small = Image::from_fn(4, 2, |x, _| if x == 1 { f32::NAN } else { 1.0 });
    assert_eq!(shown(&small).unwrap().get(20, 7), picture.get(15, 7));
    assert!(shown(&Image::filled(2, 1, 1.0)).is_none(), "depth everywhere");
    assert_eq!(shown(&Image::filled(2, 1, 0.0)).unwrap(), picture);
}

#[test]
fn without_depth_everything_is_at_infinity() {
    let (turn, capture) = here();
    let sky = |d: Vec3| Vec3::new(1.0 + d.x, 1.0 + d.y, 1.0 + d.z);
    let world = world(64, |_| f32::INFINITY, sky, (turn, capture), &coarse());
    let mut random = StdRng::seed_from_u64(6);
    let mut measured = 0.0;
    for _ in 0..2000 {
        let (o, d) = (direction(&mut random) * 3.0, direction(&mut random));
        let ray = Ray::new(o, d);
        assert!(world.hit(&ray).is_none());
        assert!(world.infinity(d).distance(sky(turn.inverse() * d)) < 0.01);
        let sample = world.sample_light(o, Vec2::new(random.random(), random.random())).unwrap();
        assert!(sample.target == LightTarget::Infinity && matches!(world.reach(&ray, &sample), Some(None)));
        measured += world.light_pdf(o, d, None) * 4.0 * PI / 2000.0;
    }
    assert!((measured - 1.0).abs() < 0.05, "{measured}");
}

/// A board before the capture point, seen from behind by rays that pass its sides: the assumed sides get the light that they
/// face. Where all is equally bright they are as bright; beside a bright wall, the side that faces it is the brighter one.
#[test]
fn hidden_sides_are_lit_by_what_they_face() {
    let board = |d: Vec3| {
        let at = d / -d.z;
        d.z < 0.0 && at.x.abs() < 0.4 && at.y.abs() < 0.4
    };
    let distance = |d: Vec3| if board(d) { 1.0 / -d.z } else { box_room(d) };
    let sides = |hidden_samples: u32, radiance: &dyn Fn(Vec3) -> Vec3| {
        let options = CapturedOptions { irradiance_samples: 64, hidden_samples, ..coarse() };
        let world = world(512, distance, radiance, here(), &options);
        [-1.0f32, 1.0].map(|side| {
            let mut random = StdRng::seed_from_u64(5);
            let (mut sum, mut count) = (0.0, 0);
            for _ in 0..4000 {
                let from = Vec3::new(side * 1.2, random.random_range(-0.2..0.2), -1.2);
                let to = Vec3::new(side * 0.4, random.random_range(-0.2..0.2), random.random_range(-1.3..-1.05));
                let ray = Ray::new(here().1 + here().0 * from, here().0 * (to - from).normalize());
                let Some((hit, Some(FieldHit { hidden_side: Some(HiddenSide::BackFace(_)), .. }))) = world.nearest(&ray) else {
                    continue;
                };
                assert!((here().0.inverse() * hit.normal).x * side > 0.95, "{hit:?}");
                (sum, count) = (sum + world.hit(&ray).unwrap().radiance.unwrap().x, count + 1);
            }
            assert!(count > 2000, "{count}");
            sum / count as f32
        })
    };
    for side in sides(1, &|_| Vec3::ONE) {
        assert!((side - 1.0).abs() < 0.02, "{side}");
    }
    // The board sends out .2, the wall at −x 4.
    let beside_a_bright_wall = |d: Vec3| Vec3::splat(if !board(d) && (d * box_room(d)).x < LO.x + 1e-3 { 4.0 } else { 0.2 });
    let [left, right] = sides(1, &beside_a_bright_wall);
    assert!(left > 3.0 * right, "{left} {right}");
    // Without asking for that light both have the colour of their front.
    for side in sides(0, &beside_a_bright_wall) {
        assert!((side - 0.2).abs() < 0.01, "{side}");
    }
}
