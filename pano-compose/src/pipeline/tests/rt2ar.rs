//! Whole frames of rt2ar: with proxies, with depth, through a depth camera.

use super::*;
use pano_core::camera::{Camera, Projection};
use std::fmt::Write;

/// A depth camera's picture of a wall at z = −3 with a post in front of it at z = −1.5: 16-bit z in millimetres, 8-bit colours.
fn depth_camera(place: &Place) -> (RadianceImage, Camera) {
    let camera = Camera {
        position: Vec3::ZERO,
        world_from_camera: glam::Quat::IDENTITY,
        projection: Projection::Pinhole { focal: Vec2::new(60.0, 60.0), center: Vec2::new(33.0, 23.0) },
        width: 64,
        height: 48,
    };
    let post = |x: usize| (20..26).contains(&x);
    let color = RadianceImage::from_fn(64, 48, |x, y| {
        let wall = Vec3::new(0.2 + x as f32 * 0.006, 0.4, 0.2 + y as f32 * 0.01);
        if post(x) { Vec3::new(0.8, 0.1, 0.05) } else { wall }
    });
    io::write_image(place.path("seen.png"), &color, None).unwrap();
    let millimetres: Vec<u16> = (0..64 * 48).map(|i| if post(i % 64) { 1500 } else { 3000 }).collect();
    let gray: image::ImageBuffer<image::Luma<u16>, _> = image::ImageBuffer::from_raw(64, 48, millimetres).unwrap();
    gray.save(place.path("seen_depth.png")).unwrap();
    (io::read_image(place.path("seen.png")).unwrap().radiance, camera)
}

const CAMERA: &str =
    "[camera]\ncolor = 'seen.png'\ndepth = 'seen_depth.png'\ndepth_format = 'kinect'\nfx = 60\ncx = 33\ncy = 23\n";

fn scene(place: &Place, text: &str) -> Scene {
    Scene::parse(text, place.path("scene.toml")).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// The pyramid at `position`, of a material.
fn thing(position: Vec3, material: &str) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "[[object]]\nmesh = 'thing.ply'\nposition = {:?}\nmaterial = {{ {material} }}", position.to_array());
    text
}

const MATT: &str = "base_color = [0.7, 0.6, 0.5], specular = 0";

#[test]
fn real_things_hide_objects_and_objects_real_things() {
    let place = Place::new();
    place.exr("sky.exr", &smooth_picture());
    let (photo, camera) = depth_camera(&place);
    let at = camera.pixel(Vec3::new(-0.3, -0.2, -2.0)).unwrap();
    let rendered = run(&scene(
        &place,
        &format!("[panorama]\ncolor = 'sky.exr'\n{CAMERA}{}[render]\nsamples = 4", thing(Vec3::new(-0.3, -0.5, -2.0), MATT)),
    ));
    assert_eq!((rendered.stats.method.as_str(), rendered.camera), ("rt2ar", camera));
    let coverage = &rendered.layers.coverage;
    let (x, y) = (at.x as usize, at.y as usize);
    assert_eq!(coverage.get(x, y), if (20..26).contains(&x) { 0.0 } else { 1.0 });
    assert!((20..26).all(|x| coverage.get(x, y) == 0.0), "the post stands in front");
    assert!(coverage.get(19, y) == 1.0 && coverage.get(27, y) == 1.0, "{} {}", coverage.get(19, y), coverage.get(27, y));
    // What nothing changes keeps the file's bits.
    let (out, layers) = (&rendered.composite.color, &rendered.layers);
    let untouched: Vec<usize> =
        (0..64 * 48).filter(|&i| layers.coverage.data()[i] == 0.0 && layers.delta.data()[i] == Vec3::ZERO).collect();
    assert!(untouched.len() > 1500 && untouched.iter().all(|&i| out.data()[i] == photo.data()[i]), "{}", untouched.len());

    let front = run(&scene(
        &place,
        &format!("[panorama]\ncolor = 'sky.exr'\n{CAMERA}{}[render]\nsamples = 4", thing(Vec3::new(-0.2, -0.3, -1.0), MATT)),
    ));
    assert_eq!(front.layers.coverage.get(22, 25), 1.0, "before the post");
}

