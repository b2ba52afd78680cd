//! The passes of iprt, in the room of `captured.rs`: G-buffers with motion, coverage, both estimates, the updated panorama.

use crate::Test;
use crate::captured::{CAPTURE, world};
use crate::frames::{balls, of_all_kinds, plain, textured, view};
use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::gpu::{Gpu, GpuError, GpuOptions};
use pano_core::image::Image;
use pano_core::material::Material;
use pano_core::progress::Silent;
use pano_core::random::Stream;
use pano_tests::random::Random;
use pano_trace::iprt::gpu::GpuFrame;
use pano_trace::iprt::{self, Earlier, Frame, GBuffer, Params, RealEstimate, Update, UpdatedWorld, VirtualEstimate};
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::world::CapturedWorld;
use std::sync::Arc;

pub(crate) const TESTS: &[Test] = &[
    ("iprt::gbuffers_equal_the_cpu", gbuffers_equal_the_cpu),
    ("iprt::updates_equal_the_cpu", updates_equal_the_cpu),
    ("iprt::estimates_equal_the_cpu", estimates_equal_the_cpu),
    ("iprt::bands_make_no_difference", bands_make_no_difference),
];

/// Views of odd sizes: from elsewhere, from the capture point, all around from either.
fn cameras() -> Vec<Camera> {
    let elsewhere = view(37, 23);
    let here = Camera { position: CAPTURE, world_from_camera: rotation_from_yaw_pitch(25.0, -20.0), ..view(29, 31) };
    let around = |camera: Camera| Camera { projection: Projection::Panorama, width: 43, height: 21, ..camera };
    vec![elsewhere, here, around(elsewhere), around(here), Camera { width: 1, height: 1, ..elsewhere }]
}

fn frame<'a>(camera: &'a Camera, objects: &'a Objects) -> Frame<'a> {
    Frame { camera, objects, capture: CAPTURE, stream: Stream { frame: 3, seed: 5 } }
}

/// Two balls, turned and moved by `step`; of two frames they share the mesh.
fn rolling(mesh: &Arc<PreparedMesh>, step: f32) -> Objects {
    let place = |x: f32, turn: f32| Placement {
        mesh: mesh.clone(),
        world_from_mesh: Affine3A::from_scale_rotation_translation(
            Vec3::new(0.35, 0.3, 0.4),
            Quat::from_rotation_z(turn),
            Vec3::new(x, 0.5, -0.6),
        ),
        material: Some(Material::diffuse(Vec3::splat(0.6))),
    };
    Objects::new(&[place(-0.4 + 0.1 * step, step), place(0.5, 0.2)])
}

/// Indices of pixels for which `same` is false.
fn off(count: usize, same: impl Fn(usize) -> bool) -> Vec<usize> {
    (0..count).filter(|i| !same(*i)).collect()
}

