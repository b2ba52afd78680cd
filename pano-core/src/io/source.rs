//! A picture file in memory: what format it is, and whether what it declares can be true.

use crate::{Error, Result, file};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Longest side of a picture that is read or written, in pixels.
pub const MAX_SIDE: usize = 32768;

/// A picture file format, told by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Exr,
    Hdr,
    Png,
    Jpeg,
    Pfm,
}

/// The bytes of the picture file `path`.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>> {
    file::read(path, u64::MAX)
        .map_err(|e| Error::file(path, format!("cannot be read: {e}"), "Check the path and the file's permissions."))
}

/// A whole file, with its name for messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) path: &'a Path,
    pub(crate) bytes: &'a [u8],
    /// Pixels it may declare.
    pub(crate) max_pixels: u64,
}

impl<'a> Source<'a> {
    /// A picture of any size up to [`MAX_SIDE`] a side.
    pub(crate) fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Self { path, bytes, max_pixels: (MAX_SIDE * MAX_SIDE) as u64 }
    }

    /// The format, by content: extensions lie.
    pub(crate) fn format(&self) -> Result<Format> {
        Ok(match self.bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Format::Exr,
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Format::Png,
            [0xff, 0xd8, 0xff, ..] => Format::Jpeg,
            [b'#', b'?', ..] => Format::Hdr,
            [b'P', b'F' | b'f', c, ..] if c.is_ascii_whitespace() => Format::Pfm,
            [] => return Err(self.broken("is empty")),
            _ => {
                let problem = "is not a picture in a known format (EXR, Radiance HDR, PNG, JPEG, PFM)";
                return Err(Error::file(self.path, problem, "Convert it to one of these formats."));
            }
        })
    }

    /// An error about damaged contents.
    pub(crate) fn broken(&self, problem: impl Display) -> Error {
        Error::file(self.path, problem.to_string(), "Check that the file is complete, or export it again.")
    }

    /// An error about contents that are valid but not supported.
    pub(crate) fn unsupported(&self, problem: impl Display, remedy: &str) -> Error {
        Error::file(self.path, problem.to_string(), remedy)
    }

    /// Refuses empty and oversized pictures, and those whose pixels, `bits_per_pixel` each, cannot be in a file of this
    /// length even if every byte of it stands for `ratio` bytes. To be called before anything of that size is allocated.
    pub(crate) fn check_size(&self, width: u64, height: u64, bits_per_pixel: u64, ratio: u64) -> Result<()> {
        if width == 0 || height == 0 {
            return Err(self.broken(format!("declares an empty picture of {width}×{height} pixels")));
        }
        let max = MAX_SIDE as u64;
        if width > max || height > max {
            let problem = format!("declares {width}×{height} pixels; at most {max} a side are supported");
            return Err(self.unsupported(problem, "Scale the picture down."));
        }
        if width * height > self.max_pixels {
            let problem = format!("declares {width}×{height} pixels; at most {} in all are supported", self.max_pixels);
            return Err(self.unsupported(problem, "Scale the picture down."));
        }
        let declared = width * height * bits_per_pixel / 8;
        let possible = (self.bytes.len() as u64).saturating_mul(ratio);
        if declared > possible {
            return Err(
                self.broken(format!("declares {width}×{height} pixels, which its {} bytes cannot hold", self.bytes.len()))
            );
        }
        Ok(())
    }

    /// Runs a decoder, and turns its panic into an error: some decoders assert on damaged input.
    pub(crate) fn guard<T>(&self, decode: impl FnOnce() -> Result<T>) -> Result<T> {
        catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| Err(self.broken("is damaged: its decoder gave up")))
    }
}
