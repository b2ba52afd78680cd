//! The operator on the CPU; rayon over rows.

use pano_core::image::RadianceImage;
use rayon::prelude::*;

/// See [`super::expand`]; sizes are checked there.
pub(super) fn expand(ldr: &RadianceImage, hdr: &mut RadianceImage) {
    let width = ldr.width();
    hdr.data_mut().par_chunks_mut(width).zip(ldr.data().par_chunks(width)).for_each(|(out, row)| {
        for (o, &rgb) in out.iter_mut().zip(row) {
            *o = super::pixel(rgb);
        }
    });
}