#[test]
fn mirrors_show_what_the_camera_has_seen_and_the_panorama_beyond() {
    let place = Place::new();
    // Above, the sky is green; the camera sees nothing green.
    place.exr("sky.exr", &Image::from_fn(32, 16, |_, y| if y < 8 { Vec3::Y * 2.0 } else { Vec3::ZERO }));
    depth_camera(&place);
    let mirror = "base_color = [1, 1, 1], metallic = 1, roughness = 0";
    let text = |panorama: &str| {
        format!("{panorama}{CAMERA}{}[render]\nsamples = 4\nbounces = 2", thing(Vec3::new(0.3, -0.3, -1.6), mirror))
    };
    let rendered = run(&scene(&place, &text("[panorama]\ncolor = 'sky.exr'\n")));
    let covered = || (0..64 * 48).filter(|&i| rendered.layers.coverage.data()[i] == 1.0);
    let seen: Vec<Vec3> = covered().map(|i| rendered.layers.object.data()[i]).collect();
    // The pyramid's front face looks up and towards the camera: it mirrors the sky. Its right face looks away.
    assert!(seen.len() > 50 && seen.iter().any(|c| c.y > 1.9 && c.x < 0.1), "{}", seen.len());

    let alone = run(&scene(&place, &text("")));
    assert!(alone.stats.warnings.iter().any(|w| w.contains("without a [panorama]")), "{:?}", alone.stats.warnings);
    let seen: Vec<Vec3> = covered().map(|i| alone.layers.object.data()[i]).collect();
    assert!(seen.iter().all(|c| c.y < 1.0 && c.is_finite()) && seen.iter().any(|c| c.x > 0.1));
}

#[test]
fn the_camera_s_post_is_seen_in_a_mirror_that_faces_it() {
    let place = Place::new();
    place.exr("black.exr", &Image::filled(8, 4, Vec3::ZERO));
    depth_camera(&place);
    // A mirror on the right, turned so that it shows the post's side to a view from elsewhere.
    std::fs::write(
        place.path("pane.ply"),
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n-0.4 -0.4 0\n0.4 -0.4 0\n0.4 0.4 0\n-0.4 0.4 0\n3 0 1 2\n3 0 2 3\n",
    )
    .unwrap();
    let text = format!(
        "[panorama]\ncolor = 'black.exr'\n{CAMERA}[[object]]\nmesh = 'pane.ply'\nposition = [0, 0, -0.4]\nyaw = 180\n\
         material = {{ base_color = [1, 1, 1], metallic = 1, roughness = 0 }}\n\
         [view]\nkind = 'perspective'\nvfov = 40\nsize = [40, 40]\nposition = [0, 0, -1.2]\nyaw = 180\n[render]\nsamples = 4\n"
    );
    let rendered = run(&scene(&place, &text));
    let object = &rendered.layers.object;
    let red = (0..1600).filter(|&i| object.data()[i].x > 0.3 && object.data()[i].y < 0.1).count();
    let wall = (0..1600).filter(|&i| object.data()[i].y > 0.1).count();
    assert!(red > 10 && wall > 100, "{red} pixels of post, {wall} of wall");
}

#[test]
fn a_depth_camera_that_does_not_fit_is_refused() {
    let place = Place::new();
    place.exr("sky.exr", &smooth_picture());
    depth_camera(&place);
    let options = RenderOptions::default();
    place.depth("small.exr", &Image::filled(8, 6, 1.0));
    let text = format!("[panorama]\ncolor = 'sky.exr'\n{CAMERA}{OBJECT}");
    fails(&scene(&place, &text.replace("seen_depth.png", "small.exr")), &options, &["small.exr", "8×6", "64×48", "aligned"]);
    fails(&scene(&place, &text.replace("seen.png", "gone.png")), &options, &["gone.png"]);
    for method in ["dpt", "mr360", "ibl", "iprt"] {
        let scene = scene(&place, &format!("{text}[render]\nmethod = '{method}'"));
        fails(&scene, &options, &[method, "depth camera", "rt2ar"]);
    }
}

