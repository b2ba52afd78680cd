//! `pano render`, from the outside.

use crate::support::{Bench, MESH};
use pano_core::io::{read_exr, read_image};

/// A bench with a panorama, a mesh, and `scene.toml`, to which `extra` is appended.
fn bench(extra: &str) -> Bench {
    let bench = Bench::new();
    bench.picture("room.exr", 32, 16, 2.0);
    bench.file("thing.ply", MESH);
    let scene = "[panorama]\ncolor = 'room.exr'\nposition = [0, 1, 0]\n[[proxy]]\nplane = { size = [8, 8] }\nalbedo = [0.5, 0.5, 0.5]\n\
        [[object]]\nmesh = 'thing.ply'\nposition = [0, 0, -2]\n[view]\nkind = 'perspective'\npitch = -25\nsize = [24, 16]\n[render]\nsamples = 2\n";
    bench.file("scene.toml", format!("{scene}{extra}"));
    bench
}

#[test]
fn a_scene_becomes_pictures() {
    let bench = bench("");
    let run = bench.pano(&["render", "scene.toml", "-o", "out.exr", "--method", "dpt", "--stats", "stats.json"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), ""), "{run:?}");
    let exr = read_exr(bench.path("out.exr")).unwrap();
    assert_eq!((exr.width, exr.height), (24, 16));
    for layer in ["", "delta", "photo", "object"] {
        assert!(exr.rgb(layer).is_some(), "no layer {layer:?}");
    }
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(bench.path("stats.json")).unwrap()).unwrap();
    assert_eq!(stats["method"], "dpt");
    for key in ["backend", "total_ms", "stages", "plan", "warnings"] {
        assert!(!stats[key].is_null(), "no {key} in {stats}");
    }
    for name in ["out.png", "out.jpg"] {
        assert_eq!(bench.pano(&["render", "scene.toml", "-o", name]).code, Some(0));
        assert_eq!(read_image(bench.path(name)).unwrap().radiance.size(), (24, 16));
    }
    assert!(bench.pano(&["render", "scene.toml", "-o", "out.png", "--json"]).json()["stages"].is_array());
}

#[test]
fn the_same_command_gives_the_same_bytes_and_the_seed_others() {
    let bench = bench("");
    let bytes = |seed: &str, name: &str| {
        let run = bench.pano(&["render", "scene.toml", "-o", name, "--method", "dpt", "--no-denoise", "--seed", seed]);
        assert_eq!(run.code, Some(0), "{run:?}");
        std::fs::read(bench.path(name)).unwrap()
    };
    assert_eq!(bytes("1", "a.exr"), bytes("1", "b.exr"));
    assert_ne!(bytes("1", "a.exr"), bytes("2", "b.exr"));
}

#[test]
fn frames_get_a_file_each() {
    let bench = bench("");
    for frame in [3, 4] {
        std::fs::copy(bench.path("room.exr"), bench.path(&format!("f_{frame:02}.exr"))).unwrap();
    }
    let scene = std::fs::read_to_string(bench.path("scene.toml")).unwrap();
    bench.file("scene.toml", scene.replace("color = 'room.exr'", "frames = 'f_%02d.exr'"));
    let render = ["render", "scene.toml", "--method", "dpt", "-o"];
    bench.pano(&[&render[..], &["out.png"]].concat()).fails_with(&["out.png", "2 frames", "out_%04d"]);
    let run = bench.pano(&[&render[..], &["out_%03d.png", "--json"]].concat()).json();
    assert_eq!((&run["frames"][0]["frame"], &run["frames"][1]["frame"]), (&3.into(), &4.into()));
    assert_eq!(bench.names_of("out"), ["out_003.png", "out_004.png"]);
    bench.pano(&[&render[..], &["more_%d.png", "--frames", "4-5"]].concat()).fails_with(&["f_05.exr", "help:"]);
    assert_eq!(bench.names_of("more"), ["more_4.png"]);
}

#[test]
fn bad_inputs_are_named_and_nothing_is_written() {
    let cases: [(&str, &str, &[&str]); 8] = [
        ("color = 'room.exr'", "color = 'gone.exr'", &["gone.exr", "help:"]),
        ("color = 'room.exr'", "color = 'empty.exr'", &["empty.exr", "is empty", "help:"]),
        ("color = 'room.exr'", "color = 'square.exr'", &["square.exr", "16×16", "2:1", "twice as wide"]),
        ("mesh = 'thing.ply'", "mesh = 'gone.ply'", &["gone.ply", "help:"]),
        ("mesh = 'thing.ply'", "mesh = 'half.ply'", &["half.ply", "help:"]),
        (
            "position = [0, 0, -2]",
            "positon = [0, 0, -2]",
            &["scene.toml:9:1", "unknown key `positon`", "positon = [0", "`position`?"],
        ),
        ("samples = 2", "samples = 0", &["scene.toml:15:11", "`samples` cannot be 0", "1 to 65536"]),
        ("[view]", "[view", &["scene.toml:10:", "TOML"]),
    ];
    for (from, to, parts) in cases {
        let bench = bench("");
        bench.file("empty.exr", "");
        bench.picture("square.exr", 16, 16, 1.0);
        bench.file("half.ply", &MESH[..MESH.len() / 2]);
        let scene = std::fs::read_to_string(bench.path("scene.toml")).unwrap();
        assert!(scene.contains(from), "{from}");
        bench.file("scene.toml", scene.replace(from, to));
        let run = bench.pano(&["render", "scene.toml", "-o", "out.exr", "--stats", "out.json"]);
        run.fails_with(parts);
        assert!(run.stdout.is_empty() && bench.names_of("out").is_empty(), "{run:?}");
    }
}

