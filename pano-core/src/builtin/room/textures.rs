//! Procedural pictures: wood, planks, a rug, paintings. Linear colours; every random number comes from an integer hash of its
//! place, so that pixels can be made in any order.

use crate::color::srgb_to_linear;
use crate::image::Image;
use crate::material::{Material, Texture};
use glam::{Vec2, Vec3, Vec4};
use std::sync::Arc;

/// No surface reflects more than this: white paint does not.
const MAX_ALBEDO: f32 = 0.82;

/// A colour written as in a paint program (sRGB, 0xRRGGBB), linear and at most [`MAX_ALBEDO`].
pub(super) fn paint(hex: u32) -> Vec3 {
    let channel = |shift: u32| srgb_to_linear((hex >> shift & 255) as f32 / 255.0);
    Vec3::new(channel(16), channel(8), channel(0)).min(Vec3::splat(MAX_ALBEDO))
}

/// A Lambertian surface showing `image`.
pub(super) fn textured(image: Image<Vec3>) -> Material {
    let image = Arc::new(image.map(|c: Vec3| c.clamp(Vec3::ZERO, Vec3::splat(MAX_ALBEDO)).extend(1.0)));
    let image: Arc<Image<Vec4>> = image;
    Material { base_color_texture: Some(Texture::new(image)), ..Material::diffuse(Vec3::ONE) }
}

/// A number in [0, 1) for a lattice point (lowbias32 of the mixed coordinates).
pub(super) fn random(x: i32, y: i32, seed: u32) -> f32 {
    let mut h = (x as u32).wrapping_mul(0x9e37_79b1)
        ^ (y as u32).wrapping_mul(0x85eb_ca77).rotate_left(13)
        ^ seed.wrapping_mul(0xc2b2_ae3d);
    h = (h ^ h >> 16).wrapping_mul(0x7feb_352d);
    h = (h ^ h >> 15).wrapping_mul(0x846c_a68b);
    ((h ^ h >> 16) >> 8) as f32 / (1 << 24) as f32
}

/// Smooth noise in [0, 1) with features of size 1.
fn noise(at: Vec2, seed: u32) -> f32 {
    let cell = at.floor();
    let f = at - cell;
    let f = f * f * (3.0 - 2.0 * f);
    let (x, y) = (cell.x as i32, cell.y as i32);
    let row = |y: i32| random(x, y, seed) * (1.0 - f.x) + random(x + 1, y, seed) * f.x;
    row(y) * (1.0 - f.y) + row(y + 1) * f.y
}

/// Four octaves of [`noise`], in [0, 1).
fn fractal(at: Vec2, seed: u32) -> f32 {
    let octave = |i: u32| noise(at * (1u32 << i) as f32, seed + i) / (2u32 << i) as f32;
    (0..4).map(octave).sum::<f32>() / 0.9375
}

/// A picture of `size` metres at `scale` pixels a metre; `color` gets metres from the top left corner.
fn picture(size: Vec2, scale: f32, color: impl Fn(Vec2) -> Vec3 + Sync) -> Image<Vec3> {
    let pixels = (size * scale).round();
    Image::par_from_fn(pixels.x as usize, pixels.y as usize, |x, y| color((Vec2::new(x as f32, y as f32) + 0.5) / pixels * size))
}

/// Wood with its grain along x; `at` in metres.
fn grain(at: Vec2, light: Vec3, dark: Vec3, seed: u32) -> Vec3 {
    let bend = fractal(at * Vec2::new(1.5, 4.0), seed) * 0.12;
    let rings = fractal(Vec2::new(at.x * 0.8, (at.y + bend) * 34.0), seed + 7);
    let fibres = noise(at * Vec2::new(12.0, 420.0), seed + 13);
    light.lerp(dark, (rings * 0.8 + fibres * 0.25).clamp(0.0, 1.0))
}

/// A table top's wood: one broad calm board.
pub(super) fn table_wood(size: Vec2) -> Image<Vec3> {
    picture(size, 600.0, |at| grain(at, paint(0xcf_a0_6c), paint(0x9c_6b_3f), 11))
}

/// Floor planks, 12 cm wide, running along x.
pub(super) fn planks(size: Vec2) -> Image<Vec3> {
    picture(size, 200.0, |at| {
        let row = (at.y / 0.12).floor();
        let shift = random(row as i32, 0, 5) * 1.3;
        let plank = ((at.x + shift) / 1.3).floor();
        let (tone, seed) = (random(plank as i32, row as i32, 17), (random(plank as i32, row as i32, 23) * 4096.0) as u32);
        let wood = grain(at + Vec2::new(0.0, row * 3.7), paint(0xb8_8a_5c), paint(0x80_58_36), seed);
        let gap = |t: f32, period: f32| (t.rem_euclid(period)).min(period - t.rem_euclid(period));
        let joint = gap(at.y, 0.12).min(gap(at.x + shift, 1.3));
        wood * (0.8 + 0.35 * tone) * if joint < 0.003 { 0.45 } else { 1.0 }
    })
}

