use super::*;
use pano_core::io;
use pano_core::progress::Silent;
use proptest::prelude::*;
use std::path::Path;

fn row(ms: f64, error: f64) -> Row {
    Row {
        series: COMBINATION.into(),
        arguments: format!("{ms} {error}"),
        method: "dpt".into(),
        samples: 1,
        bounces: 1,
        denoise: true,
        value: String::new(),
        ms,
        world_ms: 0.0,
        trace_ms: ms,
        denoise_ms: 0.0,
        error,
        error_se: 0.0,
        noise: 0.0,
        repeats: 1,
    }
}

proptest! {
    #[test]
    fn the_front_holds_just_what_nothing_dominates(points in prop::collection::vec((1.0..100.0f64, 0.01..1.0f64), 1..40)) {
        let rows: Vec<Row> = points.iter().map(|&(ms, error)| row(ms, error)).collect();
        let front = front(&rows);
        let dominated = |a: &Row| rows.iter().any(|b| b.ms <= a.ms && b.error <= a.error && (b.ms < a.ms || b.error < a.error));
        for r in &rows {
            prop_assert_eq!(front.iter().any(|f| f.arguments == r.arguments), !dominated(r), "{:?}", r);
        }
        for budget in [0.5, 10.0, 50.0, 1000.0] {
            let best = rows.iter().filter(|r| r.ms <= budget).map(|r| r.error).reduce(f64::min);
            prop_assert_eq!(affordable(&front, budget).map(|r| r.error), best);
        }
    }
}

const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n-0.4 0 0\n0.4 0 0\n0.4 0.9 0\n-0.4 0.9 0\n3 0 1 2\n3 0 2 3\n";

/// A card on a plane under a sky with a sun; `extra` goes to the end.
fn scene(folder: &Path, extra: &str) -> (Scene, String) {
    let sky = RadianceImage::from_fn(64, 32, |x, y| glam::Vec3::splat(if (x, y) == (20, 6) { 400.0 } else { 1.0 }));
    io::write_image(folder.join("sky.exr"), &sky, None).unwrap();
    std::fs::write(folder.join("card.ply"), MESH).unwrap();
    let text = format!(
        "[panorama]\ncolor = 'sky.exr'\nposition = [0, 1, 0]\n[[proxy]]\nplane = {{ size = [8, 8] }}\nalbedo = [0.5, 0.5, 0.5]\n\
         [[object]]\nmesh = 'card.ply'\nposition = [0, 0, -2]\n[view]\nkind = 'perspective'\npitch = -25\nsize = [24, 16]\n{extra}"
    );
    (Scene::parse(&text, folder.join("scene.toml")).unwrap(), text)
}

fn small() -> TradeoffParams {
    TradeoffParams { repeats: 2, longest_ms: 400.0, truth_samples: 64, ..TradeoffParams::quick() }
}

#[test]
fn a_sweep_writes_its_page_goes_on_and_refuses_what_is_not_its_own() {
    let temp = tempfile::tempdir().unwrap();
    let (scene, text) = scene(temp.path(), "");
    let folder = Folder::create(temp.path().join("out")).unwrap();
    let first = run(&scene, &text, &small(), &folder, &Silent).unwrap();
    for name in &first.files {
        assert!(folder.path().join(name).metadata().unwrap().len() > 0, "{name}");
    }
    let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,") && !page.contains("{overview}"));
    assert_eq!(page.matches(">\ndpt\n<").count(), 1, "a legend has every method once");
    assert!(!page.contains("src=\"http") && !page.contains("href="), "the page is self-contained");
    assert!(first.truth.error.unwrap() > 0.0);
    let csv = std::fs::read(folder.path().join("results.csv")).unwrap();
    let again = run(&scene, &text, &small(), &folder, &Silent).unwrap();
    assert_eq!(first.rows, again.rows, "nothing is measured twice");
    assert_eq!(csv, std::fs::read(folder.path().join("results.csv")).unwrap());

    let error = run(&scene, "another scene", &small(), &folder, &Silent).unwrap_err();
    assert!(error.to_string().contains("another scene") && error.remedy().is_some(), "{error}");
}

#[test]
fn a_given_truth_must_fit_and_is_believed() {
    let temp = tempfile::tempdir().unwrap();
    let (scene, text) = scene(temp.path(), "");
    let folder = Folder::create(temp.path().join("out")).unwrap();
    let wrong = TradeoffParams { truth: Some(RadianceImage::filled(8, 8, glam::Vec3::ONE)), ..small() };
    let error = run(&scene, &text, &wrong, &folder, &Silent).unwrap_err();
    assert!(error.to_string().contains("8×8") && error.to_string().contains("24×16"), "{error}");

    let mut bench = Bench::new(&scene, &wrong, &Silent).unwrap();
    let choice = bench.default_choice(Method::Dpt);
    let picture = bench.picture(&choice, 0, &Silent).unwrap().composite.color;
    bench.judge_by(&Truth { halves: [picture.clone(), picture.clone()], error: None, origin: "itself".into() });
    assert_eq!((bench.error_of(&picture).unwrap(), bench.error_of_truth().unwrap()), (0.0, None));
}

