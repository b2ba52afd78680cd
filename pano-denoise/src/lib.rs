//! Edge-preserving filters for path-traced layers.
//!
//! Each stage is a folder with its parameters and entry points in `mod.rs` and the algorithm in `cpu.rs`. Stages work in
//! place on [`pano_core::layers::TracedLayers`] or on one layer with its guides, and know nothing of files.
//!
//! ```
//! use pano_core::layers::TracedLayers;
//! use glam::Vec3;
//! use pano_denoise::cross_bilateral::{self, Params};
//!
//! let mut layers = TracedLayers::empty(16, 16);
//! layers.delta.set(8, 8, Vec3::splat(-0.1));
//! let report = cross_bilateral::filter(&Params::default(), &mut layers)?;
//! assert_eq!(report.object.before, 0.0);
//! # Ok::<(), pano_core::Error>(())
//! ```

pub mod atrous;
pub mod cross_bilateral;
pub mod firefly;
pub mod mean;
pub mod settle;
pub mod temporal;

mod surfaces;

#[cfg(feature = "gpu")]
pub use surfaces::gpu::GpuSurfaces;

use glam::{DVec3, Vec3};
use pano_core::color::{LUMINANCE_WEIGHTS, luminance};
use pano_core::image::Image;
use pano_core::sphere::wrap_texel;
use pano_core::{Error, Result};
use std::ops::{AddAssign, Range};

/// Every shader of this crate, for the checks that need no GPU.
#[cfg(feature = "gpu")]
pub fn shaders() -> Vec<&'static pano_core::gpu::Shader> {
    vec![
        &surfaces::gpu::SHADER,
        &cross_bilateral::gpu::SHADER,
        &atrous::gpu::SHADER,
        &firefly::gpu::SHADER,
        &mean::gpu::SHADER,
        &settle::gpu::SHADER,
        &temporal::gpu::SHADER,
    ]
}

/// Structures that Rust fills for them, with the shader that declares each.
#[cfg(feature = "gpu")]
pub fn layouts() -> Vec<(&'static pano_core::gpu::Shader, pano_core::gpu::Layout)> {
    vec![
        (&cross_bilateral::gpu::SHADER, cross_bilateral::gpu::CrossBilateral::LAYOUT),
        (&atrous::gpu::SHADER, atrous::gpu::Atrous::LAYOUT),
        (&firefly::gpu::SHADER, firefly::gpu::Firefly::LAYOUT),
        (&mean::gpu::SHADER, mean::gpu::Mean::LAYOUT),
        (&temporal::gpu::SHADER, temporal::gpu::Temporal::LAYOUT),
    ]
}

/// Luminance sums of one layer, over all pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Signed sum before filtering.
    pub before: f64,
    /// Signed sum after filtering.
    pub after: f64,
    /// Sum of the absolute values before filtering.
    pub magnitude: f64,
}

impl Energy {
    /// Of one layer before and after; values that are not finite do not count.
    pub(crate) fn between(before: &Image<Vec3>, after: &Image<Vec3>) -> Self {
        Self::in_rows(before, after, &(0..before.height()))
    }

    /// The same of some rows.
    pub(crate) fn in_rows(before: &Image<Vec3>, after: &Image<Vec3>, rows: &Range<usize>) -> Self {
        let sum = |image: &Image<Vec3>, f: fn(f64) -> f64| {
            let pixels = &image.data()[rows.start * image.width()..rows.end * image.width()];
            pixels.iter().filter(|v| v.is_finite()).map(|&v| f(f64::from(luminance(v)))).sum()
        };
        Self { before: sum(before, |v| v), after: sum(after, |v| v), magnitude: sum(before, f64::abs) }
    }

    /// Change of the sum as a fraction of the magnitude; 0 for a black layer.
    pub fn relative_change(&self) -> f64 {
        if self.magnitude > 0.0 { (self.after - self.before) / self.magnitude } else { 0.0 }
    }
}

impl AddAssign for Energy {
    fn add_assign(&mut self, other: Self) {
        self.before += other.before;
        self.after += other.after;
        self.magnitude += other.magnitude;
    }
}

/// All pictures have `size`, or an error names the one that has not.
fn check_sizes(filter: &str, size: (usize, usize), others: &[(&str, (usize, usize))]) -> Result<()> {
    match others.iter().find(|(_, other)| *other != size) {
        None => Ok(()),
        Some((name, other)) => {
            Err(Error::argument(format!("{filter}: {name} has {}×{} pixels, the layer {}×{}", other.0, other.1, size.0, size.1)))
        }
    }
}

/// Luminance of a value of any size or sign.
#[inline]
fn bright(value: DVec3) -> f64 {
    value.dot(LUMINANCE_WEIGHTS.as_dvec3())
}

/// The texel at `(x, y)`; outside of a picture that does not wrap there is none.
#[inline]
fn texel_at((width, height): (usize, usize), x: isize, y: isize, wrap: bool) -> Option<(usize, usize)> {
    let inside = (0..width as isize).contains(&x) && (0..height as isize).contains(&y);
    (inside || wrap).then(|| wrap_texel(width, height, x, y))
}

/// To `f32`, at most its largest value: dividing by a tiny share may exceed it.
#[inline]
fn to_f32(v: f64) -> f32 {
    v.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// [`to_f32`] of each channel.
#[inline]
fn to_vec3(v: DVec3) -> Vec3 {
    Vec3::new(to_f32(v.x), to_f32(v.y), to_f32(v.z))
}
