//! Point lights by median cut (Debevec 2005): the panorama is cut into regions of equal energy, each a light at its centroid.
//!
//! The classic way to light from a panorama with few lights, for comparison: it spends most of its lights on what casts no
//! visible shadow.

use crate::expand::LUMA_WEIGHTS;
use glam::{DVec3, Vec2};
use pano_core::image::RadianceImage;
use pano_core::light::DirectionalLight;
use pano_core::sphere;

/// A rectangle of pixels: columns and rows, ends excluded.
#[derive(Clone, Copy, Debug)]
struct Region {
    columns: [usize; 2],
    rows: [usize; 2],
}

/// 2^`cuts` lights that together are the panorama's light; fewer where it is black or has too few pixels. Regions do not
/// reach over the seam.
pub fn median_cut(panorama: &RadianceImage, cuts: u32) -> Vec<DirectionalLight> {
    let (w, h) = panorama.size();
    let sums = Sums::new(panorama);
    let mut regions = vec![Region { columns: [0, w], rows: [0, h] }];
    for _ in 0..cuts {
        regions = regions.into_iter().flat_map(|r| r.cut(&sums)).collect();
    }
    regions.into_iter().filter_map(|r| r.light(panorama)).collect()
}

/// Energy (luminance times solid angle) of all pixels above and left of a corner.
struct Sums {
    width: usize,
    height: usize,
    data: Vec<f64>,
}

impl Sums {
    fn new(panorama: &RadianceImage) -> Self {
        let (w, h) = panorama.size();
        let mut data = vec![0.0; (w + 1) * (h + 1)];
        for y in 0..h {
            let area = sphere::pixel_solid_angle(w, h, y);
            let mut row = 0.0;
            for (x, radiance) in panorama.row(y).iter().enumerate() {
                row += f64::from(radiance.dot(LUMA_WEIGHTS)) * area;
                data[(y + 1) * (w + 1) + x + 1] = data[y * (w + 1) + x + 1] + row;
            }
        }
        Self { width: w, height: h, data }
    }

    fn of(&self, r: Region) -> f64 {
        let at = |x: usize, y: usize| self.data[y * (self.width + 1) + x];
        let ([left, right], [top, bottom]) = (r.columns, r.rows);
        at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top)
    }
}

impl Region {
    /// The two halves of equal energy across the longer side, or the region itself if it cannot be cut.
    fn cut(self, sums: &Sums) -> Vec<Self> {
        let size = |[a, b]: [usize; 2]| b - a;
        let middle = 0.5 * (self.rows[0] + self.rows[1]) as f64 / sums.height as f64 * std::f64::consts::PI;
        // Columns are narrower towards the poles; a column at the equator is as wide as a row is high times 2·height/width.
        let across = size(self.columns) as f64 * middle.sin() * 2.0 * sums.height as f64 / sums.width as f64;
        let vertical = size(self.rows) < 2 || (across > size(self.rows) as f64 && size(self.columns) > 1);
        let [start, end] = if vertical { self.columns } else { self.rows };
        if end - start < 2 {
            return vec![self];
        }
        let part = |a: usize, b: usize| {
            if vertical { Self { columns: [a, b], ..self } } else { Self { rows: [a, b], ..self } }
        };
        let half = 0.5 * sums.of(self);
        let at = (start + 1..end - 1).find(|&at| sums.of(part(start, at)) >= half).unwrap_or(end - 1);
        vec![part(start, at), part(at, end)]
    }

    fn light(self, panorama: &RadianceImage) -> Option<DirectionalLight> {
        let (w, h) = panorama.size();
        let (mut irradiance, mut axis, mut solid_angle) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for y in self.rows[0]..self.rows[1] {
            let area = sphere::pixel_solid_angle(w, h, y);
            for x in self.columns[0]..self.columns[1] {
                let light = panorama.get(x, y).as_dvec3() * area;
                let d = sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
                irradiance += light;
                axis += d.as_dvec3() * light.dot(LUMA_WEIGHTS.as_dvec3());
                solid_angle += area;
            }
        }
        let irradiance = irradiance.as_vec3();
        let direction = axis.try_normalize()?.as_vec3();
        Some(DirectionalLight { direction, irradiance, solid_angle: solid_angle as f32, intensity: irradiance })
    }
}
