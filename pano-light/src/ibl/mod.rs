//! Stage: image-based lighting from one frame, without precomputation (MR360, section 3.1).
//!
//! A tiny map of 32×16 pixels holds diffuse light by normal, four more hold what lobes of roughness ¼, ½, ¾ and 1 see. Each
//! pixel is a mean of 36 lookups in a pyramid of the panorama: 18 inside the primary lobe, 18 outside it. Here the primary
//! lobe is the cone that half of the lobe's light comes from; both parts are cut into three rings of six sectors with equal
//! shares, and a lookup reads the level whose pixels are as large as its sector. The paper leaves these to its reference
//! (Iorns & Rhee 2016).
//!
//! [`exact`] integrates over every pixel instead, [`sh9`] is the classic cheaper path for diffuse light (Ramamoorthi &
//! Hanrahan 2001), and [`median_cut`] the classic way to turn a panorama into point lights (Debevec 2005).

mod cpu;
pub mod exact;
#[cfg(feature = "gpu")]
pub mod gpu;
mod kernel;
pub mod median_cut;
mod pyramid;
pub mod sh9;

pub use kernel::Kernel;

use pano_core::image::RadianceImage;
use pano_core::light::{GLOSSY_ROUGHNESS, RadianceMaps};

/// Size of the diffuse map.
pub const DIFFUSE_SIZE: (usize, usize) = (32, 16);
/// Size of each glossy map: as fine as its lobe is narrow.
pub const GLOSSY_SIZES: [(usize, usize); GLOSSY_ROUGHNESS.len()] = [(128, 64), (64, 32), (32, 16), (32, 16)];

/// The maps of a panorama of any size; of one whose lights cast shadows of their own, give what is left without them
/// ([`crate::detect::Detection::clamped`]).
pub fn radiance_maps(panorama: &RadianceImage) -> RadianceMaps {
    cpu::radiance_maps(panorama)
}

#[cfg(test)]
mod tests;
