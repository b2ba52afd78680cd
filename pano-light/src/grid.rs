//! Directions and solid angles of the working map's pixels, computed once.

use crate::WorkingMap;
use glam::Vec3;
use pano_core::sphere;
use std::sync::LazyLock;

/// Tables of a row or a column each.
#[derive(Debug)]
pub(crate) struct Grid {
    /// Per row: steradians of one pixel.
    pub(crate) solid_angles: Vec<f64>,
    /// Per row: (sin θ, cos θ).
    pub(crate) rows: Vec<(f32, f32)>,
    /// Per column: (sin λ, cos λ).
    pub(crate) columns: Vec<(f32, f32)>,
}

static GRID: LazyLock<Grid> = LazyLock::new(|| {
    let (w, h) = (WorkingMap::WIDTH, WorkingMap::HEIGHT);
    let angle = |i: usize, n: usize, turn: f64| ((i as f64 + 0.5) / n as f64) * turn;
    let sin_cos = |angle: f64| (angle.sin() as f32, angle.cos() as f32);
    use std::f64::consts::{PI, TAU};
    Grid {
        solid_angles: (0..h).map(|row| sphere::pixel_solid_angle(w, h, row)).collect(),
        rows: (0..h).map(|y| sin_cos(angle(y, h, PI))).collect(),
        columns: (0..w).map(|x| sin_cos(angle(x, w, TAU) - PI)).collect(),
    }
});

/// The tables.
#[inline]
pub(crate) fn grid() -> &'static Grid {
    &GRID
}

impl Grid {
    /// Direction of the centre of the pixel with that index.
    #[inline]
    pub(crate) fn direction(&self, pixel: usize) -> Vec3 {
        let ((sin_t, cos_t), (sin_l, cos_l)) = (self.rows[pixel / WorkingMap::WIDTH], self.columns[pixel % WorkingMap::WIDTH]);
        Vec3::new(sin_t * sin_l, cos_t, -sin_t * cos_l)
    }

    /// Steradians of the pixel with that index.
    #[inline]
    pub(crate) fn solid_angle(&self, pixel: usize) -> f64 {
        self.solid_angles[pixel / WorkingMap::WIDTH]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn tables_agree_with_the_sphere() {
        let (w, h) = (WorkingMap::WIDTH, WorkingMap::HEIGHT);
        for pixel in [0, 1, w / 2, w * h / 2 + 7, w * h - 1] {
            let uv = Vec2::new((pixel % w) as f32 + 0.5, (pixel / w) as f32 + 0.5) / Vec2::new(w as f32, h as f32);
            assert!(grid().direction(pixel).abs_diff_eq(sphere::direction_from_uv(uv), 1e-6));
        }
        let sum: f64 = (0..w * h).map(|pixel| grid().solid_angle(pixel)).sum();
        assert!((sum / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12);
    }
}
