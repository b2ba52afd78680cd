//! Filters between the passes.

use super::super::{Result, device::Device};
use super::Signals;
use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::Image;
use pano_denoise::{atrous, firefly, temporal};
use pano_trace::iprt::{GBuffer, RealEstimate, VirtualEstimate};

/// Base colours below this are not divided by: the filter then works on radiance.
const LEAST_ALBEDO: f32 = 0.02;
/// Standard deviation, as a share of that measured, that the filter believes of a perfectly smooth surface: most of it is
/// the picture in the mirror. Chosen on a mirror ball.
const MIRROR_NOISE: f32 = 0.125;
/// From this many samples on their own variance guides the filter; below, the neighbours' is better known.
const SAMPLES_WITH_VARIANCE: u32 = 4;

/// How many times as far luminances may be apart with so few samples: one ray in fifty that meets an object is seven standard
/// deviations from its neighbours, and must still be spread over them.
const RARE: f32 = 4.0;

/// As many standard deviations as that are no edge.
const ANY: f32 = 1e30;

/// What the filters of a frame share.
pub(super) struct Filters<'a> {
    pub(super) buffer: &'a GBuffer,
    pub(super) samples: u32,
    /// The view is a whole panorama.
    pub(super) wrap: bool,
    /// Where they run, and as what.
    pub(super) device: &'a mut Device,
    pub(super) stage: &'static str,
}

