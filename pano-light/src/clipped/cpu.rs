//! From patches to lights.

use super::Params;
use super::patches::{Patch, patches};
use crate::WorkingMap;
use crate::detect::{self, Detection, Statistics, excess, strongest};
use crate::expand::{LUMA_WEIGHTS, factor};
use crate::grid::grid;
use glam::{DVec3, Vec3};
use pano_core::image::{Image, RadianceImage};
use pano_core::light::DirectionalLight;
use pano_core::sphere::resample::resize_panorama;

/// Patches belong to a group's light up to this many standard deviations from its strongest patch.
const GROUP_REACH: f32 = 2.0;

/// See [`super::detect`].
pub(super) fn detect(ldr: &RadianceImage, map: &WorkingMap, params: &Params) -> Detection {
    let (w, h) = (WorkingMap::WIDTH, WorkingMap::HEIGHT / 2);
    let mut small = RadianceImage::filled(WorkingMap::WIDTH, WorkingMap::HEIGHT, Vec3::ZERO);
    resize_panorama(ldr, &mut small);
    let luminance = Image::from_fn(w, h, |x, y| small.get(x, y).dot(LUMA_WEIGHTS));

    let Statistics { mean, sigma, .. } = Statistics::of(map, &detect::Params::default());
    // What is clipped must exceed the threshold, however much of the picture that is.
    let white = f64::from(factor(Vec3::splat(params.white)) * params.white);
    let threshold = (mean + detect::Params::default().sigmas * sigma).min(0.5 * white);

    let groups = grouped(patches(&luminance, params), params.group_degrees.to_radians());
    let mut lights: Vec<(DirectionalLight, &[Patch])> =
        groups.iter().filter_map(|group| Some((light(map, group, threshold as f32)?, group.as_slice()))).collect();
    let found = lights.len();
    let strength = |light: &DirectionalLight| light.intensity.dot(LUMA_WEIGHTS);
    lights.sort_by(|(a, _), (b, _)| strength(b).total_cmp(&strength(a)));
    lights.truncate(strongest(lights.iter().map(|(light, _)| strength(light)), params.keep));

    let mut lit = Image::filled(w, h, false);
    for &pixel in lights.iter().flat_map(|(_, group)| group.iter()).flat_map(|patch| &patch.pixels) {
        lit.data_mut()[pixel] = true;
    }
    let lights = lights.into_iter().map(|(light, _)| light).collect();
    Detection { threshold, mean, sigma, found, lights, lit }
}

/// Groups of patches that count together. Each is gathered about the patch in whose neighbourhood most light is; no group is
/// empty.
fn grouped(mut patches: Vec<Patch>, deviation: f32) -> Vec<Vec<Patch>> {
    let weight = |a: &Patch, b: &Patch| {
        let angle = a.direction.dot(b.direction).clamp(-1.0, 1.0).acos() / deviation;
        if angle <= GROUP_REACH { (-0.5 * angle * angle).exp() } else { 0.0 }
    };
    let mut groups = Vec::new();
    loop {
        let strength = |a: &Patch| patches.iter().map(|b| weight(a, b) * b.estimate).sum::<f32>();
        let Some(center) = patches.iter().max_by(|a, b| strength(a).total_cmp(&strength(b))).cloned() else { break groups };
        let (mut group, rest): (Vec<Patch>, Vec<Patch>) = patches.into_iter().partition(|b| weight(&center, b) > 0.0);
        patches = rest;
        for patch in &mut group {
            patch.estimate *= weight(&center, patch);
        }
        groups.push(group);
    }
}

/// The light of a group; `None` if nothing in it exceeds the threshold.
fn light(map: &WorkingMap, group: &[Patch], threshold: f32) -> Option<DirectionalLight> {
    let (mut irradiance, mut solid_angle) = (DVec3::ZERO, 0.0);
    for &pixel in group.iter().flat_map(|patch| &patch.pixels) {
        let area = grid().solid_angle(pixel);
        irradiance += excess(map.radiance().data()[pixel], threshold).as_dvec3() * area;
        solid_angle += area;
    }
    let irradiance = irradiance.as_vec3();
    let direction = group.iter().map(|patch| patch.direction * patch.estimate).sum::<Vec3>().try_normalize()?;
    let estimate: f32 = group.iter().map(|patch| patch.estimate).sum();
    let luma = irradiance.dot(LUMA_WEIGHTS);
    (luma > 0.0).then_some(DirectionalLight {
        direction,
        irradiance,
        solid_angle: solid_angle as f32,
        intensity: irradiance * (estimate / luma),
    })
}