#[test]
fn other_views_of_a_depth_camera_show_its_points() {
    let place = Place::new();
    place.exr("sky.exr", &smooth_picture());
    let (photo, camera) = depth_camera(&place);
    let view = "[view]\nkind = 'perspective'\nvfov = 30\nsize = [32, 32]\nposition = [0.1, 0.1, -0.2]\n";
    let rendered = run(&scene(&place, &format!("[panorama]\ncolor = 'sky.exr'\n{CAMERA}{view}")));
    let d = rendered.camera.direction(Vec2::new(20.5, 14.5));
    let at = rendered.camera.position + d * ((-3.0 - rendered.camera.position.z) / d.z);
    let seen = camera.pixel(at).unwrap();
    let expected = photo.get(seen.x as usize, seen.y as usize);
    let found = rendered.photo.get(20, 14);
    assert!(found.abs_diff_eq(expected, 0.02), "{found} {expected}");
}

#[test]
fn ghosts_stand_in_front_of_a_panorama_s_depth() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    place.depth("far.exr", &Image::filled(64, 32, 5.0));
    let ghost = "[[proxy]]\nplane = { size = [9, 9] }\nposition = [0, 0, -1.2]\nrotation = [0.70710678, 0, 0, 0.70710678]\nalbedo = [0.5, 0.5, 0.5]\n";
    let view = "[view]\nkind = 'perspective'\nsize = [16, 16]\n[render]\nmethod = 'rt2ar'\nsamples = 2\n";
    let text = |ghost: &str| format!("[panorama]\ncolor = 'room.exr'\ndepth = 'far.exr'\n{ghost}{OBJECT}{view}");
    let (hidden, shown) = (run(&scene(&place, &text(ghost))), run(&scene(&place, &text(""))));
    assert!(shown.layers.coverage.data().iter().any(|c| *c > 0.0));
    assert!(hidden.layers.coverage.data().iter().all(|c| *c == 0.0), "the ghost wall hides the object");
}

