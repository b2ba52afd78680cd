//! Adaptive sampling: its target met, fewer samples for the same error, an error map that tells the truth.

use pano_tests::scenes::{TestScene, plane_with_two_windows, random_room};
use pano_trace::tracer::{Method, Sampling, TraceParams, Traced};
use pano_trace::world::RealWorld;

const ALL: [Method; 4] = [Method::Dpt, Method::OnePass, Method::TwoPass, Method::Ibl];

/// Pictures whose mean square errors are compared.
const SEEDS: u32 = 8;

fn params(method: Method, samples: u32, error_target: Option<f32>) -> TraceParams {
    TraceParams { method, samples, bounces: 2, error_target, ..TraceParams::default() }
}

/// Object and change of every pixel.
fn values(traced: &Traced) -> Vec<f64> {
    let (object, delta) = (traced.layers.object.data(), traced.layers.delta.data());
    object.iter().zip(delta).map(|(o, d)| f64::from(pano_core::color::luminance(*o + *d))).collect()
}

/// Root mean square difference.
fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

fn sampling(traced: &Traced) -> &Sampling {
    traced.sampling.as_ref().expect("adaptive sampling was asked for")
}

fn reference<W: RealWorld>(scene: &TestScene<W>, method: Method) -> Vec<f64> {
    values(&scene.trace(&params(method, 4096, None), 999))
}

/// The error map and its mean square are what the error is, and at equal error fewer samples are spent than everywhere alike.
#[test]
fn the_error_is_as_told_and_costs_fewer_samples() {
    let scene = plane_with_two_windows(32, 24);
    ALL.into_iter().for_each(|method| told_and_cheaper(&scene, method, 0.03, 1.2));
}

/// Here dpt takes fewer samples where objects take little of the light anyway, which leaves less to gain.
#[test]
fn it_costs_fewer_samples_in_a_captured_room_too() {
    told_and_cheaper(&random_room(1), Method::Dpt, 0.003, 1.0);
}

/// Root mean square error and rays of several pictures: one seed's error may be that of a single dot.
fn mean_of(picture: &dyn Fn(u32) -> Traced, truth: &[f64]) -> (f64, f64) {
    let pictures: Vec<Traced> = (10..10 + SEEDS).map(picture).collect();
    let mean = |of: &dyn Fn(&Traced) -> f64| pictures.iter().map(of).sum::<f64>() / f64::from(SEEDS);
    (mean(&|p| rms(&values(p), truth).powi(2)).sqrt(), mean(&|p| p.rays as f64))
}

fn told_and_cheaper<W: RealWorld>(scene: &TestScene<W>, method: Method, target: f32, least_gain: f64) {
    let truth = reference(scene, method);
    let (uniform, uniform_rays) = mean_of(&|seed| scene.trace(&params(method, 64, None), seed), &truth);
    let traced = scene.trace(&params(method, 4096, Some(target)), 2);
    let (values, sampling) = (values(&traced), sampling(&traced));
    let map: Vec<f64> = sampling.error.data().iter().map(|e| f64::from(*e)).collect();
    let noisy: Vec<usize> = (0..map.len()).filter(|&i| map[i] > 0.0).collect();
    let over_noisy = |of: &dyn Fn(usize) -> f64| (noisy.iter().map(|&i| of(i)).sum::<f64>() / noisy.len() as f64).sqrt();
    let (told, found) = (over_noisy(&|i| map[i].powi(2)), over_noisy(&|i| (values[i] - truth[i]).powi(2)));
    // What is told bounds what is found from above (stratification), and is of its size.
    assert!((0.85..1.25).contains(&(told / f64::from(target))), "{method:?}: {told} told, {target} asked for");
    assert!((0.4..1.1).contains(&(found / told)), "{method:?}: {found} found, {told} told");
    // Rays for the same error: error² times rays. Not samples: dpt takes fewer than asked for where little can change.
    let (adaptive, rays) = mean_of(&|seed| scene.trace(&params(method, 4096, Some(target)), seed), &truth);
    let gain = uniform.powi(2) * uniform_rays / (adaptive.powi(2) * rays);
    println!(
        "{method:?}: {rays:.0} rays ({} samples a pixel), error {adaptive:.4}; everywhere {uniform_rays:.0} rays, error {uniform:.4}; gain {gain:.2}",
        sampling.samples
    );
    assert!(gain > least_gain, "{method:?}: {gain}");
}

#[test]
fn a_target_that_no_number_of_samples_meets_gives_the_picture_of_the_most() {
    let scene = plane_with_two_windows(24, 18);
    for method in ALL {
        for samples in [1, 3, 16, 40] {
            // Everywhere: dpt's own thinning, which leaves pixels without a pilot, is left out.
            let params = |target| TraceParams { everywhere: true, ..params(method, samples, target) };
            let (all, adaptive) = (scene.trace(&params(None), 5), scene.trace(&params(Some(0.0)), 5));
            assert_eq!(values(&all), values(&adaptive), "{method:?}, {samples}");
            // Pixels without noise need no more than the pilot.
            assert!(adaptive.rays <= all.rays && sampling(&adaptive).samples <= samples as f32, "{method:?}, {samples}");
        }
    }
}
