//! RT²AR's tracer.

use crate::Test;
use crate::frames::worlds;
use crate::frames::{
    Apart, GREY, SAME as SAME_PIXELS, assert_alike, balls, of_all_kinds, plain, plane, rmse, sky, textured, under, view,
};
use crate::mr360::{Cancelled, assert_objects_matter, lamp, lit, mirrors, over_each_world, photo};
use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::Camera;
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::light::RadianceMaps;
use pano_core::material::{Material, Texture};
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_tests::random::Random;
use pano_trace::mr360::Lighting;
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::rt2ar::{self, Params, Rendered, Shadow, SphericalLight, gpu};
use pano_trace::tracer::Frame;
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld};
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("rt2ar::frames_equal_the_cpu", frames_equal_the_cpu),
    ("rt2ar::every_kind_of_shadow_equals_the_cpu", every_kind_of_shadow_equals_the_cpu),
    ("rt2ar::filtered_textures_equal_the_cpu", filtered_textures_equal_the_cpu),
    ("rt2ar::bodies_in_bodies_equal_the_cpu", bodies_in_bodies_equal_the_cpu),
    ("rt2ar::lamps_that_stand_somewhere_equal_the_cpu", lamps_that_stand_somewhere_equal_the_cpu),
    ("rt2ar::odd_scenes_equal_the_cpu", odd_scenes_equal_the_cpu),
    ("rt2ar::what_is_not_finite_equals_the_cpu", what_is_not_finite_equals_the_cpu),
    ("rt2ar::bands_and_submissions_make_no_difference", bands_and_submissions_make_no_difference),
    ("rt2ar::it_ends_when_it_is_cancelled_or_nothing_fits", it_ends_when_it_is_cancelled_or_nothing_fits),
];

/// Root mean square that all pixels of a frame may be off, those included for which rounding has turned a choice over.
const SAME: f64 = 1e-3;

/// Curved faces one behind the other magnify rounding, and where one ray decides about a lamp, rounding may decide: single pixels are off
/// by less than is counted apart.
const CLOSE: Apart = Apart { rest: 1e-4, ..SAME_PIXELS };

/// Shadows that adapt, a glossy floor, textures as points.
fn params(photo: &RadianceImage) -> Params<'_> {
    Params { samples: 4, gloss: 0.8, max_anisotropy: 0, ..Params::new(photo) }
}

fn both(
    gpu: &Gpu,
    camera: &Camera,
    objects: &Objects,
    world: &ProxyWorld,
    lighting: &Lighting,
    params: &Params<'_>,
) -> [Rendered; 2] {
    both_with(gpu, camera, objects, world, (lighting, &rt2ar::place_lights(world, lighting)), params)
}

fn both_with(
    gpu: &Gpu,
    camera: &Camera,
    objects: &Objects,
    world: &ProxyWorld,
    (lighting, lights): (&Lighting, &[SphericalLight]),
    params: &Params<'_>,
) -> [Rendered; 2] {
    let frame = Frame { camera, objects, stream: Stream { frame: 3, seed: 5 } };
    let got = gpu::render(gpu, &frame, world, lighting, lights, params, &Silent).unwrap().expect("nobody cancels");
    [got, rt2ar::render(&frame, world, lighting, lights, params, &Silent).expect("nobody cancels")]
}

/// Layers as those of the path tracers; shadows and penumbrae are the same in all pixels but a hundredth, and so are the rays and the
/// pixels in doubt.
fn assert_rendered(what: &str, both: &[Rendered; 2]) {
    assert_rendered_with(what, both, SAME_PIXELS);
}

/// The same with another tolerance for the pixels.
fn assert_rendered_with(what: &str, [got, want]: &[Rendered; 2], apart: Apart) {
    assert_alike(what, &got.traced, &want.traced, apart);
    let all = rmse(&got.traced, &want.traced);
    assert!(all < SAME, "{what}: {all} with all pixels");
    let pixels = want.penumbra.data().len();
    assert_eq!(got.shadows.len(), want.shadows.len(), "{what}");
    for (i, (got, want)) in got.shadows.iter().zip(&want.shadows).enumerate() {
        let off = got.data().iter().zip(want.data()).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
        assert!(off * 100 <= pixels, "{what}, lamp {i}: {off} pixels are off");
    }
    let off = got.penumbra.data().iter().zip(want.penumbra.data()).filter(|(a, b)| a != b).count();
    assert!(off * 100 <= pixels, "{what}: {off} pixels are in another penumbra");
    let near = |got: u64, want: u64| got.abs_diff(want) * 100 <= want.max(100);
    assert!(near(got.shadow_rays, want.shadow_rays), "{what}: {} shadow rays, not {}", got.shadow_rays, want.shadow_rays);
    assert!(near(got.doubted, want.doubted), "{what}: {} pixels in doubt, not {}", got.doubted, want.doubted);
}

