//! How far two pictures are apart, and what a picture, a depth map or a mesh holds in a few numbers.
//!
//! [`mse`], [`psnr`], [`ws_psnr`], [`ssim`] and [`flip`] take display-encoded RGB in [0, 1]; [`rel_rmse`] takes linear
//! radiance. With a [`Mask`], means go over the pixels where it is true. Every function fails if the sizes differ or the
//! mask is empty. A picture with NaN in it is NaN away from everything ([`flip`] takes NaN as 0).
//!
//! ```
//! use glam::Vec3;
//! use pano_core::{image::Image, metrics};
//!
//! let a = Image::filled(16, 16, Vec3::splat(0.5));
//! let b = Image::filled(16, 16, Vec3::splat(0.6));
//! assert!((metrics::mse(&a, &b, None)? - 0.01).abs() < 1e-7);
//! assert!((metrics::psnr(&a, &b, None)? - 20.0).abs() < 1e-4);
//! assert_eq!(metrics::ssim(&a, &a, None)?, Some(1.0));
//! # Ok::<(), pano_core::Error>(())
//! ```

mod flip;
mod ssim;
mod summary;
#[cfg(test)]
mod tests;

pub use flip::flip;
pub use ssim::ssim;
pub use summary::{DepthStats, LuminanceStats, MeshStats};

use crate::{Error, Result, image::Image};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Pixels that count.
pub type Mask = Image<bool>;

/// Mean squared error over pixels and channels.
///
/// # Errors
/// [`Error::Argument`] if the sizes differ or the mask is empty.
pub fn mse(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<f64> {
    mean(a, b, mask, |_| 1.0, |a, b| (a - b).length_squared() / 3.0)
}

/// Peak signal-to-noise ratio in dB for the peak 1; infinite for equal pictures.
///
/// # Errors
/// [`Error::Argument`] if the sizes differ or the mask is empty.
pub fn psnr(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<f64> {
    Ok(decibels(mse(a, b, mask)?))
}

/// [`psnr`] of an equirectangular picture with each row weighted by the cosine of its latitude (WS-PSNR), so that the
/// poles count for no more than the sphere shows of them.
///
/// # Errors
/// [`Error::Argument`] if the sizes differ or the mask is empty.
pub fn ws_psnr(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<f64> {
    let height = a.height() as f64;
    let cos_latitude = |y: usize| ((y as f64 + 0.5) / height * std::f64::consts::PI).sin();
    Ok(decibels(mean(a, b, mask, cos_latitude, |a, b| (a - b).length_squared() / 3.0)?))
}

/// Relative root mean squared error of linear radiance against the reference `b`: √mean((a − b)² / (b² + 0.01)) over
/// pixels and channels. The constant keeps dark pixels from deciding alone.
///
/// # Errors
/// [`Error::Argument`] if the sizes differ or the mask is empty.
pub fn rel_rmse(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<f64> {
    let square = |a: DVec3, b: DVec3| ((a - b) * (a - b) / (b * b + 0.01)).element_sum() / 3.0;
    Ok(mean(a, b, mask, |_| 1.0, square)?.sqrt())
}

fn decibels(mse: f64) -> f64 {
    -10.0 * mse.log10()
}

/// Fails unless the three have one size and the mask lets a pixel through.
fn check(a: &Image<Vec3>, b: &Image<Vec3>, mask: Option<&Mask>) -> Result<()> {
    let unequal = |what: &str, other: (usize, usize)| {
        let ((w, h), (ow, oh)) = (a.size(), other);
        Err(Error::argument(format!("the {what} is {ow}×{oh}, the first picture {w}×{h}: sizes must be equal")))
    };
    if b.size() != a.size() {
        return unequal("second picture", b.size());
    }
    match mask {
        Some(mask) if mask.size() != a.size() => unequal("mask", mask.size()),
        Some(mask) if !mask.data().contains(&true) => Err(Error::argument("the mask lets no pixel through")),
        _ => Ok(()),
    }
}

/// Weighted mean of `error`. Rows are summed apart and then in order, so that threads do not change the result.
fn mean(
    a: &Image<Vec3>,
    b: &Image<Vec3>,
    mask: Option<&Mask>,
    weight: impl Fn(usize) -> f64 + Sync,
    error: impl Fn(DVec3, DVec3) -> f64 + Sync,
) -> Result<f64> {
    check(a, b, mask)?;
    let row_sums = |y: usize| {
        let counts = |x: usize| mask.is_none_or(|m| m.get(x, y));
        let pairs = a.row(y).iter().zip(b.row(y)).enumerate().filter(|(x, _)| counts(*x));
        let (sum, n) = pairs.fold((0.0, 0.0), |(sum, n), (_, (a, b))| (sum + error(a.as_dvec3(), b.as_dvec3()), n + 1.0));
        (weight(y) * sum, weight(y) * n)
    };
    let rows: Vec<(f64, f64)> = (0..a.height()).into_par_iter().map(row_sums).collect();
    let (sum, weights) = rows.iter().fold((0.0, 0.0), |(s, w), row| (s + row.0, w + row.1));
    Ok(sum / weights)
}
