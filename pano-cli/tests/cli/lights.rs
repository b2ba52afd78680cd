//! `pano lights` and `pano expand`, from the outside.

use crate::support::Bench;
use glam::Vec3;
use pano_core::{image::Image, io::write_image};

/// A gray panorama with a lamp whose centre is the pixel (x, y).
fn with_lamp(bench: &Bench, name: &str, x: usize, y: usize) {
    let image = Image::from_fn(128, 64, |px, py| {
        let near = (px + 128 - x + 2) % 128 <= 4 && py.abs_diff(y) <= 2;
        if near { Vec3::splat(if name.ends_with("exr") { 50.0 } else { 1.0 }) } else { Vec3::new(0.2, 0.25, 0.3) }
    });
    write_image(bench.path(name), &image, None).unwrap();
}

fn direction(light: &serde_json::Value) -> Vec3 {
    let d = |i: usize| light["direction"][i].as_f64().unwrap() as f32;
    Vec3::new(d(0), d(1), d(2))
}

#[test]
fn a_lamp_is_listed_and_marked() {
    let bench = Bench::new();
    for name in ["pano.exr", "pano.png"] {
        with_lamp(&bench, name, 96, 16);
        let json = bench.pano(&["lights", name, "--json", "-o", "marked.png"]).json();
        let lights = json["lights"].as_array().unwrap();
        assert_eq!(lights.len(), 1, "{json}");
        // A quarter of the way down and three quarters across: 45° up, to the right.
        let expected = Vec3::new(1.0, 1.0, 0.0).normalize();
        assert!(direction(&lights[0]).distance(expected) < 0.05, "{json}");
        for key in ["threshold", "mean", "sigma"] {
            assert!(json[key].as_f64().unwrap() > 0.0, "{key}: {json}");
        }
        let same = lights[0]["irradiance"] == lights[0]["intensity"];
        assert_eq!(same, name == "pano.exr", "only clipped lights are remapped: {json}");
        assert_eq!(bench.pano(&["info", "marked.png", "--json"]).json()["files"][0]["width"], 128);
        let text = bench.pano(&["lights", name]);
        assert!(text.code == Some(0) && text.stdout.contains("height  4"), "{text:?}");
    }
    let clipped = bench.pano(&["lights", "pano.png", "--json", "--detector", "clipped"]).json();
    assert_eq!(clipped["lights"].as_array().unwrap().len(), 1, "{clipped}");
}

#[test]
fn a_sequence_is_a_line_a_frame_with_one_identity_over_the_seam() {
    let bench = Bench::new();
    for frame in 0..8 {
        with_lamp(&bench, &format!("f_{frame:02}.png"), (124 + frame) % 128, 20);
    }
    let run = bench.pano(&["lights", "f_%02d.png", "--json", "-o", "m_%02d.png"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let lines: Vec<serde_json::Value> = run.stdout.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 8);
    for (frame, line) in lines.iter().enumerate() {
        assert_eq!((&line["frame"], &line["lights"][0]["id"]), (&frame.into(), &0.into()), "{line}");
        assert_eq!(line["lights"].as_array().unwrap().len(), 1);
    }
    assert_eq!(bench.names_of("m_").len(), 8);
}

#[test]
fn wrong_inputs_of_lights_are_named() {
    let bench = Bench::new();
    bench.picture("square.png", 16, 16, 1.0);
    bench.picture("pano.exr", 32, 16, 1.0);
    bench.pano(&["lights", "square.png"]).fails_with(&["square.png", "16×16", "2:1", "help:"]);
    bench.pano(&["lights", "missing.png"]).fails_with(&["missing.png", "help:"]);
    bench.pano(&["lights", "f_%02d.png"]).fails_with(&["no frame", "f_00.png", "help:"]);
    bench.pano(&["lights", "pano.exr", "--detector", "clipped"]).fails_with(&["pano.exr", "nothing is clipped", "mr360"]);
    bench.pano(&["lights", "pano.exr", "-o", "out.txt"]).fails_with(&["out.txt", "extension", "help:"]);
    bench.picture("f_00.png", 32, 16, 1.0);
    bench.pano(&["lights", "f_%02d.png", "-o", "one.png"]).fails_with(&["one.png", "%04d"]);
    assert_eq!(bench.pano(&["lights", "pano.exr", "--detector", "eyes"]).code, Some(2));
}

#[test]
fn expanding_white_gives_11_8() {
    let bench = Bench::new();
    write_image(bench.path("white.png"), &Image::filled(4, 2, Vec3::ONE), None).unwrap();
    assert_eq!(bench.pano(&["expand", "white.png", "-o", "white.exr"]).code, Some(0));
    let hdr = pano_core::io::read_image(bench.path("white.exr")).unwrap();
    assert!(hdr.radiance.data().iter().all(|p| (p.x - 11.8).abs() < 1e-4), "{:?}", hdr.radiance.get(0, 0));
    bench.pano(&["expand", "white.exr", "-o", "again.exr"]).fails_with(&["white.exr", "no inverse tone mapping", "help:"]);
    bench.pano(&["expand", "white.png", "-o", "clipped.png"]).fails_with(&["clipped.png", "brighter than white", ".exr"]);
    bench.pano(&["expand", "missing.png", "-o", "a.exr"]).fails_with(&["missing.png", "help:"]);
}
