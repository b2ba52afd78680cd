//! Frames of one sample each, as iprt makes them for video: how far filters and history bring them.

use glam::{Quat, Vec2, Vec3};
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
             [[object]]\nmesh = 'ball.obj'\n{object}\n"
        );
        Scene::parse(&text, self.path("scene.toml")).unwrap_or_else(|e| panic!("{e}: {text}"))
    }
}

const VIEW: &str = "kind = 'perspective'\nyaw = 12\npitch = -30\nvfov = 20\nsize = [128, 96]";

const MATT: &str = "material = { base_color = [0.7, 0.5, 0.3], specular = 0 }";
const MIRROR: &str = "material = { base_color = [0.9, 0.9, 0.9], metallic = 1, roughness = 0 }";
/// Beside the box, on the floor.
const STILL: &str = "position = [0.55, -1.1, -1.7]";
/// Samples of what the others are compared with.
const TRUTH: u32 = 512;

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

/// What a frame of one sample without filters and history is off by, over what the 30th with both is, and how much two such
/// frames differ on the average: of 1 on a display.
#[test]
fn thirty_still_frames_are_eight_times_as_right_as_one_sample() {
    let place = Place::new(0);
    for material in [MATT, MIRROR] {
        let object = format!("{material}\n{STILL}");
        let truth = unfiltered(&place.scene(&object, VIEW, TRUTH), 1).composite.color;
        let raw = unfiltered(&place.scene(&object, VIEW, 1), 2).composite.color;
        let (scene, options) = (place.scene(&object, VIEW, 1), options());
        let mut sequence = Sequence::new(&scene, &options);
        let mut frame = |k| sequence.render(k, &Silent).unwrap().composite.color;
        let mut last = (0..30).map(&mut frame).last().unwrap();
        let gain = rmse(&raw, &truth) / rmse(&last, &truth);
        assert!(gain >= 8.0, "{material}: {gain}");
        let display = |v: &Vec3| v.to_array().map(linear_to_srgb);
        let mut flicker = 0.0;
        for k in 30..34 {
            let next = frame(k);
            let pairs = last.data().iter().zip(next.data()).flat_map(|(a, b)| display(a).into_iter().zip(display(b)));
            flicker += pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / (3 * next.data().len()) as f64 / 4.0;
            last = next;
        }
        assert!(flicker < 1.0 / 255.0, "{material}: {} of 255", 255.0 * flicker);
    }
}

/// A ball that rolls by leaves no ghost: where it and its shadow were some frames ago, the picture is what it is without it.
#[test]
fn a_rolling_ball_leaves_no_trail() {
    let place = Place::new(0);
    // Across the view within a second, a diameter in 18 frames.
    let place_at = |x: f32| format!("position = [{x}, -1.1, -1.7]");
    let at = |x: f32| format!("{MATT}\n{}", place_at(x));
    let x = |frame: u32| -0.2 + frame as f32 / 30.0;
    let keyframes = format!("{MATT}\nkeyframes = [{{ time = 0, {} }}, {{ time = 2, {} }}]", place_at(x(0)), place_at(x(60)));
    let (now, before) = (30, 18);
    let truth = unfiltered(&place.scene(&at(x(now)), VIEW, TRUTH), 1).composite;
    let past = unfiltered(&place.scene(&at(x(before)), VIEW, TRUTH), 3).composite;
    let raw = unfiltered(&place.scene(&at(x(now)), VIEW, 1), 2).composite.color;
    let (scene, options) = (place.scene(&keyframes, VIEW, 1), options());
    let mut sequence = Sequence::new(&scene, &options);
    let last = (0..=now).map(|k| sequence.render(k, &Silent).unwrap().composite.color).last().unwrap();
    let gain = rmse(&raw, &truth.color) / rmse(&last, &truth.color);
    // What was there, as a share of which is still there.
    let (mut trail, mut was) = (0.0, 0.0);
    for (i, (&truth, &past)) in truth.color.data().iter().zip(past.color.data()).enumerate() {
        let change = (past - truth).as_dvec3();
        if change.length() > 0.1 * f64::from(truth.length()) {
            trail += (last.data()[i] - truth).as_dvec3().dot(change);
            was += change.length_squared();
        }
    }
    assert!(gain >= 8.0, "{gain}");
    assert!((trail / was).abs() < 0.1, "{}", trail / was);
}

/// A view of the whole panorama has no first column.
#[test]
fn a_rolled_panorama_gives_a_rolled_picture() {
    let view = "kind = 'panorama'\nsize = [128, 64]";
    let turned = |columns: usize, seed: u32| {
        let angle = std::f32::consts::TAU * columns as f32 / WIDTH as f32;
        // To the right, as seen from above.
        let at = Quat::from_rotation_y(-angle) * Vec3::new(0.0, -1.1, 1.6);
        let place = Place::new(columns);
        let scene = place.scene(&format!("{MATT}\nposition = [{}, {}, {}]", at.x, at.y, at.z), view, 8);
        let options = RenderOptions { seed, ..options() };
        let mut sequence = Sequence::new(&scene, &options);
        (0..6).map(|k| sequence.render(k, &Silent).unwrap().composite.color).last().unwrap()
    };
    // The ball on the seam, and in the middle; the latter with other random numbers tells what is noise.
    let (seam, middle, other) = (turned(0, 0), turned(WIDTH / 2, 0), turned(WIDTH / 2, 1));
    let back = rolled(&middle, 64);
    let noise = rmse(&middle, &other);
    assert!(rmse(&seam, &back) < 1.3 * noise, "{} {noise}", rmse(&seam, &back));
    let columns = |image: &RadianceImage| Image::from_fn(6, 64, |x, y| image.get((x + 125) % 128, y));
    let noise = rmse(&columns(&back), &columns(&rolled(&other, 64)));
    let error = rmse(&columns(&seam), &columns(&back));
    assert!(error < 1.3 * noise, "{error} {noise}");
}
