//! The `pano` command: parse, call, print. Exit codes: 0 done, 1 failed, 2 wrong usage.

mod commands;
mod failure;
mod output;
mod progress;

use clap::Parser;
use std::process::ExitCode;

/// Put virtual objects into 360° pictures.
#[derive(Debug, Parser)]
#[command(name = "pano", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
}

fn main() -> ExitCode {
    match Cli::parse().command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::FAILURE
        }
    }
}
