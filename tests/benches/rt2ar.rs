//! RT²AR's soft shadows: all samples everywhere against the adaptive ones (figure 12 of Santos et al. 2012), frame against frame.
//! Printed first: rays, times and their ratios, measured in turn in one run, and what the probes miss; and what the size of meshes and
//! of objects in the picture costs.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Affine3A, Vec3};
use pano_core::builtin::primitives;
use pano_tests::scenes::{LitScene, clay, furnished_table, knot_on_a_table, placed, prepared, table_under_a_lamp};
use pano_trace::rt2ar::{Params, Rendered, Shadow};
use pano_trace::world::CapturedWorld;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Primary rays a pixel.
const PRIMARY: u32 = 4;
/// Frames of each kind; the fastest counts, which others on the machine disturb least.
const RUNS: usize = 3;

fn adaptive(params: &mut Params<'_>, samples: u32) {
    (params.samples, params.shadow_samples, params.shadow) = (PRIMARY, samples, Shadow::Adaptive);
}

fn soft(params: &mut Params<'_>, samples: u32) {
    (params.samples, params.shadow_samples, params.shadow) = (PRIMARY, samples, Shadow::Soft);
}

/// Share of the penumbra's pixels that `some` does not know.
fn missed(all: &Rendered, some: &Rendered) -> f64 {
    let penumbra = all.penumbra.data().iter().filter(|p| **p).count();
    let lost = all.penumbra.data().iter().zip(some.penumbra.data()).filter(|(a, s)| **a && !**s).count();
    lost as f64 / penumbra.max(1) as f64
}

/// Milliseconds that this thread has had a processor, as Linux counts them; elsewhere those that have passed.
fn clock() -> f64 {
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    let counted = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = counted.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| BEGIN.elapsed().as_secs_f64() * 1e3, |ns| ns * 1e-6)
}

/// The frame and its time in milliseconds.
fn timed(scene: &LitScene<CapturedWorld>, change: impl Fn(&mut Params<'_>)) -> (Rendered, f64) {
    let begin = clock();
    let rendered = scene.trace(change);
    (rendered, clock() - begin)
}

/// The fastest of [`RUNS`] of each of N frames, in turn.
fn fastest<const N: usize>(frame: impl Fn(usize) -> (Rendered, f64)) -> [(Rendered, f64); N] {
    let mut best = std::array::from_fn(&frame);
    for _ in 1..RUNS {
        for (i, best) in best.iter_mut().enumerate() {
            let again = frame(i);
            if again.1 < best.1 {
                *best = again;
            }
        }
    }
    best
}

/// Its name, and how it changes the defaults.
type Kind<'a> = (&'a str, &'a dyn Fn(&mut Params<'_>));

fn survey(scene: &LitScene<CapturedWorld>) {
    println!("| samples | shadows | rays | ms | ratio of rays | of times | penumbra missed |");
    println!("|--:|---|--:|--:|--:|--:|--:|");
    let [(none, ms)] = fastest(|_| timed(scene, |p| (p.samples, p.shadows) = (PRIMARY, false)));
    println!("| | none | {} | {ms:.0} | | | |", none.traced.rays);
    for samples in [20, 50] {
        let kinds: [Kind<'_>; 3] = [
            ("all everywhere", &|p| soft(p, samples)),
            ("five probes", &|p| {
                adaptive(p, samples);
                p.spread = false;
            }),
            ("and neighbours", &|p| adaptive(p, samples)),
        ];
        let best: [_; 3] = fastest(|i| timed(scene, kinds[i].1));
        let (all, all_ms) = &best[0];
        for ((name, _), (rendered, ms)) in kinds.iter().zip(&best) {
            let rays = rendered.traced.rays;
            let (fewer, faster) = (all.traced.rays as f64 / rays as f64, all_ms / ms);
            let missed = 100.0 * missed(all, rendered);
            println!("| {samples} | {name} | {rays} | {ms:.0} | {fewer:.1} | {faster:.1} | {missed:.1} % |");
        }
    }
}

/// Knots of so many triangles at one place; a ball of one hundredth of the picture, and one that fills it.
fn sizes() {
    let parts = [(300, 24), (3700, 300)];
    let knots = parts.map(|parts| knot_on_a_table(parts, 320, 240));
    println!("| triangles | rays | ms |\n|--:|--:|--:|");
    let runs: [_; 2] = fastest(|i| timed(&knots[i], |p| p.samples = PRIMARY));
    for ((along, around), (rendered, ms)) in parts.iter().zip(runs) {
        println!("| {} | {} | {ms:.0} |", 2 * along * around, rendered.traced.rays);
    }
    let balls = [(0.075, Vec3::new(0.0, 0.775, -1.2)), (0.75, Vec3::new(0.0, 0.75, -1.2))].map(|(radius, at)| {
        let ball = placed(&prepared(primitives::icosphere(radius, 5)), Affine3A::from_translation(at), clay());
        table_under_a_lamp(&[ball], 320, 240)
    });
    println!("| share of the picture | rays | ms |\n|--:|--:|--:|");
    let runs: [_; 2] = fastest(|i| timed(&balls[i], |p| p.samples = 16));
    for (rendered, ms) in runs {
        let coverage = rendered.traced.layers.coverage.data();
        let share = 100.0 * coverage.iter().sum::<f32>() / coverage.len() as f32;
        println!("| {share:.1} % | {} | {ms:.0} |", rendered.traced.rays);
    }
}

fn shadows(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nothing has run in parallel yet");
    rayon::scope(|_| sizes());
    let scene = knot_on_a_table((300, 24), 400, 300);
    for (name, scene) in [("a knot on a table", &scene), ("four objects", &furnished_table(400, 300))] {
        println!("{name}");
        rayon::scope(|_| survey(scene));
    }
    let mut group = c.benchmark_group("rt2ar");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    for samples in [20, 50] {
        group.bench_function(BenchmarkId::new("all samples", samples), |b| b.iter(|| scene.trace(|p| soft(p, samples))));
        group.bench_function(BenchmarkId::new("adaptive", samples), |b| b.iter(|| scene.trace(|p| adaptive(p, samples))));
    }
    group.finish();
}

criterion_group!(benches, shadows);
criterion_main!(benches);
