use super::*;
use crate::{SceneError, depth::DepthKind};
use proptest::prelude::*;

/// The example of the format's description, every key in use.
const FULL: &str = r#"
[panorama]
color = "pano_color.exr"      # EXR/HDR linear, PNG/JPEG sRGB
depth = "pano_depth.exr"
depth_format = { kind = "ray", scale = 1.0, invalid = 0.0 }
position = [0.3, 1.4, 4.2]
heading = 10
convention = "mitsuba"
camera_height = 1.6
fps = 25.0

[[proxy]]
plane = { size = [6.0, 5.0] }
position = [0.0, 0.0, 1.0]
albedo = [0.5, 0.5, 0.5]

[[proxy]]
mesh = "sub/room.glb"
yaw = 90.0

[[object]]
mesh = "bunny.ply"
position = [1.0, 2.0, 3.0]
yaw = 20.0
scale = 0.5
material = { base_color = [0.7, 0.6, 0.5], metallic = 0.25, roughness = 0.5, specular = 0.0, ior = 1.3, transmission = 0.75, thin = true, emissive = [0, 2.5, 0], specular_color = [1, 0, 0], attenuation_color = [0, 1, 0], attenuation_distance = 3 }
keyframes = [ { time = 0.0, position = [0.0, 0.0, 0.0], yaw = 0.0 }, { time = 2.0, rotation = [0, 2, 0, 0], scale = 2.0 } ]

[[object]]
mesh = "/absolute.obj"
rotation = [0.0, 0.0, 0.0, 3.0]

[view]
kind = "perspective"
yaw = 13.6
pitch = -29.0
vfov = 38.0
size = [512, 256]
position = [0.0, 1.0, 0.0]

[render]
method = "iprt"
samples = 128
bounces = 1
"#;

fn parse(text: &str) -> Scene {
    Scene::parse(text, "dir/scene.toml").unwrap_or_else(|e| panic!("{e} ({:?})\n{text}", e.remedy()))
}

fn fault(text: &str) -> SceneError {
    match Scene::parse(text, "dir/scene.toml") {
        Err(Error::Scene(error)) => *error,
        other => panic!("expected a scene error, got {other:?} for\n{text}"),
    }
}

#[test]
fn every_key_arrives() {
    let scene = parse(FULL);
    let p = &scene.panorama;
    assert_eq!(p.color, PicturePath::Still("dir/pano_color.exr".into()));
    assert_eq!(p.depth, Some(PicturePath::Still("dir/pano_depth.exr".into())));
    assert_eq!(p.depth_format, DepthFormat { kind: DepthKind::Ray, scale: 1.0, invalid: vec![0.0] });
    assert_eq!((p.position, p.heading, p.convention), (Vec3::new(0.3, 1.4, 4.2), 10.0, Convention::Mitsuba));
    assert_eq!((p.camera_height, p.fps), (Some(1.6), 25.0));

    assert_eq!(scene.proxies[0].shape, ProxyShape::Plane { size: Vec2::new(6.0, 5.0) });
    assert_eq!((scene.proxies[0].placement.position, scene.proxies[0].albedo), (Vec3::Z, Some(Vec3::splat(0.5))));
    assert_eq!(scene.proxies[1].shape, ProxyShape::Mesh("dir/sub/room.glb".into()));
    assert_eq!((scene.proxies[1].placement.rotation, scene.proxies[1].albedo), (Rotation::Yaw(90.0), None));

    let o = &scene.objects[0];
    assert_eq!(o.mesh, Path::new("dir/bunny.ply"));
    let rest = Placement { position: Vec3::new(1.0, 2.0, 3.0), rotation: Rotation::Yaw(20.0), scale: 0.5 };
    assert_eq!(o.placement, rest);
    let m = o.material.as_ref().unwrap();
    assert_eq!((m.base_color, m.metallic, m.roughness, m.specular), (Vec3::new(0.7, 0.6, 0.5), 0.25, 0.5, 0.0));
    assert_eq!((m.ior, m.transmission, m.thin, m.emissive), (1.3, 0.75, true, Vec3::new(0.0, 2.5, 0.0)));
    assert_eq!((m.specular_color, m.attenuation_color, m.attenuation_distance), (Vec3::X, Vec3::Y, 3.0));
    assert_eq!(o.keyframes[0].placement, Placement { position: Vec3::ZERO, rotation: Rotation::Yaw(0.0), scale: 0.5 });
    let half_turn = Rotation::Quaternion(Quat::from_xyzw(0.0, 1.0, 0.0, 0.0));
    assert_eq!(o.keyframes[1].placement, Placement { rotation: half_turn, scale: 2.0, ..rest });
    assert_eq!(o.placement_at(5.0), o.keyframes[1].placement);
    assert_eq!(scene.objects[1].mesh, Path::new("/absolute.obj"));
    assert_eq!(scene.objects[1].placement.rotation, Rotation::Quaternion(Quat::IDENTITY));
    assert!(scene.objects[1].material.is_none());

    assert_eq!(scene.view.kind, ViewKind::Perspective { vfov: 38.0 });
    assert_eq!(scene.render, Render { method: Method::Iprt, samples: 128, bounces: 1 });
    let camera = scene.camera((9, 9));
    assert_eq!((camera.width, camera.height, camera.position), (512, 256, Vec3::Y));
    assert_eq!(camera.projection, Projection::Perspective { vfov: 38f32.to_radians() });
    assert_eq!(camera.world_from_camera, rotation_from_yaw_pitch(13.6, -29.0));
}

