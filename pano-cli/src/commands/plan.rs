//! `pano plan`: what a scene calls for.

use crate::{failure::Failure, output, progress::Console};
use pano_compose::pipeline::{self, Plan, RenderOptions};
use pano_core::scene::Scene;
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `pano plan`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Scene file (TOML)
    scene: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let scene = Scene::load(&args.scene)?;
    let console = Console::new();
    let plan = pipeline::plan(&scene, &RenderOptions::default(), &console)?;
    drop(console);
    if args.json { output::print_json(&plan) } else { output::print(&to_text(&plan)) }
}

fn to_text(plan: &Plan) -> String {
    let mut text = format!("method {}\n\n", plan.method);
    // Writing to a string does not fail.
    for e in &plan.plan {
        let _ = writeln!(text, "{:17} {:3}  {}", e.effect, if e.on { "on" } else { "off" }, e.why);
    }
    text.push('\n');
    for s in &plan.stages {
        let _ = writeln!(text, "{:12} {:>9.1} ms  {}", s.name, s.ms, s.why);
    }
    let _ = writeln!(text, "{:12} {:>9.1} ms  on this machine, estimated", "all", plan.stages.iter().map(|s| s.ms).sum::<f64>());
    text
}
