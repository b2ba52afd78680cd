//! What is shown as white, and display-encoded values, for comparing and showing linear pictures.

use glam::Vec3;
use pano_core::{
    color::linear_to_srgb,
    image::{Image, RadianceImage},
};

/// Share of the pixels that stay below white.
const BELOW_WHITE: f64 = 0.985;

/// The radiance that [`BELOW_WHITE`] of the pixels stay below in every channel; 1 for a black picture.
pub(crate) fn white_of(picture: &RadianceImage) -> f32 {
    let mut brightest: Vec<f32> = picture.data().iter().map(|p| p.max_element()).collect();
    let rank = ((brightest.len() - 1) as f64 * BELOW_WHITE) as usize;
    let (_, white, _) = brightest.select_nth_unstable_by(rank, f32::total_cmp);
    if *white > 0.0 { *white } else { 1.0 }
}

/// Linear radiance with `white` at 1.
pub(crate) fn exposed(picture: &RadianceImage, white: f32) -> RadianceImage {
    picture.map(|p| p / white)
}

/// Display-encoded values in [0, 1].
pub(crate) fn encoded(exposed: &RadianceImage) -> Image<Vec3> {
    exposed.map(|p| p.map(linear_to_srgb))
}
