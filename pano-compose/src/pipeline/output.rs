//! Writes a frame.

use super::{Rendered, Result};
use crate::composite::exr_channels;
use pano_core::image::Image;
use pano_core::io;
use std::path::Path;

/// Writes the composite: all layers to `.exr`; otherwise the composite alone, display-encoded, as the name's extension says.
///
/// # Errors
/// If the file cannot be written or its extension means no format. Nothing half-written is left behind.
pub fn write_output(path: &Path, rendered: &Rendered) -> Result<()> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        let channels = exr_channels(&rendered.composite, &rendered.layers, &rendered.photo)?;
        let channels: Vec<(&str, &Image<f32>)> = channels.iter().map(|(name, image)| (name.as_str(), image)).collect();
        io::write_exr(path, &channels, &[("pano:depth_kind", "ray")])?;
    } else {
        io::write_image(path, &rendered.composite.color, None)?;
    }
    Ok(())
}
