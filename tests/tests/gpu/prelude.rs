//! The shared shader text against Rust.

use crate::Test;
use glam::{UVec2, Vec2, Vec4};
use pano_core::gpu::{Gpu, Kernel, LARGEST};
use pano_core::random::{Sampler, Stream};
use pano_core::sphere::{direction_from_uv, uv_from_direction};
use pano_tests::random::Random;
use pano_tests::shaders::PROBE;

pub(crate) const TESTS: &[Test] = &[
    ("prelude::angles", angles),
    ("prelude::directions_and_back", directions_and_back),
    ("prelude::what_is_not_finite_is_found", what_is_not_finite_is_found),
    ("prelude::random_numbers_are_the_same_bits", random_numbers_are_the_same_bits),
];

fn ask(gpu: &Gpu, entry: &'static str, given: &[Vec4], answers: usize, parameter: u32) -> Vec<Vec4> {
    let (input, output) = (gpu.upload_slice(given).unwrap(), gpu.buffer::<Vec4>(answers).unwrap());
    let kernel = Kernel { shader: &PROBE, entry, constants: &[] };
    let uniform = [given.len() as u32, parameter, 0, 0];
    gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &[(1, &input), (2, &output)], [given.len().div_ceil(64) as u32, 1, 1])
        .unwrap();
    gpu.read_slice(&output, answers).unwrap()
}

fn angles(gpu: &Gpu) {
    let mut random = Random::new(1);
    let mut given: Vec<Vec4> = (0..4000)
        .map(|_| Vec4::new(random.between(-100.0, 100.0), random.between(-2.0, 2.0), random.between(-2.0, 2.0), 0.0))
        .collect();
    // Axes, the origin, and what would be lost in squares.
    for (y, x) in [(0.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (1e-25, 2e-25), (1e25, 3e25), (1e-12, -1.0)] {
        given.push(Vec4::new(0.0, y, x, 0.0));
    }
    for (v, got) in given.iter().zip(ask(gpu, "angles", &given, given.len(), 0)) {
        let (sin, cos) = f64::from(v.x).sin_cos();
        // A hundred radians are 64 quarter turns, whose parts of π/2 are exact; the polynomials are good to an ulp of 1.
        assert!((f64::from(got.x) - sin).abs() < 3e-7 && (f64::from(got.y) - cos).abs() < 3e-7, "{v}: {got}");
        let want = f64::from(v.y).atan2(f64::from(v.z));
        // Along −x the sign of the angle is that of y, and −0 is none.
        assert!((f64::from(got.z).abs() - want.abs()).abs() < 5e-7 && (got.z * v.y >= 0.0), "{v}: {got}, {want}");
        let want = f64::from(v.y).hypot(f64::from(v.z));
        assert!((f64::from(got.w) - want).abs() <= 4e-7 * want, "{v}: {got}, {want}");
    }
}

fn directions_and_back(gpu: &Gpu) {
    let mut random = Random::new(2);
    let mut uvs: Vec<Vec2> = (0..2000).map(|_| Vec2::new(random.unit(), random.unit())).collect();
    // The seam, and both poles as near as pictures of 32768 rows come.
    uvs.extend([
        Vec2::new(0.0, 0.5),
        Vec2::new(0.999_999_9, 0.5),
        Vec2::new(0.3, 1.0 / 65536.0),
        Vec2::new(0.7, 1.0 - 1.0 / 65536.0),
    ]);
    let given: Vec<Vec4> = uvs.iter().map(|uv| Vec4::new(uv.x, uv.y, 0.0, 0.0)).collect();
    let got = ask(gpu, "directions", &given, 2 * given.len(), 0);
    for (uv, got) in uvs.iter().zip(got.chunks(2)) {
        let want = direction_from_uv(*uv);
        assert!(got[0].truncate().distance(want) < 1e-6, "{uv}: {} {want}", got[0]);
        let back = Vec2::new(got[1].x, got[1].y);
        let want = uv_from_direction(got[0].truncate());
        let gap = (back - want).abs();
        // Near a pole the same error of direction is a larger one of longitude.
        let sin = (uv.y * std::f32::consts::PI).sin().max(1e-9);
        assert!(gap.x.min(1.0 - gap.x) < 4e-7 / sin.min(1.0) && gap.y < 3e-7, "{uv}: {back} {want}");
        assert!((0.0..1.0).contains(&back.x) && (0.0..=1.0).contains(&back.y), "{uv}: {back}");
    }
}

fn what_is_not_finite_is_found(gpu: &Gpu) {
    let values = [0.0, -0.0, 1.0, f32::MAX, f32::MIN, 1e-40, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN];
    let given = values.map(|v| Vec4::new(v, 0.0, 0.0, 0.0));
    for (v, got) in values.iter().zip(ask(gpu, "finite", &given, given.len(), 0)) {
        assert_eq!((got.x == 1.0, got.y == 1.0), (v.is_finite(), v.is_nan()), "{v}");
        if v.is_finite() {
            assert!((got.z - v.clamp(-LARGEST, LARGEST)).abs() <= f32::MIN_POSITIVE, "{v}: {}", got.z);
        }
    }
}

fn random_numbers_are_the_same_bits(gpu: &Gpu) {
    let mut random = Random::new(3);
    let asked: Vec<[u32; 4]> =
        (0..3000).map(|_| [random.below(9000), random.below(9000), random.below(1 << 18), random.below(1000)]).collect();
    let given: Vec<Vec4> = asked.iter().map(|a| Vec4::from_array(a.map(f32::from_bits))).collect();
    let seed = 77;
    for (a, got) in asked.iter().zip(ask(gpu, "random", &given, given.len(), seed)) {
        let mut sampler = Sampler::new(UVec2::new(a[0], a[1]), a[2], Stream { frame: a[3], seed });
        sampler.next_4d();
        assert_eq!(got.to_array().map(f32::to_bits), sampler.next_4d().map(f32::to_bits), "{a:?}");
    }
}
