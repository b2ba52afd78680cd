//! What a ray sees that has passed behind the last surface.

use glam::Vec2;
use pano_core::{image::Image, sphere};
use std::collections::VecDeque;

/// Of a texel not reached yet: no panorama has so many.
const UNKNOWN: u32 = u32::MAX;

/// Which texel of a panorama of `size` infinity shows at each of its texels, row by row from the top: itself where it has no depth,
/// elsewhere the nearest one (in steps between texels, over seam and poles) that has none. So infinity is seen by direction, and never
/// through a wall stretched over a window frame. `None` if the whole panorama has depth.
pub(super) fn what_infinity_shows((w, h): (usize, usize), depth: &Image<f32>) -> Option<Image<u32>> {
    let nothing_at = |x: usize, y: usize| {
        let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
        let (dx, dy) = ((uv.x * depth.width() as f32) as usize, (uv.y * depth.height() as f32) as usize);
        let d = depth.get(dx.min(depth.width() - 1), dy.min(depth.height() - 1));
        !(d.is_finite() && d > 0.0)
    };
    let mut shows = Image::from_fn(w, h, |x, y| if nothing_at(x, y) { (y * w + x) as u32 } else { UNKNOWN });
    let known = |&(x, y): &(usize, usize)| shows.get(x, y) != UNKNOWN;
    let mut queue: VecDeque<(usize, usize)> = (0..w * h).map(|i| (i % w, i / w)).filter(known).collect();
    if queue.is_empty() {
        return None;
    }
    while let Some((x, y)) = queue.pop_front() {
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            let (nx, ny) = sphere::wrap_texel(w, h, x as isize + dx, y as isize + dy);
            if shows.get(nx, ny) == UNKNOWN {
                shows.set(nx, ny, shows.get(x, y));
                queue.push_back((nx, ny));
            }
        }
    }
    Some(shows)
}
