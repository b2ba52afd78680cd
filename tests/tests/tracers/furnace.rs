//! Places in which radiance is 1 everywhere: nothing that reflects all light can be seen in them.

use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::image::RadianceImage;
use pano_core::material::Material;
use pano_core::mesh::Mesh;
use pano_tests::rooms::{captured_with_cap, constant};
use pano_tests::scenes::{TestScene, panorama_view, placed, prepared, view};
use pano_tests::statistics::Estimate;
use pano_trace::objects::{Objects, Placement};
use pano_trace::tracer::{Method, TraceParams, Traced};
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, Reflectance};
use std::sync::Arc;

const DIFFERENTIAL: [Method; 3] = [Method::Dpt, Method::OnePass, Method::TwoPass];

/// Albedo ½ and emission ½.
fn half() -> Material {
    Material { emissive: Vec3::splat(0.5), ..Material::diffuse(Vec3::splat(0.5)) }
}

/// A sphere seen from inside. Its faces are flat: normals between those of faces would lose light at grazing angles.
fn hollow_sphere(radius: f32) -> Mesh {
    let mut mesh = primitives::icosphere(radius, 3);
    mesh.normals.clear();
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

fn black() -> Arc<RadianceImage> {
    Arc::new(constant(8, Vec3::ZERO))
}

fn white() -> Arc<RadianceImage> {
    Arc::new(constant(8, Vec3::ONE))
}

/// Mean over the pixels (all channels) and its standard error.
fn over_pixels(values: impl Iterator<Item = Vec3>) -> Estimate {
    Estimate::of(&values.map(|v| f64::from(v.element_sum()) / 3.0).collect::<Vec<_>>())
}

/// 4 standard errors are exceeded by one in 16 000 right answers, and seeds are fixed; rounding adds a little.
fn assert_near(what: &str, found: Estimate, expected: f64) {
    assert!((found.mean - expected).abs() < 4.0 * found.error + 2e-5, "{what}: {found:?}, expected {expected}");
    assert!(found.error < 0.01, "{what}: {found:?} tells too little");
}

/// Object, as seen where it covers the pixel, and delta.
fn layers(traced: &Traced) -> (Estimate, Estimate) {
    let l = &traced.layers;
    assert_eq!(traced.discarded, 0);
    let pairs = l.object.data().iter().zip(l.coverage.data());
    let object = over_pixels(pairs.filter(|(_, c)| **c > 0.0).map(|(o, c)| *o / *c));
    (object, over_pixels(l.delta.data().iter().copied()))
}

#[test]
fn inside_a_sphere_of_albedo_and_emission_one_half_radiance_is_one() {
    let shell = placed(&prepared(hollow_sphere(2.0)), Affine3A::IDENTITY, half());
    let camera = panorama_view(Vec3::new(0.7, 0.3, -0.4), 32);
    let scene =
        TestScene { world: ProxyWorld::new(black(), Quat::IDENTITY, Vec3::ZERO, &[]), objects: Objects::new(&[shell]), camera };
    for method in DIFFERENTIAL {
        for bounces in [1, 2, 3, 5, 64] {
            let traced = scene.trace(&TraceParams { method, samples: 32, bounces, ..TraceParams::default() }, 0);
            assert!(traced.layers.coverage.data().iter().all(|&c| c == 1.0));
            // Emission, and what n scattering events add: ½ + ¼ + …
            let expected = 1.0 - 0.5f64.powi(bounces as i32 + 1);
            assert_near(&format!("{method:?}, {bounces} bounces"), layers(&traced).0, expected);
        }
    }
}

/// A white real surface inside the shell: black without it, of radiance 1 with it.
#[test]
fn a_white_surface_in_the_sphere_changes_from_black_to_one() {
    let shell = placed(&prepared(hollow_sphere(3.0)), Affine3A::IDENTITY, half());
    let proxies = [
        Proxy {
            shape: ProxyShape::Plane(Vec2::splat(2.0)),
            world_from_local: Affine3A::from_translation(Vec3::NEG_Y),
            reflectance: Reflectance::Known(Vec3::ONE),
        },
        Proxy {
            shape: ProxyShape::Mesh(prepared(primitives::cuboid(Vec3::splat(0.5)))),
            world_from_local: Affine3A::from_translation(Vec3::new(0.2, -0.6, 0.1)),
            reflectance: Reflectance::Known(Vec3::ONE),
        },
    ];
    let world = ProxyWorld::new(black(), Quat::IDENTITY, Vec3::ZERO, &proxies);
    let camera = view(Vec3::new(0.0, 0.5, 1.6), Vec3::new(0.0, -0.8, 0.0), 60.0, 24, 24);
    let scene = TestScene { world, objects: Objects::new(&[shell]), camera };
    for method in DIFFERENTIAL {
        let traced = scene.trace(&TraceParams { method, samples: 64, bounces: 64, ..TraceParams::default() }, 1);
        let l = &traced.layers;
        // Whatever a pixel shows, it shows radiance 1.
        assert_near(&format!("{method:?}"), over_pixels(l.object.data().iter().zip(l.delta.data()).map(|(o, d)| *o + *d)), 1.0);
        let real = over_pixels(l.delta.data().iter().zip(l.coverage.data()).filter(|(_, c)| **c == 0.0).map(|(d, _)| *d));
        assert_near(&format!("{method:?}, real"), real, 1.0);
    }
}

/// Materials that give back all light, and how many bounces that takes.
fn lossless() -> Vec<(&'static str, Material, u32)> {
    vec![
        ("diffuse", Material::diffuse(Vec3::ONE), 1),
        ("coated", Material { base_color: Vec3::ONE, roughness: 0.7, ..Material::default() }, 1),
        ("mirror", Material::metal(Vec3::ONE, 0.0), 1),
        ("glass", Material::glass(1.5, 0.0), 64),
        ("thin glass", Material { thin: true, ..Material::glass(1.5, 0.0) }, 64),
        ("half mirror", Material { metallic: 0.5, roughness: 0.0, ..Material::diffuse(Vec3::ONE) }, 1),
    ]
}

#[test]
fn lossless_objects_are_invisible_in_a_white_furnace() {
    let mesh = prepared(primitives::icosphere(1.0, 4));
    let camera = view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 45.0, 24, 24);
    for (name, material, bounces) in lossless() {
        let world = ProxyWorld::new(white(), Quat::from_rotation_y(0.3), Vec3::ZERO, &[]);
        let scene = TestScene { world, objects: Objects::new(&[placed(&mesh, Affine3A::IDENTITY, material)]), camera };
        for method in DIFFERENTIAL.into_iter().chain((bounces == 1).then_some(Method::Ibl)) {
            let traced = scene.trace(&TraceParams { method, samples: 64, bounces, ..TraceParams::default() }, 2);
            let (object, delta) = layers(&traced);
            // The coat's tabulated energy is good to 0.2 %; smooth normals of the coarse sphere cost as much at its rim.
            let slack = if name == "coated" || name == "diffuse" { 4e-3 } else { 0.0 };
            let rounded = Estimate { mean: object.mean - (object.mean - 1.0).clamp(-slack, slack), ..object };
            assert_near(&format!("{name}, {method:?}"), rounded, 1.0);
            assert_eq!(delta.mean, 0.0);
        }
    }
}

