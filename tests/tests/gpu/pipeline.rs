//! Whole frames: stages on either backend, devices that are lost, small memory.

use crate::Test;
use glam::Vec3;
use pano_compose::pipeline::{Backend, GPU_STAGES, RenderOptions, Rendered, Sequence, render};
use pano_core::gpu::Gpu;
use pano_core::image::Image;
use pano_core::progress::Silent;
use pano_core::{
    io,
    scene::{Method, PicturePath, Scene},
};
use pano_tests::nasty;
use pano_tests::rooms::{plane_depth, texel_direction};

pub(crate) const TESTS: &[Test] = &[
    ("pipeline::frames_equal_the_cpu", frames_equal_the_cpu),
    ("pipeline::frames_with_depth_equal_the_cpu", frames_with_depth_equal_the_cpu),
    ("pipeline::an_ldr_panorama_is_expanded", an_ldr_panorama_is_expanded),
    ("pipeline::any_interval_of_stages_gives_the_same_picture", any_interval_of_stages_gives_the_same_picture),
    ("pipeline::a_lost_device_costs_one_warning_and_no_pixel", a_lost_device_costs_one_warning_and_no_pixel),
    ("pipeline::a_sequence_survives_a_loss", a_sequence_survives_a_loss),
    ("pipeline::small_memory_makes_no_difference", small_memory_makes_no_difference),
    ("pipeline::nasty_scenes_equal_the_cpu", nasty_scenes_equal_the_cpu),
    ("pipeline::adaptive_frames_equal_the_cpu", adaptive_frames_equal_the_cpu),
    ("pipeline::auto_knows_a_program_from_a_gpu", auto_knows_a_program_from_a_gpu),
];

/// Root mean square of the composites' differences that rounding may make, relative to a picture of radiance about 1.
pub(crate) const SAME: f64 = 1e-3;

/// A scene in a folder that goes with it.
pub(crate) struct Place {
    pub(crate) scene: Scene,
    pub(crate) folder: tempfile::TempDir,
}

impl Place {
    /// A metal pyramid in the sun, over a plane.
    pub(crate) fn new(method: &str, size: (usize, usize)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let sun = Vec3::new(0.5, 1.0, 0.3).normalize();
        let radiance = |d: Vec3| if d.dot(sun) > 0.995 { Vec3::splat(200.0) } else { Vec3::splat(0.4) + 0.3 * d };
        let panorama = Image::from_fn(64, 32, |x, y| radiance(texel_direction(64, 32, x, y)));
        io::write_image(folder.path().join("room.exr"), &panorama, None).unwrap();
        let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
            element face 4\nproperty list uchar int vertex_indices\nend_header\n\
            -0.5 0 0.5\n0.5 0 0.5\n0 0 -0.5\n0 0.9 0\n3 0 1 3\n3 1 2 3\n3 2 0 3\n3 0 2 1\n";
        std::fs::write(folder.path().join("thing.ply"), ply).unwrap();
        let (w, h) = size;
        let text = format!(
            "[panorama]\ncolor = 'room.exr'\nposition = [0, 1, 0]\n[[proxy]]\nplane = {{ size = [8, 8] }}\nalbedo = [0.5, 0.4, 0.3]\n\
            [[object]]\nmesh = 'thing.ply'\nposition = [0, 0, -2]\nmaterial = {{ base_color = [0.9, 0.7, 0.5], metallic = 1.0, roughness = 0.4 }}\n\
            [view]\nkind = 'perspective'\npitch = -25\nsize = [{w}, {h}]\n[render]\nmethod = '{method}'\nsamples = 4\nbounces = 2\n"
        );
        let scene = Scene::parse(&text, folder.path().join("scene.toml")).unwrap_or_else(|e| panic!("{e}: {text}"));
        Self { scene, folder }
    }

    fn render(&self, options: &RenderOptions) -> Rendered {
        render(&self.scene, options, &Silent).unwrap()
    }
}

pub(crate) fn on_gpu() -> RenderOptions {
    RenderOptions { backend: Backend::Gpu, ..RenderOptions::default() }
}

pub(crate) fn rmse(a: &Rendered, b: &Rendered) -> f64 {
    let pixels = a.composite.color.data().iter().zip(b.composite.color.data());
    (pixels.map(|(a, b)| f64::from((*a - *b).length_squared())).sum::<f64>() / a.composite.color.data().len() as f64).sqrt()
}

/// Name and backend of the stages that can run on a GPU.
pub(crate) fn backends(rendered: &Rendered) -> Vec<(&'static str, &'static str)> {
    let stages = rendered.stats.stages.iter().filter(|s| GPU_STAGES.contains(&s.name));
    stages.map(|s| (s.name, s.backend)).collect()
}