const CAMERA: &str = "[panorama]\ncolor = 'a'\nposition = [1, 2, 3]\n[camera]\ncolor = 'c.png'\ndepth = 'd.png'\n";

#[test]
fn a_depth_camera_stands_beside_a_panorama_or_alone() {
    let scene = parse(CAMERA);
    let camera = scene.camera.as_ref().unwrap();
    assert_eq!((camera.position, camera.rotation, camera.exposure), (Vec3::new(1.0, 2.0, 3.0), Quat::IDENTITY, 1.0));
    assert_eq!((camera.intrinsics, camera.depth_format.kind, camera.alone), (Intrinsics::Vfov(45.0), DepthKind::Z, false));
    // Its own view, pixel for pixel, unless something else is asked for.
    assert_eq!(scene.view.kind, ViewKind::Camera);
    assert_eq!(scene.camera((64, 48)), camera.camera((64, 48)));
    assert_eq!(parse(&format!("{CAMERA}[view]\nkind = 'camera'")).view.kind, ViewKind::Camera);
    let turned = parse(&format!("{CAMERA}[view]\nkind = 'perspective'")).camera((64, 48));
    assert_eq!(turned.projection, Projection::Perspective { vfov: 60f32.to_radians() });

    let keys = "depth_format = 'kinect'\nfx = 525\nfy = 520\ncx = 319.5\nposition = [0, 1, 0]\nyaw = 30\npitch = -20\nroll = 90\nexposure = 2";
    let alone = parse(&format!("[camera]\ncolor = 'c_%04d.png'\ndepth = 'd_%04d.png'\n{keys}"));
    let camera = alone.camera.as_ref().unwrap();
    assert!(camera.alone && camera.color.is_sequence() && alone.panorama.color == camera.color);
    assert_eq!((alone.panorama.position, camera.exposure), (Vec3::Y, 2.0));
    assert_eq!(camera.depth_format, DepthFormat::preset("kinect").unwrap());
    let seen = camera.camera((640, 480));
    assert_eq!(seen.projection, Projection::Pinhole { focal: Vec2::new(525.0, 520.0), center: Vec2::new(319.5, 240.0) });
    assert!(seen.direction(Vec2::new(319.5, 240.0)).distance(rotation_from_yaw_pitch(30.0, -20.0) * Vec3::NEG_Z) < 1e-6);
    // Rolled clockwise by a quarter, what was up is to the left.
    let up = rotation_from_yaw_pitch(30.0, -20.0) * Vec3::new(0.0, 0.1, -1.0);
    let at = seen.pixel(up).unwrap();
    assert!(at.x < 319.5 - 50.0 && (at.y - 240.0).abs() < 1e-2, "{at}");
}