#[test]
fn outputs_are_checked_before_the_work() {
    // So many samples that only an early failure ends in time.
    let bench = bench("bounces = 3\n");
    let render = |output: &[&str]| bench.pano(&[&["render", "scene.toml", "--samples", "65536", "-o"], output].concat());
    std::fs::create_dir(bench.path("folder.exr")).unwrap();
    render(&["out.tga"]).fails_with(&["out.tga", "extension", ".png"]);
    render(&["out"]).fails_with(&["extension"]);
    render(&["nowhere/out.exr"]).fails_with(&["nowhere", "does not exist", "create the folder"]);
    render(&["scene.toml/out.exr"]).fails_with(&["scene.toml", "does not exist"]);
    render(&["folder.exr"]).fails_with(&["folder.exr", "is a folder"]);
    render(&["out.exr", "--stats", "nowhere/s.json"]).fails_with(&["nowhere", "does not exist"]);
}

#[test]
fn wrong_usage_exits_with_2() {
    let bench = bench("");
    let usages: [&[&str]; 11] = [
        &[],
        &["--method", "path"],
        &["--samples", "0"],
        &["--samples", "65537"],
        &["--bounces", "0"],
        &["--backend", "tpu"],
        &["--frames", "5-4"],
        &["--seed", "-1"],
        &["--set", "frob=1"],
        &["--set", "mis"],
        &["--set", "reflectance_cap=2"],
    ];
    for args in usages {
        let output: &[&str] = if args.is_empty() { &[] } else { &["-o", "out.exr"] };
        let run = bench.pano(&[&["render", "scene.toml"], output, args].concat());
        assert_eq!(run.code, Some(2), "{args:?}: {run:?}");
        assert!(run.stdout.is_empty() && !run.stderr.contains("panicked"), "{run:?}");
    }
    assert!(bench.names_of("out").is_empty());
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_and_leaves_nothing() {
    use std::process::{Command, Stdio};
    let bench = bench("");
    let scene = std::fs::read_to_string(bench.path("scene.toml")).unwrap();
    bench.file("scene.toml", scene.replace("[24, 16]", "[960, 640]"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_pano"))
        .current_dir(bench.path(""))
        .args(["render", "scene.toml", "-o", "out.exr", "--method", "dpt", "--samples", "256"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Long enough to be at work, short against the minutes the work would take.
    std::thread::sleep(std::time::Duration::from_secs(1));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let begin = std::time::Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if begin.elapsed().as_secs() > 20 {
            child.kill().unwrap();
            panic!("still running 20 s after Ctrl-C");
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    };
    let stderr = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
    assert_eq!(code, Some(1), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");
    assert_eq!(bench.names_of(""), ["room.exr", "scene.toml", "thing.ply"]);
}

/// Without a GPU the CPU does the work, and one line says so; the adapter's name keeps this true on every machine.
#[cfg(feature = "gpu")]
#[test]
fn a_gpu_that_is_not_there_is_one_line() {
    let bench = bench("");
    let nowhere = [("WGPU_ADAPTER_NAME", "no such adapter")];
    let arguments = ["render", "scene.toml", "--method", "dpt", "-o"];
    let run = bench.pano_with(&nowhere, &[&arguments[..], &["gpu.exr", "--backend", "gpu", "--json"]].concat());
    assert_eq!(run.code, Some(0), "{run:?}");
    let lines: Vec<&str> = run.stderr.lines().filter(|l| l.contains("no GPU can be used")).collect();
    assert!(lines.len() == 1 && lines[0].contains("the CPU does the work"), "{}", run.stderr);
    assert_eq!(run.json()["backend"], "cpu");
    // `auto` has nothing to say, and the picture is the same.
    let run = bench.pano_with(&nowhere, &[&arguments[..], &["auto.exr"]].concat());
    assert!(run.code == Some(0) && !run.stderr.contains("GPU"), "{run:?}");
    assert_eq!(std::fs::read(bench.path("gpu.exr")).unwrap(), std::fs::read(bench.path("auto.exr")).unwrap());
}
