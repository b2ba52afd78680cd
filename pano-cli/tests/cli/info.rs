//! `pano info`, from the outside.

use crate::support::{Bench, MESH, truncate};
use pano_core::{image::Image, io::write_exr};

#[test]
fn each_kind_of_file_is_told() {
    let bench = Bench::new();
    bench.picture("room.exr", 32, 16, 8.0);
    bench.picture("room.png", 32, 16, 1.0);
    bench.picture("photo.jpg", 20, 16, 1.0);
    bench.file("thing.ply", MESH);
    let depth = Image::from_fn(32, 16, |x, _| if x < 8 { 0.0 } else { 2.0 });
    write_exr(bench.path("depth.exr"), &[("Z", &depth)], &[]).unwrap();
    let json = bench.pano(&["info", "--json", "room.exr", "room.png", "photo.jpg", "thing.ply", "depth.exr"]).json();
    let files = json["files"].as_array().unwrap();
    let kinds: Vec<_> = files.iter().map(|f| f["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["panorama", "panorama", "panorama", "mesh", "depth"]);
    assert_eq!(
        (&files[0]["width"], &files[0]["equirectangular"], &files[0]["encoding"]),
        (&32.into(), &true.into(), &"linear".into())
    );
    assert!(files[0]["problems"].as_array().unwrap().is_empty(), "{json}");
    assert_eq!((&files[1]["encoding"], &files[1]["negative"]), (&"srgb8".into(), &0.into()));
    assert!(files[2]["problems"][0].as_str().unwrap().contains("not twice as wide"), "{json}");
    assert_eq!((&files[3]["faces"], &files[3]["vertices"], &files[3]["open_edges"]), (&4.into(), &4.into(), &0.into()));
    assert_eq!((&files[4]["valid_share"], &files[4]["range"][0]), (&0.75.into(), &2.0.into()));

    let text = bench.pano(&["info", "room.exr", "thing.ply", "depth.exr", "photo.jpg"]);
    for part in
        ["room.exr: panorama", "thing.ply: mesh", "closed", "depth.exr: depth map", "75.0 %", "photo.jpg: picture", "problem"]
    {
        assert!(text.stdout.contains(part), "no {part:?} in\n{}", text.stdout);
    }
}

#[test]
fn odd_values_are_counted() {
    let bench = Bench::new();
    let channel = |a: f32, b: f32| Image::from_vec(2, 1, vec![a, b]).unwrap();
    let (r, g, b) = (channel(f32::NAN, 3.0), channel(-1.0, 2.0), channel(f32::INFINITY, 2.0));
    write_exr(bench.path("odd.exr"), &[("R", &r), ("G", &g), ("B", &b)], &[]).unwrap();
    let json = bench.pano(&["info", "--json", "odd.exr"]).json();
    assert_eq!((&json["files"][0]["negative"], &json["files"][0]["not_finite"]), (&1.into(), &2.into()), "{json}");
    assert_eq!(json["files"][0]["problems"].as_array().unwrap().len(), 2);
}

#[test]
fn a_scene_is_followed_to_its_files() {
    let bench = Bench::new();
    bench.picture("room.exr", 32, 16, 8.0);
    bench.file("thing.ply", MESH.replace("element face 4", "element face 3").replace("3 1 2 3\n", ""));
    let scene = "[panorama]\ncolor = 'room.exr'\nposition = [0.2, 0.2, 0.2]\n[[object]]\nmesh = 'thing.ply'\nmaterial = { transmission = 1 }\n";
    bench.file("scene.toml", scene);
    bench.file("gone.toml", "[panorama]\nframes = 'f_%04d.exr'\n[[object]]\nmesh = 'gone.ply'\n");
    let json = bench.pano(&["info", "--json", "scene.toml", "gone.toml"]).json();
    let (scene, gone) = (&json["files"][0], &json["files"][1]);
    assert_eq!(
        (&scene["kind"], &scene["method"], &scene["parts"][0]["role"]),
        (&"scene".into(), &"auto".into(), &"panorama.color".into())
    );
    let problems = scene["parts"][1]["problems"].to_string();
    assert!(problems.contains("not closed (3 open edges)") && problems.contains("enclose"), "{problems}");
    assert!(scene["problems"].to_string().contains("no shadow can fall"), "{scene}");
    assert_eq!((&gone["parts"][0]["kind"], &gone["frames"]), (&"error".into(), &0.into()), "{gone}");
    assert!(gone["problems"].to_string().contains("f_0000.exr") && gone["problems"].to_string().contains("1 of the 1"), "{gone}");
}

#[test]
fn faults_of_a_scene_are_underlined() {
    let bench = Bench::new();
    bench.file("scene.toml", "[panorama]\ncolor = 'room.exr'\nheadng = 4\n");
    let run = bench.pano(&["info", "scene.toml"]);
    run.fails_with(&["scene.toml:3:1", "unknown key `headng`", "headng = 4", "did you mean `heading`?"]);
    assert!(run.stdout.is_empty());
}

#[test]
fn one_bad_file_does_not_hide_the_others() {
    let bench = Bench::new();
    bench.picture("room.exr", 32, 16, 8.0);
    bench.file("empty.ply", "");
    bench.file("half.ply", &MESH[..MESH.len() / 2]);
    truncate(&bench.picture("half.exr", 64, 32, 1.0));
    let files = ["missing.exr", "empty.ply", "half.ply", "half.exr", "missing.toml", "room.exr"];
    let run = bench.pano(&[&["info"], &files[..]].concat());
    run.fails_with(&files[..5]);
    assert!(run.stdout.starts_with("room.exr: panorama"), "{}", run.stdout);
    let run = bench.pano(&[&["info", "--json"], &files[..]].concat());
    let json: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((run.code, json["files"].as_array().unwrap().len()), (Some(1), 6));
    assert!(json["files"][0]["remedy"].is_string());
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_failure() {
    use std::process::{Command, Stdio};
    let bench = Bench::new();
    bench.picture("room.exr", 32, 16, 8.0);
    let mut child = Command::new(env!("CARGO_BIN_EXE_pano"))
        .args(std::iter::once("info".into()).chain(std::iter::repeat_n(bench.path("room.exr"), 50)))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
}
