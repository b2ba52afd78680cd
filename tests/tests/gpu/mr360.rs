//! MR360's tracer.

use crate::Test;
use crate::captured::{self, CAPTURE};
use crate::frames::{
    Apart, GREY, SAME as SAME_PIXELS, assert_alike, balls, of_all_kinds, plain, plane, rmse, sky, textured, under, view, worlds,
};
use glam::{Affine3A, Quat, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::{Image, RadianceImage};
use pano_core::light::{DirectionalLight, RadianceMaps};
use pano_core::material::Material;
use pano_core::progress::{Progress, Silent};
use pano_core::random::Stream;
use pano_light::ibl;
use pano_tests::random::Random;
use pano_trace::mr360::{self, Lighting, Lit, Params, gpu};
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::tracer::{Frame, Traced};
use pano_trace::world::{CapturedOptions, CapturedWorld, ProxyWorld};
use std::f32::consts::TAU;
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("mr360::frames_equal_the_cpu", frames_equal_the_cpu),
    ("mr360::effects_that_are_off_are_off", effects_that_are_off_are_off),
    ("mr360::odd_scenes_equal_the_cpu", odd_scenes_equal_the_cpu),
    ("mr360::what_is_not_finite_is_discarded_as_on_the_cpu", what_is_not_finite_is_discarded_as_on_the_cpu),
    ("mr360::frames_with_depth_equal_the_cpu", frames_with_depth_equal_the_cpu),
    ("mr360::bands_with_depth_make_no_difference", bands_with_depth_make_no_difference),
    ("mr360::bands_and_submissions_make_no_difference", bands_and_submissions_make_no_difference),
    ("mr360::it_ends_when_it_is_cancelled_or_nothing_fits", it_ends_when_it_is_cancelled_or_nothing_fits),
];

/// Root mean square that all pixels of a frame may be off, those included for which rounding has turned a choice over.
const SAME: f64 = 1e-3;

pub(crate) fn lamp(direction: Vec3, degrees: f32, intensity: Vec3) -> DirectionalLight {
    let solid_angle = TAU * (1.0 - degrees.to_radians().cos());
    DirectionalLight { direction: direction.normalize(), irradiance: intensity, solid_angle, intensity }
}

/// The sky without its sun, and a small lamp, a wide one and one below the horizon.
pub(crate) fn lit() -> Lighting {
    Lighting {
        maps: ibl::radiance_maps(&sky(1.2)),
        lights: vec![
            lamp(Vec3::new(0.5, 1.0, 0.3), 4.0, Vec3::new(2.0, 1.8, 1.5)),
            lamp(Vec3::new(-1.0, 0.6, 0.8), 25.0, Vec3::new(0.3, 0.5, 0.8)),
            lamp(Vec3::new(0.2, -0.3, -1.0), 10.0, Vec3::splat(0.4)),
        ],
        pano_from_world: Quat::from_rotation_y(-0.7),
        capture: Vec3::new(0.0, 1.5, 2.0),
    }
}

pub(crate) fn photo(camera: &Camera) -> RadianceImage {
    let mut random = Random::new(71);
    Image::from_fn(camera.width, camera.height, |_, _| random.color(0.1, 0.9))
}

fn params(photo: &RadianceImage) -> Params<'_> {
    Params { samples: 4, shadows: true, ambient_occlusion: true, gloss: 0.8, gloss_roughness: 0.3, photo }
}

fn both(gpu: &Gpu, camera: &Camera, objects: &Objects, world: &ProxyWorld, lighting: &Lighting, params: &Params<'_>) -> [Lit; 2] {
    let frame = Frame { camera, objects, stream: Stream { frame: 3, seed: 5 } };
    let got = gpu::render(gpu, &frame, world, lighting, params, &Silent).unwrap().expect("nobody cancels");
    [got, mr360::render(&frame, world, lighting, params, &Silent).expect("nobody cancels")]
}

/// Layers as those of the path tracers; of the shadows all but a hundredth are the same, and those are off by one sample.
fn assert_lit(what: &str, both: &[Lit; 2], samples: u32) {
    assert_lit_with(what, both, samples, SAME_PIXELS);
}

