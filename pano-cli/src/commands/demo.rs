//! `pano demo`: the main job on a built-in room.

use crate::{failure::Failure, output, progress::Console};
use pano_compose::demo::{self, DemoParams, Numbers, Score};
use pano_compose::pipeline::{self, Folder};
use pano_core::progress::Progress;
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `pano demo`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Folder to write to; it is created
    #[arg(short, long, value_name = "DIR", default_value = "demo")]
    output: PathBuf,
    /// Smaller and noisier pictures, in a fraction of the time
    #[arg(long)]
    quick: bool,
    /// Changes all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Print the numbers as one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let params = if args.quick { DemoParams::quick() } else { DemoParams::full() };
    // What cannot be written is said before the work, not after it.
    let folder = Folder::create(&args.output)?;
    let console = Console::new();
    let demo = demo::run(&DemoParams { seed: args.seed, ..params }, &console)?;
    for row in &demo.numbers.methods {
        row.warnings.iter().for_each(|warning| console.message(&format!("warning: {}: {warning}", row.method)));
    }
    if console.cancelled() {
        return Err(pipeline::Error::Cancelled.into());
    }
    let names = demo.write(&folder)?;
    drop(console);
    let at = |name: &str| folder.path().join(name).display().to_string();
    output::message(&format!("{} files in {}; see {}", names.len(), folder.path().display(), at("contact-sheet.png")));
    output::message(&format!("again, with other settings: pano render {} -o out.exr", at("scene.toml")));
    if args.json { output::print_json(&demo.numbers) } else { output::print(&table(&demo.numbers)) }
}

/// A row a method: cost, then errors of the crop around the objects and of the whole view.
fn table(numbers: &Numbers) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let mut line = |cells: [&str; 12]| {
        let [name, first @ ..] = cells;
        let row = first.iter().fold(format!("{name:8}"), |row, cell| format!("{row} {cell:>8}"));
        writeln!(text, "{}", row.trim_end()).unwrap_or_default();
    };
    line(["", "", "", "", "objects", "", "", "", "view", "", "", ""]);
    line(["", "samples", "time", "Mrays", "SSIM", "PSNR", "FLIP", "relRMSE", "SSIM", "PSNR", "FLIP", "relRMSE"]);
    let mut row = |name: &str, samples: u32, ms: f64, rays: u64, crop: &Score, view: &Score| {
        let cells = |s: &Score| {
            let ssim = s.ssim.map_or("-".to_owned(), |ssim| format!("{ssim:.4}"));
            [ssim, format!("{:.2}", s.psnr), format!("{:.4}", s.flip), format!("{:.4}", s.rel_rmse)]
        };
        let ([a, b, c, d], [e, f, g, h]) = (cells(crop), cells(view));
        let (time, rays) = (format!("{:.2} s", ms / 1e3), format!("{:.1}", rays as f64 / 1e6));
        line([name, &samples.to_string(), &time, &rays, &a, &b, &c, &d, &e, &f, &g, &h]);
    };
    for m in &numbers.methods {
        row(m.method, m.samples, m.ms, m.rays, &m.scores.crop, &m.scores.view);
    }
    // The photo of the empty room against its truth: what no method can be better than.
    row("(photo)", numbers.panorama_samples, numbers.capture.ms, numbers.capture.rays, &numbers.photo.crop, &numbers.photo.view);
    let _ = writeln!(
        text,
        "truth: {:.1} s, {:.1} Mrays; all: {:.1} s",
        numbers.truth.ms / 1e3,
        numbers.truth.rays as f64 / 1e6,
        numbers.total_ms / 1e3
    );
    text
}
