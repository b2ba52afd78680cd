//! `pano tradeoff`: what accuracy costs in time.

use crate::{failure::Failure, output, progress::Console};
use pano_compose::pipeline::Folder;
use pano_compose::tradeoff::{self, BUDGETS_MS, COMBINATION, Row, TradeoffParams, Verdict, affordable, front};
use pano_core::{Error, io::read_image, scene::Scene};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `pano tradeoff`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Scene file (TOML)
    scene: PathBuf,
    /// Folder for tables, charts and the page; a second run goes on with what is there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The true picture of the view, if it is known; left out: a converged run of our own
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Fewer samples and repeats: a first look
    #[arg(long)]
    quick: bool,
    /// Changes all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Print what to choose as one JSON object instead of a table
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report<'a> {
    truth: &'a str,
    truth_error: Option<f64>,
    choices: Vec<BudgetChoice<'a>>,
    front: &'a [&'a Row],
    default: &'a Row,
    default_beaten_by: Option<&'a Row>,
    rising: &'a [String],
    untouched: f64,
}

#[derive(Debug, Serialize)]
struct BudgetChoice<'a> {
    budget_ms: f64,
    choice: Option<&'a Row>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let scene = Scene::load(&args.scene)?;
    let text = std::fs::read_to_string(&args.scene)
        .map_err(|e| Error::file(&args.scene, e.to_string(), "check the path and its permissions"))?;
    let truth = args.truth.as_ref().map(|path| read_image(path).map(|image| image.radiance)).transpose()?;
    let params =
        TradeoffParams { truth, seed: args.seed, ..if args.quick { TradeoffParams::quick() } else { TradeoffParams::full() } };
    let folder = Folder::create(&args.output)?;
    let console = Console::new();
    let found = tradeoff::run(&scene, &text, &params, &folder, &console)?;
    drop(console);
    let combined: Vec<Row> = found.rows.into_iter().filter(|r| r.series == COMBINATION).collect();
    let front = front(&combined);
    output::message(&format!("see {}", folder.path().join("index.html").display()));
    if args.json {
        let choices = BUDGETS_MS.iter().map(|&ms| BudgetChoice { budget_ms: ms, choice: affordable(&front, ms) }).collect();
        let Verdict { default, beaten_by, rising, untouched } = &found.verdict;
        return output::print_json(&Report {
            truth: &found.truth.origin,
            truth_error: found.truth.error,
            choices,
            front: &front,
            default,
            default_beaten_by: beaten_by.as_ref(),
            rising,
            untouched: *untouched,
        });
    }
    let sure = found.truth.error.map_or(String::new(), |e| format!(", own error {e:.4}"));
    let mut lines = format!("truth: {}{sure}\n", found.truth.origin);
    for ms in BUDGETS_MS {
        lines += &match affordable(&front, ms) {
            Some(row) => format!("{ms:>6} ms  {:>9.1} ms  error {:.4}  {}\n", row.ms, row.error, row.arguments),
            None => format!("{ms:>6} ms  nothing is this fast here\n"),
        };
    }
    lines += &format!("{}\n", found.verdict);
    output::print(&lines)
}
