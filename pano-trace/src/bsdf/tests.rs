use super::*;
use pano_core::random::{Sampler, Stream};
use proptest::prelude::*;
use std::f32::consts::TAU;

fn params() -> BsdfParams<'static> {
    BsdfParams {
        base_color: Vec3::ONE,
        metallic: 0.0,
        alpha: 0.3,
        specular: 0.0,
        specular_color: Vec3::ONE,
        ior: 1.5,
        transmission: 0.0,
        thin: false,
        coat: None,
    }
}

/// Every kind of surface there is, under names that say what a failure is about.
fn all(coat: &CoatTable) -> Vec<(&'static str, BsdfParams<'_>)> {
    let p = params();
    vec![
        ("lambert", p),
        ("smooth metal", BsdfParams { metallic: 1.0, alpha: 0.0, ..p }),
        ("metal 0.06", BsdfParams { metallic: 1.0, alpha: 0.06, ..p }),
        ("metal 0.1", BsdfParams { metallic: 1.0, alpha: 0.1, ..p }),
        ("metal 1", BsdfParams { metallic: 1.0, alpha: 1.0, ..p }),
        ("coated 0", BsdfParams { alpha: 0.0, specular: 1.0, coat: Some(coat), ..p }),
        ("coated 0.2", BsdfParams { alpha: 0.2, specular: 1.0, coat: Some(coat), ..p }),
        ("coated 1", BsdfParams { alpha: 1.0, specular: 0.5, coat: Some(coat), ..p }),
        ("half metal", BsdfParams { alpha: 0.3, metallic: 0.5, specular: 1.0, coat: Some(coat), ..p }),
        ("glass", BsdfParams { alpha: 0.0, transmission: 1.0, ..p }),
        ("rough glass 0.05", BsdfParams { alpha: 0.05, transmission: 1.0, ..p }),
        ("rough glass 0.5", BsdfParams { alpha: 0.5, transmission: 1.0, ..p }),
        ("thin glass", BsdfParams { alpha: 0.0, transmission: 1.0, thin: true, ..p }),
        ("half glass", BsdfParams { alpha: 0.2, transmission: 0.5, specular: 1.0, coat: Some(coat), ..p }),
    ]
}

fn direction(cos: f32, phi: f32) -> Vec3 {
    let s = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(s * phi.cos(), s * phi.sin(), cos)
}

fn numbers(n: u32) -> impl Iterator<Item = [f32; 4]> {
    (0..n).map(|i| Sampler::new(glam::UVec2::ZERO, i, Stream::default()).next_4d())
}

/// White furnace: white surfaces reflect (and let through) all light, but for what single scattering between microfacets
/// loses, and never more.
#[test]
fn white_furnace() {
    let coat = CoatTable::new(1.5);
    for (name, p) in all(&coat) {
        for cos in [1.0f32, 0.7, 0.3, 0.05, -0.05, -0.6] {
            if cos < 0.0 && p.transmission == 0.0 {
                continue;
            }
            let bsdf = Bsdf::new(&p, Vec3::Z, Vec3::Z, direction(cos, 0.4));
            let n = 16384;
            // Radiance is squeezed into a body by η²: undo it to count energy.
            let energy = |s: BsdfSample| {
                let crossed = (s.direction.z > 0.0) != (cos > 0.0);
                let eta = if cos > 0.0 { p.ior } else { 1.0 / p.ior };
                s.weight.x * if crossed && !p.thin { eta * eta } else { 1.0 }
            };
            let total: f32 = numbers(n).filter_map(|u| bsdf.sample(u)).map(energy).sum::<f32>() / n as f32;
            assert!(total < 1.012, "{name} at cos {cos}: {total}");
            // GGX has long tails: even at α = 0.06 a few per cent of a slanting ray meet a second microfacet.
            let lossless = p.metallic == 0.0 && p.transmission == 0.0 || p.alpha == 0.0;
            let expected = if lossless {
                0.985
            } else if p.alpha < 0.1 && cos.abs() > 0.1 {
                0.95
            } else {
                0.3
            };
            assert!(total > expected, "{name} at cos {cos}: {total}");
        }
    }
}

