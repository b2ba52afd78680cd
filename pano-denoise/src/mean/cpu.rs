//! The filter on the CPU: a window about each pixel of a penumbra, rayon over rows.

use super::{Params, Report, Signal};
use crate::surfaces::Surfaces;
use crate::{Energy, to_vec3};
use glam::{DVec3, Vec3};
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

fn averaged(
    params: &Params,
    penumbra: &Image<bool>,
    surfaces: &Surfaces,
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
            if !penumbra.get(x, y) || signal.share[here] <= 0.0 || !value.is_finite() {
                continue;
            }
            let (mut sum, mut weights) = (DVec3::ZERO, DVec3::ZERO);
            for (dx, dy) in (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy))) {
                let Some(tap) = surfaces.place(x, y, dx, dy) else { continue };
                let (tapped, share) = (signal.values[tap.index], signal.share[tap.index]);
                if share <= 0.0 || !tapped.is_finite() {
                    continue;
                }
                let painted = (albedo[here] - albedo[tap.index]).as_dvec3().length() / f64::from(params.sigma_albedo);
                let exponent = surfaces.exponent(here, tap, dx, dy, params.sigma_depth, params.sigma_normal);
                let weight = (-exponent - 0.5 * painted * painted).exp();
                // A channel in which the photo is black has no ratio, and says nothing about the others.
                let base = signal.base.map_or(DVec3::ONE, |base| base[tap.index].as_dvec3());
                let known = base.cmpgt(DVec3::ZERO);
                sum += DVec3::select(known, tapped.as_dvec3() / base, DVec3::ZERO) * weight;
                weights += DVec3::select(known, DVec3::splat(f64::from(share) * weight), DVec3::ZERO);
            }
            let base = signal.base.map_or(DVec3::ONE, |base| base[here].as_dvec3());
            let mean = sum / weights * f64::from(signal.share[here]) * base;
            *value = to_vec3(DVec3::select(weights.cmpgt(DVec3::ZERO) & base.cmpgt(DVec3::ZERO), mean, value.as_dvec3()));
        }
    });
    out
}
