//! The lights of a panorama, drawn on it.

use super::text::{self, GLYPH};
use glam::{Vec2, Vec3};
use pano_core::image::RadianceImage;
use pano_core::light::DirectionalLight;
use pano_core::{color, sphere};

/// Colour of the marks: unlike any lamp.
const INK: Vec3 = Vec3::new(1.0, 0.0, 0.35);
/// Colour around letters, so that they are read on any ground.
const EDGE: Vec3 = Vec3::splat(0.005);

/// A light and what to write beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct LightMark {
    /// The light; its circle has the same solid angle.
    pub light: DirectionalLight,
    /// ASCII, written to the right of the circle.
    pub label: String,
}

/// Draws a circle around each light of an equirectangular picture, and its label. Circles are circles on the sphere: they
/// widen towards the poles and go on over the seam.
pub fn draw_lights(panorama: &mut RadianceImage, marks: &[LightMark]) {
    let (w, h) = panorama.size();
    let scale = (w / 800).max(1);
    // Radians from a circle's line to its edge: one and a half pixels in all.
    let half_line = 0.75 * scale as f32 * std::f32::consts::PI / h as f32;
    let circles: Vec<(Vec3, f32)> = marks
        .iter()
        // A circle too small to be seen is drawn as one of three pixels.
        .map(|m| (m.light.direction, m.light.cos_radius().clamp(-1.0, 1.0).acos().max(4.0 * half_line)))
        .collect();
    for y in 0..h {
        for x in 0..w {
            let d = sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32));
            let on_line = |(axis, radius): &(Vec3, f32)| (axis.dot(d).clamp(-1.0, 1.0).acos() - radius).abs() <= half_line;
            if circles.iter().any(on_line) {
                panorama.set(x, y, INK);
            }
        }
    }
    for (mark, (_, radius)) in marks.iter().zip(&circles) {
        let at = sphere::uv_from_direction(mark.light.direction) * Vec2::new(w as f32, h as f32);
        let width = mark.label.len() * GLYPH * scale;
        let offset = radius / std::f32::consts::PI * h as f32 + 3.0 * scale as f32;
        // Where there is no room to the right, to the left.
        let x = if at.x + offset + width as f32 <= w as f32 { at.x + offset } else { (at.x - offset - width as f32).max(0.0) };
        let y = (at.y - 0.5 * (GLYPH * scale) as f32).clamp(0.0, h.saturating_sub(GLYPH * scale) as f32);
        let (x, y) = (x as usize, y as usize);
        for (dx, dy) in [(0, 1), (2, 1), (1, 0), (1, 2)] {
            let corner = ((x + dx * scale).saturating_sub(scale), (y + dy * scale).saturating_sub(scale));
            text::draw(panorama, corner, scale, EDGE, &mark.label);
        }
        text::draw(panorama, (x, y), scale, INK, &mark.label);
    }
}

impl LightMark {
    /// A light with its rank (1 is the strongest); of the strongest also the luminance of its irradiance and its solid angle,
    /// which for all of a dozen lights would hide the picture.
    pub fn ranked(rank: usize, light: DirectionalLight) -> Self {
        let label = match rank {
            1..=3 => format!("{rank} E={:.3} {:.4}sr", color::luminance(light.irradiance), light.solid_angle),
            _ => rank.to_string(),
        };
        Self { light, label }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(direction: Vec3, radius: f32) -> DirectionalLight {
        let solid_angle = std::f32::consts::TAU * (1.0 - radius.to_radians().cos());
        DirectionalLight { direction, irradiance: Vec3::ONE, solid_angle, intensity: Vec3::ONE }
    }

    fn drawn(direction: Vec3) -> RadianceImage {
        let mut picture = RadianceImage::filled(128, 64, Vec3::ZERO);
        draw_lights(&mut picture, &[LightMark { light: light(direction, 20.0), label: String::new() }]);
        picture
    }

    #[test]
    fn a_circle_surrounds_its_light() {
        let picture = drawn(Vec3::NEG_Z);
        // 20° are 64/9 rows from the centre.
        let inked: Vec<usize> = (0..32).filter(|&y| picture.get(64, y) != Vec3::ZERO).collect();
        assert!(inked.iter().all(|y| (23..=26).contains(y)) && !inked.is_empty(), "{inked:?}");
        assert_eq!(picture.get(64, 32), Vec3::ZERO, "and leaves it to be seen");
    }

    #[test]
    fn a_circle_goes_on_over_the_seam() {
        let picture = drawn(Vec3::Z);
        let count = |columns: std::ops::Range<usize>| {
            columns.flat_map(|x| (0..64).map(move |y| (x, y))).filter(|&(x, y)| picture.get(x, y) != Vec3::ZERO).count()
        };
        assert_eq!(count(0..64), count(64..128));
        assert!(count(0..64) > 10);
    }

    #[test]
    fn labels_stay_in_the_picture() {
        for direction in [Vec3::Z, Vec3::Y, Vec3::NEG_Y, Vec3::new(-0.1, 0.0, 1.0).normalize()] {
            let mut picture = RadianceImage::filled(300, 150, Vec3::ZERO);
            draw_lights(&mut picture, &[LightMark::ranked(1, light(direction, 5.0))]);
            assert!(picture.data().contains(&EDGE), "{direction}");
        }
    }
}
