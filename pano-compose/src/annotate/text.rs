//! Words in pictures, in an 8×8 bitmap font.

use font8x8::{BASIC_FONTS, UnicodeFonts};
use glam::Vec3;
use pano_core::image::RadianceImage;

/// Pixels of a glyph's side at scale 1.
pub(crate) const GLYPH: usize = 8;

/// Draws ASCII `text` with its top left corner at (`x`, `y`), each font pixel `scale` pixels wide. Characters the font does
/// not have leave a gap; what lies outside the picture is left out.
pub(crate) fn draw(picture: &mut RadianceImage, (x, y): (usize, usize), scale: usize, color: Vec3, text: &str) {
    let (width, height) = picture.size();
    for (i, glyph) in text.chars().enumerate() {
        let Some(rows) = BASIC_FONTS.get(glyph) else { continue };
        for (row, bits) in rows.into_iter().enumerate() {
            for column in (0..GLYPH).filter(|column| bits >> column & 1 == 1) {
                for (dx, dy) in (0..scale * scale).map(|k| (k % scale, k / scale)) {
                    let (px, py) = (x + (i * GLYPH + column) * scale + dx, y + row * scale + dy);
                    if px < width && py < height {
                        picture.set(px, py, color);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_l_is_an_l() {
        let mut picture = RadianceImage::filled(10, 9, Vec3::ZERO);
        draw(&mut picture, (1, 0), 1, Vec3::ONE, "L");
        let rows: Vec<String> =
            (0..7).map(|y| picture.row(y).iter().map(|p| if p.x > 0.0 { '#' } else { ' ' }).collect::<String>()).collect();
        let shape = rows.iter().map(|r| r.trim_end()).collect::<Vec<_>>().join("\n");
        assert_eq!(shape, " ####\n  ##\n  ##\n  ##\n  ##   #\n  ##  ##\n #######", "\n{shape}");
    }

    #[test]
    fn what_does_not_fit_is_left_out() {
        let mut picture = RadianceImage::filled(9, 3, Vec3::ZERO);
        draw(&mut picture, (5, 1), 3, Vec3::ONE, "Wide \u{1F600} text");
        draw(&mut picture, (500, 500), 1, Vec3::ONE, "far off");
        assert!(picture.data().contains(&Vec3::ONE));
    }
}
