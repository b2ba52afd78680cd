//! PNG, JPEG and Radiance HDR, through the `image` crate.

use super::source::Source;
use super::{LoadedImage, SourceEncoding};
use crate::Result;
use crate::color::srgb_to_linear;
use crate::image::{Image, RadianceImage};
use ::image::codecs::{hdr::HdrDecoder, jpeg::JpegDecoder, png::PngDecoder};
use ::image::{ColorType, ImageDecoder, ImageError};
use glam::Vec3;
use std::io::Cursor;

/// Bytes that one byte of a zlib stream can stand for, at most (zlib's own documentation: 1032:1).
const ZLIB_RATIO: u64 = 1032;

/// Codes of a picture with 8 or 16 bits a channel, `channels` of them a pixel.
#[derive(Debug)]
pub(crate) struct Codes {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    /// Largest code: 255 or 65535.
    pub(crate) max: u16,
    pub(crate) values: Vec<u16>,
    /// Bits a channel in the file: less than 8 if the codes were spread over 0..=255 while decoding.
    pub(crate) stored_bits: u16,
}

/// Reads a PNG's codes, palettes resolved.
pub(crate) fn png_codes(source: &Source<'_>) -> Result<Codes> {
    let decoder = PngDecoder::new(Cursor::new(source.bytes)).map_err(|e| damaged(source, "PNG", e))?;
    // The header chunk comes first and has a fixed layout. The decoder tells only what it makes of bits and palettes.
    let (Some(&bits), Some(&kind)) = (source.bytes.get(24), source.bytes.get(25)) else {
        return Err(source.broken("is a truncated PNG"));
    };
    let samples = match kind {
        2 => 3,
        4 => 2,
        6 => 4,
        _ => 1,
    };
    let (width, height) = decoder.dimensions();
    source.check_size(width.into(), height.into(), u64::from(bits) * samples, ZLIB_RATIO)?;
    codes(source, "PNG", decoder, bits.into())
}

/// Decodes whatever is in 8 or 16 bits a channel.
fn codes(source: &Source<'_>, format: &str, decoder: impl ImageDecoder, stored_bits: u16) -> Result<Codes> {
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let wide = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => false,
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => true,
        other => return Err(source.unsupported(format!("holds {other:?} pixels"), "Convert it to 8 or 16 bits a channel.")),
    };
    let mut bytes = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(|e| damaged(source, format, e))?;
    let values = if wide {
        bytes.chunks_exact(2).map(|b| u16::from_ne_bytes([b[0], b[1]])).collect()
    } else {
        bytes.iter().map(|&b| b.into()).collect()
    };
    Ok(Codes {
        width: width as usize,
        height: height as usize,
        channels: color.channel_count().into(),
        max: if wide { u16::MAX } else { 255 },
        values,
        stored_bits,
    })
}

/// sRGB codes to linear.
fn linear(codes: &Codes) -> Result<LoadedImage> {
    let max = f32::from(codes.max);
    let table: Vec<f32> = (0..=codes.max).map(|code| srgb_to_linear(f32::from(code) / max)).collect();
    let pixel = |p: &[u16]| {
        let at = |c: usize| table[usize::from(p[c])];
        if p.len() < 3 { Vec3::splat(at(0)) } else { Vec3::new(at(0), at(1), at(2)) }
    };
    let (w, h, channels) = (codes.width, codes.height, codes.channels);
    let radiance = Image::from_vec(w, h, codes.values.chunks_exact(channels).map(pixel).collect())?;
    let alpha = if channels % 2 == 0 {
        let opacity = |p: &[u16]| f32::from(p[channels - 1]) / max;
        Some(Image::from_vec(w, h, codes.values.chunks_exact(channels).map(opacity).collect())?)
    } else {
        None
    };
    let encoding = if codes.max == 255 { SourceEncoding::Srgb8 } else { SourceEncoding::Srgb16 };
    Ok(LoadedImage::new(radiance, alpha, encoding))
}

/// Reads a PNG of any kind.
pub(super) fn read_png(source: &Source<'_>) -> Result<LoadedImage> {
    linear(&png_codes(source)?)
}

/// Reads a JPEG.
pub(super) fn read_jpeg(source: &Source<'_>) -> Result<LoadedImage> {
    linear(&jpeg_codes(source)?)
}

/// Reads a JPEG's codes.
pub(crate) fn jpeg_codes(source: &Source<'_>) -> Result<Codes> {
    // The decoder fills what is missing with gray; a picture without its end is an error here.
    if !jpeg_has_end(source.bytes) {
        return Err(source.broken("is a truncated JPEG: its end marker is missing"));
    }
    let decoder = JpegDecoder::new(Cursor::new(source.bytes)).map_err(|e| damaged(source, "JPEG", e))?;
    let (width, height) = decoder.dimensions();
    // The least a block of 8×8 gray pixels takes is the one bit of its DC code, in a progressive scan: 512 pixels a byte.
    source.check_size(width.into(), height.into(), 8, 512)?;
    codes(source, "JPEG", decoder, 8)
}

/// Whether an end marker (FF D9) follows the first scan's start. In scan data FF is followed by 00 or a restart marker, so
/// FF D9 is no data; a thumbnail's end marker lies in a segment before the scan.
fn jpeg_has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = bytes.get(at..at + 4) {
        match marker {
            // Fill bytes may precede a marker.
            0xff => at += 1,
            0xda => return bytes[at..].windows(2).any(|pair| pair == [0xff, 0xd9]),
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
    false
}

/// Reads a Radiance HDR picture (RGBE).
pub(super) fn read_hdr(source: &Source<'_>) -> Result<LoadedImage> {
    Ok(LoadedImage::new(hdr_pixels(source)?, None, SourceEncoding::LinearFloat))
}

/// Reads a Radiance HDR picture's pixels as they are stored.
pub(crate) fn hdr_pixels(source: &Source<'_>) -> Result<RadianceImage> {
    // XYZE shares the signature and the layout, and would load as wrong colours.
    let head = &source.bytes[..source.bytes.len().min(4096)];
    if head.windows(16).any(|w| w.eq_ignore_ascii_case(b"32-bit_rle_xyze\n")) {
        return Err(source.unsupported("holds XYZ colours (32-bit_rle_xyze)", "Convert it to RGBE or EXR."));
    }
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(source.bytes)).map_err(|e| damaged(source, "HDR", e))?;
    let (width, height) = decoder.dimensions();
    // Run-length coding packs at most 127 pixels of 4 bytes into 4 runs of 2 bytes.
    source.check_size(width.into(), height.into(), 32, 64)?;
    let mut bytes = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(|e| damaged(source, "HDR", e))?;
    let value = |b: &[u8]| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
    let pixel = |p: &[u8]| Vec3::new(value(&p[..4]), value(&p[4..8]), value(&p[8..]));
    Image::from_vec(width as usize, height as usize, bytes.chunks_exact(12).map(pixel).collect())
}

/// The decoder's error as ours.
fn damaged(source: &Source<'_>, format: &str, error: ImageError) -> crate::Error {
    match error {
        ImageError::Unsupported(error) => source.unsupported(
            format!("is a {format} of an unsupported kind: {error}"),
            "Save it with ordinary settings, or convert it to another format.",
        ),
        error => source.broken(format!("is a damaged {format}: {error}")),
    }
}
