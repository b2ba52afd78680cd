mod adaptive;
mod influence;
mod iprt;
mod rt2ar;

use super::*;
use glam::{Vec2, Vec3};
use pano_core::image::Image;
use pano_core::progress::{Progress, Silent};
use pano_core::{io, scene::Method, sphere};
use pano_trace::world::RealWorld;
use std::path::PathBuf;

/// A folder with a mesh and whatever else a test writes into it.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { folder: tempfile::tempdir().unwrap() };
        // A square pyramid, 0.6 m wide and high, on y = 0.
        let ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
            element face 6\nproperty list uchar int vertex_indices\nend_header\n\
            -0.3 0 -0.3\n0.3 0 -0.3\n0.3 0 0.3\n-0.3 0 0.3\n0 0.6 0\n\
            3 0 1 2\n3 0 2 3\n3 0 4 1\n3 1 4 2\n3 2 4 3\n3 3 4 0\n";
        std::fs::write(place.path("thing.ply"), ply).unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A scene of `[panorama]` with these lines and the rest as given; 2 samples, 1 bounce.
    fn scene(&self, panorama: &str, rest: &str) -> Scene {
        let text = format!("[panorama]\n{panorama}\n[render]\nsamples = 2\nbounces = 1\n{rest}");
        Scene::parse(&text, self.path("scene.toml")).unwrap_or_else(|e| panic!("{e}: {text}"))
    }

    fn exr(&self, name: &str, picture: &RadianceImage) {
        io::write_image(self.path(name), picture, None).unwrap();
    }

    fn depth(&self, name: &str, depth: &Image<f32>) {
        io::write_exr(self.path(name), &[("Z", depth)], &[]).unwrap();
    }
}

const OBJECT: &str =
    "[[object]]\nmesh = 'thing.ply'\nposition = [0, 0, -2]\nmaterial = { base_color = [0.7, 0.6, 0.5], specular = 0 }\n";

fn direction(w: usize, h: usize, x: usize, y: usize) -> Vec3 {
    sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32))
}

/// Values over ten orders of magnitude, exact zeros, and a sun.
fn wild_picture() -> RadianceImage {
    Image::from_fn(32, 16, |x, y| match (x, y) {
        (3, 4) => Vec3::splat(1e5),
        (_, 9) if x % 5 == 0 => Vec3::ZERO,
        _ => Vec3::new(1.0 + x as f32 * 0.37, 1e-6 * (y as f32 + 1.0), 0.1 + (x * y) as f32 / 97.0),
    })
}

fn smooth_picture() -> RadianceImage {
    Image::from_fn(64, 32, |x, y| {
        let d = direction(64, 32, x, y);
        if d.y > 0.0 { Vec3::new(0.5, 0.7, 1.0) * (0.4 + d.y) } else { Vec3::new(0.3, 0.25, 0.2) }
    })
}

