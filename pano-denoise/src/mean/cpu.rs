//! The filter on the CPU: a window about each pixel of a penumbra, rayon over rows.

use super::{Params, Report, Signal};
use crate::surfaces::Surfaces;
use crate::{Energy, to_vec3};
use glam::{BVec3, DVec3, Vec3};
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;
use rayon::prelude::*;

/// See [`super::filter`]; arguments are checked there.
pub(super) fn filter(params: &Params, penumbra: &Image<bool>, photo: &RadianceImage, layers: &mut TracedLayers) -> Report {
    let surfaces = Surfaces::new(&layers.depth, &layers.normal, params.wrap);
    let covered = layers.coverage.data();
    let real: Vec<f32> = covered.iter().map(|c| 1.0 - c).collect();
    let albedo = layers.albedo.data();
    let object = Signal { values: layers.object.data(), share: covered, base: None };
    let delta = Signal { values: layers.delta.data(), share: &real, base: Some(photo.data()) };
    let [object, delta] = [object, delta].map(|signal| averaged(params, penumbra, &surfaces, albedo, &signal));
    let report = Report { object: Energy::between(&layers.object, &object), delta: Energy::between(&layers.delta, &delta) };
    (layers.object, layers.delta) = (object, delta);
    report
}

impl Signal<'_> {
    /// Whether a pixel has a share of the layer, and a value.
    fn counts(&self, i: usize) -> bool {
        self.share[i] > 0.0 && self.values[i].is_finite()
    }

    /// What a pixel's value is in proportion to, and in which channels it is neither black nor no number. Below the smallest
    /// normal number is black: shaders may take it for 0.
    fn base(&self, i: usize) -> (DVec3, BVec3) {
        let base = self.base.map_or(Vec3::ONE, |base| base[i]);
        (base.as_dvec3(), base.cmpge(Vec3::splat(f32::MIN_POSITIVE)) & base.cmple(Vec3::MAX))
    }
}

fn averaged(
    params: &Params,
    penumbra: &Image<bool>,
    surfaces: &Surfaces<'_>,
    albedo: &[Vec3],
    signal: &Signal<'_>,
) -> Image<Vec3> {
    let (width, height) = penumbra.size();
    let radius = params.radius as isize;
    let mut out = Image::filled(width, height, Vec3::ZERO);
    out.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            let here = y * width + x;
            *value = signal.values[here];
            if !penumbra.get(x, y) || !signal.counts(here) {
                continue;
            }
            let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
            for (dx, dy) in (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy))) {
                let Some(tap) = surfaces.place(x, y, dx, dy) else { continue };
                if !signal.counts(tap.index) {
                    continue;
                }
                let (tapped, share) = (signal.values[tap.index], signal.share[tap.index]);
                let painted = (albedo[here] - albedo[tap.index]).as_dvec3().length() / f64::from(params.sigma_albedo);
                let exponent = surfaces.exponent(here, tap, dx, dy, params.sigma_depth, params.sigma_normal);
                let weight = (-exponent - 0.5 * painted * painted).exp();
                if weight.is_nan() {
                    continue;
                }
                // A channel in which the photo is black has no ratio, and says nothing about the others.
                let (base, known) = signal.base(tap.index);
                sum += DVec3::select(known, tapped.as_dvec3() / base, DVec3::ZERO) * weight;
                weights += DVec3::select(known, DVec3::splat(f64::from(share) * weight), DVec3::ZERO);
            }
            let (base, known) = signal.base(here);
            let mean = sum / weights * f64::from(signal.share[here]) * base;
            *value = to_vec3(DVec3::select(weights.cmpgt(DVec3::ZERO) & known, mean, value.as_dvec3()));
        }
    });
    out
}
