//! The small copy of a panorama that light is looked for in, and that image-based lighting is made from.
//!
//! MR360 (section 6.3) resamples the upper half of each frame to 600×150 before it looks for lights. The copy here is the
//! whole sphere at that resolution, 600×300, so that what is left after the lights are taken out lights the scene.
//!
//! *Departure*: a frame wider than the copy is averaged over exact solid angles. Bilinear lookups, as for smaller frames,
//! would step over a sun of one pixel.

use crate::expand;
use glam::Vec3;
use pano_core::image::RadianceImage;
use pano_core::sphere::resample::resize_mapped_panorama;

/// Largest radiance that is kept; the square of the sum over all pixels stays finite.
const MAX_RADIANCE: f32 = 1e30;

/// A panorama of [`WorkingMap::WIDTH`] × [`WorkingMap::HEIGHT`] pixels of radiance, finite and ≥ 0.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkingMap {
    radiance: RadianceImage,
    from_ldr: bool,
}

impl WorkingMap {
    /// Columns.
    pub const WIDTH: usize = 600;
    /// Rows, from pole to pole.
    pub const HEIGHT: usize = 300;

    /// Of a panorama of any size that holds radiance. Negative channels and NaN count as 0, and
    /// 10³⁰ is the largest value.
    pub fn from_hdr(radiance: &RadianceImage) -> Self {
        Self::resampled(radiance, sanitized, false, Self::HEIGHT)
    }

    /// Of a panorama of any size that holds linear colours in [0, 1], which are inversely tone-mapped first
    /// ([`expand::expand`]).
    pub fn from_ldr(ldr: &RadianceImage) -> Self {
        Self::resampled(ldr, expand::pixel, true, Self::HEIGHT)
    }

    /// The upper half of [`Self::from_hdr`], in half the time: for light detection, which looks at nothing else. The lower half
    /// is black.
    pub fn upper_from_hdr(radiance: &RadianceImage) -> Self {
        Self::resampled(radiance, sanitized, false, Self::HEIGHT / 2)
    }

    /// The upper half of [`Self::from_ldr`], as [`Self::upper_from_hdr`].
    pub fn upper_from_ldr(ldr: &RadianceImage) -> Self {
        Self::resampled(ldr, expand::pixel, true, Self::HEIGHT / 2)
    }

    fn resampled(panorama: &RadianceImage, f: impl Fn(Vec3) -> Vec3 + Sync, from_ldr: bool, rows: usize) -> Self {
        let mut radiance = RadianceImage::filled(Self::WIDTH, Self::HEIGHT, Vec3::ZERO);
        resize_mapped_panorama(panorama, f, &mut radiance, rows);
        // Smaller pictures are interpolated as a whole.
        radiance.data_mut()[rows * Self::WIDTH..].fill(Vec3::ZERO);
        Self { radiance, from_ldr }
    }

    /// [`Self::from_ldr`] or [`Self::from_hdr`], made on the GPU; [`pano_core::gpu::LARGEST`] is the largest value.
    ///
    /// # Errors
    /// What has become of the device.
    #[cfg(feature = "gpu")]
    pub fn on_gpu(gpu: &pano_core::gpu::Gpu, panorama: &RadianceImage, from_ldr: bool) -> pano_core::gpu::GpuResult<Self> {
        let map = |band| if from_ldr { expand::gpu::expand(gpu, &band) } else { Ok(band) };
        let radiance = pano_core::sphere::resample::gpu::resize(gpu, panorama, map, (Self::WIDTH, Self::HEIGHT))?;
        Ok(Self { radiance: gpu.read(&radiance)?, from_ldr })
    }

    /// The pixels.
    pub fn radiance(&self) -> &RadianceImage {
        &self.radiance
    }

    /// Whether the radiance was guessed from a picture of low dynamic range, in which lights are clipped.
    pub fn is_from_ldr(&self) -> bool {
        self.from_ldr
    }
}

/// A pixel's radiance, finite and ≥ 0.
fn sanitized(radiance: Vec3) -> Vec3 {
    radiance.map(|c| if c > 0.0 { c.min(MAX_RADIANCE) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect;
    use crate::test_maps::{Lamp, sky};

    #[test]
    fn detection_needs_the_upper_half_only() {
        for width in [64, 600, 1400] {
            let panorama = sky(width, &[Lamp::white(0.0, 40.0, 6.0, 1.0), Lamp::white(0.0, -40.0, 6.0, 1.0)]);
            let pairs = [
                (WorkingMap::from_hdr(&panorama), WorkingMap::upper_from_hdr(&panorama)),
                (WorkingMap::from_ldr(&panorama), WorkingMap::upper_from_ldr(&panorama)),
            ];
            for (whole, upper) in pairs {
                let half = WorkingMap::WIDTH * WorkingMap::HEIGHT / 2;
                assert_eq!(whole.radiance().data()[..half], upper.radiance().data()[..half]);
                assert!(upper.radiance().data()[half..].iter().all(|p| *p == Vec3::ZERO));
                let params = detect::Params::default();
                assert_eq!(detect::detect(&whole, &params), detect::detect(&upper, &params));
            }
        }
    }
}