#[test]
fn objects_stand_on_markers() {
    let text = "panorama.color = 'a'\n[[marker]]\nid = 3\nsize = 0.12\n[[marker]]\nfamily = 'tag25h9'\nid = 4\nsize = 0.2\n\
        [[object]]\nmesh = 'm'\nmarker = 4\nposition = [0, 0.1, 0]\n[[object]]\nmesh = 'm'";
    let scene = parse(text);
    assert_eq!(scene.markers[0], Marker { family: "tag36h11", id: 3, size: 0.12 });
    assert_eq!((scene.markers[1].family, scene.objects[0].marker, scene.objects[1].marker), ("tag25h9", Some(4), None));
}

#[test]
fn the_least_scene_takes_the_defaults() {
    let scene = parse("panorama.color = 'a.png'");
    assert_eq!(
        scene.panorama,
        Panorama {
            color: PicturePath::Still("dir/a.png".into()),
            depth: None,
            depth_format: DepthFormat::preset("exr").unwrap(),
            position: Vec3::ZERO,
            heading: 0.0,
            convention: Convention::Forward,
            camera_height: None,
            fps: 30.0,
        }
    );
    assert!(scene.proxies.is_empty() && scene.objects.is_empty());
    assert_eq!((scene.view, scene.render), (View::default(), Render { method: Method::Auto, samples: 64, bounces: 3 }));
    let material = parse("panorama.color = 'a'\n[[object]]\nmesh = 'm'\nmaterial = {}").objects[0].material.clone().unwrap();
    assert_eq!((material.base_color, material.metallic, material.roughness), (Vec3::splat(0.8), 0.0, 1.0));
    assert_eq!((material.specular, material.ior, material.transmission), (1.0, 1.5, 0.0));
}

#[test]
fn sequences_are_numbered() {
    let p = parse("[panorama]\nframes = 'f/c_%04d.exr'\ndepth = 'd_%d.exr'").panorama;
    assert_eq!(p.color.path(7), Path::new("dir/f/c_0007.exr"));
    assert_eq!(p.depth.unwrap().path(7), Path::new("dir/d_7.exr"));
    let p = parse("[panorama]\nframes = 'c_%04d.exr'\ndepth = 'still.exr'").panorama;
    assert_eq!(p.depth.unwrap().path(7), Path::new("dir/still.exr"));
    // A folder with a percent sign is no pattern.
    let scene = Scene::parse("panorama.frames = 'c_%02d.exr'", "a%02d/s.toml").unwrap();
    assert_eq!(scene.panorama.color.path(3), Path::new("a%02d/c_03.exr"));
}

#[test]
fn a_panorama_view_is_the_input_picture() {
    for (convention, heading) in [("forward", 0.0), ("three", 0.0), ("usd", -30.0), ("blender", 77.0)] {
        let scene = parse(&format!("[panorama]\ncolor = 'a'\nconvention = '{convention}'\nheading = {heading}"));
        let camera = scene.camera((64, 32));
        assert_eq!((camera.projection, camera.width, camera.height), (Projection::Panorama, 64, 32));
        let center = camera.direction(Vec2::new(32.0, 16.0));
        let yaw = f32::to_radians(heading + scene.panorama.convention.center_yaw());
        assert!(center.distance(Vec3::new(yaw.sin(), 0.0, -yaw.cos())) < 1e-5, "{convention} {heading}: {center}");
    }
    let turned = parse("[panorama]\ncolor = 'a'\nheading = 50\n[view]\nyaw = 90").camera((64, 32));
    assert!(turned.direction(Vec2::new(32.0, 16.0)).distance(Vec3::X) < 1e-5);
}