/// The same with another tolerance for the pixels.
fn assert_lit_with(what: &str, [got, want]: &[Lit; 2], samples: u32, apart: Apart) {
    assert_alike(what, &got.traced, &want.traced, apart);
    let all = rmse(&got.traced, &want.traced);
    assert!(all < SAME, "{what}: {all} with all pixels");
    assert_eq!(got.shadows.len(), want.shadows.len(), "{what}");
    for (i, (got, want)) in got.shadows.iter().zip(&want.shadows).enumerate() {
        let apart = || got.data().iter().zip(want.data()).map(|(a, b)| (a - b).abs() * samples as f32);
        assert!(apart().all(|d| d < 1.5), "{what}, lamp {i}: {:?}", apart().fold(0.0, f32::max));
        let off = apart().filter(|d| *d > 0.5).count();
        assert!(off * 100 <= got.data().len(), "{what}, lamp {i}: {off} pixels are off");
    }
}

/// Gives every kind of surface over each world to `check`, in a view and all around, with the photo of each.
pub(crate) fn over_each_world(check: impl Fn(&str, &Camera, &Objects, &ProxyWorld, &RadianceImage)) {
    let whole = Camera { projection: Projection::Panorama, position: Vec3::new(0.1, 0.9, 0.4), ..view(80, 41) };
    for (i, (world, objects)) in worlds(30.0).iter().zip([of_all_kinds(), plain(), textured()]).enumerate() {
        for camera in [&view(67, 45), &whole] {
            check(&format!("world {i}, {:?}", camera.projection), camera, &objects, world, &photo(camera));
        }
    }
}

/// Objects show, and change what is around them.
pub(crate) fn assert_objects_matter(what: &str, traced: &Traced) {
    let changed = traced.layers.delta.data().iter().filter(|d| d.length() > 0.01).count();
    let covered = traced.layers.coverage.data().iter().filter(|c| **c > 0.0).count();
    assert!(changed > 100 && covered > 50, "{what}: {changed} pixels change, objects are in {covered}");
}

/// With all effects.
fn frames_equal_the_cpu(gpu: &Gpu) {
    over_each_world(|what, camera, objects, world, photo| {
        let lit = both(gpu, camera, objects, world, &lit(), &params(photo));
        let [_, want] = &lit;
        assert_objects_matter(what, &want.traced);
        assert!(want.shadows[0].data().iter().any(|s| *s < 1.0), "{what}");
        assert_lit(what, &lit, 4);
    });
}

/// No shadows, no ambient occlusion, matt floors, floors like mirrors, no lamps.
fn effects_that_are_off_are_off(gpu: &Gpu) {
    let (camera, world, objects) = (view(37, 26), &worlds(3.0)[1], of_all_kinds());
    let photo = photo(&camera);
    let all = params(&photo);
    let dark = Lighting { lights: vec![], ..lit() };
    for (what, params, lighting) in [
        ("no shadows", Params { shadows: false, ..all }, lit()),
        ("no occlusion", Params { ambient_occlusion: false, ..all }, lit()),
        ("matt", Params { gloss: 0.0, ..all }, lit()),
        ("polished", Params { gloss: 1.0, gloss_roughness: 0.0, ..all }, lit()),
        ("no lamps", all, dark.clone()),
        ("nothing", Params { shadows: false, ambient_occlusion: false, gloss: 0.0, ..all }, dark),
    ] {
        assert_lit(what, &both(gpu, &camera, &objects, world, &lighting, &params), 4);
    }
}