fn bits(image: &RadianceImage) -> Vec<[u32; 3]> {
    image.data().iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

fn run(scene: &Scene) -> Rendered {
    let mut options = RenderOptions::default();
    options.settings.captured.irradiance_width = 64;
    render(scene, &options, &Silent).unwrap_or_else(|e| panic!("{e}"))
}

fn fails(scene: &Scene, options: &RenderOptions, words: &[&str]) {
    let error = render(scene, options, &Silent).err().unwrap_or_else(|| panic!("no error with {words:?}"));
    let text = format!("{error} {}", error.remedy().expect("a remedy"));
    assert!(words.iter().all(|w| text.contains(w)), "{text} has not all of {words:?}");
}

#[test]
fn without_objects_an_exr_comes_back_bit_for_bit() {
    let place = Place::new();
    let picture = wild_picture();
    place.exr("room.exr", &picture);
    place.depth("depth.exr", &Image::filled(16, 8, 2.5));
    let proxy = "[[proxy]]\nplane = { size = [5, 5] }\n";
    for (panorama, rest) in [
        ("color = 'room.exr'", ""),
        ("color = 'room.exr'\nheading = 33\nconvention = 'blender'\nposition = [1, 2, 3]", ""),
        ("color = 'room.exr'\ndepth = 'depth.exr'", ""),
        ("color = 'room.exr'\ncamera_height = 1.6", ""),
        ("color = 'room.exr'", proxy),
    ] {
        let rendered = run(&place.scene(panorama, rest));
        assert_eq!(bits(&rendered.composite.color), bits(&picture), "{panorama}");
        assert!(rendered.composite.multiplier.data().iter().all(|m| *m == Vec3::ONE));
        assert!(rendered.stats.stages.iter().all(|s| s.name != "denoise"));
        write_output(&place.path("out.exr"), &rendered).unwrap();
        let back = io::read_exr(place.path("out.exr")).unwrap();
        for layer in ["", "photo"] {
            assert_eq!(bits(&back.rgb(layer).unwrap()), bits(&picture), "{panorama}, layer {layer:?}");
        }
        assert!(back.rgb("object").unwrap().data().iter().chain(back.rgb("delta").unwrap().data()).all(|p| *p == Vec3::ZERO));
    }
}

#[test]
fn without_objects_an_ldr_picture_keeps_its_codes() {
    let place = Place::new();
    // Every code of 8 bits occurs, and 16-bit codes that 8 bits cannot hold.
    let picture = Image::from_fn(32, 16, |x, y| Vec3::new((y * 32 + x) as f32 / 511.0, y as f32 / 15.0, 0.5 + x as f32 / 4000.0));
    let path = |name: &str| place.path(name);
    io::write_png8(path("in8.png"), &picture, None).unwrap();
    io::write_png16(path("in16.png"), &picture, None).unwrap();
    io::write_jpeg(path("in.jpg"), &picture, 90).unwrap();
    for (name, encoding) in
        [("in8.png", SourceEncoding::Srgb8), ("in16.png", SourceEncoding::Srgb16), ("in.jpg", SourceEncoding::Srgb8)]
    {
        let rendered = run(&place.scene(&format!("color = '{name}'"), ""));
        assert_eq!(rendered.encoding, encoding);
        write_output(&path("out.png"), &rendered).unwrap();
        let (before, after) = (io::read_image(path(name)).unwrap(), io::read_image(path("out.png")).unwrap());
        assert_eq!(after.encoding, encoding, "{name}");
        assert_eq!(bits(&after.radiance), bits(&before.radiance), "{name}");
    }
}

/// Above the horizon nothing can change but where the object stands; everywhere the picture is the photo where the layers
/// say so.
#[test]
fn pixels_that_no_object_touches_stay_bit_for_bit() {
    let place = Place::new();
    place.exr("sky.exr", &smooth_picture());
    io::write_png8(place.path("sky.png"), &smooth_picture(), None).unwrap();
    for name in ["sky.exr", "sky.png"] {
        let panorama = format!("color = '{name}'\nposition = [0, 1.5, 0]\ncamera_height = 1.5");
        let rendered = run(&place.scene(&panorama, OBJECT));
        let (photo, layers) = (&rendered.photo, &rendered.layers);
        let (mut untouched, mut touched) = (0, 0);
        for y in 0..32 {
            for x in 0..64 {
                if layers.coverage.get(x, y) == 0.0 && layers.delta.get(x, y) == Vec3::ZERO {
                    let (a, b) = (rendered.composite.color.get(x, y), photo.get(x, y));
                    assert_eq!(a.to_array().map(f32::to_bits), b.to_array().map(f32::to_bits), "({x}, {y})");
                    untouched += 1;
                } else {
                    touched += 1;
                }
            }
        }
        assert!(untouched > 1024 && touched > 20, "{name}: {untouched} {touched}");
        assert!((0..64).all(|x| (0..16).all(|y| layers.delta.get(x, y) == Vec3::ZERO)), "{name}: the sky has changed");
        let source = io::read_image(place.path(name)).unwrap().radiance;
        assert_eq!(bits(photo), bits(&source), "{name}: the view of the panorama itself needs no resampling");
    }
}

#[test]
fn settings_are_checked() {
    let mut settings = Settings::default();
    for (key, value) in [
        ("mis", "light"),
        ("second_order", "false"),
        ("reflectance_cap", "0.5"),
        ("field_resolution", "64"),
        ("gap_contrast", "4"),
        ("gap_relative", "0.02"),
        ("mirrors", "false"),
        ("irradiance_width", "64"),
        ("irradiance_samples", "4"),
        ("hidden_samples", "4"),
    ] {
        let before = settings;
        settings.set(key, value).unwrap_or_else(|e| panic!("{e}"));
        assert_ne!(settings, before, "{key} changes something");
    }
    for (key, value) in [
        ("mis", "both"),
        ("mis", ""),
        ("second_order", "1"),
        ("reflectance_cap", "1.5"),
        ("reflectance_cap", "-0.1"),
        ("reflectance_cap", "NaN"),
        ("field_resolution", "100000"),
        ("field_resolution", "-1"),
        ("gap_contrast", "0"),
        ("gap_contrast", "inf"),
        ("gap_relative", "0"),
        ("irradiance_width", "1"),
        ("irradiance_samples", "0"),
        ("irradiance_samples", "many"),
    ] {
        let before = settings;
        let error = settings.set(key, value).unwrap_err();
        let remedy = error.remedy().unwrap_or_default();
        assert!(error.to_string().contains(key) && error.to_string().contains(value), "{error}");
        assert!(SETTINGS.iter().any(|s| s.key == key && s.help == remedy), "{key}: {remedy}");
        assert_eq!(settings, before);
    }
    let error = settings.set("colour", "red").unwrap_err();
    assert!(error.to_string().contains("`colour`"), "{error}");
    assert!(SETTINGS.iter().all(|s| error.remedy().is_some_and(|r| r.contains(s.key))), "{error:?}");
    for setting in SETTINGS {
        assert!(setting.help.ends_with(')') && setting.help.contains('('), "{}: names its default", setting.key);
        assert!(settings.set(setting.key, "§").is_err(), "{}", setting.key);
    }
}

#[test]
fn depth_may_have_another_size_but_not_another_shape() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    let scene = |depth: &str| place.scene(&format!("color = 'room.exr'\ndepth = '{depth}'\nposition = [0, 1.5, 0]"), OBJECT);
    let floor = |w: usize| {
        Image::from_fn(w, w / 2, |x, y| {
            let down = -direction(w, w / 2, x, y).y;
            if down > 0.02 { 1.5 / down } else { f32::INFINITY }
        })
    };
    for width in [32, 64, 256] {
        place.depth("depth.exr", &floor(width));
        let rendered = run(&scene("depth.exr"));
        let below = rendered.layers.depth.get(16, 31);
        assert!((below - 1.5).abs() < 0.05, "depth of {width} columns: {below} m straight down");
        assert!(rendered.layers.delta.data().iter().any(|d| d.y < 0.0), "depth of {width} columns: a shadow falls");
    }
    place.depth("wide.exr", &Image::filled(48, 16, 1.0));
    fails(&scene("wide.exr"), &RenderOptions::default(), &["wide.exr", "48×16", "2:1"]);
    place.depth("nothing.exr", &Image::filled(16, 8, 0.0));
    let rendered = run(&scene("nothing.exr"));
    assert!(rendered.stats.warnings.iter().any(|w| w.contains("no pixel has depth")), "{:?}", rendered.stats.warnings);
    assert!(rendered.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
}

/// Irradiance is measured with the seed of the picture: else repeats would hide its noise.
#[test]
fn a_seed_is_that_of_the_preparation_too() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    place.depth("room_depth.exr", &Image::from_fn(64, 32, |x, _| 2.0 + (x % 8) as f32 / 8.0));
    let scene = place.scene("color = 'room.exr'\ndepth = 'room_depth.exr'", "");
    let inputs = Loader::default().load(&scene, 0).unwrap();
    let objects = pano_trace::objects::Objects::new(&[]);
    let irradiance = |seed: u32| {
        let options = RenderOptions { seed, ..RenderOptions::default() };
        let world = build_world(&scene, &inputs, &objects, &options, &mut Vec::new(), &Silent).unwrap();
        let World::Captured(world) = world else { panic!("not captured") };
        let hit = world.hit(&pano_trace::bvh::Ray::new(scene.panorama.position, Vec3::new(0.3, -0.8, 0.5))).unwrap();
        world.irradiance(&hit)
    };
    assert!(irradiance(3) == irradiance(3) && irradiance(3) != irradiance(4));
}

