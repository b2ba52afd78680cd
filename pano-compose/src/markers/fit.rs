//! The pose whose picture is the picture: every pixel of a marker against what the print would show there (direct alignment,
//! Lucas & Kanade 1981, with the pose as the warp). All edges of the print count, and the pixels' own filter is part of the
//! model, so that a hundredth of a pixel is told: a tag of 40 pixels from straight on shows a degree of tilt by a fiftieth.
//!
//! The print's white and black are whatever fits best, each with a linear change over the marker. A picture less sharp than its
//! pixels blurs all edges alike and shifts none.

use super::pattern::Pattern;
use super::pose::{Pose, least_squares, solve};
use glam::{DVec3, Vec2};
use pano_core::camera::{Camera, Projection};
use pano_core::color::luminance;
use pano_core::image::RadianceImage;

/// Samples along a pixel's side; between them the print is averaged exactly, along its own axes.
const GRID: usize = 3;
/// Most pixels that are compared; of larger markers every so many.
const MOST_PIXELS: usize = 5000;
/// Share of the rim's module that is looked at: beside it may be anything.
const RIM: f64 = 0.7;
/// Unknowns of the print's colours: white and black at the middle, and how both change to the right and down.
const COLORS: usize = 6;
/// The fit is taken if it leaves less than this share of the picture's variance unexplained; chosen empirically: a print of
/// another marker leaves half.
const LEFT_OVER: f64 = 0.1;

/// The pixels that show a marker.
pub(super) struct Sighting<'a> {
    pattern: &'a Pattern,
    size: f64,
    /// Radians a pixel.
    pixel: f64,
    /// Directions through each pixel, and its luminance.
    pixels: Vec<([DVec3; GRID * GRID], f64)>,
}

/// A pose and how well it explains the picture.
pub(super) struct Fit {
    pub(super) pose: Pose,
    /// Sum of squares of what is left.
    pub(super) left: f64,
    /// Degrees of freedom.
    pub(super) freedom: f64,
}