/// Mirrors that face each other, hollow glass, smooth coats and metals: rays that end because there are too many of them.
pub(crate) fn mirrors() -> Objects {
    let mesh = Arc::new(PreparedMesh::new(primitives::cuboid(Vec3::ONE)).unwrap());
    let wall = |at: Vec3, roughness: f32| Placement {
        mesh: mesh.clone(),
        world_from_mesh: Affine3A::from_scale_rotation_translation(Vec3::new(2.0, 1.5, 0.1), Quat::from_rotation_y(0.1), at),
        material: Some(Material::metal(Vec3::new(0.95, 0.9, 0.85), roughness)),
    };
    let ball = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
    let shell = |radius: f32| Placement {
        mesh: ball.clone(),
        world_from_mesh: Affine3A::from_scale_rotation_translation(
            Vec3::splat(radius),
            Quat::IDENTITY,
            Vec3::new(0.2, 0.5, -0.4),
        ),
        material: Some(Material::glass(1.5, 0.0)),
    };
    let walls = [wall(Vec3::new(0.0, 0.75, -1.2), 0.0), wall(Vec3::new(0.0, 0.4, 2.6), 0.0)];
    Objects::new(&[walls[0].clone(), walls[1].clone(), shell(0.3), shell(-0.25), wall(Vec3::new(1.6, 0.3, -0.5), 0.2)])
}

/// One pixel, nothing real, black light, more lamps than count, lamps of a whole hemisphere, mirrors in mirrors, a camera inside
/// an object.
fn odd_scenes_equal_the_cpu(gpu: &Gpu) {
    let worlds = worlds(3.0);
    let (one, small) = (view(1, 1), view(31, 22));
    let (photo_of_one, photo_of_small) = (photo(&one), photo(&small));
    assert_lit("one pixel", &both(gpu, &one, &plain(), &worlds[0], &lit(), &params(&photo_of_one)), 4);
    assert_lit("nothing real", &both(gpu, &small, &of_all_kinds(), &under(sky(4.0), &[]), &lit(), &params(&photo_of_small)), 4);
    let black = RadianceImage::filled(2, 1, Vec3::ZERO);
    let maps = RadianceMaps { diffuse: black.clone(), glossy: std::array::from_fn(|_| black.clone()), mirror: black.clone() };
    let night = Lighting { maps, lights: vec![], ..lit() };
    assert_lit("night", &both(gpu, &small, &plain(), &under(black, &[]), &night, &params(&photo_of_small)), 4);
    let mut random = Random::new(81);
    let mut any_lamp = || lamp(random.direction(), random.between(0.1, 120.0), random.color(0.0, 0.3));
    let many = Lighting { lights: (0..20).map(|_| any_lamp()).collect(), ..lit() };
    let lamps = both(gpu, &small, &plain(), &worlds[0], &many, &params(&photo_of_small));
    assert_eq!(lamps[0].shadows.len(), 16);
    assert_lit("many lamps", &lamps, 4);
    assert_lit("mirrors", &both(gpu, &small, &mirrors(), &worlds[1], &lit(), &params(&photo_of_small)), 4);
    let inside = Camera { position: Vec3::new(0.0, 0.38, -0.6), ..small };
    let glass = balls(&[Material::glass(1.3, 0.0), Material::glass(1.5, 0.4), Material::diffuse(Vec3::ONE)]);
    assert_lit("inside", &both(gpu, &inside, &glass, &worlds[2], &lit(), &params(&photo_of_small)), 4);
}

