//! The layers of one frame that tracers make, filters smooth and compositing reads.

use crate::image::Image;
use glam::Vec3;

/// What a tracer makes of one frame. Every picture has the view's size.
///
/// The composite is `photo·(1 − coverage) + delta + object`.
#[derive(Clone, Debug)]
pub struct TracedLayers {
    /// Radiance of the virtual objects, premultiplied by `coverage`.
    pub object: Image<Vec3>,
    /// Share of the pixel that shows a virtual object, [0, 1].
    pub coverage: Image<f32>,
    /// Signed change of the real surfaces' radiance, premultiplied by their share of the pixel.
    pub delta: Image<Vec3>,
    /// Distance along the ray in metres to the nearest surface, virtual or real, at the pixel's centre; infinite where
    /// there is nothing.
    pub depth: Image<f32>,
    /// World-space unit shading normal at the pixel's centre; zero where there is nothing.
    pub normal: Image<Vec3>,
    /// Reflectance at the pixel's centre; zero where there is nothing.
    pub albedo: Image<Vec3>,
}

impl TracedLayers {
    /// Layers of a frame in which nothing virtual is.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn empty(width: usize, height: usize) -> Self {
        let black = Image::filled(width, height, Vec3::ZERO);
        Self {
            object: black.clone(),
            coverage: Image::filled(width, height, 0.0),
            delta: black.clone(),
            depth: Image::filled(width, height, f32::INFINITY),
            normal: black.clone(),
            albedo: black,
        }
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        self.coverage.size()
    }
}
