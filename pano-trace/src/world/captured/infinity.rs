//! What a ray sees that has passed behind the last surface.

use glam::{Vec2, Vec3};
use pano_core::{image::Image, image::RadianceImage, sphere};
use std::collections::VecDeque;

/// The panorama with every texel that has depth replaced by the nearest one (in steps between texels, over seam and poles)
/// that has none: infinity is seen by direction, and never through a wall stretched over a window frame. `None` if the
/// whole panorama has depth.
pub(super) fn what_infinity_shows(radiance: &RadianceImage, depth: &Image<f32>) -> Option<RadianceImage> {
    let (w, h) = radiance.size();
    let nothing_at = |x: usize, y: usize| {
        let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
        let (dx, dy) = ((uv.x * depth.width() as f32) as usize, (uv.y * depth.height() as f32) as usize);
        let d = depth.get(dx.min(depth.width() - 1), dy.min(depth.height() - 1));
        !(d.is_finite() && d > 0.0)
    };
    let mut shows = radiance.clone();
    let mut known = Image::from_fn(w, h, nothing_at);
    let mut queue: VecDeque<(usize, usize)> = (0..w * h).map(|i| (i % w, i / w)).filter(|&(x, y)| known.get(x, y)).collect();
    if queue.is_empty() {
        return None;
    }
    while let Some((x, y)) = queue.pop_front() {
        let value: Vec3 = shows.get(x, y);
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            let (nx, ny) = sphere::wrap_texel(w, h, x as isize + dx, y as isize + dy);
            if !known.get(nx, ny) {
                known.set(nx, ny, true);
                shows.set(nx, ny, value);
                queue.push_back((nx, ny));
            }
        }
    }
    Some(shows)
}
