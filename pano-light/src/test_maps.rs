//! Panoramas made in code, for the tests of this crate.

use glam::{Vec2, Vec3};
use pano_core::image::RadianceImage;
use pano_core::sphere::direction_from_uv;

/// A round lamp at infinity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamp {
    /// Degrees to the right of −Z.
    pub(crate) yaw: f32,
    /// Degrees up.
    pub(crate) height: f32,
    /// Angular radius in degrees.
    pub(crate) radius: f32,
    pub(crate) radiance: Vec3,
}

impl Lamp {
    pub(crate) fn direction(&self) -> Vec3 {
        let (yaw, height) = (self.yaw.to_radians(), self.height.to_radians());
        Vec3::new(height.cos() * yaw.sin(), height.sin(), -height.cos() * yaw.cos())
    }

    pub(crate) fn white(yaw: f32, height: f32, radius: f32, radiance: f32) -> Self {
        Self { yaw, height, radius, radiance: Vec3::splat(radiance) }
    }
}

/// `width` × `width`/2 pixels, each the mean of 4×4 points: lamps before a dim sky that is brighter near the horizon.
pub(crate) fn sky(width: usize, lamps: &[Lamp]) -> RadianceImage {
    const POINTS: usize = 4;
    let height = width / 2;
    let lamps: Vec<(Vec3, f32, Vec3)> = lamps.iter().map(|l| (l.direction(), l.radius.to_radians().cos(), l.radiance)).collect();
    RadianceImage::par_from_fn(width, height, |x, y| {
        let point = |i: usize| {
            let at = Vec2::new((i % POINTS) as f32 + 0.5, (i / POINTS) as f32 + 0.5) / POINTS as f32;
            let d = direction_from_uv((Vec2::new(x as f32, y as f32) + at) / Vec2::new(width as f32, height as f32));
            let base = Vec3::new(0.15, 0.18, 0.22) * (1.2 - d.y.abs());
            lamps.iter().find(|(axis, cos, _)| axis.dot(d) > *cos).map_or(base, |lamp| lamp.2)
        };
        (0..POINTS * POINTS).map(point).sum::<Vec3>() / (POINTS * POINTS) as f32
    })
}

/// Degrees between unit vectors.
pub(crate) fn degrees(a: Vec3, b: Vec3) -> f32 {
    // Exact for small angles, where the arc cosine is not.
    (2.0 * (0.5 * a.distance(b)).min(1.0).asin()).to_degrees()
}