/// Depth, positions and normals are good to the marching's 10⁻⁴, textured colours to the rounding of their coordinates times the
/// contrast of a texture of noise. At the rim of a thing rounding may decide which side the centre is on, or one of 16 points: at most
/// one pixel in five hundred.
fn gbuffers_equal_the_cpu(gpu: &Gpu) {
    let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 2)).unwrap());
    let (mut pixels, mut apart, mut points) = (0, 0, 0);
    for camera in cameras() {
        let before = Earlier {
            camera: Camera {
                position: camera.position + Vec3::new(0.1, 0.0, 0.05),
                world_from_camera: camera.world_from_camera * Quat::from_rotation_y(0.05),
                ..camera
            },
            objects: rolling(&mesh, 1.0),
        };
        let now = rolling(&mesh, 0.0);
        for (objects, earlier) in [(&now, Some(&before)), (&of_all_kinds(), Some(&before)), (&textured(), None)] {
            let world = world(objects, |_| ());
            let frame = frame(&camera, objects);
            let held = GpuFrame::new(gpu, &frame, &world, earlier).unwrap();
            let (got, got_motion) = held.gbuffer(gpu, &frame).unwrap();
            let want = GBuffer::new(&frame, &world);
            let count = camera.width * camera.height;
            let same = |i: usize| {
                let depth = (got.depth.data()[i], want.depth.data()[i]);
                let close = |a: &Image<Vec3>, b: &Image<Vec3>, most: f32| a.data()[i].distance(b.data()[i]) <= most;
                (depth.0 == depth.1 || (depth.0 - depth.1).abs() <= 1e-4 * depth.1)
                    && close(&got.position, &want.position, 1e-4 * (1.0 + depth.1.min(1e3)))
                    && close(&got.normal, &want.normal, 1e-3)
                    && close(&got.albedo, &want.albedo, 1e-4)
                    && (got.thing.data()[i], got.smooth.data()[i]) == (want.thing.data()[i], want.smooth.data()[i])
            };
            let others = off(count, same);
            assert_eq!(got_motion.is_some(), earlier.is_some());
            if let (Some(got_motion), Some(earlier)) = (got_motion, earlier) {
                let (previous, distance) = iprt::motion(&want, &camera, objects, earlier);
                let wrong = off(count, |i| {
                    let (a, b) = (got_motion.0.data()[i], previous.data()[i]);
                    let (c, d) = (got_motion.1.data()[i], distance.data()[i]);
                    // Around the sphere the first column is beside the last one.
                    let apart = (a - b).abs();
                    let across = apart.x.min((apart.x - camera.width as f32).abs()).max(apart.y);
                    let near = a.is_nan() && b.is_nan() || across < 0.02 || b.abs().max_element() > 1e3;
                    (near && (c == d || (c - d).abs() <= 1e-4 * d)) || others.contains(&i)
                });
                assert!(wrong.is_empty(), "{camera:?}: motion of {wrong:?}");
            }
            let (got_cover, want_cover) = (held.coverage(gpu, &frame, &want).unwrap(), want.coverage(&frame, &world));
            let cover = got_cover.data().iter().zip(want_cover.data()).map(|(a, b)| ((a - b).abs() * 16.0) as usize);
            points += cover.sum::<usize>();
            apart += others.len();
            pixels += count;
        }
    }
    println!("{apart} of {pixels} pixels and {points} of their points show another thing");
    assert!(apart * 500 <= pixels && points * 50 <= pixels, "{apart} pixels and {points} points of {pixels}");
}

/// Ratios of noise between .2 and 1.5, and a gloss of a third of the pixels.
fn noise(random: &mut Random, (w, h): (usize, usize)) -> (Image<Vec3>, Image<Vec2>) {
    let ratio = Image::from_fn(w, h, |_, _| random.color(0.2, 1.5));
    let gloss = |random: &mut Random| match random.below(3) {
        0 => Vec2::new(random.between(0.3, 1.0), random.between(0.0, 0.6)),
        _ => Vec2::X,
    };
    (ratio, Image::from_fn(w, h, |_, _| gloss(random)))
}

/// The values are copies. Rounding decides which pixel shows a texel on the border of two, or whether it is within the tolerance of the
/// depth: one texel in three hundred.
fn updates_equal_the_cpu(gpu: &Gpu) {
    let objects = plain();
    let world = world(&objects, |_| ());
    let (mut texels, mut apart, mut shown) = (0, 0, 0);
    for (seed, camera) in cameras().into_iter().enumerate() {
        let frame = frame(&camera, &objects);
        let held = GpuFrame::new(gpu, &frame, &world, None).unwrap();
        let buffer = GBuffer::new(&frame, &world);
        let (ratio, gloss) = noise(&mut Random::new(seed as u32), (camera.width, camera.height));
        for size in [(128, 64), (51, 25), (1, 1)] {
            let got = held.panorama_update(gpu, &frame, &buffer, &ratio, &gloss, size).unwrap();
            let want = iprt::panorama_update(&frame, &world, &buffer, &ratio, &gloss, size);
            let same = |i: usize| got.ratio.data()[i] == want.ratio.data()[i] && got.gloss.data()[i] == want.gloss.data()[i];
            apart += off(size.0 * size.1, same).len();
            texels += size.0 * size.1;
            shown += want.ratio.data().iter().filter(|r| **r != Vec3::ONE).count();
        }
    }
    println!("{apart} of {texels} texels show another pixel; {shown} show any");
    assert!(apart * 300 <= texels && shown * 5 > texels, "{apart} of {texels}, {shown} shown");
}

