//! The reference: rows in parallel, one pixel at a time.

use super::super::{bilinear, direction_from_uv, uv_from_direction};
use crate::camera::{Camera, Projection};
use crate::image::{Image, RadianceImage};
use glam::{DVec3, Quat, Vec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Calls `pixel(x, y)` for every pixel, rows in parallel.
fn fill(image: &mut RadianceImage, pixel: impl Fn(usize, usize) -> Vec3 + Sync) {
    let width = image.width();
    image.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = pixel(x, y);
        }
    });
}

/// The centre of pixel (x, y).
fn center(x: usize, y: usize) -> Vec2 {
    Vec2::new(x as f32 + 0.5, y as f32 + 0.5)
}

/// The view's column x is the panorama's column x + `columns`.
pub(super) fn roll(panorama: &RadianceImage, columns: usize, view: &mut RadianceImage) {
    let width = panorama.width();
    view.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let (left, right) = panorama.row(y).split_at(columns);
        row[..width - columns].copy_from_slice(right);
        row[width - columns..].copy_from_slice(left);
    });
}

pub(super) fn view_from_panorama(panorama: &RadianceImage, world_from_pano: Quat, camera: &Camera, view: &mut RadianceImage) {
    let pano_from_world = world_from_pano.inverse();
    fill(view, |x, y| bilinear(panorama, uv_from_direction(pano_from_world * camera.direction(center(x, y)))));
}

/// Interpolates where an axis grows; an axis of the same size stays as it is.
pub(super) fn enlarge(panorama: &RadianceImage, resized: &mut RadianceImage) {
    if panorama.size() == resized.size() {
        resized.data_mut().copy_from_slice(panorama.data());
        return;
    }
    let size = Vec2::new(resized.width() as f32, resized.height() as f32);
    fill(resized, |x, y| bilinear(panorama, center(x, y) / size));
}

/// Averages `f` of the pixels over solid angle, for the first `rows` rows. An axis of the same size stays as it is.
pub(super) fn shrink(panorama: &RadianceImage, f: impl Fn(Vec3) -> Vec3 + Sync, resized: &mut RadianceImage, rows: usize) {
    let (width, height) = resized.size();
    let columns: Vec<Vec<(usize, f64)>> =
        (0..width).map(|x| overlaps(x, width, panorama.width()).map(|(i, [a, b])| (i, b - a)).collect()).collect();
    resized.data_mut().par_chunks_mut(width).take(rows).enumerate().for_each(|(y, row)| {
        // Down first: that pass reads every pixel once, in order. f64: a sun of 1e5 among thousands of dim pixels must not
        // swallow them; a few rows at a time are added in f32, which is twice as fast and exact enough for so few.
        let mut sums = vec![DVec3::ZERO; panorama.width()];
        let mut block = vec![Vec3::ZERO; panorama.width()];
        let mut mapped = block.clone();
        for rows in row_shares(y, height, panorama.height()).chunks(BLOCK_ROWS) {
            block.fill(Vec3::ZERO);
            for &(j, share) in rows {
                mapped.iter_mut().zip(panorama.row(j)).for_each(|(out, &pixel)| *out = f(pixel));
                // Channel by channel, for the compiler to see that all are treated alike.
                let (block, mapped): (&mut [f32], &[f32]) = (bytemuck::cast_slice_mut(&mut block), bytemuck::cast_slice(&mapped));
                let share = share as f32;
                block.iter_mut().zip(mapped).for_each(|(sum, m)| *sum += share * m);
            }
            sums.iter_mut().zip(&block).for_each(|(sum, b)| *sum += b.as_dvec3());
        }
        for (out, taps) in row.iter_mut().zip(&columns) {
            *out = (width as f64 * taps.iter().map(|&(i, share)| share * sums[i]).sum::<DVec3>()).as_vec3();
        }
    });
}

/// Rows that [`shrink`] adds in f32.
const BLOCK_ROWS: usize = 16;

/// The rows that row `target` of `targets` overlaps, one after the other, each with its share of the solid angle.
pub(super) fn row_shares(target: usize, targets: usize, sources: usize) -> Vec<(usize, f64)> {
    let mut slices: Vec<(usize, f64)> = overlaps(target, targets, sources)
        // cos top − cos bottom as a product: no cancellation in thin slices.
        .map(|(j, [top, bottom])| (j, (0.5 * PI * (top + bottom)).sin() * (0.5 * PI * (bottom - top)).sin()))
        .collect();
    let total: f64 = slices.iter().map(|(_, slice)| slice).sum();
    slices.iter_mut().for_each(|(_, slice)| *slice /= total);
    slices
}

/// The cells of `sources` equal parts of [0, 1] that part `target` of `targets` overlaps, each with the overlap's ends. Ends
/// are compared as integers in units of 1/(targets·sources), so that the overlaps cover each cell exactly once.
fn overlaps(target: usize, targets: usize, sources: usize) -> impl Iterator<Item = (usize, [f64; 2])> {
    let (start, end) = (target * sources, (target + 1) * sources);
    let unit = (targets * sources) as f64;
    (start / targets..end.div_ceil(targets)).map(move |i| {
        let (from, to) = (start.max(i * targets), end.min((i + 1) * targets));
        (i, [from as f64 / unit, to as f64 / unit])
    })
}

pub(super) fn panorama_from_view(
    view: &RadianceImage,
    camera: &Camera,
    world_from_pano: Quat,
    panorama: &mut RadianceImage,
    coverage: &mut Image<f32>,
) {
    let (width, height) = panorama.size();
    let size = Vec2::new(width as f32, height as f32);
    let rows = panorama.data_mut().par_chunks_mut(width).zip(coverage.data_mut().par_chunks_mut(width));
    rows.enumerate().for_each(|(y, (row, mask))| {
        for (x, (out, covered)) in row.iter_mut().zip(mask).enumerate() {
            let seen = look_up(view, camera, world_from_pano * direction_from_uv(center(x, y) / size));
            *out = seen.unwrap_or(Vec3::ZERO);
            *covered = if seen.is_some() { 1.0 } else { 0.0 };
        }
    });
}

/// What the view shows in the world's direction `d`.
pub(super) fn look_up(view: &RadianceImage, camera: &Camera, d: Vec3) -> Option<Vec3> {
    let at = camera.pixel(d)?;
    let size = Vec2::new(camera.width as f32, camera.height as f32);
    if camera.projection == Projection::Panorama {
        return Some(bilinear(view, at / size));
    }
    if !(at.cmpge(Vec2::ZERO).all() && at.cmple(size).all()) {
        return None;
    }
    // The outer half of the border's pixels has no neighbour outside: it repeats them.
    let inner = (at - 0.5).clamp(Vec2::ZERO, size - 1.0);
    let (x, y) = (inner.x as usize, inner.y as usize);
    let (right, below) = ((x + 1).min(camera.width - 1), (y + 1).min(camera.height - 1));
    let f = inner - inner.floor();
    let upper = view.get(x, y).lerp(view.get(right, y), f.x);
    let lower = view.get(x, below).lerp(view.get(right, below), f.x);
    Some(upper.lerp(lower, f.y))
}
