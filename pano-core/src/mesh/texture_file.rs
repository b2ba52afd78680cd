//! Texture pictures: PNG, JPEG and Radiance HDR to linear RGBA.

use super::Files;
use crate::color::srgb_to_linear;
use crate::image::Image;
use crate::io::{self, Codes, Format, Source};
use crate::{Error, Result};
use glam::Vec4;
use std::path::Path;

/// What a texture's numbers mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Encoding {
    /// sRGB-encoded colour; becomes linear. Alpha is linear already.
    Color,
    /// Plain numbers (roughness, normals); become code / largest code.
    Data,
}

/// Pixels a texture may have: 16 bytes each once decoded.
const MAX_PIXELS: u64 = 1 << 26;

/// Reads the texture `file`, which the mesh `path` names, through `files`.
pub(super) fn read(path: &Path, file: &Path, files: &Files<'_>, encoding: Encoding) -> Result<Image<Vec4>> {
    let bytes = files(file).map_err(|e| {
        Error::file(
            path,
            format!("its texture {} cannot be read: {e}", file.display()),
            "Put the texture where the mesh expects it, or take it out of the material.",
        )
    })?;
    decode(&bytes, encoding).map_err(|problem| {
        Error::file(path, format!("its texture {} {problem}", file.display()), "Save the texture as PNG or JPEG.")
    })
}

/// Decodes a picture held in memory; the error continues the sentence "the texture …".
pub(super) fn decode(bytes: &[u8], encoding: Encoding) -> Result<Image<Vec4>, String> {
    let source = Source { max_pixels: MAX_PIXELS, ..Source::new(Path::new(""), bytes) };
    pixels(&source, encoding).map_err(|e| match e {
        Error::File { problem, .. } => problem,
        other => other.to_string(),
    })
}

fn pixels(source: &Source<'_>, encoding: Encoding) -> Result<Image<Vec4>> {
    let format = source.format()?;
    source.guard(|| match format {
        Format::Png => rgba(&io::png_codes(source)?, encoding),
        Format::Jpeg => rgba(&io::jpeg_codes(source)?, encoding),
        Format::Hdr => {
            let finite = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
            Ok(io::hdr_pixels(source)?.map(|p| p.map(finite).extend(1.0)))
        }
        Format::Exr | Format::Pfm => Err(source.unsupported("is neither PNG nor JPEG nor Radiance HDR", "Convert it to PNG.")),
    })
}

/// Codes as linear RGBA, gray spread over the colours, opaque where the file does not say.
fn rgba(codes: &Codes, encoding: Encoding) -> Result<Image<Vec4>> {
    let max = f32::from(codes.max);
    let curve = |v: f32| if encoding == Encoding::Color { srgb_to_linear(v) } else { v };
    let table: Vec<f32> = (0..=codes.max).map(|code| curve(f32::from(code) / max)).collect();
    let pixel = |p: &[u16]| {
        let color = |c: usize| table[usize::from(p[c])];
        let alpha = |c: usize| f32::from(p[c]) / max;
        match p.len() {
            1 => Vec4::new(color(0), color(0), color(0), 1.0),
            2 => Vec4::new(color(0), color(0), color(0), alpha(1)),
            3 => Vec4::new(color(0), color(1), color(2), 1.0),
            _ => Vec4::new(color(0), color(1), color(2), alpha(3)),
        }
    };
    Image::from_vec(codes.width, codes.height, codes.values.chunks_exact(codes.channels).map(pixel).collect())
}
