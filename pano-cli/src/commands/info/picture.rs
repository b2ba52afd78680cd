//! What a panorama holds.

use super::{Content, FileInfo, percent};
use pano_core::{
    Result,
    io::{LoadedImage, SourceEncoding, read_image},
    metrics::LuminanceStats,
};
use serde::Serialize;
use std::path::Path;

/// Share of clipped pixels from which lights are likely to be lost.
const CLIPPED: f64 = 1e-3;

/// A picture.
#[derive(Debug, Serialize)]
pub(super) struct PictureInfo {
    width: usize,
    height: usize,
    /// Is it 2:1, as a whole sphere is?
    pub(super) equirectangular: bool,
    /// `linear`, `srgb8` or `srgb16`.
    encoding: &'static str,
    luminance: Luminance,
    /// Share of pixels of an LDR picture with a channel at its largest value.
    clipped_share: Option<f64>,
    /// Values below 0 in the file.
    negative: usize,
    /// NaN and infinite values in the file.
    not_finite: usize,
}

/// Linear Rec.709 luminance.
#[derive(Debug, Serialize)]
struct Luminance {
    min: f32,
    max: f32,
    mean: f64,
    median: f32,
    black_share: f64,
    dynamic_range_stops: f64,
}

/// Reads a picture and lists its problems.
pub(super) fn inspect(path: &Path) -> Result<FileInfo> {
    let image = read_image(path)?;
    let info = PictureInfo::of(&image);
    let problems = info.problems();
    Ok(FileInfo { path: path.to_owned(), content: Content::Panorama(info), problems })
}

impl PictureInfo {
    fn of(image: &LoadedImage) -> Self {
        let (width, height) = image.radiance.size();
        let LuminanceStats { min, max, mean, median, black_share, dynamic_range_stops } = LuminanceStats::of(&image.radiance);
        let encoding = match image.encoding {
            SourceEncoding::LinearFloat => "linear",
            SourceEncoding::Srgb8 => "srgb8",
            SourceEncoding::Srgb16 => "srgb16",
        };
        let clipped = || image.radiance.data().iter().filter(|p| p.max_element() >= 1.0).count();
        let share = |n: usize| n as f64 / (width * height) as f64;
        Self {
            width,
            height,
            equirectangular: width == 2 * height,
            encoding,
            luminance: Luminance { min, max, mean, median, black_share, dynamic_range_stops },
            clipped_share: (image.encoding != SourceEncoding::LinearFloat).then(|| share(clipped())),
            negative: image.report.negative,
            not_finite: image.report.not_finite,
        }
    }

    fn problems(&self) -> Vec<String> {
        let mut problems = vec![];
        if !self.equirectangular {
            problems.push(format!("is {}×{}, not twice as wide as high: no whole panorama", self.width, self.height));
        }
        if self.negative > 0 {
            problems.push(format!("{} values are negative and are taken as 0", self.negative));
        }
        if self.not_finite > 0 {
            problems.push(format!("{} values are NaN or infinite and are taken as 0", self.not_finite));
        }
        if self.luminance.max <= 0.0 {
            problems.push("is black: it gives no light".into());
        } else if self.encoding == "linear" && self.luminance.max <= 1.0 {
            problems.push("no luminance is above 1: probably not the full range of an HDR capture".into());
        }
        if let Some(share) = self.clipped_share.filter(|share| *share > CLIPPED) {
            let lost = "lights are darker than they were (`pano expand` estimates them)";
            problems.push(format!("{} of the pixels are clipped: {lost}", percent(share)));
        }
        problems
    }

    /// For the text output.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let l = &self.luminance;
        let shape = if self.equirectangular { "2:1" } else { "not 2:1" };
        let mut facts = vec![
            ("size", format!("{}×{} ({shape}), {}", self.width, self.height, self.encoding)),
            ("luminance", format!("{:.4e} to {:.4e}, mean {:.4e}, median {:.4e}", l.min, l.max, l.mean, l.median)),
            ("range", format!("{:.1} stops, {} of the pixels are black", l.dynamic_range_stops, percent(l.black_share))),
        ];
        facts.extend(self.clipped_share.map(|share| ("clipped", format!("{} of the pixels", percent(share)))));
        facts
    }
}