/// A woven rug: border stripes around a field of lozenges.
pub(super) fn rug(size: Vec2) -> Image<Vec3> {
    let [red, blue, cream, ochre] = [0x9c_2f_2a, 0x27_3f_63, 0xe3_d5_b8, 0xc9_8a_35].map(paint);
    picture(size, 180.0, move |at| {
        let edge = at.min(size - at).min_element();
        let cell = Vec2::new(0.3, 0.3);
        let in_cell = ((at - 0.5 * size) / cell + 0.5).rem_euclid(Vec2::ONE) - 0.5;
        let lozenge = in_cell.x.abs() + in_cell.y.abs();
        let color = match edge {
            e if e < 0.04 => cream,
            e if e < 0.10 => blue,
            e if e < 0.12 => ochre,
            e if e < 0.20 => {
                if (at.x * 12.0).fract() < 0.5 || (at.y * 12.0).fract() < 0.5 {
                    red
                } else {
                    cream
                }
            }
            e if e < 0.23 => blue,
            _ if lozenge < 0.12 => ochre,
            _ if lozenge < 0.24 => blue,
            _ if lozenge < 0.30 => cream,
            _ => red,
        };
        // Knots of wool differ a little.
        color * (0.82 + 0.2 * noise(at * 160.0, 31) + 0.1 * fractal(at * 3.0, 37))
    })
}

/// A painting: hills under an evening sun.
pub(super) fn landscape(size: Vec2) -> Image<Vec3> {
    let hills = [0x6f_8f_a8, 0x4d_73_6a, 0x35_56_3c, 0x23_36_29].map(paint);
    picture(size, 280.0, move |at| {
        let p = at / size.y;
        let mut color = paint(0x8f_b5_d6).lerp(paint(0xf3_c9_8a), (p.y * 1.5).min(1.0));
        if p.distance(Vec2::new(1.05, 0.42)) < 0.11 {
            color = paint(0xf7_e3_9c);
        }
        for (i, hill) in hills.into_iter().enumerate() {
            let line = 0.42 + 0.15 * i as f32 - 0.22 * (noise(Vec2::new(p.x * (1.6 + i as f32 * 0.7), 0.5), 41 + i as u32) - 0.3);
            if p.y > line {
                color = hill;
            }
        }
        color * (0.85 + 0.25 * fractal(at * 50.0, 43))
    })
}

/// A painting: coloured fields between black bars.
pub(super) fn fields(size: Vec2) -> Image<Vec3> {
    let colors = [0xe8_e2_d4, 0xb5_2a_22, 0xe8_e2_d4, 0x23_4f_92, 0xe3_b4_2a, 0xe8_e2_d4].map(paint);
    let (columns, rows) = ([0.0, 0.3, 0.72, 1.0], [0.0, 0.42, 0.78, 1.0]);
    picture(size, 280.0, move |at| {
        let p = at / size;
        let place = |t: f32, lines: &[f32; 4]| (0..3).rfind(|&i| t >= lines[i]).unwrap_or(0);
        let near = |t: f32, lines: &[f32; 4], length: f32| lines[1..3].iter().any(|l| (t - l).abs() * length < 0.008);
        if near(p.x, &columns, size.x) || near(p.y, &rows, size.y) {
            return paint(0x1c_1a_19);
        }
        colors[(place(p.x, &columns) * 4 + place(p.y, &rows) * 3 + 1) % 6]
    })
}

/// A painting: overlapping discs on a pale ground.
pub(super) fn discs(size: Vec2) -> Image<Vec3> {
    let colors = [0xd9_6c_3f, 0x2f_6d_74, 0xe0_b2_4f, 0x7d_3b_52, 0x8a_a8_7a].map(paint);
    picture(size, 280.0, move |at| {
        let mut color = paint(0xe6_dc_c8);
        for (i, c) in colors.into_iter().enumerate() {
            let [x, y, r] = [0, 1, 2].map(|k| random(i as i32, k, 53));
            if (at - size * Vec2::new(0.2 + 0.6 * x, 0.2 + 0.6 * y)).length() < size.x * (0.12 + 0.18 * r) {
                color = c;
            }
        }
        color * (0.9 + 0.15 * fractal(at * 40.0, 59))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_stays_in_its_range_and_fills_it() {
        let values: Vec<f32> = (0..4000).map(|i| fractal(Vec2::new(i as f32 * 0.37, i as f32 * 0.11 - 200.0), 3)).collect();
        let (low, high) = values.iter().fold((1.0f32, 0.0f32), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(low >= 0.0 && high < 1.0 && low < 0.25 && high > 0.75, "{low} {high}");
    }

    #[test]
    fn hashed_numbers_are_even() {
        let mut bins = [0; 16];
        (0..64).for_each(|x| (0..64).for_each(|y| bins[(random(x, y, 9) * 16.0) as usize] += 1));
        assert!(bins.iter().all(|&n| (196..=316).contains(&n)), "256 ± 4σ each: {bins:?}");
    }
}
