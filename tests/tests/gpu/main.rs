//! GPU twins against the CPU. Without an adapter every test shows as ignored, with the reason; with `PANO_REQUIRE_GPU=1` a
//! missing adapter is a failure. The adapter and the number of tests that ran on it are printed at the end.

mod atrous;
mod bsdf;
mod bvh;
mod captured;
mod composite;
mod context;
mod cross_bilateral;
mod expand;
mod firefly;
mod frames;
mod iprt;
mod lens;
mod light;
mod march;
mod mean;
mod mr360;
mod pipeline;
mod prelude;
mod resample;
mod rt2ar;
mod sequences;
mod settle;
mod sparse;
mod support;
mod temporal;
mod trace;

use libtest_mimic::{Arguments, Trial};
use pano_core::gpu::{Gpu, GpuOptions};
use std::sync::Arc;

/// A test's name and function.
type Test = (&'static str, fn(&Gpu));

/// With this variable set to 1, doing without a GPU is a failure.
const REQUIRED: &str = "PANO_REQUIRE_GPU";

fn main() {
    let arguments = Arguments::from_args();
    let tests: Vec<Test> = [
        context::TESTS,
        prelude::TESTS,
        expand::TESTS,
        composite::TESTS,
        lens::TESTS,
        cross_bilateral::TESTS,
        atrous::TESTS,
        firefly::TESTS,
        mean::TESTS,
        settle::TESTS,
        temporal::TESTS,
        resample::TESTS,
        light::TESTS,
        sparse::TESTS,
        bsdf::TESTS,
        bvh::TESTS,
        march::TESTS,
        trace::TESTS,
        captured::TESTS,
        mr360::TESTS,
        rt2ar::TESTS,
        iprt::TESTS,
        pipeline::TESTS,
        sequences::TESTS,
    ]
    .concat();
    let required = std::env::var(REQUIRED).is_ok_and(|v| v == "1");
    let found = Gpu::new(&GpuOptions::default()).map(Arc::new).map_err(|e| e.to_string());
    let trials = tests.into_iter().map(|(name, test)| match &found {
        Ok(gpu) => {
            let gpu = gpu.clone();
            Trial::test(name, move || {
                test(&gpu);
                // What a test does not wait for must not fail either.
                gpu.check().map_err(|e| e.to_string().into())
            })
        }
        Err(why) if required => {
            let failure = format!("{REQUIRED} is set, and {why}");
            Trial::test(name, move || Err(failure.into()))
        }
        Err(why) => Trial::test(name, || Ok(())).with_kind(why.clone()).with_ignored_flag(true),
    });
    let conclusion = libtest_mimic::run(&arguments, trials.collect());
    if !arguments.list {
        let ran = conclusion.num_passed + conclusion.num_failed;
        match &found {
            Ok(gpu) => println!("{ran} GPU tests ran on {}, driver {}\n", gpu.adapter(), gpu.adapter().driver),
            Err(why) => println!("no GPU test ran: {why}\n"),
        }
    }
    conclusion.exit();
}