/// Pixels of the photo, texels of the panorama and of a map, and a lamp's light that are no number or infinite.
fn what_is_not_finite_is_discarded_as_on_the_cpu(gpu: &Gpu) {
    let camera = view(31, 22);
    let mut odd = photo(&camera);
    for (i, value) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38, -1.0].into_iter().enumerate() {
        (0..8).for_each(|k| odd.set(3 * i + k % 3, 14 + k / 3, Vec3::new(0.5, value, 0.2)));
    }
    let mut bright = sky(3.0);
    (0..6).for_each(|k| bright.set(20 + k, 5, Vec3::splat([f32::INFINITY, 1e38][k % 2])));
    let mut lighting = lit();
    lighting.maps.diffuse.set(3, 4, Vec3::splat(f32::INFINITY));
    lighting.maps.glossy[2].set(7, 3, Vec3::new(f32::NAN, 1.0, 1.0));
    lighting.lights[2].intensity = Vec3::splat(f32::INFINITY);
    let cases = [
        ("photo", odd, sky(3.0), lit()),
        ("panorama", photo(&camera), bright, lit()),
        ("maps and lamps", photo(&camera), sky(3.0), lighting),
    ];
    for (what, photo, sky, lighting) in cases {
        let world = under(sky, &[plane(Vec3::ZERO, Quat::IDENTITY, GREY)]);
        let [got, want] = both(gpu, &camera, &of_all_kinds(), &world, &lighting, &params(&photo));
        let (got, want) = (&got.traced, &want.traced);
        assert!(want.discarded > 0, "{what}: nothing goes wrong");
        // A sample for which rounding turns a choice over may miss what is not finite.
        let apart = got.discarded.abs_diff(want.discarded);
        assert!(apart * 50 <= want.discarded, "{what}: {} are discarded, not {}", got.discarded, want.discarded);
        let layers = [&got.layers.object, &got.layers.delta];
        assert!(layers.iter().all(|l| l.data().iter().all(|p| p.is_finite())), "{what}");
        let apart = |(a, b): &(&Vec3, &Vec3)| (**a - **b).abs().max_element() > 2e-3 * b.abs().max_element().max(1.0);
        let count = |got: &RadianceImage, want: &RadianceImage| got.data().iter().zip(want.data()).filter(apart).count();
        let off = count(&got.layers.object, &want.layers.object) + count(&got.layers.delta, &want.layers.delta);
        assert!(off * 50 <= got.layers.coverage.data().len(), "{what}: {off} pixels are off");
    }
}

fn both_captured(
    gpu: &Gpu,
    camera: &Camera,
    objects: &Objects,
    world: &CapturedWorld,
    lighting: &Lighting,
    params: &Params<'_>,
) -> [Lit; 2] {
    let frame = Frame { camera, objects, stream: Stream { frame: 3, seed: 5 } };
    let got = gpu::render_captured(gpu, &frame, world, lighting, params, &Silent).unwrap().expect("nobody cancels");
    [got, mr360::render(&frame, world, lighting, params, &Silent).expect("nobody cancels")]
}

/// In the room of `captured.rs`, from where the panorama was taken, from another place and all around, and in a room without rims. What
/// mirrors show of the room has lamps at 12.
fn frames_with_depth_equal_the_cpu(gpu: &Gpu) {
    let lighting = Lighting { capture: CAPTURE, ..lit() };
    let (moved, small) = (view(67, 45), view(31, 22));
    let seen = Camera { position: CAPTURE, ..moved };
    let around = Camera { projection: Projection::Panorama, ..view(80, 41) };
    let rooms = |objects: &Objects| {
        let round = Image::filled(128, 64, 2.5);
        [captured::world(objects, |_| ()), captured::world_of(&round, objects, &CapturedOptions::default())]
    };
    for (what, objects) in [("all kinds", of_all_kinds()), ("plain", plain()), ("textured", textured())] {
        let [room, round] = rooms(&objects);
        for (world, camera) in [(&room, &seen), (&room, &moved), (&room, &around), (&round, &moved)] {
            let photo = photo(camera);
            let both = both_captured(gpu, camera, &objects, world, &lighting, &params(&photo));
            let [_, want] = &both;
            let changed = want.traced.layers.delta.data().iter().filter(|d| d.length() > 0.01).count();
            let covered = want.traced.layers.coverage.data().iter().filter(|c| **c > 0.0).count();
            assert!(changed > 100 && covered > 20, "{what}: {changed} pixels change, objects are in {covered}");
            assert_lit_with(&format!("{what}, {:?}", camera.projection), &both, 4, captured::APART);
        }
    }
    let photo = photo(&small);
    let all = params(&photo);
    let [room, _] = rooms(&mirrors());
    let dark = Lighting { lights: vec![], ..lighting.clone() };
    for (what, params, lighting) in [
        ("mirrors", all, lighting.clone()),
        ("no shadows", Params { shadows: false, ..all }, lighting),
        ("nothing", Params { shadows: false, ambient_occlusion: false, gloss: 0.0, ..all }, dark),
    ] {
        let both = both_captured(gpu, &small, &mirrors(), &room, &lighting, &params);
        assert_lit_with(what, &both, 4, captured::APART);
    }
}