/// The roughest metal seen head on: ∫D cos G₂ has the closed form 1 − ln 2.
#[test]
fn roughest_metal_reflects_one_minus_ln_two() {
    let bsdf = Bsdf::new(&BsdfParams { metallic: 1.0, alpha: 1.0, ..params() }, Vec3::Z, Vec3::Z, Vec3::Z);
    let n = 65536;
    let total: f32 = numbers(n).filter_map(|u| bsdf.sample(u)).map(|s| s.weight.x).sum::<f32>() / n as f32;
    assert!((total - (1.0 - std::f32::consts::LN_2)).abs() < 2e-3, "{total}");
}

#[test]
fn reciprocity() {
    let coat = CoatTable::new(1.5);
    for (name, p) in all(&coat) {
        for u in numbers(300) {
            let (a, b) = (direction(u[0] * 0.98 + 0.01, u[1] * TAU), direction(u[2] * 0.98 + 0.01, u[3] * TAU));
            // Through a body, f/η² is symmetric: with b below the surface the radiances differ by the squared index.
            for (b, factor) in [(b, 1.0), (-b, p.ior * p.ior)] {
                let forth = Bsdf::new(&p, Vec3::Z, Vec3::Z, a).eval(b).f_cos / b.z.abs();
                let back = Bsdf::new(&p, Vec3::Z, Vec3::Z, b).eval(a).f_cos / a.z.abs();
                if b.z > 0.0 || p.transmission > 0.0 {
                    let (f, g) = (forth.x * factor, back.x);
                    assert!((f - g).abs() <= 2e-3 * (f.abs() + g.abs()) + 1e-5, "{name}: {a} {b}: {f} {g}");
                }
            }
        }
    }
}

/// χ² of sampled directions against the density, integrated over cells of the sphere.
#[test]
fn samples_follow_the_pdf_chi_squared() {
    let coat = CoatTable::new(1.5);
    for (name, p) in all(&coat) {
        for cos in [0.95f32, 0.5, 0.1, -0.7] {
            if cos < 0.0 && p.transmission == 0.0 {
                continue;
            }
            let bsdf = Bsdf::new(&p, Vec3::Z, Vec3::Z, direction(cos, 1.0));
            let (nz, np) = (16usize, 16usize);
            let bin = |d: Vec3| {
                let phi = (d.y.atan2(d.x) / TAU).rem_euclid(1.0);
                (((d.z * 0.5 + 0.5) * nz as f32) as usize).min(nz - 1) * np + ((phi * np as f32) as usize).min(np - 1)
            };
            let n = 100_000u32;
            let mut observed = vec![0f64; nz * np];
            let mut state = 7u32;
            let mut next = || {
                state = pano_core::random::combine(state, 3);
                (state >> 8) as f32 / (1 << 24) as f32
            };
            for _ in 0..n {
                if let Some(s) = bsdf.sample([next(), next(), next(), next()])
                    && !s.specular
                {
                    observed[bin(s.direction)] += 1.0;
                }
            }
            let (m, mp) = (1600, 640);
            let mut expected = vec![0f64; nz * np];
            for i in 0..m {
                for j in 0..mp {
                    let d = direction(2.0 * (i as f32 + 0.5) / m as f32 - 1.0, (j as f32 + 0.5) / mp as f32 * TAU);
                    expected[bin(d)] += f64::from(bsdf.eval(d).pdf_solid_angle) * 4.0 * std::f64::consts::PI / (m * mp) as f64;
                }
            }
            let total: f64 = expected.iter().sum();
            assert!(total < 1.01, "{name} at {cos}: the density integrates to {total}");
            let (mut chi2, mut dof) = (0.0, 0);
            for (o, e) in observed.iter().zip(expected.iter().map(|e| e * f64::from(n))) {
                if e > 20.0 {
                    // The quadrature's own error, 1 % a cell at sharp peaks, adds to Poisson's.
                    chi2 += (o - e).powi(2) / (e + (0.01 * e).powi(2));
                    dof += 1;
                }
            }
            assert!(
                chi2 <= f64::from(dof) + 6.0 * (2.0 * f64::from(dof)).sqrt() + 1.0,
                "{name} at {cos}: χ² {chi2} with {dof} cells"
            );
        }
    }
}

