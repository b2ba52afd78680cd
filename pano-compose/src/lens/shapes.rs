//! How bright light is spread, in numbers: what both backends take weights and steps from.

use super::Params;

/// The glare's threshold over the bloom's.
pub(super) const GLARE_THRESHOLD: f32 = 1.5;
/// Gaussian filters one after the other.
pub(super) const SUCCESSIVE: usize = 3;
/// What rounding leaves of a kernel's tail is no light.
pub(super) const NOTHING: f32 = 1e-12;
/// The glare's rays, as signs of their steps; each carries the same part of the light.
pub(super) const DIAGONALS: [(i32, i32); 4] = [(1, 1), (-1, 1), (1, -1), (-1, -1)];
/// Samples of a pass of the glare: with steps of 4^(n−1) pixels, four of them reach where the next pass takes over.
const SAMPLES: i32 = 4;
/// Pixels of the reduced bright map to a standard deviation of the bloom: fewer show its grid.
const PIXELS_PER_SIGMA: f32 = 4.0;

/// By how much the bright map of a picture of that size is reduced for the bloom, and the weights of each of the [`SUCCESSIVE`]
/// filters over it, the middle one first.
pub(super) fn bloom_shape(params: &Params, (w, h): (usize, usize)) -> (usize, Vec<f32>) {
    let sigma = (params.radius * h as f32).max(0.5);
    let k = ((sigma / PIXELS_PER_SIGMA) as usize).clamp(1, w.min(h));
    // A panorama's columns must come out even, or the seam shows.
    let k = if params.wrap { (1..=k).rev().find(|k| w.is_multiple_of(*k)).unwrap_or(1) } else { k };
    // Variances add up.
    (k, gaussian(sigma / k as f32 / (SUCCESSIVE as f32).sqrt()))
}

/// Weights of a Gaussian to four standard deviations, which add up to 1; the middle one first.
fn gaussian(sigma: f32) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as usize;
    let mut weights: Vec<f32> = (0..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    weights.iter_mut().for_each(|w| *w /= sum);
    weights
}

/// One pass of the glare along a ray.
pub(super) struct RayPass {
    /// Pixels from one sample to the next, in either axis: b of equation 2.
    pub(super) step: i32,
    /// Weights of the samples, which add up to 1.
    pub(super) weights: [f32; SAMPLES as usize],
}

impl RayPass {
    /// The passes, shortest steps first.
    pub(super) fn all(params: &Params) -> impl Iterator<Item = Self> {
        let attenuation = params.attenuation;
        (0..params.passes).map(move |n| {
            // Equation 2.
            let step = 4i32.pow(n);
            // Equation 3.
            let weights: [f32; SAMPLES as usize] = std::array::from_fn(|s| attenuation.powi(step * s as i32));
            let total: f32 = weights.iter().sum();
            Self { step, weights: weights.map(|w| w / total) }
        })
    }

    /// Rows on either side of a pixel that all passes look at.
    #[cfg(feature = "gpu")]
    pub(super) fn reach(params: &Params) -> usize {
        Self::all(params).map(|pass| (SAMPLES - 1) as usize * pass.step as usize).sum()
    }
}
