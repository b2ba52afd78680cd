//! Clipped patches and what the picture tells of them.

use super::Params;
use crate::WorkingMap;
use crate::detect::components;
use crate::grid::grid;
use glam::{DVec3, Vec3};
use pano_core::image::Image;
use std::f32::consts::{PI, TAU};

/// Degrees from the edge of a patch's cap to the inner and the outer end of the two rings of its halo. The first starts half a
/// pixel off, outside the patch's blurred edge.
const RINGS: [[f32; 2]; 2] = [[0.6, 3.0], [3.0, 8.0]];
/// Added to both rings' luminance: noise of dark surroundings is no halo.
const DARK: f32 = 0.02;
/// Added to the compactness, so that a ring around nothing still counts a little.
const HOLLOW: f32 = 0.05;
/// Most patches that are looked at, the largest first; more only add to each other's noise.
const MAX_PATCHES: usize = 256;

/// A connected patch of clipped pixels.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// Its pixels in the upper half.
    pub(super) pixels: Vec<usize>,
    /// Unit mean direction.
    pub(super) direction: Vec3,
    /// Steradians.
    pub(super) solid_angle: f32,
    /// Estimated irradiance.
    pub(super) estimate: f32,
}

/// The patches of `luminance` (linear, of the upper half), estimated.
pub(super) fn patches(luminance: &Image<f32>, params: &Params) -> Vec<Patch> {
    let grid = grid();
    let clipped = luminance.map(|y| y >= params.white);
    let mut patches: Vec<Patch> = components(&clipped)
        .into_iter()
        .filter_map(|pixels| {
            let solid_angle = pixels.iter().map(|&p| grid.solid_angle(p)).sum::<f64>();
            let axis: DVec3 = pixels.iter().map(|&p| grid.direction(p).as_dvec3() * grid.solid_angle(p)).sum();
            let direction = axis.try_normalize()?.as_vec3();
            let solid_angle = solid_angle as f32;
            (solid_angle >= params.least_solid_angle).then_some(Patch { pixels, direction, solid_angle, estimate: 0.0 })
        })
        .collect();
    patches.sort_by(|a, b| b.solid_angle.total_cmp(&a.solid_angle));
    patches.truncate(MAX_PATCHES);
    for patch in &mut patches {
        let surroundings = Surroundings::of(patch, luminance, &clipped);
        patch.estimate = params.scale
            * patch.solid_angle.powf(params.size)
            * surroundings.halo.powf(params.halo)
            * (params.height * patch.direction.y).exp()
            * surroundings.compactness.powf(params.compactness);
    }
    patches
}

/// What lies in and around a patch's cap.
#[derive(Clone, Copy, Debug)]
struct Surroundings {
    halo: f32,
    compactness: f32,
}

impl Surroundings {
    fn of(patch: &Patch, luminance: &Image<f32>, clipped: &Image<bool>) -> Self {
        let (w, h) = luminance.size();
        let grid = grid();
        let cos_cap = (1.0 - patch.solid_angle / TAU).clamp(-1.0, 1.0);
        let cap = cos_cap.acos();
        let cos = |degrees: f32| (cap + degrees.to_radians()).min(PI).cos();
        let edges = RINGS.map(|[inner, outer]| [cos(inner), cos(outer)]);

        let inside: f64 = patch
            .pixels
            .iter()
            .filter(|&&p| grid.direction(p).dot(patch.direction) >= cos_cap)
            .map(|&p| grid.solid_angle(p))
            .sum();
        // Rows beyond the outermost ring cannot take part.
        let theta = patch.direction.y.clamp(-1.0, 1.0).acos();
        let reach = cap + RINGS[1][1].to_radians();
        let row = |angle: f32| (angle / PI * WorkingMap::HEIGHT as f32).clamp(0.0, h as f32) as usize;
        let d = patch.direction;
        let across: Vec<f32> = grid.columns.iter().map(|(sin_l, cos_l)| d.x * sin_l - d.z * cos_l).collect();
        let mut rings = [(0.0, 0.0); 2];
        for y in row(theta - reach)..(row(theta + reach) + 1).min(h) {
            let ((sin_t, cos_t), area_of_pixel) = (grid.rows[y], grid.solid_angles[y]);
            for (x, &horizontal) in across.iter().enumerate() {
                let pixel = y * w + x;
                if clipped.data()[pixel] {
                    continue;
                }
                let cos = sin_t * horizontal + cos_t * patch.direction.y;
                for ((light, area), [inner, outer]) in rings.iter_mut().zip(edges) {
                    if cos < inner && cos >= outer {
                        *light += f64::from(luminance.data()[pixel]) * area_of_pixel;
                        *area += area_of_pixel;
                    }
                }
            }
        }
        // A ring that is clipped all over tells nothing: it counts as dark.
        let [near, far] = rings.map(|(light, area)| if area > 0.0 { (light / area) as f32 } else { 0.0 });
        Self { halo: (near + DARK) / (far + DARK), compactness: (inside / f64::from(patch.solid_angle)) as f32 + HOLLOW }
    }
}
