use super::*;
use crate::pipeline::Folder;
use pano_core::progress::Silent;

const TINY: DemoParams =
    DemoParams { panorama_width: 64, panorama_samples: 4, view: (40, 30), samples: 4, truth_samples: 4, bounces: 2, seed: 0 };

#[test]
fn a_tiny_demo_is_complete_and_repeatable() {
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let (one, two) = (pool(1).install(|| run(&TINY, &Silent).unwrap()), pool(2).install(|| run(&TINY, &Silent).unwrap()));
    assert_eq!(one.composites.iter().map(|c| c.0).collect::<Vec<_>>(), METHODS);
    for ((method, a), (_, b)) in one.composites.iter().zip(&two.composites) {
        assert!(a.composite.color.data() == b.composite.color.data(), "{method:?} depends on the number of threads");
        assert!(a.composite.color.data().iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{method:?}");
    }
    assert!(one.truth.data() == two.truth.data());

    let folder = tempfile::tempdir().unwrap();
    let files = one.write(&Folder::create(folder.path()).unwrap()).unwrap();
    assert!(files.iter().all(|f| folder.path().join(f).is_file()), "{files:?}");
    let numbers: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.path().join("numbers.json")).unwrap()).unwrap();
    assert!(numbers.is_object());
    Scene::load(folder.path().join(SCENE_FILE)).unwrap();
}

#[test]
fn a_demo_of_nothing_is_refused() {
    for params in
        [DemoParams { samples: 0, ..TINY }, DemoParams { view: (0, 3), ..TINY }, DemoParams { panorama_width: 7, ..TINY }]
    {
        assert!(run(&params, &Silent).is_err(), "{params:?}");
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    assert!(Folder::create(file.path()).is_err());
}

#[test]
fn the_cases_of_rt2ar_hold_their_objects() {
    // Markers that are looked for must be large enough to be found.
    let panorama_width = if cfg!(feature = "markers") { 1024 } else { 64 };
    let params = CaseParams { panorama_width, captured_samples: 1, size: (32, 24), samples: 2, truth_samples: 1 };
    let cases = cases(&params, None, &Silent).unwrap();
    let mut names = vec!["occlusion", "reflection", "glossy table", "recursion", "refraction", "soft shadows"];
    names.extend(cfg!(feature = "markers").then_some("marker"));
    assert_eq!(cases.iter().map(|c| c.name).collect::<Vec<_>>(), names);
    for case in &cases {
        assert_eq!(case.truth.size(), (32, 24), "{}", case.name);
        for rendered in [&case.panorama, &case.camera] {
            assert_eq!(rendered.stats.method, "rt2ar");
            assert!(rendered.composite.color.data().iter().all(|p| p.is_finite()), "{}", case.name);
            let covered: f32 = rendered.layers.coverage.data().iter().sum();
            assert!(covered > 4.0, "{}: {covered} pixels of objects", case.name);
        }
    }
    assert!(super::cases(&CaseParams { samples: 0, ..params }, None, &Silent).is_err());
}