fn frames_equal_the_cpu(gpu: &Gpu) {
    for method in ["dpt", "onepass", "twopass", "mr360", "ibl", "rt2ar"] {
        let mut place = Place::new(method, (67, 45));
        if method == "rt2ar" {
            // A mirror too rough for its rays to stay outside sees the object's bottom from within: in one place with the floor, rounding
            // would tell which of them comes first.
            place.scene.objects[0].placement.position.y = 0.01;
        }
        let (got, want) = (place.render(&on_gpu()), place.render(&RenderOptions::default()));
        let traced = backends(&got).contains(&("trace", "gpu"));
        assert!(backends(&got).iter().all(|s| s.1 == "gpu") && traced, "{method}: {:?}", backends(&got));
        assert!(backends(&want).iter().all(|s| s.1 == "cpu"), "{method}: {:?}", backends(&want));
        assert_eq!((got.stats.backend, want.stats.backend), ("gpu", "cpu"));
        assert_eq!((got.stats.adapter, &want.stats.adapter), (Some(gpu.adapter().to_string()), &None));
        assert_eq!(got.stats.warnings, want.stats.warnings, "{method}");
        let (got, error) = (place.render(&on_gpu()), rmse(&place.render(&on_gpu()), &want));
        assert!(error < SAME, "{method}: {error}");
        let farthest =
            got.composite.color.data().iter().zip(want.composite.color.data()).map(|(a, b)| (*a - *b).abs().max_element());
        let farthest = farthest.fold(0.0, f32::max);
        // No pixel is far off: the filter's own tolerance.
        assert!(farthest < 5e-3, "{method}: {farthest}");
    }
}

fn frames_with_depth_equal_the_cpu(_: &Gpu) {
    for method in ["dpt", "onepass", "mr360"] {
        let mut place = Place::new(method, (67, 45));
        let depth = place.folder.path().join("depth.exr");
        io::write_exr(&depth, &[("Z", &plane_depth(64, 1.0))], &[]).unwrap();
        place.scene.panorama.depth = Some(PicturePath::Still(depth));
        place.scene.proxies.clear();
        let (got, want) = (place.render(&on_gpu()), place.render(&RenderOptions::default()));
        assert!(backends(&got).contains(&("trace", "gpu")), "{method}: {:?} {:?}", backends(&got), got.stats.warnings);
        assert_eq!(got.stats.warnings, want.stats.warnings, "{method}");
        assert!(rmse(&got, &want) < SAME, "{method}: {}", rmse(&got, &want));
    }
}

fn an_ldr_panorama_is_expanded(_: &Gpu) {
    let mut place = Place::new("dpt", (40, 30));
    let picture = place.folder.path().join("room.png");
    let panorama = Image::from_fn(64, 32, |x, y| if (x, y) == (20, 5) { Vec3::ONE } else { Vec3::splat(0.3 + 0.01 * y as f32) });
    io::write_png8(&picture, &panorama, None).unwrap();
    place.scene.panorama.color = PicturePath::Still(picture);
    let (got, want) = (place.render(&on_gpu()), place.render(&RenderOptions::default()));
    let load = |r: &Rendered| r.stats.stages.iter().find(|s| s.name == "load").map(|s| s.backend);
    assert_eq!((load(&got), load(&want)), (Some("gpu"), Some("cpu")));
    assert!(rmse(&got, &want) < SAME, "{}", rmse(&got, &want));
}