/// With enough bounces a white object on a white plane neither shows nor casts a shadow.
#[test]
fn a_white_object_on_a_white_plane_is_invisible_in_a_white_furnace() {
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(3.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(Vec3::ONE),
    };
    let mut cube = primitives::cuboid(Vec3::splat(0.6));
    cube.normals.clear();
    let object = placed(
        &prepared(cube),
        Affine3A::from_rotation_translation(Quat::from_rotation_y(0.4), Vec3::new(0.0, 0.35, 0.0)),
        Material::diffuse(Vec3::ONE),
    );
    let world = ProxyWorld::new(white(), Quat::IDENTITY, Vec3::Y, &[plane]);
    let camera = view(Vec3::new(0.3, 1.5, 2.0), Vec3::new(0.0, 0.2, 0.0), 45.0, 24, 24);
    let scene = TestScene { world, objects: Objects::new(&[object]), camera };
    for method in DIFFERENTIAL {
        let traced = scene.trace(&TraceParams { method, samples: 64, bounces: 64, ..TraceParams::default() }, 3);
        let (object, delta) = layers(&traced);
        assert_near(&format!("{method:?} object"), object, 1.0);
        assert_near(&format!("{method:?} delta"), delta, 0.0);
    }
}

/// The captured version: a panorama of radiance 1 on a sphere all around.
#[test]
fn radiance_in_a_captured_furnace_is_one() {
    let depth = constant(64, Vec3::splat(2.0)).map(|d| d.x);
    let turn = Quat::from_rotation_y(1.1);
    let capture = Vec3::new(0.2, 1.0, -0.3);
    let sphere = prepared(primitives::icosphere(0.4, 4));
    // Flat faces: rays at the rim of a smooth-shaded ball may end between its true and its shading side.
    let mut flat = primitives::icosphere(0.4, 2);
    flat.normals.clear();
    let flat = prepared(flat);
    let at = |p: Vec3| Affine3A::from_translation(capture + p);
    let objects: [Placement; 4] = [
        placed(&flat, at(Vec3::new(0.0, 0.3, -1.0)), half()),
        placed(&flat, at(Vec3::new(1.0, -0.2, 0.0)), Material::diffuse(Vec3::ONE)),
        placed(&flat, at(Vec3::new(-1.0, 0.0, 0.0)), Material::metal(Vec3::ONE, 0.0)),
        placed(&sphere, at(Vec3::new(0.0, -0.4, 1.1)), Material { base_color: Vec3::ONE, roughness: 0.8, ..Material::default() }),
    ];
    // Reflectance ⅓: the change of surfaces that see one another is sampled with a few of its rays, and on white walls its
    // noise would grow with every bounce.
    let world = captured_with_cap(&constant(64, Vec3::ONE), &depth, turn, capture, 1.0 / 3.0);
    let scene = TestScene { world, objects: Objects::new(&objects), camera: panorama_view(capture, 48) };
    for method in DIFFERENTIAL {
        for (bounces, second_order) in [(64, false), (64, true)] {
            let params = TraceParams { method, samples: 64, bounces, second_order, ..TraceParams::default() };
            let (object, delta) = layers(&scene.trace(&params, 4));
            assert_near(&format!("{method:?} object, {bounces} bounces"), object, 1.0);
            assert_near(&format!("{method:?} delta, {bounces} bounces"), delta, 0.0);
        }
    }
}

