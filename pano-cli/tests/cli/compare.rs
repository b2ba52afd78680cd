//! `pano compare`, from the outside.

use crate::support::{Bench, truncate};

#[test]
fn identical_pictures_are_no_way_apart() {
    let bench = Bench::new();
    for name in ["a.png", "a.exr"] {
        bench.picture(name, 32, 16, 1.0);
        let json = bench.pano(&["compare", name, name, "--json"]).json();
        assert_eq!((&json["mse"], &json["flip"], &json["rel_rmse"]), (&0.0.into(), &0.0.into(), &0.0.into()), "{json}");
        assert!((json["ssim"].as_f64().unwrap() - 1.0).abs() < 1e-9 && json["psnr"].is_null() && json["ws_psnr"].is_null());
        assert_eq!(json.as_object().unwrap().len(), 6);
    }
    let text = bench.pano(&["compare", "a.png", "a.exr"]);
    assert_eq!(text.code, Some(0));
    assert!(text.stdout.contains("psnr") && text.stderr.is_empty(), "{text:?}");
}

#[test]
fn white_scales_linear_pictures() {
    let bench = Bench::new();
    bench.picture("one.exr", 32, 16, 1.0);
    bench.picture("four.exr", 32, 16, 4.0);
    let raw = bench.pano(&["compare", "one.exr", "four.exr", "--json"]).json();
    assert!(raw["mse"].as_f64().unwrap() > 0.01, "{raw}");
    // Divided by 4, `one` is darker; against itself nothing changes.
    let same = bench.pano(&["compare", "four.exr", "four.exr", "--white", "4", "--json"]).json();
    assert_eq!(same["mse"], 0.0);
}

#[test]
fn a_mask_chooses_pixels() {
    let bench = Bench::new();
    bench.picture("a.exr", 16, 16, 1.0);
    bench.picture("b.exr", 16, 16, 0.5);
    bench.picture("all.png", 16, 16, 1.0);
    bench.picture("none.png", 16, 16, 0.0);
    bench.picture("small.png", 8, 16, 1.0);
    let args = ["compare", "a.exr", "b.exr", "--json"];
    assert_eq!(bench.pano(&[&args[..], &["--mask", "all.png"]].concat()).json(), bench.pano(&args).json());
    bench.pano(&[&args[..], &["--mask", "none.png"]].concat()).fails_with(&["none.png", "black", "paint"]);
    bench.pano(&[&args[..], &["--mask", "small.png"]].concat()).fails_with(&["small.png", "8×16", "16×16", "equal size"]);
}

#[test]
fn small_pictures_have_no_ssim() {
    let bench = Bench::new();
    bench.picture("a.png", 10, 5, 1.0);
    assert!(bench.pano(&["compare", "a.png", "a.png", "--json"]).json()["ssim"].is_null());
    assert!(bench.pano(&["compare", "a.png", "a.png"]).stdout.contains("smaller than 11×11"));
}

#[test]
fn bad_inputs_are_named() {
    let bench = Bench::new();
    bench.picture("good.png", 16, 8, 1.0);
    bench.picture("other.png", 16, 16, 1.0);
    bench.file("empty.png", "");
    bench.file("text.png", "no picture at all");
    for name in ["half.png", "half.exr", "half.jpg", "half.hdr"] {
        truncate(&bench.picture(name, 64, 32, 1.0));
    }
    bench.pano(&["compare", "good.png", "missing.png"]).fails_with(&["missing.png", "help:"]);
    bench.pano(&["compare", "good.png", "empty.png"]).fails_with(&["empty.png", "is empty", "help:"]);
    bench.pano(&["compare", "good.png", "text.png"]).fails_with(&["text.png", "not a picture", "help:"]);
    bench.pano(&["compare", "good.png", "."]).fails_with(&["not a regular file", "help:"]);
    bench.pano(&["compare", "good.png", "other.png"]).fails_with(&["other.png", "16×16", "16×8", "equal size"]);
    for name in ["half.png", "half.exr", "half.jpg", "half.hdr"] {
        bench.pano(&["compare", name, name]).fails_with(&[name, "help:"]);
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let bench = Bench::new();
    let usages: [&[&str]; 8] = [
        &[],
        &["frobnicate"],
        &["compare"],
        &["compare", "a.png"],
        &["compare", "a", "b", "--white", "0"],
        &["compare", "a", "b", "--white", "nan"],
        &["compare", "a", "b", "--frob"],
        &["info"],
    ];
    for args in usages {
        let run = bench.pano(args);
        assert_eq!(run.code, Some(2), "{args:?}: {run:?}");
        assert!(run.stdout.is_empty() && !run.stderr.is_empty(), "{args:?}: {run:?}");
    }
    assert_eq!(bench.pano(&["--version"]).code, Some(0));
    assert_eq!(bench.pano(&["compare", "--help"]).code, Some(0));
}
