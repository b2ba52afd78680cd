//! RT²AR's soft shadows: all samples everywhere against the adaptive ones (figure 12 of Santos et al. 2012), frame against frame.
//! Printed first: rays, times and their ratios, measured in turn in one run, and what the probes miss; and what the size of meshes and
//! of objects in the picture costs.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Affine3A, Vec3};
use pano_core::builtin::primitives;
use pano_core::material::Material;
use pano_tests::scenes::{LitScene, furnished_table, knot_on_a_table, placed, prepared, table_under_a_lamp};
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

/// Its name, and how it changes the defaults.
type Kind<'a> = (&'a str, &'a dyn Fn(&mut Params<'_>));

fn survey(scene: &LitScene<CapturedWorld>) {
    println!("| samples | shadows | rays | ms | ratio of rays | of times | penumbra missed |");
    println!("|--:|---|--:|--:|--:|--:|--:|");
    let none = (0..RUNS).map(|_| timed(scene, |p| (p.samples, p.shadows) = (PRIMARY, false)));
    let (none, ms) = none.min_by(|a, b| a.1.total_cmp(&b.1)).expect("there are runs");
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
        let mut best: [Option<(Rendered, f64)>; 3] = [const { None }; 3];
        for _ in 0..RUNS {
            for ((_, change), best) in kinds.iter().zip(&mut best) {
                let run = timed(scene, change);
                if best.as_ref().is_none_or(|b| run.1 < b.1) {
                    *best = Some(run);
                }
            }
        }
        let best = best.map(|b| b.expect("there are runs"));
        let (all, all_ms) = &best[0];
        for ((name, _), (rendered, ms)) in kinds.iter().zip(&best) {
            let rays = rendered.traced.rays;
            let (fewer, faster) = (all.traced.rays as f64 / rays as f64, all_ms / ms);
            let missed = 100.0 * missed(all, rendered);
            println!("| {samples} | {name} | {rays} | {ms:.0} | {fewer:.1} | {faster:.1} | {missed:.1} % |");
        }
    }
}

/// The fastest of [`RUNS`] of each scene in turn, with 4 or 16 primary rays a pixel.
fn fastest(scenes: &[LitScene<CapturedWorld>], primary: u32) -> Vec<(Rendered, f64)> {
    let mut runs: Vec<_> =
        (0..RUNS).map(|_| scenes.iter().map(|s| timed(s, |p| p.samples = primary)).collect::<Vec<_>>()).collect();
    let mut best = runs.pop().expect("there are runs");
    for run in runs.into_iter().flat_map(|run| run.into_iter().enumerate()) {
        let (i, run) = run;
        if run.1 < best[i].1 {
            best[i] = run;
        }
    }
    best
}

/// Knots of so many triangles at one place; a ball of one hundredth of the picture, and one that fills it.
fn sizes() {
    let clay = || Material::diffuse(Vec3::new(0.72, 0.34, 0.22));
    let meshes = [(300, 24), (3700, 300)].map(|(along, around)| primitives::torus_knot(2, 3, 0.12, 0.035, along, around));
    let triangles = meshes.each_ref().map(|mesh| mesh.triangles.len());
    let place = Affine3A::from_translation(Vec3::new(0.0, 0.87, -1.2));
    let knots = meshes.map(|mesh| table_under_a_lamp(&[placed(&prepared(mesh), place, clay())], 320, 240));
    println!("| triangles | rays | ms |\n|--:|--:|--:|");
    for (triangles, (rendered, ms)) in triangles.iter().zip(fastest(&knots, PRIMARY)) {
        println!("| {triangles} | {} | {ms:.0} |", rendered.traced.rays);
    }
    let balls = [(0.075, Vec3::new(0.0, 0.775, -1.2)), (0.75, Vec3::new(0.0, 0.75, -1.2))].map(|(radius, at)| {
        let ball = placed(&prepared(primitives::icosphere(radius, 5)), Affine3A::from_translation(at), clay());
        table_under_a_lamp(&[ball], 320, 240)
    });
    println!("| share of the picture | rays | ms |\n|--:|--:|--:|");
    for (rendered, ms) in fastest(&balls, 16) {
        let coverage = rendered.traced.layers.coverage.data();
        let share = 100.0 * coverage.iter().sum::<f32>() / coverage.len() as f32;
        println!("| {share:.1} % | {} | {ms:.0} |", rendered.traced.rays);
    }
}

fn shadows(c: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("nothing has run in parallel yet");
    rayon::scope(|_| sizes());
    let scene = knot_on_a_table(400, 300);
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