/// Ill-conditioned directions show at once where every pixel of a mirror must be exactly 1: straight up and down, at the
/// seam, and all around.
#[test]
fn a_mirror_all_around_shows_neither_seam_nor_pole() {
    for turn in [Quat::IDENTITY, Quat::from_rotation_y(std::f32::consts::PI), Quat::from_rotation_x(1.0)] {
        let world = ProxyWorld::new(white(), turn, Vec3::ZERO, &[]);
        let mirror = Material::metal(Vec3::ONE, 0.0);
        let mut flat = primitives::icosphere(0.7, 3);
        flat.normals.clear();
        let flat = prepared(flat);
        let balls: Vec<Placement> = [Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z]
            .map(|p| placed(&flat, Affine3A::from_translation(2.0 * p), mirror.clone()))
            .into();
        let scene = TestScene { world, objects: Objects::new(&balls), camera: panorama_view(Vec3::ZERO, 64) };
        for method in DIFFERENTIAL {
            let traced = scene.trace(&TraceParams { method, samples: 4, bounces: 64, ..TraceParams::default() }, 5);
            let l = &traced.layers;
            let worst =
                l.object.data().iter().zip(l.coverage.data()).map(|(o, c)| (*o - *c).abs().max_element()).fold(0.0, f32::max);
            assert!(worst < 1e-5, "{method:?}, {turn}: a pixel is off by {worst}");
            assert!([0, 31].iter().all(|&row| l.coverage.row(row).iter().all(|&c| c == 1.0)), "both poles are covered");
        }
    }
}