#[test]
fn the_noise_of_the_truth_is_no_error() {
    let temp = tempfile::tempdir().unwrap();
    let (scene, _) = scene(temp.path(), "");
    let params = small();
    let mut bench = Bench::new(&scene, &params, &Silent).unwrap();
    // A truth of 0.25 with noise that the encoding does not clip, and a picture that is 0.25 everywhere.
    let noisy = |seed: u32| {
        RadianceImage::from_fn(24, 16, |x, y| {
            let bits = pano_core::random::Sampler::new(glam::UVec2::new(x as u32, y as u32), seed, Default::default()).next_1d();
            glam::Vec3::splat(if (x, y) == (0, 0) { 1.0 } else { 0.25 + 0.1 * (bits - 0.5) })
        })
    };
    bench.judge_by(&Truth { halves: [noisy(1), noisy(2)], error: None, origin: String::new() });
    let flat = RadianceImage::from_fn(24, 16, |x, y| glam::Vec3::splat(if (x, y) == (0, 0) { 1.0 } else { 0.25 }));
    let (own, error) = (bench.error_of_truth().unwrap().unwrap(), bench.error_of(&flat).unwrap());
    assert!(own > 0.01 && error < 0.6 * own, "truth {own}, picture {error}");
}

#[test]
fn unfiltered_noise_falls_with_the_samples() {
    let temp = tempfile::tempdir().unwrap();
    let (scene, _) = scene(temp.path(), "");
    let params = small();
    let mut bench = Bench::new(&scene, &params, &Silent).unwrap();
    let folder = Folder::create(temp.path().join("out")).unwrap();
    let truth = truth::find(&mut bench, &params, &folder, &Silent).unwrap();
    bench.judge_by(&truth);
    let mut row = |samples| {
        let choice = Choice { samples, denoise: false, ..bench.default_choice(Method::Dpt) };
        bench.measure(&choice, &Silent).unwrap()
    };
    let (few, more) = (row(1), row(4));
    assert!(more.error < few.error && few.error_se > 0.0, "{few:?} {more:?}");
    assert!(more.noise < few.noise && few.noise < 1.1 * few.error && more.noise > 0.0, "{few:?} {more:?}");
}

#[test]
fn a_scene_without_objects_is_refused() {
    let temp = tempfile::tempdir().unwrap();
    let (mut scene, text) = scene(temp.path(), "");
    scene.objects.clear();
    let folder = Folder::create(temp.path().join("out")).unwrap();
    let error = run(&scene, &text, &small(), &folder, &Silent).unwrap_err();
    assert!(error.to_string().contains("no objects"), "{error}");
}

#[test]
fn smaller_errors_take_more_samples_and_the_impossible_is_said() {
    let temp = tempfile::tempdir().unwrap();
    let (scene, _) = scene(temp.path(), "");
    let chosen = |goal: Goal| choose(&scene, goal, false, &Silent).unwrap();
    let (rough, fine) = (chosen(Goal::Error(0.05)), chosen(Goal::Error(0.005)));
    assert!(fine.choice.samples > rough.choice.samples, "{rough:?} {fine:?}");
    let impossible = chosen(Goal::Time(1e-3));
    assert!(impossible.caveat.is_some() && impossible.choice.samples == 1, "{impossible:?}");
    assert!(choose(&scene, Goal::Time(f64::NAN), true, &Silent).is_err());
}

#[test]
fn a_verdict_minds_clock_and_error_bars() {
    let with = |samples: u32, ms: f64, error: f64, error_se: f64| Row {
        arguments: format!("--method dpt --samples {samples} --bounces 3"),
        samples,
        error_se,
        ..row(ms, error)
    };
    let default = with(64, 1000.0, 0.02, 1e-3);
    let verdict_with = |other: &Row, untouched| Verdict::new(default.clone(), &[default.clone(), other.clone()], untouched);
    let verdict = |other: &Row| verdict_with(other, 0.1);
    let beaten = |other: &Row| verdict(other).beaten_by.is_some();
    assert!(beaten(&with(16, 900.0, 0.017, 1e-3)));
    assert!(!beaten(&with(16, 980.0, 0.017, 1e-3)), "the clock");
    assert!(!beaten(&with(16, 900.0, 0.018, 1e-3)), "the error bars");
    assert!(!beaten(&Row { series: "mis".into(), ..with(16, 900.0, 0.01, 0.0) }), "a knob turned by itself");
    // Error bars of 2·√2·10⁻³.
    assert_eq!(verdict(&with(256, 4000.0, 0.0225, 1e-3)).rising, [""; 0]);
    assert_eq!(verdict(&with(256, 4000.0, 0.0235, 1e-3)).rising, ["--method dpt --samples 256 --bounces 3"]);
    let clipped = verdict_with(&with(256, 4000.0, 0.0235, 1e-3), 0.019);
    assert_eq!(clipped.rising, [""; 0], "both worse than the photo");
    assert_eq!(
        verdict(&Row {
            method: "ibl".into(),
            arguments: "--method ibl --samples 256 --bounces 3".into(),
            ..with(256, 1.0, 1.0, 0.0)
        })
        .rising,
        [""; 0]
    );
    assert!(verdict(&with(16, 500.0, 0.03, 0.0)).to_string().contains("lie on the front"));
}
