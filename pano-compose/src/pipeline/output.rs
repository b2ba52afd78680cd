//! Writes a frame.

use super::{Rendered, Result};
use crate::composite::exr_channels;
use pano_core::image::Image;
use pano_core::io::{self, SourceEncoding};
use std::path::Path;

/// Writes the composite: all layers to `.exr`, with irradiance, the `shadow.<light>.V` of each light and `error.V` where the
/// method has them; otherwise the composite alone, display-encoded, as the name's extension says (`.png` with 16 bits a channel if the
/// panorama had them).
///
/// # Errors
/// If the file cannot be written or its extension means no format. Nothing half-written is left behind.
pub fn write_output(path: &Path, rendered: &Rendered) -> Result<()> {
    let extension = |e: &str| path.extension().is_some_and(|x| x.eq_ignore_ascii_case(e));
    if extension("exr") {
        let mut channels = exr_channels(&rendered.composite, &rendered.layers, &rendered.photo)?;
        if let Some(irradiance) = &rendered.irradiance {
            for (layer, image) in [("irradiance_real", &irradiance.real), ("irradiance_mixed", &irradiance.mixed())] {
                for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
                    channels.push((format!("{layer}.{name}"), image.map(|e| e[c])));
                }
            }
        }
        if let Some(error) = &rendered.error {
            channels.push(("error.V".to_owned(), error.clone()));
        }
        for (light, shadow) in rendered.shadows.iter().enumerate() {
            channels.push((format!("shadow.{light}.V"), shadow.clone()));
        }
        let channels: Vec<(&str, &Image<f32>)> = channels.iter().map(|(name, image)| (name.as_str(), image)).collect();
        io::write_exr(path, &channels, &[("pano:depth_kind", "ray")])?;
    } else if extension("png") && rendered.encoding == SourceEncoding::Srgb16 {
        io::write_png16(path, &rendered.composite.color, None)?;
    } else {
        io::write_image(path, &rendered.composite.color, None)?;
    }
    Ok(())
}
