//! Round trips, the odd kinds of every format, and damaged files.

mod exr;
mod formats;
mod malformed;

use crate::image::{Image, RadianceImage};
use glam::Vec3;
use std::path::PathBuf;
use tempfile::TempDir;

/// A name in a folder of its own, which goes away with the first value.
fn place(name: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

/// A picture whose pixels all differ, from 0 to 3.
fn picture(width: usize, height: usize) -> RadianceImage {
    let scale = 3.0 / (width * height) as f32;
    Image::from_fn(width, height, |x, y| Vec3::new(x as f32 * 0.1, y as f32 * 0.07, (y * width + x) as f32 * scale))
}