/// Text after a valid [panorama], what the span must cover, parts of the problem and of the remedy.
const FAULTS: &[(&str, &str, &str, &str)] = &[
    // Keys.
    ("hedding = 1", "hedding", "unknown key `hedding` in [panorama]", "did you mean `heading`?"),
    ("samples = 1", "samples", "unknown key", "`samples` belongs in [render]"),
    ("zzz = 1", "zzz", "unknown key", "keys here are: color, frames,"),
    ("[[object]]\nmesh = 'm'\nmaterial = { rougness = 1 }", "rougness", "in `material`", "did you mean `roughness`?"),
    ("[[object]]\nmesh = 'm'\nmaterial = { baseColor = 1 }", "baseColor", "in `material`", "did you mean `base_color`?"),
    ("[[objekt]]\nmesh = 'm'", "objekt", "in the scene file", "did you mean `object`?"),
    ("\"\" = 1", "\"\"", "unknown key ``", "keys here are"),
    ("[[proxy]]\nplane = { size = [1, 1], width = 2 }", "width", "in `plane`", "keys here are: size"),
    ("color = 'twice'", "color", "duplicate key", "TOML"),
    ("heading = ", "", "", "TOML"),
    ("heading = 1 2", "1 2", "", "TOML"),
    ("[view", "", "", "TOML"),
    // Exclusive and missing keys.
    ("frames = 'f_%04d.exr'", "frames", "`color` and `frames` exclude", "keep"),
    ("[[object]]\nyaw = 3", "[[object]]", "[[object]] has no `mesh`", "bunny.ply"),
    ("[[object]]\nmesh = 'm'\nrotation = [0, 0, 0, 1]\nyaw = 3", "yaw", "exclude", "keep one"),
    ("[[proxy]]\nmesh = 'm'\nplane = { size = [1, 1] }", "plane", "exclude", "[[proxy]]"),
    ("[[proxy]]\nscale = 1", "[[proxy]]", "has no `mesh`", "plane"),
    ("[[proxy]]\nplane = {}", "{}", "`plane` has no `size`", "6.0"),
    // Types.
    ("heading = 'north'", "'north'", "is a string, not a number", "heading = 1.0"),
    ("heading = true", "true", "is a boolean", "heading"),
    ("position = 1.0", "1.0", "not an array of 3 numbers", "[0.0, 0.0, 0.0]"),
    ("position = [1, 2]", "[1, 2]", "has 2 elements, not 3", "position = [0.0"),
    ("position = [1, 2, 3, 4]", "[1, 2, 3, 4]", "has 4 elements", "position"),
    ("position = [1, 'b', 3]", "'b'", "`position` holds a string, not a number", "position = [0.0, 0.0, 0.0]"),
    ("depth = 3", "3", "is an integer, not a string", "depth = "),
    ("depth = 1979-05-27", "1979-05-27", "is a date", "depth"),
    ("depth = []", "[]", "is an array", "depth"),
    ("depth_format = 7", "7", "is an integer", "invalid = 0.0"),
    ("view = 1", "view", "unknown key `view` in [panorama]", "belongs in the scene file"),
    ("[object]\nmesh = 'm'", "[object]", "is a table, not an array of tables", "[[object]]"),
    ("[[view]]", "[[view]]", "is an array, not a table", "[view]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { thin = 1 }", "1", "not a boolean", "thin = true"),
    ("[[object]]\nmesh = 'm'\nmaterial = 'gold'", "'gold'", "not a table", "base_color"),
    ("[[object]]\nmesh = 'm'\nkeyframes = { time = 1 }", "{ time = 1 }", "not an array of tables", "time"),
    ("[[object]]\nmesh = 'm'\nkeyframes = [1]", "1", "`keyframes` holds an integer, not a table", "[{ … }]"),
    ("[render]\nsamples = 2.5", "2.5", "not an integer", "samples"),
    // Choices.
    ("convention = 'forwad'", "'forwad'", "unknown convention `forwad`", "did you mean `forward`?"),
    ("convention = ''", "''", "empty", "leave the key out"),
    ("depth_format = 'kiti'", "'kiti'", "unknown depth format", "`kitti`"),
    ("depth_format = { kind = 'w' }", "'w'", "unknown kind", "ray, z, disparity"),
    ("[view]\nkind = 'fisheye'", "'fisheye'", "unknown kind", "panorama, perspective, camera"),
    ("[view]\nkind = 'camera'", "'camera'", "no [camera]", "[camera]"),
    ("[[marker]]\nsize = 1", "[[marker]]", "[[marker]] has no `id`", "number"),
    ("[[marker]]\nid = 1", "[[marker]]", "[[marker]] has no `size`", "black square"),
    ("[[marker]]\nid = 1\nsize = 0", "0", "`size` cannot be 0", "metres"),
    ("[[marker]]\nid = 1\nsize = 1\nfamily = 'tag36h1'", "'tag36h1'", "unknown family", "tag36h1"),
    ("[[marker]]\nid = 11\nsize = 1\n[[marker]]\nid = 11\nsize = 2", "11", "two markers have the id 11", "its own"),
    ("[[object]]\nmesh = 'm'\nmarker = 7", "7", "there is no marker 7", "`id = 7`"),
    ("[camera]\ndepth = 'd'", "[camera]", "[camera] has no `color`", "color"),
    ("[camera]\ncolor = 'c'", "[camera]", "[camera] has no `depth`", "depth"),
    ("[camera]\ncolor = 'c'\ndepth = 'd'\ncx = 3", "3", "`cx` needs `fx`", "focal length"),
    ("[camera]\ncolor = 'c'\ndepth = 'd'\nfx = 0", "0", "`fx` cannot be 0", "pixels"),
    ("[camera]\ncolor = 'c'\ndepth = 'd'\nvfov = 50\nfx = 300", "fx", "exclude", "keep `vfov`"),
    ("[camera]\ncolor = 'c'\ndepth = 'd'\npitch = 5\nrotation = [0, 0, 0, 1]", "rotation", "exclude", "keep"),
    ("[camera]\ncolor = 'c_%04d.png'\ndepth = 'd'", "'c_%04d.png'", "the panorama is one picture", "frames"),
    ("[camera]\ncolor = 'c'\ndepth = 'd'\n[view]\nkind = 'camera'\nyaw = 3", "3", "own view has no `yaw`", "perspective"),
    ("[render]\nmethod = 'path'", "'path'", "unknown method `path`", "auto, iprt, dpt, mr360, rt2ar, ibl, onepass, twopass"),
    ("[render]\nmethod = 'DPT'", "'DPT'", "unknown method", "did you mean `dpt`?"),
    // Values.
    ("heading = nan", "nan", "`heading` cannot be nan", "degrees"),
    ("heading = -inf", "-inf", "cannot be -inf", "degrees"),
    ("heading = 1e400", "1e400", "", ""),
    ("heading = 99999999999999999999", "99999999999999999999", "", ""),
    ("position = [0, nan, 0]", "nan", "cannot be nan", "metres"),
    ("position = [0, 1e39, 0]", "1e39", "cannot be 1e39", "metres"),
    ("camera_height = 0", "0", "cannot be 0", "above 0"),
    ("camera_height = -1.6", "-1.6", "cannot be -1.6", "above 0"),
    ("fps = 0.0", "0.0", "cannot be 0.0", "above 0"),
    ("depth_format = { scale = 0 }", "0", "cannot be 0", "[1e-9, 1e9]"),
    ("depth_format = { invalid = nan }", "nan", "cannot be nan", "always mean"),
    ("depth = 'd_%04d.exr'", "'d_%04d.exr'", "`depth` is a sequence", "`frames`"),
    ("depth = \"a\\u0000b\"", "\"a\\u0000b\"", "NUL", "file name"),
    ("[[proxy]]\nplane = { size = [-1, 1] }", "-1", "`size` cannot be -1", "above 0"),
    ("[[proxy]]\nplane = { size = [0, 1] }", "0", "cannot be 0", "above 0"),
    ("[[proxy]]\nplane = { size = [1, 1] }\nalbedo = [0, 1.5, 0]", "1.5", "`albedo` cannot be 1.5", "[0, 1]"),
    ("[[object]]\nmesh = ''", "''", "`mesh` is empty", "value"),
    ("[[object]]\nmesh = 'm'\nscale = 0", "0", "`scale` cannot be 0", "1e-6"),
    ("[[object]]\nmesh = 'm'\nscale = -1", "-1", "cannot be -1", "1e-6"),
    ("[[object]]\nmesh = 'm'\nrotation = [0, 0.0, 0, 0]", "[0, 0.0, 0, 0]", "zero", "[0, 0, 0, 1]"),
    ("[[object]]\nmesh = 'm'\nrotation = [0, nan, 0, 0]", "nan", "cannot be nan", "number"),
    ("[[object]]\nmesh = 'm'\nkeyframes = [{ yaw = 0 }]", "{ yaw = 0 }", "has no `time`", "seconds"),
    ("[[object]]\nmesh = 'm'\nkeyframes = [{ time = 1 }, { time = 1.0 }]", "1.0", "follows one at 1 s", "sort"),
    ("[[object]]\nmesh = 'm'\nkeyframes = [{ time = -1 }]", "-1", "cannot be -1", "seconds"),
    ("[[object]]\nmesh = 'm'\nmaterial = { roughness = 1.01 }", "1.01", "`roughness` cannot be 1.01", "[0, 1]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { roughness = -0.1 }", "-0.1", "cannot be", "[0, 1]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { metallic = 2 }", "2", "cannot be 2", "[0, 1]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { ior = 0.9 }", "0.9", "`ior` cannot be 0.9", "[1, 10]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { emissive = [0, -1, 0] }", "-1", "cannot be -1", "[0, 1000000000]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { base_color = [0, 2, 0] }", "2", "cannot be 2", "[0, 1]"),
    ("[[object]]\nmesh = 'm'\nmaterial = { attenuation_distance = 0 }", "0", "cannot be 0", "clear body"),
    ("[view]\nkind = 'perspective'\nvfov = 0", "0", "`vfov` cannot be 0", "between 0 and 180"),
    ("[view]\nkind = 'perspective'\nvfov = 180.0", "180.0", "cannot be 180.0", "between 0 and 180"),
    ("[view]\nvfov = 40", "40", "a panorama view has no `vfov`", "perspective"),
    ("[view]\npitch = 91", "91", "`pitch` cannot be 91", "[-90, 90]"),
    ("[view]\nsize = [0, 512]", "0", "`size` cannot be 0", "1 to 32768"),
    ("[view]\nsize = [65536, 32768]", "65536", "cannot be 65536", "1 to 32768"),
    ("[view]\nsize = [512, 512]", "[512, 512]", "twice as wide", "size = [1024, 512]"),
    ("[render]\nsamples = 0", "0", "`samples` cannot be 0", "1 to 65536"),
    ("[render]\nsamples = 65537", "65537", "cannot be 65537", "1 to 65536"),
    ("[render]\nsamples = -3", "-3", "cannot be -3", "1 to 65536"),
    ("[render]\nsamples = 0x1_0000_0000_0000_0000", "0x1_0000_0000_0000_0000", "", "1 to 65536"),
    ("[render]\nbounces = 0", "0", "`bounces` cannot be 0", "1 to 64"),
];