/// Something that is known of the panorama, in patches.
fn known(seed: u32) -> Update {
    let (ratio, gloss) = noise(&mut Random::new(seed), (32, 16));
    Update { ratio, gloss }
}

/// Pixels that are off, and the root mean square of what the others are apart.
fn compare(pictures: &[(&Image<Vec3>, &Image<Vec3>)]) -> (Vec<usize>, f64) {
    let count = pictures[0].0.data().len();
    let apart = |i: usize| {
        let one = |(a, b): &(&Image<Vec3>, &Image<Vec3>)| {
            let (a, b) = (a.data()[i], b.data()[i]);
            (a - b).abs().max_element() / b.abs().max_element().max(1.0)
        };
        pictures.iter().map(one).fold(0.0, f32::max)
    };
    let off = off(count, |i| apart(i) <= 2e-3);
    let squares: f64 = (0..count).filter(|i| !off.contains(i)).map(|i| f64::from(apart(i)).powi(2)).sum();
    (off, (squares / count as f64).sqrt())
}

fn values(image: &Image<f32>) -> Image<Vec3> {
    image.map(Vec3::splat)
}

fn compare_real(got: &RealEstimate, want: &RealEstimate) -> (Vec<usize>, f64) {
    let touched = |e: &RealEstimate| e.touched.map(|t| Vec3::splat(f32::from(u8::from(t))));
    // Irradiance is some ten times the radiance.
    let of = |e: &RealEstimate| {
        let variance = e.irradiance_variance.map(|v| Vec3::splat(v.sqrt() / 10.0));
        let change = e.change_variance.map(|v| Vec3::splat(v.sqrt() / 10.0));
        [values(&e.share), e.irradiance.map(|e| e / 10.0), e.change.map(|e| e / 10.0), variance, change, touched(e)]
            .into_iter()
            .chain([e.mirror.clone(), e.mirrored.clone(), e.mirrored_mixed.clone()])
            .collect::<Vec<_>>()
    };
    let (got, want) = (of(got), of(want));
    compare(&got.iter().zip(&want).collect::<Vec<_>>())
}

fn compare_virtual(got: &VirtualEstimate, want: &VirtualEstimate) -> (Vec<usize>, f64) {
    let of = |e: &VirtualEstimate| [values(&e.coverage), e.radiance.clone(), e.variance.map(|v| Vec3::splat(v.sqrt()))];
    let (got, want) = (of(got), of(want));
    compare(&got.iter().zip(&want).collect::<Vec<_>>())
}

