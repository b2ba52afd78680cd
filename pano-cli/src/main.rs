//! The `pano` command.
fn main() {}