/// What must come of the scenes in which things go wrong comes of them here, too, and the same picture.
fn nasty_scenes_equal_the_cpu(_: &Gpu) {
    let mut failures = Vec::new();
    for scene in nasty::scenes() {
        // The methods whose stages differ; the baselines share those of dpt.
        for method in [Method::Iprt, Method::Dpt, Method::Mr360].into_iter().filter(|method| scene.suits(*method)) {
            let got = scene.render(method, Backend::Gpu);
            scene.check(method, &got);
            let want = scene.render(method, Backend::Cpu);
            let mean = want.composite.color.data().iter().map(|p| f64::from(p.length())).sum::<f64>();
            let error = rmse(&got, &want) / (mean / want.composite.color.data().len() as f64).max(1e-30);
            if error > SAME {
                failures.push(format!("{}, {method:?}: {error}", scene.name));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn any_interval_of_stages_gives_the_same_picture(_: &Gpu) {
    let place = Place::new("dpt", (41, 30));
    let want = place.render(&RenderOptions::default());
    let end = GPU_STAGES.len() - 1;
    for (from, first) in GPU_STAGES.iter().enumerate() {
        // Each stage alone, all from it on, all up to it, and none.
        let ends = |until: &usize| *until == from || *until == end || from == 0 || (from == end && *until == 0);
        for (until, last) in GPU_STAGES.iter().enumerate().filter(|(until, _)| ends(until)) {
            let mut options = on_gpu();
            options.settings.set("gpu_from", first).unwrap();
            options.settings.set("gpu_until", last).unwrap();
            let got = place.render(&options);
            for (name, backend) in backends(&got) {
                let at = GPU_STAGES.iter().position(|s| *s == name).unwrap();
                assert_eq!(backend == "gpu", from <= at && at <= until, "{name} of {from}..={until}");
            }
            assert!(rmse(&got, &want) < SAME, "{from}..={until}: {}", rmse(&got, &want));
        }
    }
}

/// Whenever the device is lost: it is lost anew each time it is set up, so that the CPU ends the work, or it ends by itself.
fn a_lost_device_costs_one_warning_and_no_pixel(_: &Gpu) {
    let place = Place::new("dpt", (41, 30));
    let want = place.render(&RenderOptions::default());
    let (mut by_cpu, mut by_gpu) = (0, 0);
    for lose_after in (0..30).step_by(3) {
        let mut options = on_gpu();
        options.settings.set("gpu_lose_after", &lose_after.to_string()).unwrap();
        let got = place.render(&options);
        assert!(rmse(&got, &want) < SAME, "{lose_after}: {}", rmse(&got, &want));
        let lost: Vec<&String> = got.stats.warnings.iter().filter(|w| w.contains("GPU was lost")).collect();
        match got.stats.stages.last().map(|s| s.backend) {
            Some("cpu") => {
                by_cpu += 1;
                // A stage that was lost and done again may come before the one that was lost for good.
                assert!((1..=2).contains(&lost.len()), "{lose_after}: {:?}", got.stats.warnings);
            }
            _ => {
                by_gpu += 1;
                assert!(lost.len() <= 1, "{lose_after}: {lost:?}");
            }
        }
        if lose_after == 0 {
            assert_eq!(lost.len(), 1, "{lost:?}");
            assert!(lost[0].contains("the CPU does the rest"), "{lost:?}");
        }
    }
    assert!(by_cpu > 0 && by_gpu > 0, "{by_cpu} and {by_gpu}");
}

/// The device that is lost in the second frame is set up again.
fn a_sequence_survives_a_loss(_: &Gpu) {
    let place = Place::new("dpt", (41, 30));
    let want = place.render(&RenderOptions::default());
    let mut rebuilt = 0;
    for lose_after in (18..36).step_by(3) {
        let mut options = on_gpu();
        options.settings.set("gpu_lose_after", &lose_after.to_string()).unwrap();
        let mut sequence = Sequence::new(&place.scene, &options);
        let frames: Vec<Rendered> = (0..2).map(|_| sequence.render(0, &Silent).unwrap()).collect();
        let warnings: Vec<&String> = frames.iter().flat_map(|f| &f.stats.warnings).filter(|w| w.contains("lost")).collect();
        if let [warning] = warnings[..]
            && warning.contains("set up again")
            && frames.iter().all(|f| backends(f).iter().all(|s| s.1 == "gpu"))
        {
            rebuilt += 1;
        }
        assert!(frames.iter().all(|f| rmse(f, &want) < SAME), "{lose_after}");
    }
    assert!(rebuilt > 0);
}

fn small_memory_makes_no_difference(_: &Gpu) {
    // 400×200 pixels of 16 bytes are 1.2 MiB: two bands.
    let place = Place::new("dpt", (400, 200));
    let (whole, mut options) = (place.render(&on_gpu()), on_gpu());
    options.settings.set("gpu_binding", "1").unwrap();
    let banded = place.render(&options);
    assert!(banded.composite == whole.composite, "{}", rmse(&banded, &whole));
    assert!(backends(&banded).iter().all(|s| s.1 == "gpu"), "{:?}", backends(&banded));
}

fn auto_knows_a_program_from_a_gpu(gpu: &Gpu) {
    let auto = RenderOptions { backend: Backend::Auto, ..RenderOptions::default() };
    let got = Place::new("dpt", (20, 10)).render(&auto);
    let told = got.stats.warnings.iter().filter(|w| w.contains(&gpu.adapter().name)).count();
    let software = gpu.adapter().software;
    assert_eq!((got.stats.backend, told), if software { ("cpu", 1) } else { ("gpu", 0) }, "{:?}", got.stats.warnings);
}

fn adaptive_frames_equal_the_cpu(_: &Gpu) {
    let [mut gpu, mut cpu] = [on_gpu(), RenderOptions::default()];
    for options in [&mut gpu, &mut cpu] {
        options.settings.set("error_target", "0.02").unwrap();
    }
    let mut place = Place::new("dpt", (41, 30));
    place.scene.render.samples = 64;
    let (got, want) = (place.render(&gpu), place.render(&cpu));
    assert!(backends(&got).contains(&("trace", "gpu")), "{:?} {:?}", backends(&got), got.stats.warnings);
    assert_eq!(got.stats.warnings, want.stats.warnings);
    let samples = want.stats.sampling.expect("sampling was adaptive").samples;
    assert!((17.0..63.0).contains(&samples), "{samples} samples are no test");
    assert_eq!(got.stats.sampling.map(|s| s.samples), Some(samples));
    assert!(rmse(&got, &want) < SAME, "{}", rmse(&got, &want));
}