#[test]
fn camera_height_makes_a_ground() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    // Depth for the front half only.
    place.depth("half.exr", &Image::from_fn(256, 128, |x, _| if (64..192).contains(&x) { 1.0 } else { 0.0 }));
    let heading = "color = 'room.exr'\nposition = [2, 1.6, -1]\nheading = 70\ncamera_height = 1.6";
    for (panorama, front) in [(heading.to_owned(), None), (format!("{heading}\ndepth = 'half.exr'"), Some(1.0))] {
        let scene = place.scene(&panorama, "");
        let inputs = Loader::default().load(&scene, 0).unwrap();
        let mut warnings = Vec::new();
        let objects = pano_trace::objects::Objects::new(&[]);
        let world = build_world(&scene, &inputs, &objects, &RenderOptions::default(), &mut warnings, &Silent).unwrap();
        let origin = scene.panorama.position;
        let turn = scene.panorama.world_from_pano();
        for d in [Vec3::new(0.0, -0.5, 1.0), Vec3::new(0.6, -1.0, 0.9), Vec3::new(0.0, -0.5, -1.0)].map(Vec3::normalize) {
            let expected = match front {
                Some(t) if d.z < 0.0 => t,
                _ => 1.6 / -d.y,
            };
            let hit = world.hit_position(origin, turn * d).unwrap();
            assert!((hit.distance(origin) - expected).abs() < 0.03, "{panorama}: {d} meets {hit}, expected {expected} m");
        }
        assert_eq!(world.hit_position(origin, turn * Vec3::new(0.0, 0.9, 0.1).normalize()), None);
        assert_eq!(world.hit_position(origin, turn * Vec3::new(0.0, 0.5, 1.0).normalize()), None);
        assert!(matches!((&world, front), (World::Proxies(_), None) | (World::Captured(_), Some(_))));
    }
}