#[test]
fn every_fault_is_pointed_at_and_has_a_remedy() {
    for (text, span, problem, remedy) in FAULTS {
        let text = format!("[panorama]\ncolor = 'café.exr'\n{text}\n");
        let error = fault(&text);
        if !span.is_empty() {
            assert_eq!(&error.text[error.span.clone()], *span, "{text}\n{error}");
        }
        assert!(error.problem.contains(problem), "{text}\n{error}");
        assert!(error.remedy.contains(remedy) && !error.remedy.is_empty(), "{text}\n{error}: {}", error.remedy);
        let before = &error.text[..error.span.start];
        assert_eq!(error.line, before.split('\n').count(), "{text}\n{error}");
        assert_eq!(error.column, before.split('\n').next_back().unwrap().chars().count() + 1, "{text}\n{error}");
        assert!(error.to_string().starts_with("dir/scene.toml:"));
    }
}

#[test]
fn columns_count_characters() {
    let error = fault("panorama = { color = 'é€😀', heading = nan }");
    assert_eq!((error.line, error.column), (1, 39));
    let error = fault("[panorama]\r\ncolor = 'a'\r\n  heading = nan\r\n");
    assert_eq!((error.line, error.column), (3, 13));
}

#[test]
fn faults_of_whole_files() {
    assert!(fault("").problem.contains("has no `panorama`"));
    assert!(fault("[panorama]").problem.contains("[panorama] has no `color`"));
    assert!(fault("panorama = 3").problem.contains("not a table"));
    assert!(fault("panorama.frames = 'a.exr'").remedy.contains("%04d"));
    assert!(fault("panorama.frames = '%04d/%04d.exr'").problem.contains("one frame number"));
    assert!(fault("[panorama]\nframes = 'a_%d'\ndepth = '%d_%d'").problem.contains("one frame number"));
    fault(&format!("a = {}", "[".repeat(100_000)));
    fault(&format!("{} = 1", "a.".repeat(100_000)));
    fault(&format!("{} = 1", "k".repeat(1_000_000)));
}