/// With all effects.
fn frames_equal_the_cpu(gpu: &Gpu) {
    over_each_world(|what, camera, objects, world, photo| {
        let rendered = both(gpu, camera, objects, world, &lit(), &params(photo));
        let [_, want] = &rendered;
        assert_objects_matter(what, &want.traced);
        assert!(want.penumbra.data().iter().any(|p| *p) && want.doubted > 0, "{what}");
        assert_rendered(what, &rendered);
    });
}

/// Hard, soft, adaptive with few and many samples and probes; without neighbours, without shadows, lamps and gloss; few surfaces after one
/// another.
fn every_kind_of_shadow_equals_the_cpu(gpu: &Gpu) {
    let (camera, world, objects) = (view(37, 26), &worlds(3.0)[1], of_all_kinds());
    let photo = photo(&camera);
    let all = params(&photo);
    let dark = Lighting { lights: vec![], ..lit() };
    for (what, params, lighting) in [
        ("hard", Params { shadow: Shadow::Hard, ..all }, lit()),
        ("soft", Params { shadow: Shadow::Soft, samples: 2, ..all }, lit()),
        ("many samples", Params { shadow_samples: 60, probes: 13, samples: 2, ..all }, lit()),
        ("few samples", Params { shadow_samples: 3, ..all }, lit()),
        ("no neighbours", Params { spread: false, ..all }, lit()),
        ("no shadows", Params { shadows: false, ..all }, lit()),
        ("matt", Params { gloss: 0.0, ..all }, lit()),
        ("polished", Params { gloss: 1.0, gloss_roughness: 0.0, ..all }, lit()),
        ("no surface after another", Params { depth: 0, ..all }, lit()),
        ("one surface after another", Params { depth: 1, ..all }, lit()),
        ("no lamps", all, dark.clone()),
        ("nothing", Params { shadows: false, gloss: 0.0, ..all }, dark),
    ] {
        assert_rendered_with(what, &both(gpu, &camera, &objects, world, &lighting, &params), CLOSE);
    }
}

/// Textures over footprints: seen directly, in mirrors, through smooth and rough glass, by few rays and by more.
fn filtered_textures_equal_the_cpu(gpu: &Gpu) {
    let camera = view(41, 28);
    let photo = photo(&camera);
    let world = &worlds(3.0)[1];
    for objects in [textured(), textured_among_mirrors()] {
        for (max_anisotropy, samples) in [(16, 1), (1, 4), (64, 2)] {
            let params = Params { max_anisotropy, samples, gloss_roughness: 0.05, ..params(&photo) };
            let rendered = both(gpu, &camera, &objects, world, &lit(), &params);
            let as_points = both(gpu, &camera, &objects, world, &lit(), &Params { max_anisotropy: 0, ..params });
            assert!(rmse(&rendered[1].traced, &as_points[1].traced) > 0.01, "footprints make no difference");
            assert_rendered(&format!("{max_anisotropy} lookups, {samples} samples"), &rendered);
        }
    }
}

/// A picture on a floor and on a wall before a mirror, a smooth ball of glass and a rough one.
fn textured_among_mirrors() -> Objects {
    let mut random = Random::new(91);
    let picture = Image::from_fn(32, 16, |_, _| random.color(0.2, 0.8).extend(1.0));
    let mut texture = Texture::new(Arc::new(picture));
    texture.texture_from_mesh = Affine2::from_scale(Vec2::splat(2.0));
    let painted = Material { base_color: Vec3::ONE, base_color_texture: Some(texture), ..Material::diffuse(Vec3::ONE) };
    let ball = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
    let block = Arc::new(PreparedMesh::new(primitives::cuboid(Vec3::ONE)).unwrap());
    let place = |mesh: &Arc<PreparedMesh>, size: Vec3, at: Vec3, material: Material| Placement {
        mesh: mesh.clone(),
        world_from_mesh: Affine3A::from_scale_rotation_translation(size, Quat::from_rotation_y(0.2), at),
        material: Some(material),
    };
    Objects::new(&[
        place(&block, Vec3::new(3.0, 0.05, 3.0), Vec3::new(0.0, 0.0, -0.5), painted.clone()),
        place(&block, Vec3::new(0.8, 0.8, 0.1), Vec3::new(-0.9, 0.5, -0.3), painted),
        place(&block, Vec3::new(2.5, 1.2, 0.1), Vec3::new(0.0, 0.7, -1.5), Material::metal(Vec3::splat(0.9), 0.0)),
        place(&ball, Vec3::splat(0.3), Vec3::new(0.1, 0.4, 0.1), Material::glass(1.5, 0.0)),
        place(&ball, Vec3::splat(0.3), Vec3::new(0.8, 0.4, 0.0), Material::glass(1.4, 0.4)),
    ])
}

