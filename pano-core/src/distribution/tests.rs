use super::*;
use crate::{image::Image, random, sphere};
use glam::{UVec2, Vec2, Vec3};
use proptest::prelude::*;

fn points(n: u32, seed: u32) -> impl Iterator<Item = Vec2> {
    (0..n).map(move |i| random::Sampler::new(UVec2::new(seed, 0), i, random::Stream::default()).next_2d())
}

/// A picture with a sun, an edge and noise.
fn sun_picture(w: usize, h: usize, seed: usize) -> Image<f32> {
    let mut image = Image::from_fn(w, h, |x, y| ((x * 7 + y * 13 + seed) % 11) as f32 * 0.1);
    image.set(seed % w, (seed / 3) % h, 300.0);
    image
}

#[test]
fn nothing_to_sample_is_none() {
    assert!(Distribution1d::new(&[]).is_none());
    assert!(Distribution1d::new(&[0.0, f32::NAN, -1.0, f32::INFINITY]).is_none());
    assert!(SphereDistribution::new(&Image::filled(4, 2, 0.0)).is_none());
}

#[test]
fn a_constant_sphere_is_uniform() {
    let d = SphereDistribution::new(&Image::filled(64, 32, 2.0)).unwrap();
    let uniform = 0.25 / std::f32::consts::PI;
    for u in points(1000, 0) {
        let s = d.sample(u).unwrap();
        // sin θ varies by half a cell (π/32/2) around the mean of the cell, relatively by that over tan θ.
        let theta = s.direction.y.acos();
        let bound = 0.5 * std::f32::consts::PI / 32.0 / theta.tan().abs();
        assert!((s.pdf_solid_angle / uniform - 1.0).abs() < 1.2 * bound + 2e-3 || s.direction.y.abs() > 0.95, "{s:?}");
    }
}

/// χ² over equal-area cells of the sphere, poles and seam included, against the pdf integrated numerically.
#[test]
fn samples_follow_the_pdf_chi_squared() {
    for (w, h, seed) in [(16, 8, 0), (16, 8, 15), (7, 5, 100), (2, 1, 1), (1, 1, 0), (33, 16, 33 * 3)] {
        let d = SphereDistribution::new(&sun_picture(w, h, seed)).unwrap();
        let (nu, nz) = (12usize, 9usize);
        let bin = |d: Vec3| {
            let u = sphere::uv_from_direction(d).x;
            ((u * nu as f32) as usize).min(nu - 1) + nu * (((1.0 - d.y) * 0.5 * nz as f32) as usize).min(nz - 1)
        };
        let n = 200_000u32;
        let mut observed = vec![0f64; nu * nz];
        let mut drawn = 0.0;
        let mut rng = random::hash(seed as u32 + 1);
        let mut next = || {
            rng = random::combine(rng, 1);
            (rng >> 8) as f32 / (1u32 << 24) as f32
        };
        for _ in 0..n {
            if let Some(s) = d.sample(Vec2::new(next(), next())) {
                // Near the poles and at cell borders rounding moves a direction; the density is steep next to the sun.
                if s.direction.y.abs() < 0.99 {
                    assert!((d.pdf(s.direction) / s.pdf_solid_angle - 1.0).abs() < 0.01, "{w}×{h}: {s:?} {}", d.pdf(s.direction));
                }
                observed[bin(s.direction)] += 1.0;
                drawn += 1.0;
            }
        }
        let mut expected = vec![0f64; nu * nz];
        let m = 1260;
        for i in 0..m {
            for j in 0..m {
                let dir = sphere::direction_from_uv(Vec2::new((i as f32 + 0.5) / m as f32, (j as f32 + 0.5) / m as f32));
                expected[bin(dir)] += f64::from(d.pdf(dir)) * sphere::pixel_solid_angle(m, m, j);
            }
        }
        let sum: f64 = expected.iter().sum();
        assert!((sum - 1.0).abs() < 3e-3, "{w}×{h}: the pdf integrates to {sum}");
        let (mut chi2, mut dof) = (0.0, 0);
        for (o, e) in observed.iter().zip(&expected) {
            let e = e / sum * drawn;
            if e > 10.0 {
                chi2 += (o - e).powi(2) / e;
                dof += 1;
            }
        }
        // Mean dof, standard deviation √(2·dof); the quadrature of the expectation adds a little.
        assert!(chi2 < dof as f64 + 6.0 * (2.0 * dof as f64).sqrt(), "{w}×{h}: χ² {chi2} with {dof} bins");
    }
}

#[test]
fn luminance_over_pdf_is_nearly_constant_beside_a_sun() {
    let mut image = Image::filled(64, 32, 0.1);
    image.set(20, 16, 1e5);
    let d = SphereDistribution::new(&image).unwrap();
    let ratios: Vec<f32> = points(2000, 9)
        .map(|u| d.sample(u).unwrap())
        // The few samples far from the sun lie at other latitudes, where sin θ varies more.
        .filter(|s| s.direction.dot(sphere::direction_from_uv(Vec2::new(20.5 / 64.0, 16.5 / 32.0))) > 0.9)
        .map(|s| sphere::bilinear(&image, sphere::uv_from_direction(s.direction)) / s.pdf_solid_angle)
        .collect();
    let (lo, hi) = ratios.iter().fold((f32::MAX, 0f32), |(l, h), &r| (l.min(r), h.max(r)));
    assert!(hi / lo < 1.02, "{lo} {hi}");
}

proptest! {
    #[test]
    fn one_dimension_finds_every_index_in_proportion(weights in prop::collection::vec(0.0f32..10.0, 1..40), extra in 0usize..40) {
        let mut weights = weights;
        let k = extra % weights.len();
        weights[k] += 0.5;
        let d = Distribution1d::new(&weights).unwrap();
        let total: f32 = weights.iter().sum();
        let n = 4096;
        let mut counts = vec![0f32; weights.len()];
        for i in 0..n {
            let (index, rest) = d.sample((i as f32 + 0.5) / n as f32);
            prop_assert!((0.0..1.0).contains(&rest));
            counts[index] += 1.0;
        }
        for (i, w) in weights.iter().enumerate() {
            prop_assert!((d.probability(i) - w / total).abs() < 1e-5);
            // Stratified samples: at most one off at each end of the interval.
            prop_assert!((counts[i] - w / total * n as f32).abs() <= 2.01, "{i}: {} {}", counts[i], w / total * n as f32);
        }
    }

    #[test]
    fn the_sphere_integrates_its_own_picture(seed in 0usize..2000, w in 1usize..20, h in 1usize..12) {
        // E[f/p] = ∫f for f = a smooth function times the interpolated picture.
        let image = sun_picture(w, h, seed);
        let d = SphereDistribution::new(&image).unwrap();
        let f = |dir: Vec3| f64::from(sphere::bilinear(&image, sphere::uv_from_direction(dir))) * f64::from(1.0 + dir.x);
        let n = 4096;
        let estimate: f64 = points(n, seed as u32).filter_map(|u| d.sample(u)).map(|s| f(s.direction) / f64::from(s.pdf_solid_angle)).sum::<f64>() / f64::from(n);
        let m = 512;
        let mut exact = 0.0;
        for j in 0..m {
            let weight = sphere::pixel_solid_angle(m, m, j);
            for i in 0..m {
                exact += f(sphere::direction_from_uv(Vec2::new((i as f32 + 0.5) / m as f32, (j as f32 + 0.5) / m as f32))) * weight;
            }
        }
        prop_assert!((estimate / exact - 1.0).abs() < 0.02, "{estimate} {exact}");
    }
}