#[test]
fn stages_and_settings_are_told() {
    let place = Place::new();
    // A lamp over a plane.
    let lamp = Image::from_fn(64, 32, |x, y| if y == 6 && x == 20 { Vec3::splat(900.0) } else { Vec3::splat(0.3) });
    place.exr("lamp.exr", &lamp);
    let ground = "color = 'lamp.exr'\ncamera_height = 1.0";
    let mut scene = place.scene(ground, &OBJECT.replace("[0, 0, -2]", "[0, -1, -2]"));
    scene.render = pano_core::scene::Render { method: Method::Rt2ar, samples: 2, bounces: 6 };
    scene.view = pano_core::scene::View {
        kind: pano_core::scene::ViewKind::Perspective { vfov: 40.0 },
        pitch: Some(-25.0),
        size: Some((48, 32)),
        ..Default::default()
    };
    let with = |settings: &[(&str, &str)]| {
        let mut options = RenderOptions::default();
        settings.iter().for_each(|(key, value)| options.settings.set(key, value).unwrap());
        render(&scene, &options, &Silent).unwrap()
    };
    let plain = with(&[]);
    let names: Vec<&str> = plain.stats.stages.iter().map(|s| s.name).collect();
    assert_eq!(names, ["load", "world", "view", "lights", "trace", "mean", "composite"]);
    assert!(plain.stats.plan.is_on("light_shadows") && plain.stats.plan.is_on("multi_bounce"));
    assert_eq!(plain.shadows.len(), 1);
    let least = plain.layers.delta.data().iter().map(|d| d.max_element()).fold(0.0, f32::min);
    assert!(least < -0.05, "a shadow falls: {least}");
    let hard = with(&[("shadow", "hard")]);
    assert!(!hard.stats.stages.iter().any(|s| s.name == "mean"));
    let rays = |r: &Rendered| r.stats.stages.iter().map(|s| s.rays).sum::<u64>();
    assert!(rays(&hard) < rays(&plain) && rays(&plain) < rays(&with(&[("shadow", "soft")])));
    let no_shadows = {
        let mut options = RenderOptions::default();
        options.force("light_shadows", false).unwrap();
        render(&scene, &options, &Silent).unwrap()
    };
    assert!(no_shadows.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
    let glossy = with(&[("gloss", "1"), ("gloss_roughness", "0")]);
    assert!(glossy.layers.delta.data() != plain.layers.delta.data());
}

/// A glossy floor mirrors a lamp that an object hides in part. Of rays spread over the lobe few meet the lamp, and each of these
/// would take more from its pixel than is there: twenty dark specks, if each ray takes what it meets.
#[test]
fn hidden_lamps_leave_no_specks_in_glossy_floors() {
    let place = Place::new();
    let lamp = |x: usize, y: usize| (31..34).contains(&x) && (8..11).contains(&y);
    let room = |x, y| if lamp(x, y) { Vec3::new(600.0, 700.0, 800.0) } else { Vec3::new(0.5, 0.3, 0.2) };
    place.exr("lamp.exr", &Image::from_fn(64, 32, room));
    let text = "color = 'lamp.exr'\ncamera_height = 1.0";
    let mut scene = place.scene(text, &OBJECT.replace("[0, 0, -2]", "[0, -1, -2]"));
    scene.render = pano_core::scene::Render { method: Method::Rt2ar, samples: 4, bounces: 3 };
    scene.view = pano_core::scene::View {
        kind: pano_core::scene::ViewKind::Perspective { vfov: 40.0 },
        pitch: Some(-30.0),
        size: Some((72, 48)),
        ..Default::default()
    };
    let with = |gloss: &str| {
        let mut options = RenderOptions { denoise: false, ..RenderOptions::default() };
        options.settings.set("gloss", gloss).unwrap();
        options.settings.set("gloss_roughness", "0.4").unwrap();
        render(&scene, &options, &Silent).unwrap()
    };
    let (matt, glossy) = (with("0"), with("0.2"));
    let changed = |r: &Rendered| r.layers.delta.data().iter().filter(|d| **d != Vec3::ZERO).count();
    assert!(changed(&glossy) > changed(&matt) + 50, "the floor mirrors the object: {} {}", changed(&glossy), changed(&matt));
    let floor = |x: usize, y: usize| glossy.layers.coverage.get(x, y) == 0.0;
    let light = |x: usize, y: usize| glossy.composite.color.get(x, y).max_element();
    let mut specks = Vec::new();
    for (x, y) in (1..47).flat_map(|y| (1..71).map(move |x| (x, y))).filter(|&(x, y)| floor(x, y)) {
        let around = (0..9).filter(|i| *i != 4).map(|i| (x + i % 3 - 1, y + i / 3 - 1)).filter(|&(x, y)| floor(x, y));
        let mut lights: Vec<f32> = around.map(|(x, y)| light(x, y)).collect();
        lights.sort_by(f32::total_cmp);
        // A shadow has an inside: pixels as dark beside each other.
        if lights.len() > 5 && light(x, y) < 0.25 * lights[2] {
            specks.push((x, y, light(x, y), lights[2]));
        }
    }
    assert!(specks.is_empty(), "{} specks: {specks:?}", specks.len());
}

#[test]
fn lens_effects_run_only_if_asked_for() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    let shining = OBJECT.replace("specular = 0", "specular = 0, emissive = [30, 20, 10]");
    let scene = place.scene("color = 'room.exr'", &shining);
    let off = run(&scene);
    assert!(!off.stats.stages.iter().any(|s| s.name == "lens") && !off.stats.plan.is_on("lens"));
    let mut options = RenderOptions::default();
    options.settings.set("bloom", "0.2").unwrap();
    options.settings.set("bloom_radius", "0.1").unwrap();
    let on = render(&scene, &options, &Silent).unwrap();
    assert!(on.stats.stages.iter().any(|s| s.name == "lens") && on.stats.plan.is_on("lens"));
    assert!(on.stats.warnings.iter().any(|w| w.contains("lens effects spread")), "{:?}", on.stats.warnings);
    let brighter = |x: usize, y: usize| on.composite.color.get(x, y).x - off.composite.color.get(x, y).x;
    let at = (0..64 * 32).find(|&i| off.layers.coverage.data()[i] == 1.0).unwrap();
    assert!(brighter(at % 64, at / 64 - 3) > 1e-3 && brighter(5, 2) == 0.0);
}

