//! The `pano` command: parse, call, print. Exit codes: 0 done, 1 failed, 2 wrong usage.

mod commands;
mod failure;
mod output;
mod processor;
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
    if let Some(feature) = processor::missing() {
        eprintln!("error: this pano was built for processors with {feature}, and this one has none");
        eprintln!("help: build it with RUSTFLAGS=\"-C target-cpu=x86-64\" cargo build --release");
        return ExitCode::FAILURE;
    }
    match Cli::parse().command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::FAILURE
        }
    }
}
