//! The channels of a layered picture.

use super::{Composite, check_sizes};
use glam::Vec3;
use pano_core::Result;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;

/// The channels of the layered OpenEXR picture, by name, in this order: composite `R G B A` (A is 1: the photo fills the
/// frame), `object.R/G/B/A`, `delta.R/G/B`, `multiplier.R/G/B`, `photo.R/G/B`, `Z` (distance along the ray in metres,
/// infinite where nothing is), `normal.X/Y/Z`, `albedo.R/G/B`.
///
/// # Errors
/// [`pano_core::Error::Argument`] if the pictures differ in size.
pub fn exr_channels(composite: &Composite, layers: &TracedLayers, photo: &RadianceImage) -> Result<Vec<(String, Image<f32>)>> {
    check_sizes(photo, layers, composite)?;
    let (width, height) = photo.size();
    let mut channels = Vec::with_capacity(24);
    let mut add = |prefix: &str, names: [&str; 3], image: &Image<Vec3>| {
        for (c, name) in names.into_iter().enumerate() {
            channels.push((format!("{prefix}{name}"), image.map(|p| p[c])));
        }
    };
    let rgb = ["R", "G", "B"];
    add("", rgb, &composite.color);
    add("object.", rgb, &layers.object);
    add("delta.", rgb, &layers.delta);
    add("multiplier.", rgb, &composite.multiplier);
    add("photo.", rgb, photo);
    add("normal.", ["X", "Y", "Z"], &layers.normal);
    add("albedo.", rgb, &layers.albedo);
    channels.insert(3, ("A".to_owned(), Image::filled(width, height, 1.0)));
    channels.insert(7, ("object.A".to_owned(), layers.coverage.clone()));
    channels.insert(17, ("Z".to_owned(), layers.depth.clone()));
    Ok(channels)
}
