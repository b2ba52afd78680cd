//! History and filters between the passes.

use super::super::{Result, device::Device};
use super::Signals;
use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::Image;
use pano_denoise::{atrous, firefly, temporal};
use pano_trace::iprt::{GBuffer, Motion, RealEstimate, VirtualEstimate};

/// Base colours below this are not divided by: the filter then works on radiance.
const LEAST_ALBEDO: f32 = 0.02;
/// Standard deviation, as a share of that measured, that the filter believes of a perfectly smooth surface: most of it is
/// the picture in the mirror. Chosen on a mirror ball.
const MIRROR_NOISE: f32 = 0.125;
/// From this many samples on their own variance guides the filter; below, the neighbours' is better known.
const SAMPLES_WITH_VARIANCE: u32 = 4;

/// How many times as far luminances may be apart in a first frame of so few samples: one ray in fifty that meets an object is
/// seven standard deviations from its neighbours, and must still be spread over them. It falls with the root of the frames.
const RARE: f32 = 4.0;

/// A change by more than so many times what arrives is no shadow, in which one sample may be worth a few times the mean, but a
/// caustic.
const CAUSTIC: f32 = 4.0;

/// As many standard deviations as that are no edge.
const ANY: f32 = 1e30;

/// What history and filters of a frame share.
pub(super) struct Filters<'a> {
    pub(super) buffer: &'a GBuffer,
    pub(super) samples: u32,
    /// Where points were in the frame before, and how far from the camera; `None`: in no frame.
    pub(super) motion: Option<&'a Motion>,
    /// Nothing moves, so that what mirrors show does not either.
    pub(super) settled: bool,
    /// Where values of real surfaces were interpolated, and how far: [`temporal::Guides::level`].
    pub(super) level: Option<&'a Image<u8>>,
    /// The view is a whole panorama.
    pub(super) wrap: bool,
    /// Where they run, and as what.
    pub(super) device: &'a mut Device,
    pub(super) stage: &'static str,
}

/// What is known of a signal besides its values.
pub(super) struct Noise {
    /// Of the pixel, as the signal is premultiplied by it; 0 where nothing is known.
    share: Image<f32>,
    /// Of the luminance without the premultiplication, as the filter is to believe it.
    variance: Image<f32>,
}

/// The histories of a frame's signals.
pub(super) type Histories = Signals<Option<temporal::History>>;

