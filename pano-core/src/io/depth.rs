//! Depth maps from EXR, PNG and PFM.

use super::source::{Format, Source, read_file};
use super::{exr, ldr, pfm};
use crate::Result;
use crate::camera::Projection;
use crate::depth::{DepthFormat, DepthKind, RayDepth};
use crate::image::Image;
use std::path::Path;

/// Reads a depth map of the declared format, seen by a camera of the given projection.
///
/// - EXR: channel Z, else Y, else R, else a layer's Z, else the only channel. If the file states its depth kind (attribute
///   `pano:depth_kind`), it must be the declared one.
/// - PNG: gray, 8 or 16 bits; the codes are the stored values.
/// - PFM: gray.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if the file is missing, damaged, or holds no depth;
/// [`Error::Argument`](crate::Error::Argument) as [`RayDepth::from_raw`].
pub fn read_depth(path: impl AsRef<Path>, format: &DepthFormat, projection: Projection) -> Result<RayDepth> {
    let path = path.as_ref();
    decode_depth(&read_file(path)?, path, format, projection)
}

/// [`read_depth`] of a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read_depth`].
pub fn decode_depth(bytes: &[u8], name: &Path, format: &DepthFormat, projection: Projection) -> Result<RayDepth> {
    RayDepth::from_raw(stored(&Source::new(name, bytes), format.kind)?, format, projection)
}

/// The stored values of a depth map in memory.
fn stored(source: &Source<'_>, kind: DepthKind) -> Result<Image<f32>> {
    let picture = source.format()?;
    source.guard(|| match picture {
        Format::Exr => exr::read_depth(source, kind),
        Format::Png => png_depth(source),
        Format::Pfm => match pfm::read(source)? {
            pfm::Pfm::Gray(gray) => Ok(gray),
            pfm::Pfm::Color(_) => Err(no_depth(source, "holds colours, not depth")),
        },
        Format::Jpeg | Format::Hdr => Err(no_depth(source, "is in a format that cannot hold depth")),
    })
}

/// Raw codes of a gray PNG.
fn png_depth(source: &Source<'_>) -> Result<Image<f32>> {
    let codes = ldr::png_codes(source)?;
    if codes.channels > 2 || codes.stored_bits < 8 {
        return Err(no_depth(source, "holds colours or fewer than 8 bits, not depth"));
    }
    let values = codes.values.chunks_exact(codes.channels).map(|p| f32::from(p[0])).collect();
    Image::from_vec(codes.width, codes.height, values)
}

/// An error about a file that is a picture but no depth map.
pub(super) fn no_depth(source: &Source<'_>, problem: &str) -> crate::Error {
    source.unsupported(problem, "Give depth as EXR (channel Z), gray PNG with 16 or 8 bits, or gray PFM.")
}
