//! `pano expand`: inverse tone mapping.

use crate::{failure::Failure, output};
use pano_core::{
    Error,
    io::{self, SourceEncoding},
};
use pano_light::expand;
use std::path::PathBuf;

/// Extensions of formats that hold values above 1.
const HDR_EXTENSIONS: [&str; 3] = ["exr", "hdr", "pfm"];

/// Arguments of `pano expand`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Every pixel's linear colour is multiplied by 10·Y¹⁰ + 1.8, Y being its luminance: white becomes 11.8, \
and what is not bright keeps its proportions.")]
pub(crate) struct Args {
    /// Picture of low dynamic range: PNG or JPEG
    ldr: PathBuf,
    /// Picture to write: .exr, .hdr or .pfm
    #[arg(short, long, value_name = "HDR")]
    output: PathBuf,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let extension = args.output.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if !HDR_EXTENSIONS.contains(&extension.as_str()) {
        let remedy = format!("end it in one of: .{}", HDR_EXTENSIONS.join(", ."));
        return Err(Error::file(&args.output, "its format would clip what is brighter than white", remedy).into());
    }
    let mut picture = io::read_image(&args.ldr)?;
    if picture.encoding == SourceEncoding::LinearFloat {
        let problem = "holds linear values, which need no inverse tone mapping";
        return Err(Error::file(&args.ldr, problem, "give a PNG or JPEG picture").into());
    }
    let ldr = picture.radiance;
    picture.radiance = ldr.clone();
    expand::expand(&ldr, &mut picture.radiance)?;
    io::write_image(&args.output, &picture.radiance, picture.alpha.as_ref())?;
    output::message(&format!("{}: radiance from 0 to 11.8, at most", args.output.display()));
    Ok(())
}
