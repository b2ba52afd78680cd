//! `pano plan` and `pano tradeoff`, from the outside.

use crate::support::{Bench, MESH};

fn bench(material: &str) -> Bench {
    let bench = Bench::new();
    bench.picture("room.exr", 32, 16, 2.0);
    bench.file("thing.ply", MESH);
    bench.file(
        "scene.toml",
        format!(
            "[panorama]\ncolor = 'room.exr'\nposition = [0, 1, 0]\n[[proxy]]\nplane = {{ size = [8, 8] }}\nalbedo = [0.5, 0.5, 0.5]\n\
             [[object]]\nmesh = 'thing.ply'\nposition = [0, 0, -2]\nmaterial = {{ {material} }}\n\
             [view]\nkind = 'perspective'\npitch = -25\nsize = [24, 16]\n[render]\nsamples = 16\n"
        ),
    );
    bench
}

#[test]
fn a_plan_names_every_effect_and_the_stages_that_run() {
    let effect = |json: &serde_json::Value, name: &str| {
        let effects = json["plan"].as_array().unwrap();
        effects.iter().find(|e| e["effect"] == name).unwrap_or_else(|| panic!("no {name}"))["on"].as_bool().unwrap()
    };
    let diffuse = bench("specular = 0").pano(&["plan", "scene.toml", "--json"]).json();
    let glass = bench("transmission = 1").pano(&["plan", "scene.toml", "--json"]).json();
    assert_eq!((effect(&diffuse, "glossy"), effect(&diffuse, "transmission")), (false, false));
    assert!(effect(&glass, "transmission"));
    assert_eq!(diffuse["plan"].as_array().unwrap().len(), 10);
    let stages: Vec<&str> = diffuse["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(stages, ["load", "world", "view", "trace", "denoise", "composite"]);
    assert!(diffuse["stages"].as_array().unwrap().iter().all(|s| s["ms"].as_f64().unwrap() >= 0.0));
    let text = bench("specular = 0").pano(&["plan", "scene.toml"]);
    assert!(text.stdout.contains("multi_bounce") && text.stdout.contains("estimated"), "{text:?}");
}

#[test]
fn a_plan_of_a_broken_scene_is_an_error() {
    let bench = bench("specular = 0");
    bench.pano(&["plan", "gone.toml"]).fails_with(&["gone.toml", "help:"]);
    bench.file("thing.ply", "");
    bench.pano(&["plan", "scene.toml"]).fails_with(&["thing.ply"]);
}

#[test]
fn a_truth_of_another_size_is_refused() {
    let bench = bench("specular = 0");
    bench.pano(&["tradeoff", "scene.toml", "-o", "out", "--quick", "--truth", "room.exr"]).fails_with(&["32×16", "24×16"]);
    bench.pano(&["tradeoff", "scene.toml", "-o", "scene.toml", "--quick"]).fails_with(&["scene.toml", "folder"]);
}

#[test]
fn a_budget_chooses_settings_and_says_so() {
    let bench = bench("specular = 0");
    let run = bench.pano(&["render", "scene.toml", "-o", "out.exr", "--budget", "2s"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for word in ["chose --method dpt --samples", "expecting", "took"] {
        assert!(run.stderr.contains(word), "no {word} in {}", run.stderr);
    }
    assert_eq!(bench.names_of("out"), ["out.exr"]);
    let conflict = bench.pano(&["render", "scene.toml", "-o", "out.exr", "--budget", "2s", "--samples", "4"]);
    assert_eq!(conflict.code, Some(2), "{conflict:?}");
}
