//! Nine spherical-harmonic coefficients a channel: diffuse light to a few percent (Ramamoorthi & Hanrahan 2001).

use glam::{Vec2, Vec3};
use pano_core::image::RadianceImage;
use pano_core::sphere;
use std::f32::consts::PI;

/// The first three bands of a panorama's radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sh9 {
    coefficients: [Vec3; 9],
}

/// What convolution with a clamped cosine leaves of bands 0, 1 and 2.
const COSINE: [f32; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];
/// Band of each coefficient.
const BAND: [usize; 9] = [0, 1, 1, 1, 2, 2, 2, 2, 2];

/// The real basis functions, with y, z and x of the literature (z up) being +X, +Y and +Z here.
fn basis(d: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = d;
    [
        0.282_095,
        0.488_603 * x,
        0.488_603 * y,
        0.488_603 * z,
        1.092_548 * z * x,
        1.092_548 * x * y,
        0.315_392 * (3.0 * y * y - 1.0),
        1.092_548 * z * y,
        0.546_274 * (z * z - x * x),
    ]
}

impl Sh9 {
    /// Of an equirectangular panorama.
    pub fn project(panorama: &RadianceImage) -> Self {
        let (w, h) = panorama.size();
        let mut sums = [glam::DVec3::ZERO; 9];
        for y in 0..h {
            let area = sphere::pixel_solid_angle(w, h, y);
            for (x, &radiance) in panorama.row(y).iter().enumerate() {
                let d = sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
                for (sum, value) in sums.iter_mut().zip(basis(d)) {
                    *sum += radiance.as_dvec3() * (f64::from(value) * area);
                }
            }
        }
        Self { coefficients: sums.map(|sum| sum.as_vec3()) }
    }

    /// Irradiance on a surface with unit `normal`; ringing below 0 is set to 0.
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        let basis = basis(normal);
        (0..9).map(|i| self.coefficients[i] * (COSINE[BAND[i]] * basis[i])).sum::<Vec3>().max(Vec3::ZERO)
    }
}