#[test]
fn mirrors_and_glass_follow_the_laws_of_reflection_and_refraction() {
    let out = direction(0.6, 0.0);
    let mirror = Bsdf::new(&BsdfParams { metallic: 1.0, alpha: 0.0, ..params() }, Vec3::Z, Vec3::Z, out);
    let s = mirror.sample([0.3, 0.6, 0.5, 0.5]).unwrap();
    assert!(s.specular && s.direction.distance(Vec3::new(-out.x, 0.0, 0.6)) < 1e-6 && s.weight.distance(Vec3::ONE) < 1e-6);
    let glass = Bsdf::new(&BsdfParams { transmission: 1.0, alpha: 0.0, ..params() }, Vec3::Z, Vec3::Z, out);
    let s = glass.sample([0.3, 0.6, 0.5, 0.99]).unwrap();
    assert!((s.direction.x + 0.8 / 1.5).abs() < 1e-6 && s.direction.z < 0.0);
    // From inside at a grazing angle everything is reflected.
    let inside = Bsdf::new(&BsdfParams { transmission: 1.0, alpha: 0.0, ..params() }, Vec3::Z, Vec3::Z, direction(-0.3, 0.0));
    assert!(numbers(64).all(|u| inside.sample(u).is_some_and(|s| s.direction.z < 0.0)));
}

#[test]
fn exact_fresnel() {
    assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-6);
    assert_eq!(dielectric(0.1, 1.0 / 1.5), 1.0);
    // Brewster's angle: the parallel part vanishes, the perpendicular one is ((η²−1)/(η²+1))²/… = half of it remains.
    let brewster = 1.0 / (1.0 + 1.5f32 * 1.5).sqrt();
    assert!((dielectric(brewster, 1.5) - 0.5 * ((1.5f32 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0)).powi(2)).abs() < 1e-6);
}

proptest! {
    /// Whatever the parameters, the directions and the numbers: finite, non-negative, weight = f·cos/pdf.
    #[test]
    fn everything_stays_finite(
        color in 0.0f32..=1.0, metallic in 0.0f32..=1.0, alpha in 0.0f32..=1.0, specular in 0.0f32..=1.0, transmission in 0.0f32..=1.0,
        ior in 1.0f32..3.0, thin: bool, z in -1.0f32..=1.0, tilt in -1.5f32..1.5, u in prop::array::uniform4(0.0f32..1.0),
    ) {
        let coat = CoatTable::new(1.5);
        let p = BsdfParams { base_color: Vec3::splat(color), metallic, alpha, specular, specular_color: Vec3::ONE, ior, transmission, thin, coat: Some(&coat) };
        let shading = Vec3::new(tilt.sin(), 0.0, tilt.cos());
        let bsdf = Bsdf::new(&p, Vec3::Z, shading, direction(z, 0.3));
        if let Some(s) = bsdf.sample(u) {
            prop_assert!(s.direction.is_normalized());
            prop_assert!(s.weight.is_finite() && s.weight.min_element() >= 0.0, "{s:?}");
            if !s.specular {
                let v = bsdf.eval(s.direction);
                prop_assert!(v.pdf_solid_angle.is_finite());
                // Sampled and evaluated values agree but for rounding at the rims of narrow lobes.
                if alpha > 0.05 && v.pdf_solid_angle > 1e-3 {
                    prop_assert!((v.f_cos / v.pdf_solid_angle - s.weight).abs().max_element() <= 0.02 * (1.0 + s.weight.max_element()), "{v:?} {s:?}");
                }
            }
        }
    }
}