impl<'a> Sighting<'a> {
    /// The pixels that show the marker at `pose`. `None` if there are too few.
    pub(super) fn new(
        picture: &RadianceImage,
        camera: &Camera,
        pixel: f64,
        pattern: &'a Pattern,
        pose: &Pose,
        size: f64,
    ) -> Option<Self> {
        let mut sighting = Self { pattern, size, pixel, pixels: Vec::new() };
        let reach = size * (0.5 + 1.0 / pattern.side());
        let rim = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, z)| pose.world_from_marker * DVec3::new(x * reach, 0.0, z * reach) + pose.position);
        let middle = camera.pixel(pose.position.as_vec3())?;
        let wrap = camera.projection == Projection::Panorama;
        let width = camera.width as f32;
        let (mut lo, mut hi) = (middle, middle);
        for corner in rim {
            let mut at = camera.pixel(corner.as_vec3())?;
            if wrap {
                at.x -= ((at.x - middle.x) / width).round() * width;
            }
            (lo, hi) = (lo.min(at), hi.max(at));
        }
        // Rows of a panorama bend: near a pole a marker is in all columns.
        let bend = if wrap { 0.1 * (hi - lo).max_element() } else { 0.0 };
        let (lo, hi) = (lo - 2.0 - bend, hi + 2.0 + bend);
        let at_pole = wrap && (lo.y < 0.06 * camera.height as f32 || hi.y > 0.94 * camera.height as f32);
        let (left, right) = if at_pole { (0, camera.width as isize) } else { (lo.x as isize, hi.x as isize + 1) };
        let (top, bottom) = ((lo.y.max(0.0)) as usize, (hi.y.max(0.0) as usize + 1).min(camera.height));
        let area = (right - left).max(0) as usize * bottom.saturating_sub(top);
        let step = ((area / MOST_PIXELS) as f64).sqrt().ceil().max(1.0) as usize;
        for y in (top..bottom).step_by(step) {
            for x in (left..right).step_by(step) {
                let x = if wrap { x.rem_euclid(camera.width as isize) } else { x };
                if !(0..camera.width as isize).contains(&x) {
                    continue;
                }
                let at = |i: usize| (Vec2::new((i % GRID) as f32, (i / GRID) as f32) + 0.5) / GRID as f32;
                let corner = Vec2::new(x as f32, y as f32);
                let rays: [DVec3; GRID * GRID] = std::array::from_fn(|i| camera.direction(corner + at(i)).as_dvec3());
                let beyond = pattern.side() + RIM;
                let known = |m: [f64; 2]| m.iter().all(|v| (-RIM..beyond).contains(v));
                if rays.iter().all(|ray| sighting.on_print(pose, *ray).is_some_and(known))
                    && sighting.shown(pose, &rays).is_finite()
                {
                    let value = luminance(picture.get(x as usize, y));
                    sighting.pixels.push((rays, f64::from(value)));
                }
            }
        }
        // Too few tell nothing that the corners do not.
        (sighting.pixels.len() >= 64).then_some(sighting)
    }

    /// Where on the print a ray meets it, in modules.
    fn on_print(&self, pose: &Pose, ray: DVec3) -> Option<[f64; 2]> {
        let back = pose.world_from_marker.inverse();
        let (origin, direction) = (back * -pose.position, back * ray);
        let t = -origin.y / direction.y;
        let at = (origin + direction * t) / self.size + 0.5;
        (t > 0.0 && t.is_finite()).then(|| [at.x * self.pattern.side(), at.z * self.pattern.side()])
    }

    /// How white the print is in a pixel; NaN where that is not known.
    fn shown(&self, pose: &Pose, rays: &[DVec3; GRID * GRID]) -> f64 {
        let mut at = [[0.0; 2]; GRID * GRID];
        for (at, ray) in at.iter_mut().zip(rays) {
            let Some(on_print) = self.on_print(pose, *ray) else { return f64::NAN };
            *at = on_print;
        }
        // Half of what a sample covers, along the print's axes.
        let (last, spans) = (GRID - 1, 2.0 * (GRID - 1) as f64);
        let half: [f64; 2] =
            std::array::from_fn(|k| ((at[last][k] - at[0][k]).abs() + (at[GRID * last][k] - at[0][k]).abs()) / spans);
        let one = |m: &[f64; 2]| self.pattern.white([m[0] - half[0], m[1] - half[1]], [m[0] + half[0], m[1] + half[1]]);
        at.iter().map(one).sum::<f64>() / (GRID * GRID) as f64
    }

    /// What the best colours leave of each pixel. `None` if the picture does not tell them.
    fn residuals(&self, pose: &Pose) -> Option<Vec<f64>> {
        let rows: Vec<[f64; COLORS]> = self
            .pixels
            .iter()
            .map(|(rays, _)| {
                let white = self.shown(pose, rays);
                let white = if white.is_finite() { white } else { 0.5 };
                let [x, y] =
                    self.on_print(pose, rays[GRID * GRID / 2]).unwrap_or_default().map(|v| v / self.pattern.side() - 0.5);
                [1.0, white, x, y, white * x, white * y]
            })
            .collect();
        let mut normal = [[0.0; COLORS + 1]; COLORS];
        for (row, (_, value)) in rows.iter().zip(&self.pixels) {
            for i in 0..COLORS {
                for j in 0..COLORS {
                    normal[i][j] += row[i] * row[j];
                }
                normal[i][COLORS] += row[i] * value;
            }
        }
        let colors = solve(normal)?;
        let left = |(row, (_, value)): (&[f64; COLORS], &([DVec3; GRID * GRID], f64))| {
            row.iter().zip(&colors).map(|(a, b)| a * b).sum::<f64>() - value
        };
        Some(rows.iter().zip(&self.pixels).map(left).collect())
    }

    /// The pose near `start` that explains the picture best. `None` if none does.
    pub(super) fn fit(&self, start: Pose) -> Option<Fit> {
        let steps = [2e-3, 2e-3, 2e-3, 0.1 * self.pixel, 0.1 * self.pixel, 0.1 * self.pixel];
        let (pose, left) = least_squares(start, steps, |pose| self.residuals(pose))?;
        let n = self.pixels.len() as f64;
        let mean = self.pixels.iter().map(|p| p.1).sum::<f64>() / n;
        let variance = self.pixels.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>();
        (left < LEFT_OVER * variance).then_some(Fit { pose, left, freedom: n - (COLORS + 6) as f64 })
    }
}