#[test]
fn unreadable_files_are_named() {
    let missing = std::env::temp_dir().join("pano-no-such-folder/scene.toml");
    let error = Scene::load(&missing).unwrap_err();
    assert!(matches!(&error, Error::File { path, .. } if *path == missing), "{error}");

    let latin1 = std::env::temp_dir().join(format!("pano-latin1-{}.toml", std::process::id()));
    std::fs::write(&latin1, b"# caf\xe9").unwrap();
    let error = Scene::load(&latin1).unwrap_err();
    std::fs::remove_file(&latin1).unwrap();
    assert!(error.to_string().contains("byte 5 is not UTF-8"), "{error}");
}

proptest! {
    #[test]
    fn random_text_never_panics(text: String) {
        let _ = Scene::parse(&text, "s.toml");
    }

    /// Cuts, doubles and overwrites pieces of a valid file, which gets much deeper than random text.
    #[test]
    fn damaged_scenes_never_panic(
        damage in proptest::collection::vec((any::<proptest::sample::Index>(), 0usize..20, "[\\[\\]{}=.,'\"#a-z0-9 \n-]{0,6}"), 1..4),
    ) {
        let mut text = FULL.to_owned();
        for (at, cut, insert) in damage {
            let start = at.index(text.len());
            text.replace_range(start..(start + cut).min(text.len()), &insert);
        }
        if let Err(Error::Scene(error)) = Scene::parse(&text, "s.toml") {
            prop_assert!(text.get(error.span.clone()).is_some() && !error.remedy.is_empty());
        }
    }

    #[test]
    fn what_parses_is_usable(
        position in proptest::array::uniform3(-1e7f64..1e7), q in proptest::array::uniform4(-2.0f64..2.0), scale in 0.0f64..2e6, vfov in -10.0f64..200.0,
    ) {
        let text = format!(
            "panorama.color = 'a'\n[[object]]\nmesh = 'm'\nposition = {position:?}\nrotation = {q:?}\nscale = {scale:?}\n[view]\nkind = 'perspective'\nvfov = {vfov:?}"
        );
        if let Ok(scene) = Scene::parse(&text, "s.toml") {
            let world = scene.objects[0].placement.world_from_local();
            prop_assert!(world.is_finite() && world.inverse().is_finite());
            prop_assert!(scene.camera((2, 1)).direction(Vec2::new(3.0, 5.0)).is_finite());
        }
    }
}
