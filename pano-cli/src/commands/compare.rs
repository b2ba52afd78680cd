//! `pano compare`: the metrics of two pictures.

use crate::{failure::Failure, output};
use pano_core::{
    Error,
    color::linear_to_srgb,
    image::Image,
    io::{LoadedImage, SourceEncoding, read_image},
    metrics::{self, Mask},
};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `pano compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "PNG and JPEG are compared as they are encoded. EXR, HDR and PFM are divided by --white, clamped \
to [0, 1] and sRGB-encoded; rel_rmse takes linear values, divided by --white, with B as the reference. In JSON, psnr and \
ws_psnr are null for identical pictures (infinite), ssim is null for pictures smaller than 11×11.")]
pub(crate) struct Args {
    /// First picture
    a: PathBuf,
    /// Second picture, the reference
    b: PathBuf,
    /// Picture of the same size; only pixels that are not black in it count
    #[arg(long, value_name = "M")]
    mask: Option<PathBuf>,
    /// Radiance shown as white, in EXR, HDR and PFM
    #[arg(long, value_name = "W", default_value = "1", value_parser = parse_white)]
    white: f32,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// The metrics, named as in JSON.
#[derive(Debug, Serialize)]
struct Comparison {
    mse: f64,
    psnr: f64,
    ssim: Option<f64>,
    flip: f64,
    ws_psnr: f64,
    rel_rmse: f64,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (a, b) = (load(&args.a)?, load(&args.b)?);
    let mask = args.mask.as_deref().map(load_mask).transpose()?;
    check_sizes(args, &a, &b, mask.as_ref())?;
    let mask = mask.as_ref();
    let (ea, eb) = (encoded(&a, args.white), encoded(&b, args.white));
    let (la, lb) = (linear(&a, args.white), linear(&b, args.white));
    let result = Comparison {
        mse: metrics::mse(&ea, &eb, mask)?,
        psnr: metrics::psnr(&ea, &eb, mask)?,
        ssim: metrics::ssim(&ea, &eb, mask)?,
        flip: metrics::flip(&ea, &eb, mask)?,
        ws_psnr: metrics::ws_psnr(&ea, &eb, mask)?,
        rel_rmse: metrics::rel_rmse(&la, &lb, mask)?,
    };
    if args.json { output::print_json(&result) } else { output::print(&result.to_text()) }
}

impl Comparison {
    fn to_text(&self) -> String {
        let Self { mse, psnr, flip, ws_psnr, rel_rmse, .. } = self;
        let ssim = self.ssim.map_or("none: smaller than 11×11".into(), |s| format!("{s:.6}"));
        format!(
            "mse       {mse:.6e}\npsnr      {psnr:.3} dB\nssim      {ssim}\nflip      {flip:.6}\nws_psnr   {ws_psnr:.3} dB\nrel_rmse  {rel_rmse:.6}\n"
        )
    }
}

fn parse_white(text: &str) -> Result<f32, String> {
    let white: f32 = text.parse().map_err(|_| "not a number".to_owned())?;
    if white.is_finite() && white > 0.0 { Ok(white) } else { Err("must be finite and above 0".into()) }
}

fn load(path: &Path) -> Result<LoadedImage, Failure> {
    let image = read_image(path)?;
    let report = image.report;
    if !report.is_clean() {
        output::message(&format!(
            "warning: {}: {} negative and {} NaN or infinite values are taken as 0",
            path.display(),
            report.negative,
            report.not_finite
        ));
    }
    Ok(image)
}

fn load_mask(path: &Path) -> Result<Mask, Failure> {
    let mask = read_image(path)?.radiance.map(|p| p.max_element() > 0.0);
    if !mask.data().contains(&true) {
        return Err(Error::file(path, "the mask is all black, so that no pixel counts", "paint what counts white").into());
    }
    Ok(mask)
}

/// Unequal sizes are an error about the file that is unlike A.
fn check_sizes(args: &Args, a: &LoadedImage, b: &LoadedImage, mask: Option<&Mask>) -> Result<(), Failure> {
    let (w, h) = a.radiance.size();
    let others = [Some((&args.b, b.radiance.size())), args.mask.as_ref().zip(mask.map(Image::size))];
    match others.into_iter().flatten().find(|(_, size)| *size != (w, h)) {
        None => Ok(()),
        Some((path, (ow, oh))) => {
            let problem = format!("is {ow}×{oh} pixels, but {} is {w}×{h}", args.a.display());
            Err(Error::file(path, problem, "compare pictures of equal size").into())
        }
    }
}

/// Display-encoded values in [0, 1]: the stored codes of LDR pictures, exactly.
fn encoded(image: &LoadedImage, white: f32) -> Image<glam::Vec3> {
    let codes = match image.encoding {
        SourceEncoding::Srgb8 => 255.0,
        SourceEncoding::Srgb16 => 65535.0,
        SourceEncoding::LinearFloat => return image.radiance.map(|p| (p / white).map(linear_to_srgb)),
    };
    image.radiance.map(|p| (p.map(linear_to_srgb) * codes).round() / codes)
}

/// Linear values in units of white.
fn linear(image: &LoadedImage, white: f32) -> Image<glam::Vec3> {
    match image.encoding {
        SourceEncoding::LinearFloat => image.radiance.map(|p| p / white),
        SourceEncoding::Srgb8 | SourceEncoding::Srgb16 => image.radiance.clone(),
    }
}
