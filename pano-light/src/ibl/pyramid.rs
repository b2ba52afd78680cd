//! The panorama at falling resolutions, prepared for lookups of round footprints.

use glam::{Vec3, Vec3A};
use pano_core::image::{Image, RadianceImage};
use pano_core::sphere::{self, resample::resize_panorama};
use std::f32::consts::PI;

/// Rows of the finest level: 1.4° a row, half of what the smallest sector of the narrowest glossy lobe spans.
pub(super) const ROWS: usize = 128;
/// Levels, down to 4×2 pixels.
pub(super) const LEVELS: usize = 7;

/// Levels of 256×128, 128×64, … 4×2 pixels.
#[derive(Clone, Debug)]
pub(super) struct Pyramid {
    levels: Vec<Image<Vec3A>>,
}

impl Pyramid {
    pub(super) fn new(panorama: &RadianceImage) -> Self {
        let mut finest = RadianceImage::filled(2 * ROWS, ROWS, Vec3::ZERO);
        resize_panorama(panorama, &mut finest);
        let mut plain = vec![finest.map(Vec3A::from)];
        for level in 1..LEVELS {
            plain.push(halved(&plain[level - 1]));
        }
        Self { levels: plain.iter().map(widened).collect() }
    }

    /// A level, of those that [`level_for`] names.
    pub(super) fn level(&self, level: usize) -> &Image<Vec3A> {
        &self.levels[level]
    }
}

/// The level whose pixels at the equator come nearest to `solid_angle` in steradians.
pub(super) fn level_for(solid_angle: f32) -> usize {
    let rows = PI / solid_angle.max(1e-8).sqrt();
    (ROWS as f32 / rows).log2().round().clamp(0.0, (LEVELS - 1) as f32) as usize
}

/// Half the width over which row `y` of a level is averaged, in whole pixels; the row at the pole is one value.
pub(super) fn reach(width: usize, height: usize, y: usize) -> usize {
    let sin = ((y as f32 + 0.5) / height as f32 * PI).sin();
    ((0.5 / sin) as usize).min((width - 1) / 2)
}

/// Two by two pixels become one; rows weigh as their solid angles do.
fn halved(finer: &Image<Vec3A>) -> Image<Vec3A> {
    let (w, h) = (finer.width() / 2, finer.height() / 2);
    let area = |row: usize| sphere::pixel_solid_angle(finer.width(), finer.height(), row) as f32;
    let mut coarser = Image::filled(w, h, Vec3A::ZERO);
    for (y, row) in coarser.data_mut().chunks_mut(w).enumerate() {
        let (upper, lower) = (area(2 * y), area(2 * y + 1));
        let (upper, lower) = (0.5 * upper / (upper + lower), 0.5 * lower / (upper + lower));
        let pairs = finer.row(2 * y).chunks(2).zip(finer.row(2 * y + 1).chunks(2));
        for (out, (above, below)) in row.iter_mut().zip(pairs) {
            *out = (above[0] + above[1]) * upper + (below[0] + below[1]) * lower;
        }
    }
    coarser
}

/// Pixels are narrower towards the poles: each becomes a mean over 1/sin θ of them, so that all cover round patches of the
/// same size.
fn widened(level: &Image<Vec3A>) -> Image<Vec3A> {
    let (w, h) = level.size();
    let mut wide = level.clone();
    for y in 0..h {
        let half = reach(w, h, y);
        if half == 0 {
            continue;
        }
        let row = level.row(y);
        let share = 1.0 / (2 * half + 1) as f32;
        let mut sum: Vec3A = (0..2 * half + 1).map(|i| row[(i + w - half) % w]).sum();
        for x in 0..w {
            wide.set(x, y, sum * share);
            sum += row[(x + half + 1) % w] - row[(x + w - half) % w];
        }
    }
    wide
}