/// Shells and cores: a ball of each material about the same point, from the outside in.
fn nested(materials: &[Material]) -> Objects {
    let ball = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
    let place = |(i, material): (usize, &Material)| Placement {
        mesh: ball.clone(),
        world_from_mesh: Affine3A::from_scale_rotation_translation(
            Vec3::splat(0.5 - 0.1 * i as f32),
            Quat::from_rotation_y(0.3 * i as f32),
            Vec3::new(0.15 * i as f32, 0.55, -0.5),
        ),
        material: Some(material.clone()),
    };
    Objects::new(&materials.iter().enumerate().map(place).collect::<Vec<_>>())
}

/// Bodies one in another and overlapping, with absorption, rough, thin, and those that cannot be seen.
fn bodies_in_bodies_equal_the_cpu(gpu: &Gpu) {
    let camera = view(41, 28);
    let photo = photo(&camera);
    let clear = |ior: f32, roughness: f32| Material { base_color: Vec3::ONE, ..Material::glass(ior, roughness) };
    let green = Material { attenuation_color: Vec3::new(0.2, 0.9, 0.4), attenuation_distance: 0.2, ..clear(1.5, 0.0) };
    let pane = Material { thin: true, base_color: Vec3::new(0.9, 0.8, 0.7), ..clear(1.5, 0.0) };
    let red = Material::diffuse(Vec3::new(0.8, 0.1, 0.1));
    let many: Vec<Material> = (0..4).map(|i| clear(1.1 + 0.1 * i as f32, 0.0)).collect();
    for (what, objects) in [
        ("nested", nested(&[clear(1.5, 0.0), green.clone(), clear(1.2, 0.0), red.clone()])),
        ("many", nested(&many)),
        ("not there", nested(&[clear(1.0, 0.0), red.clone()])),
        ("of one index", nested(&[clear(1.5, 0.0), clear(1.5, 0.0), green.clone()])),
        ("rough", nested(&[clear(1.4, 0.4), green])),
        ("thin", nested(&[pane, red])),
        ("mirrors", mirrors()),
    ] {
        for world in &worlds(3.0)[1..] {
            assert_rendered_with(what, &both(gpu, &camera, &objects, world, &lit(), &params(&photo)), CLOSE);
        }
    }
    let inside = Camera { position: Vec3::new(0.0, 0.38, -0.6), ..camera };
    let glass = balls(&[Material::glass(1.3, 0.0), Material::glass(1.5, 0.4), Material::diffuse(Vec3::ONE)]);
    assert_rendered("inside", &both(gpu, &inside, &glass, &worlds(3.0)[2], &lit(), &params(&photo)));
}

/// Lamps on a wall, near to objects and beside them.
fn lamps_that_stand_somewhere_equal_the_cpu(gpu: &Gpu) {
    let camera = view(41, 28);
    let photo = photo(&camera);
    let world = &worlds(3.0)[1];
    let lighting = lit();
    let mut lights = rt2ar::place_lights(world, &lighting);
    for (light, distance) in lights.iter_mut().zip([2.0, 1.5, 0.8]) {
        light.distance = distance;
        light.center = lighting.capture + light.direction * distance;
    }
    lights.push(SphericalLight { center: Vec3::new(0.9, 0.4, -0.5), distance: 2.5, ..lights[0] });
    for objects in [of_all_kinds(), plain()] {
        let rendered = both_with(gpu, &camera, &objects, world, (&lighting, &lights), &params(&photo));
        assert!(rendered[1].penumbra.data().iter().any(|p| *p));
        assert_rendered("standing lamps", &rendered);
    }
}

/// One pixel, nothing real, black light, more lamps than count, lamps of a whole hemisphere.
fn odd_scenes_equal_the_cpu(gpu: &Gpu) {
    let worlds = worlds(3.0);
    let (one, small) = (view(1, 1), view(31, 22));
    let (photo_of_one, photo_of_small) = (photo(&one), photo(&small));
    assert_rendered("one pixel", &both(gpu, &one, &plain(), &worlds[0], &lit(), &params(&photo_of_one)));
    assert_rendered("nothing real", &both(gpu, &small, &of_all_kinds(), &under(sky(4.0), &[]), &lit(), &params(&photo_of_small)));
    let black = RadianceImage::filled(2, 1, Vec3::ZERO);
    let maps = RadianceMaps { diffuse: black.clone(), glossy: std::array::from_fn(|_| black.clone()), mirror: black.clone() };
    let night = Lighting { maps, lights: vec![], ..lit() };
    assert_rendered("night", &both(gpu, &small, &plain(), &under(black, &[]), &night, &params(&photo_of_small)));
    let mut random = Random::new(81);
    let mut any_lamp = || lamp(random.direction(), random.between(0.1, 120.0), random.color(0.0, 0.3));
    let many = Lighting { lights: (0..20).map(|_| any_lamp()).collect(), ..lit() };
    let lamps = both(gpu, &small, &plain(), &worlds[0], &many, &params(&photo_of_small));
    assert_eq!(lamps[0].shadows.len(), 16);
    assert_rendered("many lamps", &lamps);
}

