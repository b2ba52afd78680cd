//! Time of the estimators at equal samples, by the number of bounces.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use pano_tests::scenes::plane_with_two_windows;
use pano_trace::tracer::{Method, TraceParams};
use std::time::Duration;

fn methods(c: &mut Criterion) {
    let scene = plane_with_two_windows(128, 96);
    let mut group = c.benchmark_group("methods");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    for bounces in [1, 2, 3, 6, 10] {
        for (name, method) in [("dpt", Method::Dpt), ("onepass", Method::OnePass), ("twopass", Method::TwoPass)] {
            let params = TraceParams { method, samples: 8, bounces, ..TraceParams::default() };
            group.bench_function(BenchmarkId::new(name, bounces), |b| b.iter(|| scene.trace(&params, 0)));
        }
    }
    group.finish();
}

criterion_group!(benches, methods);
criterion_main!(benches);
