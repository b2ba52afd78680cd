//! Writers of radiance pictures.

use super::exr::{split_channels, write_exr};
use super::source::MAX_SIDE;
use super::{clamp_or_zero, pfm, write_atomically};
use crate::color::linear_to_srgb;
use crate::image::{Image, RadianceImage};
use crate::{Error, Result};
use ::image::codecs::{hdr::HdrEncoder, jpeg::JpegEncoder, png::PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder, Rgb};
use glam::Vec3;
use rayon::prelude::*;
use std::io;
use std::path::Path;

/// File name extensions [`write_image`] knows.
pub const IMAGE_EXTENSIONS: [&str; 6] = ["png", "jpg", "jpeg", "hdr", "pfm", "exr"];

/// JPEG quality used by [`write_image`].
const JPEG_QUALITY: u8 = 95;

/// Writes a picture in the format its name's extension says: `.png` (8 bits, sRGB), `.jpg`/`.jpeg` (sRGB), `.hdr`, `.pfm`,
/// `.exr` (linear). Only PNG and EXR hold `alpha`; the other formats leave it out. The radiance is written as it is given:
/// premultiplied or not is the caller's choice.
///
/// # Errors
/// [`Error::File`] for another extension, or if the file cannot be written; [`Error::Argument`] if the sizes differ.
pub fn write_image(path: impl AsRef<Path>, image: &RadianceImage, alpha: Option<&Image<f32>>) -> Result<()> {
    let path = path.as_ref();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "png" => write_png8(path, image, alpha),
        "jpg" | "jpeg" => write_jpeg(path, image, JPEG_QUALITY),
        "hdr" => write_hdr(path, image),
        "pfm" => write_pfm(path, image),
        "exr" => {
            let [r, g, b] = split_channels(image);
            let mut channels = vec![("R", &r), ("G", &g), ("B", &b)];
            channels.extend(alpha.map(|alpha| ("A", alpha)));
            write_exr(path, &channels, &[])
        }
        _ => {
            let problem = match extension.as_str() {
                "" => "cannot be written: its name has no extension to tell the format by".to_owned(),
                other => format!("cannot be written: .{other} is not a known picture format"),
            };
            let remedy = format!("Use one of .{}.", IMAGE_EXTENSIONS.join(", ."));
            Err(Error::file(path, problem, remedy))
        }
    }
}

/// Writes a PNG with 8 bits a channel, sRGB-encoded and clamped to [0, 1]. A picture loaded from 8 bits gets its codes back.
///
/// # Errors
/// [`Error::File`] if it cannot be written; [`Error::Argument`] if `alpha` has another size.
pub fn write_png8(path: impl AsRef<Path>, image: &RadianceImage, alpha: Option<&Image<f32>>) -> Result<()> {
    let codes = encode(path.as_ref(), image, alpha, 255.0, |code| code as u8)?;
    let color = if alpha.is_some() { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
    write_png(path.as_ref(), &codes, image, color)
}

/// Writes a PNG with 16 bits a channel, sRGB-encoded and clamped to [0, 1]. A picture loaded from 16 bits gets its codes
/// back.
///
/// # Errors
/// [`Error::File`] if it cannot be written; [`Error::Argument`] if `alpha` has another size.
pub fn write_png16(path: impl AsRef<Path>, image: &RadianceImage, alpha: Option<&Image<f32>>) -> Result<()> {
    let codes = encode(path.as_ref(), image, alpha, 65535.0, |code| code as u16)?;
    let color = if alpha.is_some() { ExtendedColorType::Rgba16 } else { ExtendedColorType::Rgb16 };
    write_png(path.as_ref(), bytemuck::cast_slice(&codes), image, color)
}

/// The common end of both depths.
fn write_png(path: &Path, bytes: &[u8], image: &RadianceImage, color: ExtendedColorType) -> Result<()> {
    let (w, h) = (image.width() as u32, image.height() as u32);
    write_atomically(path, |file| PngEncoder::new(file).write_image(bytes, w, h, color).map_err(io::Error::other))
}

/// Writes a JPEG, sRGB-encoded and clamped to [0, 1]; `quality` from 1 (small) to 100 (faithful), clamped.
///
/// # Errors
/// [`Error::File`] if it cannot be written.
pub fn write_jpeg(path: impl AsRef<Path>, image: &RadianceImage, quality: u8) -> Result<()> {
    let codes = encode(path.as_ref(), image, None, 255.0, |code| code as u8)?;
    let (w, h) = (image.width() as u32, image.height() as u32);
    write_atomically(path, |file| {
        let encoder = JpegEncoder::new_with_quality(file, quality.clamp(1, 100));
        encoder.write_image(&codes, w, h, ExtendedColorType::Rgb8).map_err(io::Error::other)
    })
}

/// Writes a Radiance HDR picture (RGBE, 8-bit mantissas: within 1 % of a pixel's largest channel). Negative values and NaN
/// become 0, and 10³⁸ is the largest value.
///
/// # Errors
/// [`Error::File`] if it cannot be written.
pub fn write_hdr(path: impl AsRef<Path>, image: &RadianceImage) -> Result<()> {
    check_side(path.as_ref(), image)?;
    let pixels: Vec<_> = image.data().iter().map(|p| Rgb(p.to_array().map(|x| clamp_or_zero(x, 1e38)))).collect();
    write_atomically(path, |file| HdrEncoder::new(file).encode(&pixels, image.width(), image.height()).map_err(io::Error::other))
}

/// Writes a portable float map: every value as it is.
///
/// # Errors
/// [`Error::File`] if it cannot be written.
pub fn write_pfm(path: impl AsRef<Path>, image: &RadianceImage) -> Result<()> {
    check_side(path.as_ref(), image)?;
    write_atomically(path, |file| pfm::write(file, image))
}

/// sRGB codes from 0 to `max`, interleaved, with alpha (linear) as the fourth channel if there is one.
fn encode<T: Copy + Send + Default>(
    path: &Path,
    image: &RadianceImage,
    alpha: Option<&Image<f32>>,
    max: f32,
    code: impl Fn(f32) -> T + Sync,
) -> Result<Vec<T>> {
    check_side(path, image)?;
    if let Some(alpha) = alpha
        && alpha.size() != image.size()
    {
        return Err(Error::argument(format!("alpha is {:?} pixels, its picture {:?}", alpha.size(), image.size())));
    }
    let channels = if alpha.is_some() { 4 } else { 3 };
    let mut codes = vec![T::default(); image.data().len() * channels];
    codes.par_chunks_mut(channels * image.width()).enumerate().for_each(|(y, row)| {
        for (x, out) in row.chunks_exact_mut(channels).enumerate() {
            let encoded: Vec3 = image.get(x, y).map(linear_to_srgb);
            for (out, value) in out.iter_mut().zip(encoded.to_array()) {
                *out = code((value * max).round());
            }
            if let Some(alpha) = alpha {
                out[3] = code((clamp_or_zero(alpha.get(x, y), 1.0) * max).round());
            }
        }
    });
    Ok(codes)
}

/// Nothing is written that could not be read back.
pub(super) fn check_side<T: Copy>(path: &Path, image: &Image<T>) -> Result<()> {
    let (w, h) = image.size();
    if w <= MAX_SIDE && h <= MAX_SIDE {
        return Ok(());
    }
    let problem = format!("cannot be written: {w}×{h} pixels are more than {MAX_SIDE} a side");
    Err(Error::file(path, problem, "Make the picture smaller."))
}
