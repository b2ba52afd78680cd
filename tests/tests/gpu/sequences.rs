//! Sequences of iprt as the pipeline makes them, whose frames each need the one before: all stages, moving objects, devices that are
//! lost, small memory.

use crate::Test;
use crate::captured::room;
use crate::pipeline::{Place, SAME, backends, on_gpu, rmse};
use glam::Vec3;
use pano_compose::pipeline::{RenderOptions, Rendered, Sequence};
use pano_core::gpu::Gpu;
use pano_core::io;
use pano_core::progress::Silent;
use pano_core::scene::{Keyframe, PicturePath, Placement};
use pano_tests::rooms::plane_depth;

pub(crate) const TESTS: &[Test] = &[
    ("sequences::frames_over_a_plane_equal_the_cpu", frames_over_a_plane_equal_the_cpu),
    ("sequences::frames_of_a_room_equal_the_cpu", frames_of_a_room_equal_the_cpu),
    ("sequences::lost_devices_cost_no_pixel", lost_devices_cost_no_pixel),
    ("sequences::what_does_not_fit_is_told_once_a_frame", what_does_not_fit_is_told_once_a_frame),
];

/// The passes of iprt that its filters stand between.
const PASSES: [&str; 4] = ["g-buffer", "real pixels", "update", "virtual pixels"];

fn over_a_plane(size: (usize, usize)) -> Place {
    let mut place = Place::new("iprt", size);
    let depth = place.folder.path().join("depth.exr");
    io::write_exr(&depth, &[("Z", &plane_depth(64, 1.0))], &[]).unwrap();
    place.scene.panorama.depth = Some(PicturePath::Still(depth));
    place.scene.proxies.clear();
    place
}

/// The pyramid moves over the floor of a room with a table, a window and a lamp, seen from beside the capture point.
fn in_a_room(size: (usize, usize)) -> Place {
    let mut place = over_a_plane(size);
    let folder = place.folder.path();
    io::write_image(folder.join("room.exr"), &room().radiance(128), None).unwrap();
    io::write_exr(folder.join("depth.exr"), &[("Z", &room().depth(128))], &[]).unwrap();
    place.scene.view.position = Some(Vec3::new(0.2, 1.1, 0.3));
    let at = |x: f32| Placement { position: Vec3::new(x, -0.5, -1.2), ..place.scene.objects[0].placement };
    place.scene.objects[0].keyframes =
        vec![Keyframe { time: 0.0, placement: at(0.3) }, Keyframe { time: 1.0, placement: at(1.8) }];
    place.scene.panorama.fps = 30.0;
    place
}

/// Frames by both backends, the same random numbers: their RMSE, and the pixels that are off by more than a hundredth.
fn compare(place: &Place, frames: u32) -> Vec<(f64, usize)> {
    let options = [on_gpu(), RenderOptions::default()];
    let [mut gpu, mut cpu] = options.each_ref().map(|options| Sequence::new(&place.scene, options));
    let mut found = Vec::new();
    for frame in 0..frames {
        let (got, want) = (gpu.render(frame, &Silent).unwrap(), cpu.render(frame, &Silent).unwrap());
        let ran = backends(&got);
        assert!(PASSES.iter().all(|pass| ran.iter().any(|(name, _)| name == pass)), "{ran:?}");
        // Views from beside the capture point are the CPU's.
        assert!(ran.iter().all(|(name, backend)| *backend == "gpu" || *name == "view"), "{ran:?}");
        assert_eq!(got.stats.warnings, want.stats.warnings);
        let pixels = got.composite.color.data().iter().zip(want.composite.color.data());
        let off = pixels.filter(|(a, b)| (**a - **b).abs().max_element() > 1e-2 * b.max_element().max(1.0)).count();
        let rays = |r: &Rendered| r.stats.stages.iter().map(|s| s.rays).sum::<u64>();
        println!("frame {frame}: {:.1e}, {off} pixels off, rays {} {}", rmse(&got, &want), rays(&got), rays(&want));
        found.push((rmse(&got, &want), off));
    }
    found
}

fn frames_over_a_plane_equal_the_cpu(_: &Gpu) {
    for samples in [1, 16] {
        let mut place = over_a_plane((48, 36));
        place.scene.render.samples = samples;
        for (frame, (error, off)) in compare(&place, 3).into_iter().enumerate() {
            assert!(error < SAME && off == 0, "{samples} samples, frame {frame}: {error}, {off} pixels");
        }
    }
}

/// Rounding may turn a sample's choice over; then its pixel is off by a sample, at most one in a thousand. In the frames of four samples
/// there are two such pixels, both on the pyramid's rim, where one or two samples show the floor.
fn frames_of_a_room_equal_the_cpu(_: &Gpu) {
    let size = (57, 41);
    for samples in [1, 4] {
        let mut place = in_a_room(size);
        place.scene.render.samples = samples;
        for (frame, (error, off)) in compare(&place, 4).into_iter().enumerate() {
            assert!(error < SAME && off * 1000 <= size.0 * size.1, "{samples} samples, frame {frame}: {error}, {off} pixels");
        }
    }
}

/// Whenever the device is lost, what is done is kept, and the scene is copied to the next one.
fn lost_devices_cost_no_pixel(_: &Gpu) {
    let place = over_a_plane((20, 15));
    let want = Sequence::new(&place.scene, &RenderOptions::default()).render(0, &Silent).unwrap();
    let mut rebuilt = 0;
    for lose_after in [0, 20, 90, 250] {
        let mut options = on_gpu();
        options.settings.set("gpu_lose_after", &lose_after.to_string()).unwrap();
        let got = Sequence::new(&place.scene, &options).render(0, &Silent).unwrap();
        assert!(rmse(&got, &want) < SAME, "{lose_after}: {}", rmse(&got, &want));
        rebuilt += got.stats.warnings.iter().filter(|w| w.contains("set up again")).count();
    }
    assert!(rebuilt > 0);
}

fn what_does_not_fit_is_told_once_a_frame(_: &Gpu) {
    let place = over_a_plane((20, 15));
    let want = Sequence::new(&place.scene, &RenderOptions::default()).render(0, &Silent).unwrap();
    let mut options = on_gpu();
    // The panorama's radiance alone takes 24 kB.
    options.settings.gpu.max_binding = Some(20_000);
    let got = Sequence::new(&place.scene, &options).render(0, &Silent).unwrap();
    let told: Vec<&String> = got.stats.warnings.iter().filter(|w| w.contains("runs on the CPU")).collect();
    let passes = backends(&got).into_iter().filter(|(name, _)| PASSES.contains(name));
    assert!(passes.clone().count() > 0 && passes.clone().all(|pass| pass.1 == "cpu"), "{:?}", backends(&got));
    assert!(told.len() == 1, "{told:?}");
    assert!(rmse(&got, &want) < SAME);
}