/// Both passes with the same random numbers. A sample for which rounding turns a choice over (which side of an edge or gap it is on, a
/// lobe, whose slopes are the median at a corner) finds something else, and its pixel is off by a sample: these are counted apart, at
/// most one in a hundred. There is one here: a ray to a corner of the table, whose mirror image goes by another of the slopes around.
/// The others are within the rounding of sums over light of up to 12.
fn estimates_equal_the_cpu(gpu: &Gpu) {
    let kinds = of_all_kinds();
    let (plain_ones, mirror) = (plain(), balls(&[Material::metal(Vec3::splat(0.9), 0.0)]));
    let few = Params { samples: 2, attempts: 16, bounces: 3, ..Params::default() };
    let many = Params { samples: 8, attempts: 1, bounces: 2, ..Params::default() };
    let once = Params { samples: 1, attempts: 3, bounces: 1, ..Params::default() };
    let cases = [
        ("few samples, every kind of surface", &kinds, few, known(1)),
        ("many samples, diffuse", &plain_ones, many, known(2)),
        ("a mirror, nothing known", &mirror, many, Update::default()),
        ("one bounce", &kinds, once, Update::default()),
    ];
    for ((what, objects, params, update), camera) in cases.iter().zip(cameras().into_iter().cycle()) {
        let world: CapturedWorld = world(objects, |o| o.hidden_samples = 2);
        let frame = frame(&camera, objects);
        let held = GpuFrame::new(gpu, &frame, &world, None).unwrap();
        let updated = UpdatedWorld::new(&world, CAPTURE, update);
        // Some pixels are left to interpolation.
        let wanted = |x: usize, y: usize| !(x + 3 * y).is_multiple_of(7);
        let got = held.trace_real(gpu, &frame, &world, update, params, wanted, &Silent).unwrap().unwrap();
        let want = iprt::trace_real(&frame, &updated, params, None, wanted, &Silent).unwrap();
        let (off, rest) = compare_real(&got, &want);
        println!("{what}, real: {rest:.1e} but for {} pixels; rays {} {}", off.len(), got.rays, want.rays);
        let pixels = camera.width * camera.height;
        assert!(off.len() * 100 <= pixels && rest < 1e-4, "{what}, real: {rest}, off {off:?}");
        assert!(got.rays.abs_diff(want.rays) * 200 <= want.rays, "{what}: {} rays, not {}", got.rays, want.rays);

        let got = held.trace_virtual(gpu, &frame, update, params, &Silent).unwrap().unwrap();
        let want = iprt::trace_virtual(&frame, &updated, params, &Silent).unwrap();
        let (off, rest) = compare_virtual(&got, &want);
        println!("{what}, virtual: {rest:.1e} but for {} pixels; rays {} {}", off.len(), got.rays, want.rays);
        assert!(off.len() * 100 <= pixels && rest < 1e-4, "{what}, virtual: {rest}, off {off:?}");
        assert!(got.rays.abs_diff(want.rays) * 200 <= want.rays, "{what}: {} rays, not {}", got.rays, want.rays);
    }
}

/// Rows of a view that do not fit one binding, and an update of 5 numbers a texel, 1.5 bindings in all; a panorama that does not is
/// refused.
fn bands_make_no_difference(_: &Gpu) {
    let objects = plain();
    let world = world(&objects, |_| ());
    let camera = view(70, 60);
    let frame = frame(&camera, &objects);
    let update = known(3);
    let [whole, banded] = [None, Some(1 << 18)].map(|max_binding| {
        let gpu = Gpu::new(&GpuOptions { max_binding, ..GpuOptions::default() }).unwrap();
        let held = GpuFrame::new(&gpu, &frame, &world, None).unwrap();
        let (buffer, _) = held.gbuffer(&gpu, &frame).unwrap();
        let coverage = held.coverage(&gpu, &frame, &buffer).unwrap();
        let seen = held.trace_virtual(&gpu, &frame, &update, &Params::default(), &Silent).unwrap().unwrap();
        let (ratio, gloss) = noise(&mut Random::new(8), (camera.width, camera.height));
        let update = held.panorama_update(&gpu, &frame, &buffer, &ratio, &gloss, (200, 100)).unwrap();
        let told = held.trace_virtual(&gpu, &frame, &update, &Params::default(), &Silent).unwrap().unwrap();
        ((buffer.depth, buffer.normal, coverage, seen.radiance, update.ratio, update.gloss, told.radiance), gpu.submissions())
    });
    assert!(banded.1 > 2 * whole.1, "{} {}", banded.1, whole.1);
    assert!(banded.0 == whole.0);
    for most in [10_000, 90_000] {
        let small = Gpu::new(&GpuOptions { max_binding: Some(most), ..GpuOptions::default() }).unwrap();
        let refused = GpuFrame::new(&small, &frame, &world, None);
        assert!(matches!(refused, Err(GpuError::TooLarge { .. })), "{most}: {refused:?}");
    }
}
