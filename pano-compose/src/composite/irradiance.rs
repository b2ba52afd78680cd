//! Compositing by irradiance, eq. 2 of the IPRT paper: L = (1 − M)·k_V·E_RV + M·(E_RV / E_R)·L_cam.
//!
//! The ratio is taken as 1 + (E_RV − E_R) / max(E_R, floor). *Departure*: E_R → 0 must not divide by nothing. The floor is
//! the larger of [`IRRADIANCE_FLOOR`] times the frame's mean of E_R, and of π·L_cam / cap: a surface that sends out more than
//! a reflectance of `cap` could is a lamp, whose own light no shadow touches. In the limit E_R → 0 the change of the picture
//! is that of a surface of reflectance `cap` at most.

use glam::{Vec2, Vec3};
use pano_core::color::luminance;
use pano_core::image::{Image, RadianceImage};
use pano_core::{Error, Result};
use std::f32::consts::PI;

/// Least irradiance that is divided by, as a share of the frame's mean: ten stops below it.
pub const IRRADIANCE_FLOOR: f32 = 1e-3;

/// Pixels on either side of one over which a mirror's reflectance is measured.
pub const GLOSS_RADIUS: usize = 4;

/// Irradiance of a view's real surfaces without and with the objects. All pictures have the view's size.
#[derive(Clone, Debug)]
pub struct Irradiance {
    /// M: share of the pixel that shows a real surface, [0, 1].
    pub share: Image<f32>,
    /// E_R, premultiplied by `share`.
    pub real: Image<Vec3>,
    /// E_RV − E_R, premultiplied by `share`.
    pub change: Image<Vec3>,
}

impl Irradiance {
    /// E_RV, premultiplied.
    pub fn mixed(&self) -> Image<Vec3> {
        let (w, h) = self.real.size();
        // Noise of the change may exceed what there is.
        Image::from_fn(w, h, |x, y| (self.real.get(x, y) + self.change.get(x, y)).max(Vec3::ZERO))
    }

    /// E_RV / E_R of each pixel with the real picture `lit`, from which the irradiance was found; 1 where nothing changes.
    /// `cap` is the largest reflectance of a real surface, in [0, 1].
    ///
    /// # Errors
    /// [`Error::Argument`] if the pictures differ in size.
    pub fn ratio(&self, lit: &RadianceImage, cap: f32) -> Result<Image<Vec3>> {
        let size = self.check(&[self.change.size(), lit.size()])?;
        let floor = IRRADIANCE_FLOOR * self.mean();
        Ok(Image::from_fn(size.0, size.1, |x, y| {
            let (share, change) = (self.share.get(x, y), self.change.get(x, y));
            if share <= 0.0 || change == Vec3::ZERO {
                return Vec3::ONE;
            }
            let (real, change, lit) = (self.real.get(x, y) / share, change / share, lit.get(x, y));
            Vec3::from_array(std::array::from_fn(|c| {
                let least = floor.max(if cap > 0.0 { PI * lit[c] / cap } else { f32::INFINITY });
                let by = real[c].max(least);
                // A black frame has no scale, and nothing to change.
                let ratio = if by > 0.0 { 1.0 + change[c] / by } else { 1.0 };
                if ratio.is_finite() { ratio.max(0.0) } else { 1.0 }
            }))
        }))
    }

