//! What goes to stdout and stderr. A reader that closes its end early (`pano info x | head -1`) is no failure.

use crate::failure::Failure;
use pano_core::Error;
use serde::Serialize;
use std::io::{self, ErrorKind, Write};

/// Prints text to stdout.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            Err(Error::file("stdout", e.to_string(), "check where the output goes").into())
        }
        _ => Ok(()),
    }
}

/// Prints one JSON object to stdout; numbers that are not finite become null.
pub(crate) fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    match serde_json::to_string_pretty(value) {
        Ok(json) => print(&(json + "\n")),
        Err(e) => Err(Error::argument(format!("the result cannot be written as JSON: {e}")).into()),
    }
}

/// Prints one JSON object to stdout, on a line of its own.
pub(crate) fn print_json_line(value: &impl Serialize) -> Result<(), Failure> {
    match serde_json::to_string(value) {
        Ok(json) => print(&(json + "\n")),
        Err(e) => Err(Error::argument(format!("the result cannot be written as JSON: {e}")).into()),
    }
}

/// Prints a line to stderr, if anyone still reads it.
pub(crate) fn message(text: &str) {
    let _ = writeln!(io::stderr(), "{}", text.trim_end_matches('\n'));
}
