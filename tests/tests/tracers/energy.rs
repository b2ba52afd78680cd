//! Energy: a virtual sheet on a real plane, of the plane's own reflectance, changes nothing.

use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::image::RadianceImage;
use pano_core::material::Material;
use pano_core::sphere;
use pano_tests::rooms::{captured, plane_depth, texel_direction};
use pano_tests::scenes::{Lamp, TestScene, placed, prepared, sky, view};
use pano_tests::statistics::{Estimate, sidak_bound};
use pano_trace::objects::Objects;
use pano_trace::tracer::{Method, TraceParams};
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, RealWorld, Reflectance};
use std::f32::consts::PI;
use std::sync::Arc;

const ALBEDO: Vec3 = Vec3::new(0.7, 0.5, 0.3);
const REPETITIONS: u32 = 24;

fn day() -> RadianceImage {
    let sun = Lamp { direction: Vec3::new(0.5, 0.8, 0.3).normalize(), cos_radius: 0.98, radiance: Vec3::new(9.0, 8.0, 7.0) };
    sky(128, Vec3::new(0.1, 0.2, 0.1), Vec3::new(0.4, 0.6, 1.0), &[sun])
}

/// What a plane that faces up sends back under `sky`.
fn lit_plane(sky: &RadianceImage) -> Vec3 {
    let (w, h) = sky.size();
    let mut irradiance = Vec3::ZERO;
    for y in 0..h / 2 {
        let weight = sphere::pixel_solid_angle(w, h, y) as f32;
        irradiance += (0..w).map(|x| sky.get(x, y) * (weight * texel_direction(w, h, x, y).y)).sum::<Vec3>();
    }
    ALBEDO * irradiance / PI
}

/// Renders the sheet by all methods; the composite over the plane's radiance must stay what it was, in every block.
/// `slack` is the relative error that the world's own discretisation may cause.
fn sheet_changes_nothing<W: RealWorld>(world: W, photo: Vec3, height: f32, bounces: u32, slack: f64) {
    let turn = Quat::from_rotation_y(0.5);
    let sheet = placed(
        &prepared(primitives::plane(Vec2::new(0.8, 0.6))),
        Affine3A::from_rotation_translation(turn, Vec3::new(0.1, height, -1.0)),
        Material::diffuse(ALBEDO),
    );
    // From the capture point, so that photo and world are one.
    let camera = view(Vec3::Y * 1.5, Vec3::new(0.1, 0.0, -1.0), 40.0, 32, 32);
    let scene = TestScene { world, objects: Objects::new(&[sheet]), camera };
    for method in [Method::Dpt, Method::OnePass, Method::TwoPass] {
        let params = TraceParams { method, samples: 4, bounces, ..TraceParams::default() };
        let mut blocks = vec![Vec::new(); 16];
        let mut covered = 0.0;
        for seed in 0..REPETITIONS {
            let layers = scene.trace(&params, seed).layers;
            covered += layers.coverage.data().iter().sum::<f32>() / 1024.0 / REPETITIONS as f32;
            for (b, block) in blocks.iter_mut().enumerate() {
                let pixels = (0..64).map(|i| (b % 4 * 8 + i % 8, b / 4 * 8 + i / 8));
                let change = |(x, y)| layers.object.get(x, y) + layers.delta.get(x, y) - photo * layers.coverage.get(x, y);
                block.push(pixels.map(|at| f64::from((change(at) / photo).element_sum()) / 3.0 / 64.0).sum::<f64>());
            }
        }
        assert!(covered > 0.2 && covered < 0.8, "the sheet and the plane are both seen: {covered}");
        // Student's t of 23 degrees of freedom is a quarter wider out there.
        let bound = 1.25 * sidak_bound(blocks.len(), 1e-3);
        for (b, block) in blocks.iter().enumerate() {
            let change = Estimate::of(block);
            assert!(
                change.mean.abs() <= bound * change.error + slack,
                "{method:?}, block {b}: relative change {change:?}, {bound} SE allowed"
            );
            assert!(change.error < 0.02, "{method:?}, block {b}: {change:?} tells too little");
        }
    }
}

#[test]
fn a_sheet_of_the_planes_albedo_changes_nothing_on_a_proxy() {
    let sky = day();
    let photo = lit_plane(&sky);
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(8.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(ALBEDO),
    };
    for bounces in [1, 3] {
        let world = ProxyWorld::new(Arc::new(sky.clone()), Quat::IDENTITY, Vec3::Y * 1.5, std::slice::from_ref(&plane));
        sheet_changes_nothing(world, photo, 1e-3, bounces, 2e-3);
    }
}

#[test]
fn a_sheet_of_the_planes_albedo_changes_nothing_on_a_captured_plane() {
    let width = 512;
    let sky = day();
    let photo = lit_plane(&sky);
    let depth = plane_depth(width, 1.5);
    let picture = RadianceImage::from_fn(width, width / 2, |x, y| {
        let d = texel_direction(width, width / 2, x, y);
        if depth.get(x, y).is_finite() { photo } else { sphere::bilinear(&sky, sphere::uv_from_direction(d)) }
    });
    for bounces in [1, 3] {
        // Rays leave a captured surface 0.3 ‰ of its distance above it; the sheet lies above that.
        let world = captured(&picture, &depth, Quat::IDENTITY, Vec3::Y * 1.5);
        sheet_changes_nothing(world, photo, 4e-3, bounces, 0.01);
    }
}