/// An LDR panorama lights the objects by its inverse tone mapping, and is shown as it is.
#[test]
fn ldr_panoramas_are_expanded_for_lighting_only() {
    let place = Place::new();
    // A clipped lamp straight up, over a gray room.
    let picture = Image::from_fn(64, 32, |x, y| Vec3::splat(if direction(64, 32, x, y).y > 0.9 { 1.0 } else { 0.2 }));
    io::write_png8(place.path("room.png"), &picture, None).unwrap();
    place.exr("room.exr", &io::read_image(place.path("room.png")).unwrap().radiance);
    let scene = |name: &str| {
        let mut scene = place.scene(&format!("color = '{name}'\nposition = [0, 1.5, 0]\ncamera_height = 1.5"), OBJECT);
        scene.render.samples = 16;
        scene.render.method = Method::Dpt;
        scene
    };
    let inputs = Loader::default().load(&scene("room.png"), 0).unwrap();
    let lighting = inputs.lighting.as_ref().expect("an LDR picture is expanded");
    // MR360: 10·Y¹⁰ + 1.8, and what is not bright keeps its value.
    assert!(
        (lighting.get(0, 0).x - 11.8 / 1.8).abs() < 1e-3
            && (lighting.get(0, 16).x / inputs.photo.get(0, 16).x - 1.0).abs() < 1e-3
    );
    assert!(Loader::default().load(&scene("room.exr"), 0).unwrap().lighting.is_none());

    let (ldr, hdr) = (run(&scene("room.png")), run(&scene("room.exr")));
    assert_eq!(bits(&ldr.photo), bits(&hdr.photo));
    let sum =
        |r: &Rendered| r.layers.object.data().iter().map(|p| p.y).sum::<f32>() / r.layers.coverage.data().iter().sum::<f32>();
    assert!(sum(&ldr) > 1.5 * sum(&hdr), "the clipped lamp lights the object: {} {}", sum(&ldr), sum(&hdr));
    // No shadow takes away more than there is.
    let least = ldr.layers.delta.data().iter().zip(ldr.photo.data()).map(|(d, p)| d.y / p.y).fold(0.0, f32::min);
    assert!((-1.0..-0.01).contains(&least), "{least}");
}

