//! What shadows and sizes cost, in rays, which do not depend on the machine.

use super::*;
use crate::test_scenes::{ball, lamp, under};
use pano_core::builtin::primitives;

/// The paper's case: an object on a table under one lamp, most of the picture without a penumbra.
fn teapot_on_a_table() -> (Objects, Lighting) {
    let knot = primitives::torus_knot(2, 3, 0.3, 0.1, 200, 24);
    (objects([(knot, Vec3::new(0.0, 0.45, 0.0), Material::default())]), under(vec![lamp(Vec3::new(0.6, 1.0, 0.3), 4.0, 2.0)]))
}

#[test]
fn adaptive_shadows_cost_a_fraction_of_all_samples() {
    let (objects, lighting) = teapot_on_a_table();
    for samples in [20u32, 50] {
        let [soft, adaptive] = [Shadow::Soft, Shadow::Adaptive]
            .map(|shadow| lit(&objects, &lighting, |p| (p.shadow, p.shadow_samples, p.samples) = (shadow, samples, 1)));
        let ratio = soft.shadow_rays as f64 / adaptive.shadow_rays as f64;
        println!("{samples} samples: {} shadow rays, adaptive {}, {ratio:.1}×", soft.shadow_rays, adaptive.shadow_rays);
        assert!(ratio >= 4.0, "{samples} samples: {ratio}");
    }
}

#[test]
fn rays_do_not_depend_on_the_number_of_triangles() {
    let lighting = under(vec![lamp(Vec3::new(0.6, 1.0, 0.3), 4.0, 2.0)]);
    let rays = |level: usize| {
        let mesh = primitives::icosphere(0.5, level);
        let things = objects([(mesh, Vec3::Y * 0.6, Material::default())]);
        lit(&things, &lighting, |p| p.samples = 1).traced.rays as f64
    };
    let (coarse, fine) = (rays(3), rays(6));
    assert!((fine / coarse - 1.0).abs() < 0.02, "{coarse} {fine}");
}

#[test]
fn pixels_that_nothing_changes_cost_one_look_and_no_shadow_ray() {
    let lighting = under(vec![lamp(Vec3::Y, 1.0, 1.0)]);
    let out = lit(&ball(Vec3::new(0.0, 0.5, 0.0), 0.05, Material::default()), &lighting, |p| p.samples = 16);
    let pixels = (SIZE * SIZE) as u64;
    let primary = out.traced.rays - out.shadow_rays;
    let touched = out.shadows[0].data().iter().filter(|s| **s < 1.0).count() as u64;
    assert!((1..20).contains(&touched) && primary < pixels + pixels / 4, "{primary} rays for {pixels} pixels");
    assert!(out.shadow_rays < pixels, "{} shadow rays", out.shadow_rays);
}