impl Filters<'_> {
    /// Blends `signal`, premultiplied by `share`, with its `history`, and premultiplies it by `target` in the end. `measured` is
    /// the variance of its luminance, if that is known; it counts from [`SAMPLES_WITH_VARIANCE`] on.
    pub(super) fn remember(
        &mut self,
        (share, target): (&Image<f32>, &Image<f32>),
        measured: Option<&Image<f32>>,
        signal: &mut Image<Vec3>,
        history: &mut Option<temporal::History>,
    ) -> Result<Noise> {
        // What this frame knows nothing of is not a number, which history replaces.
        for (value, &share) in signal.data_mut().iter_mut().zip(share.data()) {
            *value = if share > 0.0 { *value / share } else { Vec3::NAN };
        }
        let still;
        let (previous, previous_depth) = match self.motion {
            Some((previous, depth)) => (previous, depth),
            None => {
                *history = None;
                still = Image::filled(signal.width(), signal.height(), glam::Vec2::NAN);
                (&still, &self.buffer.depth)
            }
        };
        let guides = temporal::Guides {
            depth: &self.buffer.depth,
            normal: &self.buffer.normal,
            thing: &self.buffer.thing,
            previous,
            previous_depth,
            sharp: (!self.settled).then_some(&self.buffer.smooth),
            level: self.level,
        };
        let params = temporal::Params { wrap: self.wrap, ..temporal::Params::default() };
        let few = self.samples < SAMPLES_WITH_VARIANCE;
        let mut variance = self.device.accumulate(self.stage, &params, &guides, measured.filter(|_| !few), signal, history)?;
        let remembered = history.as_ref().map(temporal::History::frames);
        let frames = |i: usize| remembered.map_or(0.0, |frames| frames.data()[i]);
        if few {
            let rough = variance.data_mut().iter_mut().enumerate().filter(|(i, _)| !self.buffer.smooth.data()[*i]);
            for (i, variance) in rough {
                *variance *= (RARE * RARE / frames(i).max(1.0)).max(1.0);
            }
        }
        let mut known = target.clone();
        for (i, (value, known)) in signal.data_mut().iter_mut().zip(known.data_mut()).enumerate() {
            *value *= *known;
            if frames(i) == 0.0 {
                *known = 0.0;
            }
        }
        Ok(Noise { share: known, variance })
    }

    /// The à-trous filter with this [`atrous::Params::sigma_luminance`].
    fn spread_by(
        &mut self,
        sigma_luminance: f32,
        share: &Image<f32>,
        mut variance: Image<f32>,
        signal: &mut Image<Vec3>,
    ) -> Result<()> {
        let guides = atrous::Guides { depth: &self.buffer.depth, normal: &self.buffer.normal };
        let params = atrous::Params { wrap: self.wrap, sigma_luminance, ..atrous::Params::default() };
        self.device.spread(self.stage, &params, &guides, share, &mut variance, signal)
    }

    /// The filter for what many paths bring.
    pub(super) fn spread(&mut self, noise: Noise, signal: &mut Image<Vec3>) -> Result<()> {
        self.spread_by(atrous::Params::default().sigma_luminance, &noise.share, noise.variance, signal)
    }

    /// The filter for the objects' radiance: a mirror image is sharp from the first sample on.
    pub(super) fn spread_seen(&mut self, noise: &Noise, signal: &mut Image<Vec3>) -> Result<()> {
        for smooth in [false, true] {
            let share = |x, y| if self.buffer.smooth.get(x, y) == smooth { noise.share.get(x, y) } else { 0.0 };
            let share = Image::from_fn(signal.width(), signal.height(), share);
            if share.data().iter().any(|&s| s > 0.0) {
                let sigma = atrous::Params::default().sigma_luminance * if smooth { MIRROR_NOISE } else { 1.0 };
                self.spread_by(sigma, &share, noise.variance.clone(), signal)?;
            }
        }
        Ok(())
    }

    /// Takes the fireflies of E_R and spreads their light over the surface.
    pub(super) fn tame_real(&mut self, real: &mut RealEstimate, warnings: &mut Vec<String>) -> Result<()> {
        self.tame("irradiance", &real.share, &mut real.irradiance, |_| true, warnings)
    }

    /// Spreads over the surface what of the change no few samples can draw: caustics as bright as this, of which a sample meets
    /// one in thousands. `known` is E_R as history has it, `all` and `part` the shares by which it and the change are premultiplied.
    pub(super) fn tame_change(
        &mut self,
        (known, all): (&Image<Vec3>, &Image<f32>),
        part: &Image<f32>,
        change: &mut Image<Vec3>,
    ) -> Result<()> {
        if self.samples >= SAMPLES_WITH_VARIANCE {
            return Ok(());
        }
        let (mut excess, mut any) = (change.clone(), false);
        for (i, (value, excess)) in change.data_mut().iter_mut().zip(excess.data_mut()).enumerate() {
            let (share, all) = (part.data()[i], all.data()[i]);
            let limit = if all > 0.0 { CAUSTIC * luminance(known.data()[i]) * share / all } else { f32::INFINITY };
            let bright = luminance(*value).abs();
            if bright > limit {
                *value *= limit / bright;
                any = true;
            }
            *excess -= *value;
        }
        if any { self.spread_excess(part, excess, change) } else { Ok(()) }
    }

    /// Takes the fireflies of the objects' radiance, which loses its base colour, and spreads their light where surfaces are rough.
    pub(super) fn tame_seen(&mut self, seen: &mut VirtualEstimate, warnings: &mut Vec<String>) -> Result<()> {
        let rough = |i: usize| !self.buffer.smooth.data()[i];
        for (i, radiance) in seen.radiance.data_mut().iter_mut().enumerate() {
            *radiance /= divided_by(self.buffer.albedo.data()[i]);
        }
        for (variance, &albedo) in seen.variance.data_mut().iter_mut().zip(self.buffer.albedo.data()) {
            *variance /= luminance(divided_by(albedo)).powi(2);
        }
        self.tame("object", &seen.coverage, &mut seen.radiance, rough, warnings)
    }

    /// Gives the objects' radiance its base colour back.
    pub(super) fn color(&self, radiance: &mut Image<Vec3>) {
        for (radiance, &albedo) in radiance.data_mut().iter_mut().zip(self.buffer.albedo.data()) {
            *radiance *= divided_by(albedo);
        }
    }

    /// Clamps fireflies and spreads what was taken over the surface where it may be: it is light all the same. What is taken
    /// elsewhere is lost, and told.
    fn tame(
        &mut self,
        layer: &str,
        share: &Image<f32>,
        signal: &mut Image<Vec3>,
        may_spread: impl Fn(usize) -> bool,
        warnings: &mut Vec<String>,
    ) -> Result<()> {
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
        if spread { self.spread_excess(share, excess, signal) } else { Ok(()) }
    }

    /// Adds `excess` to the signal, spread over the surface.
    fn spread_excess(&mut self, share: &Image<f32>, mut excess: Image<Vec3>, signal: &mut Image<Vec3>) -> Result<()> {
        let variance = Image::filled(share.width(), share.height(), 1.0);
        self.spread_by(ANY, share, variance, &mut excess)?;
        for (value, excess) in signal.data_mut().iter_mut().zip(excess.data()) {
            *value += *excess;
        }
        Ok(())
    }
}

/// What radiance is divided by before it is filtered: the base colour, if it is not too dark.
fn divided_by(albedo: Vec3) -> Vec3 {
    if albedo.min_element() >= LEAST_ALBEDO { albedo } else { Vec3::ONE }
}
