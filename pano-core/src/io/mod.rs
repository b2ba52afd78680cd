//! Reading and writing of pictures: EXR, Radiance HDR, PNG, JPEG and PFM.
//!
//! - The format is told by a file's content, not by its name.
//! - [`read_image`] gives linear Rec.709 radiance, finite and ≥ 0; what had to be set to 0 is counted.
//! - [`read_depth`] gives distance along the ray.
//! - `decode_…` does the same for a file in memory.
//! - [`read_exr`] gives every channel as it is stored, [`write_exr`] writes any list of channels.
//! - Writers go through [`write_atomically`]: a failed write leaves nothing behind.
//! - Pictures of more than [`MAX_SIDE`] pixels a side, and files that declare more pixels than they can hold, are refused
//!   before memory is allocated for them.

mod atomic;
mod depth;
mod exr;
mod ldr;
mod pfm;
mod source;
mod write;

pub use atomic::{AtomicFile, write_atomically, write_text};
pub use depth::{decode_depth, read_depth};
pub use exr::{Chromaticities, DEPTH_KIND_ATTRIBUTE, ExrChannels, decode_exr, read_exr, split_channels, write_exr};
pub use source::MAX_SIDE;
pub use write::{IMAGE_EXTENSIONS, write_hdr, write_image, write_jpeg, write_pfm, write_png8, write_png16};

use crate::Result;
use crate::image::{Image, RadianceImage};
use glam::Vec3;
pub(crate) use ldr::{Codes, hdr_pixels, jpeg_codes, png_codes};
use source::read_file;
pub(crate) use source::{Format, Source};
use std::path::Path;

/// How a file stored its colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SourceEncoding {
    /// Linear floating point: EXR, Radiance HDR, PFM.
    LinearFloat,
    /// sRGB with 8 bits a channel: PNG, JPEG.
    Srgb8,
    /// sRGB with 16 bits a channel: PNG.
    Srgb16,
}

/// How many channel values loading had to set to 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sanitized {
    /// Values < 0 (compression rings around a sun; colours outside Rec.709).
    pub negative: usize,
    /// NaN and infinite values.
    pub not_finite: usize,
}

impl Sanitized {
    /// Whether every value was kept.
    pub fn is_clean(&self) -> bool {
        *self == Self::default()
    }
}

/// A picture as loaded.
#[derive(Clone, Debug)]
pub struct LoadedImage {
    /// Linear Rec.709 radiance, finite and ≥ 0.
    pub radiance: RadianceImage,
    /// Opacity in [0, 1], if the file has it. The radiance is as stored: premultiplied in EXR, not so in PNG.
    pub alpha: Option<Image<f32>>,
    /// How the file stored its colours.
    pub encoding: SourceEncoding,
    /// What had to be set to 0.
    pub report: Sanitized,
}

impl LoadedImage {
    /// Sets what is not finite or negative to 0, counting it; opacity is clamped to [0, 1].
    fn new(mut radiance: RadianceImage, mut alpha: Option<Image<f32>>, encoding: SourceEncoding) -> Self {
        let mut report = Sanitized::default();
        for value in radiance.data_mut().iter_mut().flat_map(|p| p.as_mut()) {
            if !value.is_finite() {
                report.not_finite += 1;
                *value = 0.0;
            } else if *value < 0.0 {
                report.negative += 1;
                *value = 0.0;
            }
        }
        for a in alpha.iter_mut().flat_map(|a| a.data_mut()) {
            *a = clamp_or_zero(*a, 1.0);
        }
        Self { radiance, alpha, encoding, report }
    }
}

/// `value` in [0, max]; NaN becomes 0, where `clamp` would keep it.
fn clamp_or_zero(value: f32, max: f32) -> f32 {
    if value > 0.0 { value.min(max) } else { 0.0 }
}

/// Reads a picture.
///
/// - EXR: the channels R, G, B (or Y) and A of the file, else of the first layer that has them; colours with other
///   chromaticities are converted to Rec.709.
/// - PNG and JPEG: sRGB (colour profiles in the file are not looked at), gray spread over the three channels, palettes
///   resolved.
/// - PFM and Radiance HDR: taken as linear Rec.709; PFM's scale and HDR's exposure are not applied.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if the file is missing, truncated, damaged, too large, or no picture.
pub fn read_image(path: impl AsRef<Path>) -> Result<LoadedImage> {
    let path = path.as_ref();
    decode_image(&read_file(path)?, path)
}

/// [`read_image`] of a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read_image`].
pub fn decode_image(bytes: &[u8], name: &Path) -> Result<LoadedImage> {
    let source = &Source::new(name, bytes);
    let format = source.format()?;
    source.guard(|| match format {
        Format::Exr => exr::read_image(source),
        Format::Hdr => ldr::read_hdr(source),
        Format::Png => ldr::read_png(source),
        Format::Jpeg => ldr::read_jpeg(source),
        Format::Pfm => {
            let radiance = match pfm::read(source)? {
                pfm::Pfm::Gray(gray) => gray.map(Vec3::splat),
                pfm::Pfm::Color(color) => color,
            };
            Ok(LoadedImage::new(radiance, None, SourceEncoding::LinearFloat))
        }
    })
}

#[cfg(test)]
mod tests;
