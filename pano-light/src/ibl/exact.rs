//! The reference: every pixel of the panorama, weighted by its solid angle.

use super::Kernel;
use glam::{Vec2, Vec3};
use pano_core::image::RadianceImage;
use pano_core::sphere;

/// `panorama` seen through `kernel`, for the pixels of a picture of `width` × `height`. Takes time in proportion to the
/// product of both pictures' pixels.
///
/// # Panics
/// If a side is 0.
pub fn convolved(panorama: &RadianceImage, kernel: Kernel, (width, height): (usize, usize)) -> RadianceImage {
    let (w, h) = panorama.size();
    let uv = |x: usize, y: usize, w: usize, h: usize| Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
    let light: Vec<(Vec3, f32, Vec3)> = (0..w * h)
        .map(|i| {
            let area = sphere::pixel_solid_angle(w, h, i / w) as f32;
            (sphere::direction_from_uv(uv(i % w, i / w, w, h)), area, panorama.data()[i])
        })
        .collect();
    RadianceImage::par_from_fn(width, height, |x, y| {
        let axis = sphere::direction_from_uv(uv(x, y, width, height));
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for &(direction, area, radiance) in &light {
            let weight = kernel.value(direction.dot(axis)) * area;
            sum += radiance * weight;
            total += weight;
        }
        if total > 0.0 { sum / total } else { Vec3::ZERO }
    })
}