const ON_MARKER: &str =
    "[[marker]]\nid = 9\nsize = 0.4\n[[object]]\nmesh = 'thing.ply'\nmarker = 9\nscale = 0.5\nmaterial = { specular = 0 }\n";

/// An object on a marker stands where the marker lies, in whatever place and direction the panorama was captured.
#[cfg(feature = "markers")]
#[test]
fn objects_stand_on_their_markers() {
    use crate::markers::tests::{Print, panorama, photograph};
    use glam::{Affine3A, Quat};
    let place = Place::new();
    // Lying on the ground, to the right and ahead of the capture point.
    let lying = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.5), Vec3::new(0.6, -0.9, -0.8));
    place.exr("room.exr", &photograph(&panorama(1024), &[Print::new(9, 0.4, lying)]));
    let text = format!(
        "[panorama]\ncolor = 'room.exr'\nposition = [5, 1, 2]\nheading = 90\n{ON_MARKER}[render]\nmethod = 'ibl'\nsamples = 1"
    );
    let scene = scene(&place, &text);
    let rendered = run(&scene);
    assert!(
        rendered.stats.warnings.iter().any(|w| w.contains("marker 9 is 1.3") && w.contains('°')),
        "{:?}",
        rendered.stats.warnings
    );
    let inputs = Loader::default().load(&scene, 0).unwrap();
    let found = inputs.markers[0].1;
    // Turned by 90° to the right, what was ahead lies to the right.
    let expected = Vec3::new(5.8, 0.1, 2.6);
    assert!(Vec3::from(found.translation).distance(expected) < 0.015, "{} {expected}", found.translation);
    assert!(found.transform_vector3(Vec3::Y).dot(Vec3::Y) > 0.9995);
    let ball = prepare_objects(&scene, &inputs, 0).balls()[0];
    assert!(ball.center.distance(expected + Vec3::Y * 0.15) < 0.05, "{} stands on {expected}", ball.center);

    let missing = Scene::parse(&text.replace("= 9", "= 8"), place.path("scene.toml")).unwrap();
    fails(&missing, &RenderOptions::default(), &["room.exr", "marker 8 (tag36h11) is not in the picture", "20 pixels"]);
}

#[cfg(not(feature = "markers"))]
#[test]
fn without_the_feature_markers_are_refused() {
    let place = Place::new();
    place.exr("room.exr", &smooth_picture());
    let scene = scene(&place, &format!("[panorama]\ncolor = 'room.exr'\n{ON_MARKER}"));
    fails(&scene, &RenderOptions::default(), &["cannot look for markers", "--features markers"]);
}

/// A mesh file named a hundred times is read once and has one hierarchy, which all its instances point to.
#[test]
fn instances_of_a_mesh_share_its_hierarchy() {
    let place = Place::new();
    place.exr("sky.exr", &smooth_picture());
    std::fs::copy(place.path("thing.ply"), place.path("other.ply")).unwrap();
    let object = |i: usize| {
        let file = if i < 100 { "thing.ply" } else { "other.ply" };
        format!("[[object]]\nmesh = '{file}'\nposition = [{}, 0, {}]\nscale = {}\n", i % 10, i / 10, 0.1 + 0.01 * i as f32)
    };
    let scene = place.scene("color = 'sky.exr'\ncamera_height = 1.5", &(0..101).map(object).collect::<String>());
    let inputs = Loader::default().load(&scene, 0).unwrap();
    let objects = prepare_objects(&scene, &inputs, 0);
    let mut hierarchies: Vec<_> = inputs.meshes.iter().map(|mesh| std::sync::Arc::as_ptr(mesh.blas())).collect();
    assert_eq!(hierarchies.len(), 101);
    hierarchies.sort_unstable();
    hierarchies.dedup();
    assert_eq!(hierarchies.len(), 2, "one hierarchy a file");
    // The mesh's own and one reference an instance: none of them is a copy.
    assert_eq!(std::sync::Arc::strong_count(inputs.meshes[0].blas()), 101);
    assert_eq!(objects.balls().len(), 101);
    // Sizes differ all the same.
    assert!(objects.balls()[99].radius > 5.0 * objects.balls()[0].radius);
}