    /// Which part of the real picture is a mirror image, given what the mirror direction shows (`mirror`): x is the share that
    /// is none, y the mirror's reflectance.
    ///
    /// Light beyond what a reflectance of `cap` could send out (see the floor) is a lamp's own or a mirror image. Where it is
    /// not brighter than what lies in the mirror direction it is taken for its image, with that quotient as the mirror's
    /// reflectance, over the pixels within [`GLOSS_RADIUS`]: mirrors are not perfect, nor is what is known to lie there. A
    /// lamp is brighter than what it mirrors and keeps its light.
    ///
    /// # Errors
    /// [`Error::Argument`] if the pictures differ in size.
    pub fn gloss(&self, lit: &RadianceImage, mirror: &Image<Vec3>, cap: f32) -> Result<Image<Vec2>> {
        let (w, h) = self.check(&[mirror.size(), lit.size()])?;
        let beyond = Image::from_fn(w, h, |x, y| {
            let share = self.share.get(x, y);
            let diffuse = self.real.get(x, y) / share * (cap / PI);
            if share > 0.0 { luminance((lit.get(x, y) - diffuse).max(Vec3::ZERO)) } else { 0.0 }
        });
        Ok(Image::par_from_fn(w, h, |x, y| {
            let here = beyond.get(x, y);
            if here <= 0.0 {
                return Vec2::X;
            }
            let around = |at: usize, end: usize| at.saturating_sub(GLOSS_RADIUS)..(at + GLOSS_RADIUS + 1).min(end);
            let (mut sent, mut mirrored) = (0.0, 0.0);
            for (i, j) in around(y, h).flat_map(|j| around(x, w).map(move |i| (i, j))) {
                let beyond = beyond.get(i, j);
                if beyond > 0.0 {
                    (sent, mirrored) = (sent + beyond, mirrored + luminance(mirror.get(i, j)));
                }
            }
            if sent <= mirrored { Vec2::new(1.0 - here / luminance(lit.get(x, y)), sent / mirrored) } else { Vec2::X }
        }))
    }

    /// The change of the picture where real surfaces mirror: an addition to eq. 2, which takes them all for diffuse. Where an
    /// object comes before what the surface mirrors, it shows `after` in place of `before` (both premultiplied, 0 where none
    /// does), but takes no more than the mirror image there was. `gloss` is that of [`Self::gloss`].
    ///
    /// # Errors
    /// [`Error::Argument`] if the pictures differ in size.
    pub fn mirror_delta(
        &self,
        lit: &RadianceImage,
        gloss: &Image<Vec2>,
        before: &Image<Vec3>,
        after: &Image<Vec3>,
    ) -> Result<Image<Vec3>> {
        let (w, h) = self.check(&[gloss.size(), before.size(), after.size(), lit.size()])?;
        Ok(Image::from_fn(w, h, |x, y| {
            let (gloss, before) = (gloss.get(x, y), before.get(x, y));
            let blocked = luminance(before);
            if blocked <= 0.0 {
                return Vec3::ZERO;
            }
            let image = (1.0 - gloss.x) * luminance(lit.get(x, y)) * self.share.get(x, y);
            let change = (after.get(x, y) - before) * gloss.y.min(image / blocked);
            if change.is_finite() { change } else { Vec3::ZERO }
        }))
    }

    /// That pictures of `others` belong to this one; its size.
    fn check(&self, others: &[(usize, usize)]) -> Result<(usize, usize)> {
        let size = self.share.size();
        match others.iter().chain([&self.real.size()]).find(|&&other| other != size) {
            None => Ok(size),
            Some(other) => Err(Error::argument(format!("irradiance of {size:?} pixels beside a picture of {other:?}"))),
        }
    }

    /// Mean luminance of E_R over the pixels with a share, weighted by it.
    fn mean(&self) -> f32 {
        let sum: f64 = self.real.data().iter().map(|&e| f64::from(luminance(e))).filter(|l| l.is_finite()).sum();
        let shares: f64 = self.share.data().iter().map(|&s| f64::from(s)).sum();
        if shares > 0.0 { (sum / shares) as f32 } else { 0.0 }
    }
}

/// M·(E_RV / E_R − 1)·L_cam: the `delta` layer. The three pictures have one size.
pub fn delta_from_ratio(photo: &RadianceImage, share: &Image<f32>, ratio: &Image<Vec3>) -> Image<Vec3> {
    let (w, h) = photo.size();
    Image::from_fn(w, h, |x, y| {
        let ratio = ratio.get(x, y);
        // Where nothing changes the photo stays bit for bit.
        if ratio == Vec3::ONE { Vec3::ZERO } else { photo.get(x, y) * (ratio - 1.0) * share.get(x, y) }
    })
}