/// `auto` lights an LDR panorama as MR360 does, and its EXR holds a shadow layer a light.
#[test]
fn ldr_panoramas_cast_shadows_of_their_lights() {
    let place = Place::new();
    let lamp = Vec3::new(1.0, 0.7, 0.0).normalize();
    let picture = Image::from_fn(128, 64, |x, y| {
        Vec3::splat(if direction(128, 64, x, y).dot(lamp) > 8f32.to_radians().cos() { 1.0 } else { 0.2 })
    });
    io::write_png8(place.path("room.png"), &picture, None).unwrap();
    let mut scene = place.scene("color = 'room.png'\nposition = [0, 1.5, 0]\ncamera_height = 1.5", OBJECT);
    scene.render.samples = 16;
    let rendered = run(&scene);
    assert_eq!(rendered.stats.method, "mr360");
    assert!(rendered.stats.plan.is_on("light_shadows") && rendered.stats.plan.is_on("ambient_occlusion"));
    assert!(rendered.stats.stages.iter().any(|s| s.name == "lights"));
    assert!(rendered.stats.warnings.iter().any(|w| w.contains("LDR")), "{:?}", rendered.stats.warnings);
    let least = rendered.layers.delta.data().iter().zip(rendered.photo.data()).map(|(d, p)| d.y / p.y).fold(0.0, f32::min);
    assert!((-1.0..-0.02).contains(&least), "{least}");
    assert_eq!(rendered.shadows.len(), 1);
    write_output(&place.path("out.exr"), &rendered).unwrap();
    let exr = io::read_exr(place.path("out.exr")).unwrap();
    let shadow = exr.channels.iter().find(|(name, _)| name == "shadow.0.V").map(|(_, image)| image.clone());
    let shadow = shadow.expect("a layer a light");
    assert!(shadow.data().contains(&1.0) && shadow.data().iter().any(|v| *v < 0.9));
}

#[test]
fn what_cannot_be_done_is_said() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    place.exr("square.exr", &Image::filled(16, 16, Vec3::ONE));
    let options = RenderOptions::default();
    fails(&place.scene("color = 'square.exr'", ""), &options, &["square.exr", "16×16", "2:1"]);
    fails(&place.scene("color = 'gone.exr'", ""), &options, &["gone.exr"]);
    let scene = place.scene("color = 'room.exr'", OBJECT);
    let mut without_depth = scene.clone();
    without_depth.render.method = Method::Iprt;
    fails(&without_depth, &options, &["iprt", "dpt"]);
    struct Cancel;
    impl Progress for Cancel {
        fn cancelled(&self) -> bool {
            true
        }
    }
    assert!(matches!(render(&scene, &options, &Cancel), Err(Error::Cancelled)));
    let rendered = run(&scene);
    assert!(rendered.stats.warnings.iter().any(|w| w.contains("nothing real receives shadows")), "{:?}", rendered.stats.warnings);
    assert!(write_output(&place.path("out.tiff"), &rendered).is_err() && !place.path("out.tiff").exists());
    assert!(write_output(&place.path("no/such/folder/out.exr"), &rendered).is_err());
}

#[test]
fn damaged_radiance_is_mended_and_reported() {
    let place = Place::new();
    let mut picture = smooth_picture();
    picture.set(5, 6, Vec3::new(f32::NAN, -1.0, 2.0));
    picture.set(6, 6, Vec3::new(f32::INFINITY, 1.0, -3.0));
    place.exr("room.exr", &picture);
    let rendered = run(&place.scene("color = 'room.exr'\ncamera_height = 1", OBJECT));
    assert_eq!(rendered.photo.get(5, 6), Vec3::new(0.0, 0.0, 2.0));
    assert!(rendered.composite.color.data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0));
    assert!(rendered.stats.warnings.iter().any(|w| w.contains("2 negative and 2 non-finite")), "{:?}", rendered.stats.warnings);
}

/// Without the bounds every pixel is asked for its change, for many more rays and the same picture.
#[test]
fn a_forced_full_run_gives_the_planned_picture() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    let mut scene = place.scene("color = 'room.exr'\nposition = [0, 1.5, 0]\ncamera_height = 1.5", OBJECT);
    scene.render.samples = 256;
    let planned = run(&scene);
    let mut options = RenderOptions::default();
    options.force("influence", false).unwrap();
    let forced = render(&scene, &options, &Silent).unwrap();
    assert!(planned.stats.plan.is_on("influence") && !forced.stats.plan.is_on("influence"));
    let rays = |r: &Rendered| r.stats.stages.iter().map(|s| s.rays).sum::<u64>();
    assert!(rays(&forced) > 2 * rays(&planned), "{} {}", rays(&forced), rays(&planned));
    let sum = |r: &Rendered| r.layers.delta.data().iter().map(|d| f64::from(d.y)).sum::<f64>();
    assert!((sum(&forced) / sum(&planned) - 1.0).abs() < 0.05, "{} {}", sum(&forced), sum(&planned));

    options.force("multi_bounce", false).unwrap();
    assert!(options.force("glossy", true).unwrap_err().remedy().unwrap().contains("influence"));
}
