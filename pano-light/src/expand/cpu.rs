//! The operator on the CPU; rayon over rows.

use super::factor;
use glam::Vec3;
use pano_core::image::RadianceImage;
use rayon::prelude::*;

/// See [`super::expand`]; sizes are checked there.
pub(super) fn expand(ldr: &RadianceImage, hdr: &mut RadianceImage) {
    let width = ldr.width();
    hdr.data_mut().par_chunks_mut(width).zip(ldr.data().par_chunks(width)).for_each(|(out, row)| {
        for (o, &rgb) in out.iter_mut().zip(row) {
            // `f32::clamp` would let NaN through.
            let rgb = Vec3::from_array(rgb.to_array().map(|c| if c > 0.0 { c.min(1.0) } else { 0.0 }));
            *o = rgb * factor(rgb);
        }
    });
}
