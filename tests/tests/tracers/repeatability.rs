//! The same command gives the same bytes; another seed gives other noise, which falls with the samples.

use pano_core::layers::TracedLayers;
use pano_tests::scenes::{TestScene, random_proxies, random_room};
use pano_tests::statistics::Estimate;
use pano_trace::tracer::{Method, TraceParams};
use pano_trace::world::RealWorld;

const ALL: [Method; 4] = [Method::Dpt, Method::OnePass, Method::TwoPass, Method::Ibl];

fn bits(layers: &TracedLayers) -> Vec<u32> {
    let colors = [&layers.object, &layers.delta, &layers.normal, &layers.albedo];
    let scalars = [&layers.coverage, &layers.depth];
    let colors = colors.into_iter().flat_map(|i| i.data()).flat_map(|p| p.to_array());
    colors.chain(scalars.into_iter().flat_map(|i| i.data().iter().copied())).map(f32::to_bits).collect()
}

fn same_for_any_number_of_threads<W: RealWorld>(scene: &TestScene<W>) {
    for (method, error_target) in ALL.into_iter().flat_map(|method| [(method, None), (method, Some(0.05))]) {
        // Adaptive sampling begins beyond its pilot.
        let samples = if error_target.is_some() { 32 } else { 3 };
        let params = TraceParams { method, samples, bounces: 3, error_target, ..TraceParams::default() };
        let [one, two, again] = [1, 2, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
            let traced = pool.install(|| scene.trace(&params, 7));
            (bits(&traced.layers), traced.rays, traced.discarded)
        });
        assert!(one == two && two == again, "{method:?}");
        let other = scene.trace(&params, 8);
        assert_ne!(one.0, bits(&other.layers), "{method:?}: the seed changes the noise");
    }
}

#[test]
fn one_and_two_threads_give_the_same_bytes_over_proxies() {
    same_for_any_number_of_threads(&random_proxies(3));
}

/// The captured world is built anew for each number of threads: its map of irradiance is sampled, too.
#[test]
fn one_and_two_threads_give_the_same_bytes_in_a_captured_room() {
    same_for_any_number_of_threads(&random_room(0));
    let scenes = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        pool.install(|| random_room(1))
    });
    let params = TraceParams { samples: 2, ..TraceParams::default() };
    let [a, b] = scenes.map(|scene| bits(&scene.trace(&params, 0).layers));
    assert_eq!(a, b);
}

/// Mean over the pixels of the variance between repetitions, of object and delta.
fn variance<W: RealWorld>(scene: &TestScene<W>, method: Method, samples: u32) -> f64 {
    let params = TraceParams { method, samples, bounces: 2, ..TraceParams::default() };
    let runs: Vec<TracedLayers> = (0..12).map(|seed| scene.trace(&params, 100 * samples + seed).layers).collect();
    let pixels = scene.camera.width * scene.camera.height;
    let of_pixel = |i: usize| {
        let values: Vec<f64> = runs.iter().map(|l| f64::from(l.object.data()[i].y + l.delta.data()[i].y)).collect();
        // The error of the mean, squared, times n.
        Estimate::of(&values).error.powi(2) * values.len() as f64
    };
    (0..pixels).map(of_pixel).sum::<f64>() / pixels as f64
}

#[test]
fn variance_falls_with_the_number_of_samples() {
    for scene in [random_proxies(1), random_proxies(6)] {
        for method in ALL {
            let (few, many) = (variance(&scene, method, 4), variance(&scene, method, 32));
            // Independent samples would give 8. Stratified ones do better, up to edges of objects and the noise of later
            // bounces; 12 repetitions of 768 pixels know each variance to a few percent, but for rare bright samples.
            let ratio = few / many;
            assert!((5.5..64.0).contains(&ratio), "{method:?}: the variance fell by {ratio} with 8 times the samples");
        }
    }
}