impl Filters<'_> {
    /// Adds what [`Self::clamp_fireflies`] took to the filtered signal, spread over the surface: it is light all the same.
    fn spread_fireflies(&mut self, share: &Image<f32>, mut excess: Image<Vec3>, signal: &mut Image<Vec3>) -> Result<()> {
        self.spread_by(ANY, share, None, &mut excess)?;
        for (value, excess) in signal.data_mut().iter_mut().zip(excess.data()) {
            *value += *excess;
        }
        Ok(())
    }

    /// The filter for light that many paths bring; `variance` counts from [`SAMPLES_WITH_VARIANCE`] on.
    fn spread(&mut self, share: &Image<f32>, variance: &mut Image<f32>, signal: &mut Image<Vec3>) -> Result<()> {
        let sigma = atrous::Params::default().sigma_luminance;
        if self.samples < SAMPLES_WITH_VARIANCE {
            self.spread_by(RARE * sigma, share, None, signal)
        } else {
            self.spread_by(sigma, share, Some(variance), signal)
        }
    }

    /// The filter for what smooth surfaces mirror.
    fn spread_mirrored(&mut self, share: &Image<f32>, variance: &mut Image<f32>, signal: &mut Image<Vec3>) -> Result<()> {
        let variance = (self.samples >= SAMPLES_WITH_VARIANCE).then_some(variance);
        self.spread_by(MIRROR_NOISE * atrous::Params::default().sigma_luminance, share, variance, signal)
    }

    /// The à-trous filter with this [`atrous::Params::sigma_luminance`].
    fn spread_by(
        &mut self,
        sigma_luminance: f32,
        share: &Image<f32>,
        variance: Option<&mut Image<f32>>,
        signal: &mut Image<Vec3>,
    ) -> Result<()> {
        let guides = atrous::Guides { depth: &self.buffer.depth, normal: &self.buffer.normal };
        let params = atrous::Params { wrap: self.wrap, sigma_luminance, ..atrous::Params::default() };
        self.device.spread(self.stage, &params, &guides, share, variance, signal)
    }

    /// E_R and E_RV − E_R.
    pub(super) fn real(&mut self, real: &mut RealEstimate, warnings: &mut Vec<String>) -> Result<()> {
        let excess = self.clamp_fireflies("irradiance", &real.share, &mut real.irradiance, |_| true, warnings)?;
        self.spread(&real.share, &mut real.irradiance_variance, &mut real.irradiance)?;
        if let Some(excess) = excess {
            self.spread_fireflies(&real.share, excess, &mut real.irradiance)?;
        }
        // The change keeps the energy of its fireflies: they are caustics.
        self.spread(&real.share, &mut real.change_variance, &mut real.change)
    }

    /// The objects' radiance, without their base colour.
    pub(super) fn seen(&mut self, seen: &mut VirtualEstimate, warnings: &mut Vec<String>) -> Result<()> {
        let rough = |i: usize| !self.buffer.smooth.data()[i];
        let mut excess = self.clamp_fireflies("object", &seen.coverage, &mut seen.radiance, rough, warnings)?;
        let albedo = self.buffer.albedo.map(|a| if a.min_element() >= LEAST_ALBEDO { a } else { Vec3::ONE });
        for layer in [Some(&mut seen.radiance), excess.as_mut()].into_iter().flatten() {
            layer.data_mut().iter_mut().zip(albedo.data()).for_each(|(radiance, &albedo)| *radiance /= albedo);
        }
        for (variance, &albedo) in seen.variance.data_mut().iter_mut().zip(albedo.data()) {
            *variance /= luminance(albedo).powi(2);
        }
        // A mirror image is sharp from the first sample on.
        let of_kind = |smooth: bool| {
            let share = |x, y| if self.buffer.smooth.get(x, y) == smooth { seen.coverage.get(x, y) } else { 0.0 };
            let share = Image::from_fn(seen.coverage.width(), seen.coverage.height(), share);
            share.data().iter().any(|&s| s > 0.0).then_some(share)
        };
        let (rough, smooth) = (of_kind(false), of_kind(true));
        if let Some(share) = rough {
            self.spread(&share, &mut seen.variance, &mut seen.radiance)?;
        }
        if let Some(share) = smooth {
            self.spread_mirrored(&share, &mut seen.variance, &mut seen.radiance)?;
        }
        if let Some(excess) = excess {
            self.spread_fireflies(&seen.coverage, excess, &mut seen.radiance)?;
        }
        for (radiance, &albedo) in seen.radiance.data_mut().iter_mut().zip(albedo.data()) {
            *radiance *= albedo;
        }
        Ok(())
    }

    /// Clamps fireflies, and returns what was taken where it may be spread over the surface; `None` if that is nothing. What
    /// is taken elsewhere is lost, and told.
    fn clamp_fireflies(
        &mut self,
        layer: &str,
        share: &Image<f32>,
        signal: &mut Image<Vec3>,
        may_spread: impl Fn(usize) -> bool,
        warnings: &mut Vec<String>,
    ) -> Result<Option<Image<Vec3>>> {
        let params = firefly::Params { wrap: self.wrap, ..firefly::Params::default() };
        let mut excess = signal.clone();
        let clamped = self.device.clamp_fireflies(self.stage, &params, share, signal)?;
        let (mut spread, mut lost) = (false, 0.0);
        for (i, (excess, kept)) in excess.data_mut().iter_mut().zip(signal.data()).enumerate() {
            *excess -= *kept;
            if may_spread(i) {
                spread |= *excess != Vec3::ZERO;
            } else {
                lost += f64::from(luminance(*excess).abs());
                *excess = Vec3::ZERO;
            }
        }
        // Less than a hundredth is what rounds away at the edges of highlights.
        if lost > 1e-2 * clamped.before {
            let share = 100.0 * lost / clamped.before;
            warnings.push(format!("clamping fireflies took {share:.1} % of the {layer} layer's light, off smooth surfaces"));
        }
        Ok(spread.then_some(excess))
    }
}

/// Blends `signal`, premultiplied by `share`, with its `history`, and premultiplies it by `target` in the end.
pub(super) fn remember(
    (device, stage): (&mut Device, &'static str),
    params: &temporal::Params,
    guides: &temporal::Guides<'_>,
    (share, target): (&Image<f32>, &Image<f32>),
    signal: &mut Image<Vec3>,
    history: &mut Option<temporal::History>,
) -> Result<()> {
    // What this frame knows nothing of is not a number, which history replaces.
    for (value, &share) in signal.data_mut().iter_mut().zip(share.data()) {
        *value = if share > 0.0 { *value / share } else { Vec3::NAN };
    }
    device.accumulate(stage, params, guides, signal, history)?;
    for (value, &target) in signal.data_mut().iter_mut().zip(target.data()) {
        *value *= target;
    }
    Ok(())
}

/// The histories of a frame's signals.
pub(super) type Histories = Signals<Option<temporal::History>>;
