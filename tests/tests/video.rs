//! Frames of one sample each, as iprt makes them for video: how far filters and history bring them.

use glam::{Vec2, Vec3};
use pano_compose::pipeline::{RenderOptions, Rendered, Sequence, render};
use pano_core::builtin::primitives;
use pano_core::color::linear_to_srgb;
use pano_core::image::{Image, RadianceImage};
use pano_core::io;
use pano_core::progress::Silent;
use pano_core::scene::Scene;
use pano_tests::rooms::{Cuboid, Room};
use std::fmt::Write;
use tempfile::TempDir;

const WIDTH: usize = 256;

/// A room with a box in it, daylight through a window, and a ball.
struct Place {
    folder: TempDir,
}

impl Place {
    /// With what the panorama shows moved `columns` to the right.
    fn new(columns: usize) -> Self {
        let room = Room {
            walls: Cuboid { lo: Vec3::new(-2.0, -1.4, -2.5), hi: Vec3::new(2.0, 1.2, 2.5) },
            table: Some(Cuboid { lo: Vec3::new(-1.4, -1.4, -2.0), hi: Vec3::new(-0.6, -0.8, -1.3) }),
            window: Some((Vec2::new(-0.2, -0.4), Vec2::new(1.4, 0.8))),
            colors: [Vec3::new(0.25, 0.2, 0.15), Vec3::new(0.3, 0.35, 0.4)],
            lights: [Vec3::new(4.0, 5.0, 6.0), Vec3::splat(8.0)],
        };
        let place = Self { folder: tempfile::tempdir().unwrap() };
        io::write_image(place.path("room.exr"), &rolled(&room.radiance(WIDTH), columns), None).unwrap();
        io::write_exr(place.path("depth.exr"), &[("Z", &rolled(&room.depth(WIDTH), columns))], &[]).unwrap();
        let ball = primitives::icosphere(0.3, 3);
        let mut obj = String::new();
        for p in &ball.positions {
            writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap();
        }
        for [a, b, c] in &ball.triangles {
            writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
        }
        std::fs::write(place.path("ball.obj"), obj).unwrap();
        place
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    /// The ball where `object` says, seen as `view` says.
    fn scene(&self, object: &str, view: &str, samples: u32) -> Scene {
        let text = format!(
            "[panorama]\ncolor = 'room.exr'\ndepth = 'depth.exr'\nfps = 30\n[render]\nmethod = 'iprt'\nsamples = {samples}\n[view]\n{view}\n\
             [[object]]\nmesh = 'ball.obj'\nmaterial = {{ base_color = [0.7, 0.5, 0.3], specular = 0 }}\n{object}\n"
        );
        Scene::parse(&text, self.path("scene.toml")).unwrap_or_else(|e| panic!("{e}: {text}"))
    }
}

const VIEW: &str = "kind = 'perspective'\nyaw = 12\npitch = -30\nvfov = 20\nsize = [128, 96]";

fn rolled<T: Copy>(image: &Image<T>, columns: usize) -> Image<T> {
    let (w, h) = image.size();
    Image::from_fn(w, h, |x, y| image.get((x + w - columns % w) % w, y))
}

fn options() -> RenderOptions {
    let mut options = RenderOptions::default();
    options.settings.captured.irradiance_width = 128;
    options
}

/// The picture without filters and history.
fn unfiltered(scene: &Scene, seed: u32) -> Rendered {
    render(scene, &RenderOptions { denoise: false, seed, ..options() }, &Silent).unwrap()
}

fn rmse(a: &RadianceImage, b: &RadianceImage) -> f64 {
    let squares = a.data().iter().zip(b.data()).map(|(a, b)| f64::from(a.distance_squared(*b)));
    (squares.sum::<f64>() / a.data().len() as f64).sqrt()
}

#[test]
fn explore() {
    let place = Place::new(0);
    let still = "position = [0.55, -1.1, -1.7]";
    let t0 = std::time::Instant::now();
    let truth = unfiltered(&place.scene(still, VIEW, 512), 1).composite.color;
    eprintln!("truth {:?}", t0.elapsed());
    let raw = unfiltered(&place.scene(still, VIEW, 1), 2).composite.color;
    let scene = place.scene(still, VIEW, 1);
    let options = options();
    let mut sequence = Sequence::new(&scene, &options);
    let mut last: Option<RadianceImage> = None;
    for frame in 0..36 {
        let now = sequence.render(frame, &Silent).unwrap().composite.color;
        let flicker = last.as_ref().map_or(0.0, |last| {
            let e = |v: Vec3| Vec3::new(linear_to_srgb(v.x), linear_to_srgb(v.y), linear_to_srgb(v.z));
            last.data().iter().zip(now.data()).map(|(a, b)| f64::from((e(*a) - e(*b)).abs().element_sum() / 3.0)).sum::<f64>() / now.data().len() as f64
        });
        eprintln!("{frame}: {} of {}; flicker {}", rmse(&raw, &truth) / rmse(&now, &truth), rmse(&raw, &truth), flicker * 255.0);
        last = Some(now);
    }
    for (n, p) in [("truth", &truth), ("raw", &raw), ("last", last.as_ref().unwrap())] {
        io::write_image(std::path::Path::new(&format!("/tmp/lead/vid/v_{n}.exr")), p, None).unwrap();
    }
}
