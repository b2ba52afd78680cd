//! Time of the estimators at equal samples, by the number of bounces; and, printed first, what those samples are worth:
//! rays, variance, and efficiency.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::Vec3;
use pano_core::image::Image;
use pano_tests::scenes::{TestScene, plane_with_two_windows};
use pano_trace::tracer::{Method, TraceParams, Traced};
use pano_trace::world::ProxyWorld;
use std::time::{Duration, Instant};

const BOUNCES: [u32; 5] = [1, 2, 3, 6, 10];
const METHODS: [(&str, Method); 3] = [("dpt", Method::Dpt), ("onepass", Method::OnePass), ("twopass", Method::TwoPass)];

fn params(method: Method, bounces: u32) -> TraceParams {
    TraceParams { method, samples: 8, bounces, ..TraceParams::default() }
}

/// Mean over pixels and colours of the variance between repetitions.
fn variance<'a>(runs: &'a [Traced], layer: impl Fn(&'a Traced) -> &'a Image<Vec3>) -> f64 {
    let (n, pixels) = (runs.len() as f64, layer(&runs[0]).data().len());
    let of_pixel = |i: usize| {
        let mean = runs.iter().map(|r| layer(r).data()[i].as_dvec3()).sum::<glam::DVec3>() / n;
        runs.iter().map(|r| (layer(r).data()[i].as_dvec3() - mean).length_squared()).sum::<f64>() / (3.0 * (n - 1.0))
    };
    (0..pixels).map(of_pixel).sum::<f64>() / pixels as f64
}

/// Efficiency is 1/(variance · time), given relative to one-pass at the same number of bounces.
fn survey(scene: &TestScene<ProxyWorld>) {
    println!("| bounces | method | ms | rays a sample | variance of delta | of objects | efficiency on delta | on objects |");
    println!("|--:|---|--:|--:|--:|--:|--:|--:|");
    for bounces in BOUNCES {
        let rows = METHODS.map(|(name, method)| {
            let mut times = Vec::new();
            let runs: Vec<Traced> = (0..8)
                .map(|seed| {
                    let begin = Instant::now();
                    let traced = scene.trace(&params(method, bounces), seed);
                    times.push(begin.elapsed().as_secs_f64() * 1e3);
                    traced
                })
                .collect();
            times.sort_by(f64::total_cmp);
            let samples = (scene.camera.width * scene.camera.height) as f64 * 8.0;
            let rays = runs[0].rays as f64 / samples;
            (name, times[times.len() / 2], rays, variance(&runs, |r| &r.layers.delta), variance(&runs, |r| &r.layers.object))
        });
        let one = rows[1];
        for (name, ms, rays, delta, object) in rows {
            println!(
                "| {bounces} | {name} | {ms:.0} | {rays:.2} | {delta:.2e} | {object:.2e} | {:.1} | {:.2} |",
                one.3 * one.1 / (delta * ms),
                one.4 * one.1 / (object * ms)
            );
        }
    }
}

fn methods(c: &mut Criterion) {
    let scene = plane_with_two_windows(128, 96);
    survey(&scene);
    let mut group = c.benchmark_group("methods");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    for bounces in BOUNCES {
        for (name, method) in METHODS {
            group.bench_function(BenchmarkId::new(name, bounces), |b| b.iter(|| scene.trace(&params(method, bounces), 0)));
        }
    }
    group.finish();
}

criterion_group!(benches, methods);
criterion_main!(benches);