/// Rows of a frame that do not fit one binding; a panorama that does not is refused.
fn bands_with_depth_make_no_difference(_: &Gpu) {
    let (objects, lighting, camera) = (plain(), lit(), view(90, 60));
    let world = captured::world(&objects, |_| ());
    let photo = photo(&camera);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    let [whole, banded] = [None, Some(1 << 19)].map(|max_binding| {
        let gpu = Gpu::new(&GpuOptions { max_binding, ..GpuOptions::default() }).unwrap();
        let lit = gpu::render_captured(&gpu, &frame, &world, &lighting, &params(&photo), &Silent).unwrap().unwrap();
        (lit, gpu.submissions())
    });
    assert!(banded.1 > 2 * whole.1, "{} {}", banded.1, whole.1);
    assert!(banded.0.traced.layers.object == whole.0.traced.layers.object && banded.0.shadows == whole.0.shadows);
    assert!(banded.0.traced.layers.delta == whole.0.traced.layers.delta);
    for most in [10_000, 150_000] {
        let small = Gpu::new(&GpuOptions { max_binding: Some(most), ..GpuOptions::default() }).unwrap();
        let refused = gpu::render_captured(&small, &frame, &world, &lighting, &params(&photo), &Silent);
        assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{most}: {refused:?}");
    }
}

/// A frame in one part, and in many: of rows, as memory is small, and of samples.
fn bands_and_submissions_make_no_difference(_: &Gpu) {
    // Devices of its own: other tests submit at the same time.
    let [large, small] =
        [None, Some(200_000)].map(|max_binding| Gpu::new(&GpuOptions { max_binding, ..GpuOptions::default() }).unwrap());
    let (objects, world, lighting) = (plain(), &worlds(3.0)[0], lit());
    let trace = |gpu: &Gpu, camera: &Camera, samples: u32| {
        let photo = photo(camera);
        let frame = Frame { camera, objects: &objects, stream: Stream::default() };
        let before = gpu.submissions();
        let lit = gpu::render(gpu, &frame, world, &lighting, &Params { samples, ..params(&photo) }, &Silent).unwrap().unwrap();
        (lit, gpu.submissions() - before)
    };
    let wide = view(150, 61);
    let ((whole, once), (banded, often)) = (trace(&large, &wide, 2), trace(&small, &wide, 2));
    assert!(often >= 4 * once, "{once} and {often} submissions");
    assert_eq!(whole.traced.layers.object.data(), banded.traced.layers.object.data());
    assert_eq!(whole.traced.layers.delta.data(), banded.traced.layers.delta.data());
    assert_eq!((whole.shadows, whole.traced.rays), (banded.shadows, banded.traced.rays));

    let tall = view(40, 64);
    let (long, submissions) = trace(&large, &tall, 100);
    assert!(submissions >= 5, "{submissions}");
    let photo = photo(&tall);
    let frame = Frame { camera: &tall, objects: &objects, stream: Stream::default() };
    let want = mr360::render(&frame, world, &lighting, &Params { samples: 100, ..params(&photo) }, &Silent).unwrap();
    assert_lit("100 samples", &[long, want], 100);
}

/// Stops at once.
pub(crate) struct Cancelled;

impl Progress for Cancelled {
    fn cancelled(&self) -> bool {
        true
    }
}

fn it_ends_when_it_is_cancelled_or_nothing_fits(gpu: &Gpu) {
    let (camera, objects, world) = (view(8, 8), plain(), &worlds(3.0)[0]);
    let photo = photo(&camera);
    let frame = Frame { camera: &camera, objects: &objects, stream: Stream::default() };
    assert!(gpu::render(gpu, &frame, world, &lit(), &params(&photo), &Cancelled).unwrap().is_none());
    let small = Gpu::new(&GpuOptions { max_binding: Some(3000), ..GpuOptions::default() }).unwrap();
    let refused = gpu::render(&small, &frame, world, &lit(), &params(&photo), &Silent);
    assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{refused:?}");
}