fn placed(size: Vec3, at: Vec3) -> Affine3A {
    Affine3A::from_scale_rotation_translation(size, Quat::IDENTITY, at)
}

/// A lamp beyond all numbers: its change is none where it is no number, and what is not finite is discarded, as on the CPU.
fn what_is_not_finite_equals_the_cpu(gpu: &Gpu) {
    let camera = view(31, 22);
    let photo = photo(&camera);
    // A plate before a wall takes nothing of the blinding lamp behind it that the wall leaves; a ball takes another lamp's light there.
    let block = Arc::new(PreparedMesh::new(primitives::cuboid(Vec3::ONE)).unwrap());
    let ball = Arc::new(PreparedMesh::new(primitives::icosphere(0.3, 2)).unwrap());
    let wall = Proxy {
        shape: ProxyShape::Mesh(block.clone()),
        world_from_local: placed(Vec3::new(1.0, 1.0, 0.05), Vec3::new(0.0, 0.5, -1.0)),
        reflectance: GREY,
    };
    let world = &under(sky(3.0), &[plane(Vec3::ZERO, Quat::IDENTITY, GREY), wall]);
    let put =
        |mesh: &Arc<PreparedMesh>, world_from_mesh: Affine3A| Placement { mesh: mesh.clone(), world_from_mesh, material: None };
    let objects = Objects::new(&[
        put(&block, placed(Vec3::new(0.8, 0.8, 0.02), Vec3::new(0.0, 0.45, -0.95))),
        put(&ball, placed(Vec3::ONE, Vec3::new(0.0, 0.35, 0.9))),
    ]);
    let lights = vec![lamp(Vec3::new(0.0, 1.0, -1.2), 25.0, Vec3::INFINITY), lamp(Vec3::new(0.0, 0.8, 1.0), 10.0, Vec3::ONE)];
    let blinding = Lighting { lights, pano_from_world: Quat::IDENTITY, ..lit() };
    for shadow in [Shadow::Hard, Shadow::Soft, Shadow::Adaptive] {
        let [got, want] = both(gpu, &camera, &objects, world, &blinding, &Params { shadow, gloss: 0.0, ..params(&photo) });
        assert!(want.traced.discarded > 0, "{shadow:?}");
        assert_eq!(got.traced.discarded, want.traced.discarded, "{shadow:?}");
        let off = rmse(&got.traced, &want.traced);
        assert!(off < SAME, "{shadow:?}: {off}");
    }
}

/// A frame in one part, and in many: of rows, as memory is small, and of rays.
fn bands_and_submissions_make_no_difference(_: &Gpu) {
    // Devices of its own: other tests submit at the same time.
    let [large, small] =
        [None, Some(200_000)].map(|max_binding| Gpu::new(&GpuOptions { max_binding, ..GpuOptions::default() }).unwrap());
    let (camera, objects, world, lighting) = (view(61, 40), plain(), &worlds(3.0)[0], lit());
    let photo = photo(&camera);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let lights = rt2ar::place_lights(world, &lighting);
    let trace = |gpu: &Gpu| {
        let rendered = gpu::render(gpu, &frame, world, &lighting, &lights, &params(&photo), &Silent).unwrap().unwrap();
        (rendered, gpu.submissions())
    };
    let ((whole, once), (banded, often)) = (trace(&large), trace(&small));
    assert!(often >= 3 * once, "{once} and {often} submissions");
    assert!(whole.traced.layers.object == banded.traced.layers.object && whole.traced.layers.delta == banded.traced.layers.delta);
    assert_eq!((whole.shadows, whole.penumbra, whole.doubted), (banded.shadows, banded.penumbra, banded.doubted));
    assert_eq!((whole.traced.rays, whole.shadow_rays), (banded.traced.rays, banded.shadow_rays));
}

fn it_ends_when_it_is_cancelled_or_nothing_fits(gpu: &Gpu) {
    let (camera, objects, lighting) = (view(8, 8), plain(), lit());
    let world = under(sky(3.0), &[plane(Vec3::ZERO, Quat::IDENTITY, GREY)]);
    let photo = photo(&camera);
    let params = params(&photo);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let lights = rt2ar::place_lights(&world, &lighting);
    assert!(gpu::render(gpu, &frame, &world, &lighting, &lights, &params, &Cancelled).unwrap().is_none());
    let small = Gpu::new(&GpuOptions { max_binding: Some(3000), ..GpuOptions::default() }).unwrap();
    let refused = gpu::render(&small, &frame, &world, &lighting, &lights, &params, &Silent);
    assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
}
