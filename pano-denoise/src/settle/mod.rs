//! Single pixels that stick out, settled before and after the cross-bilateral filter, which keeps edges and would keep them: light is
//! never negative ([`before`], `bounds.rs`), a lone bright or dark pixel is spread over its surface before ([`before`]) and taken back
//! among its neighbours after ([`after`], `strays.rs`). [`filter`] is all of it with the filter in between.

mod bounds;
#[cfg(feature = "gpu")]
pub mod gpu;
mod strays;

use crate::cross_bilateral::{self, Params, Report};
use pano_core::Result;
use pano_core::image::RadianceImage;
use pano_core::layers::TracedLayers;

/// Bounds what the layers of a view that shows `photo` can be, and spreads what sticks out of the change of real surfaces over the
/// surface around. Columns wrap if `wrap`.
///
/// # Panics
/// If the pictures differ in size.
pub fn before(layers: &mut TracedLayers, photo: &RadianceImage, wrap: bool) {
    bounds::leave_no_less_than_black(layers, photo);
    strays::spread_what_sticks_out(layers, photo, wrap);
    bounds::objects_are_not_darker_than_black(layers);
}

/// Takes what the filter had nothing to average with back among its neighbours. Columns wrap if `wrap`.
///
/// # Panics
/// If the pictures differ in size.
pub fn after(layers: &mut TracedLayers, photo: &RadianceImage, wrap: bool) {
    strays::nothing_stands_alone(layers, photo, wrap);
}

/// [`cross_bilateral::filter`] between [`before`] and [`after`], with the report of the filter alone. `photo` is what the view shows
/// without objects.
///
/// # Errors
/// As [`cross_bilateral::filter`]; also if the photo is of another size.
pub fn filter(params: &Params, photo: &RadianceImage, layers: &mut TracedLayers) -> Result<Report> {
    check_sizes(photo, layers)?;
    before(layers, photo, params.wrap);
    let report = cross_bilateral::filter(params, layers)?;
    after(layers, photo, params.wrap);
    Ok(report)
}

/// All pictures that are looked at before the filter are of one size.
fn check_sizes(photo: &RadianceImage, layers: &TracedLayers) -> Result<()> {
    let layer_sizes = [("the object layer", layers.object.size()), ("the delta layer", layers.delta.size())];
    let guides = [("depth", layers.depth.size()), ("normal", layers.normal.size()), ("the photo", photo.size())];
    crate::check_sizes("settling", layers.size(), &[&layer_sizes[..], &guides].concat())
}
