//! From one projection or size of picture to another: views of a panorama, panoramas of another size, panoramas of a view.
//!
//! Views are bilinear lookups at pixel centres. Smaller panoramas are averages over exact solid angles, so that no light is
//! lost or gained: a sun of one pixel lights as much after shrinking as before. Where nothing has to be resampled, pixels
//! are copied bit for bit.

mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;

use crate::camera::{Camera, Projection};
use crate::image::{Image, RadianceImage};
use crate::{Error, Result};
use glam::{Quat, Vec3};

/// Shows what `camera` sees of a panorama at infinity (the camera's position plays no part); `world_from_pano` turns the
/// panorama's directions into the world's.
///
/// One bilinear lookup at each pixel's centre: a view much coarser than the panorama needs a smaller panorama first
/// ([`resize_panorama`]). A view of the whole panorama at its own size, turned by whole columns or not at all, is a copy.
///
/// # Errors
/// [`Error::Argument`] if `view` is not of the camera's size.
pub fn view_from_panorama(
    panorama: &RadianceImage,
    world_from_pano: Quat,
    camera: &Camera,
    view: &mut RadianceImage,
) -> Result<()> {
    check_size("view", view, camera)?;
    match columns_to_roll(panorama, world_from_pano, camera) {
        Some(columns) => cpu::roll(panorama, columns, view),
        None => cpu::view_from_panorama(panorama, world_from_pano, camera, view),
    }
    Ok(())
}

/// By how many columns a view is the panorama rolled, if it is nothing else.
fn columns_to_roll(panorama: &RadianceImage, world_from_pano: Quat, camera: &Camera) -> Option<usize> {
    let same = camera.projection == Projection::Panorama && (camera.width, camera.height) == panorama.size();
    let pano_from_camera = world_from_pano.inverse() * camera.world_from_camera;
    if same { whole_columns(pano_from_camera, camera.width) } else { None }
}

/// Resamples a panorama to the size of `resized`.
///
/// An axis that shrinks is averaged, every pixel weighted by its exact solid angle within the new pixel: the integral of
/// radiance over the sphere stays the same. An axis that grows is interpolated, over the seam and the poles.
pub fn resize_panorama(panorama: &RadianceImage, resized: &mut RadianceImage) {
    let rows = resized.height();
    resize_mapped_panorama(panorama, |pixel| pixel, resized, rows);
}

/// The first `rows` rows of [`resize_panorama`] of the picture with `f` applied to every pixel, which is not kept: a large
/// frame is read only once, and only as far as it is needed. What further rows of `resized` hold is not specified.
pub fn resize_mapped_panorama(
    panorama: &RadianceImage,
    f: impl Fn(Vec3) -> Vec3 + Sync,
    resized: &mut RadianceImage,
    rows: usize,
) {
    let smaller = (panorama.width().min(resized.width()), panorama.height().min(resized.height()));
    if smaller == panorama.size() {
        cpu::enlarge(&panorama.map(f), resized);
    } else if smaller == resized.size() {
        cpu::shrink(panorama, f, resized, rows);
    } else {
        let mut between = Image::filled(smaller.0, smaller.1, Vec3::ZERO);
        cpu::shrink(panorama, f, &mut between, smaller.1);
        cpu::enlarge(&between, resized);
    }
}

/// Puts a view back onto the sphere: where the view shows the centre of a panorama's pixel, a bilinear lookup and a coverage
/// of 1; elsewhere black and 0. `world_from_pano` turns the panorama's directions into the world's.
///
/// # Errors
/// [`Error::Argument`] if `view` is not of the camera's size, or `coverage` not of the panorama's.
pub fn panorama_from_view(
    view: &RadianceImage,
    camera: &Camera,
    world_from_pano: Quat,
    panorama: &mut RadianceImage,
    coverage: &mut Image<f32>,
) -> Result<()> {
    check_size("view", view, camera)?;
    if coverage.size() != panorama.size() {
        let (mask, pano) = (coverage.size(), panorama.size());
        return Err(Error::argument(format!("the coverage has {mask:?} pixels, its panorama {pano:?}")));
    }
    cpu::panorama_from_view(view, camera, world_from_pano, panorama, coverage);
    Ok(())
}

/// What a camera's picture shows in world direction `d` from its own place, bilinear between the centres of pixels; `None`
/// outside the picture. `view` must be of the camera's size.
#[inline]
pub fn look_up_view(view: &RadianceImage, camera: &Camera, d: Vec3) -> Option<Vec3> {
    cpu::look_up(view, camera, d)
}

/// That a picture is of the size its camera says.
fn check_size(what: &str, image: &RadianceImage, camera: &Camera) -> Result<()> {
    if image.size() == (camera.width, camera.height) {
        return Ok(());
    }
    let size = image.size();
    Err(Error::argument(format!("the {what} has {size:?} pixels, its camera ({}, {})", camera.width, camera.height)))
}

/// By how many of `width` columns to the right a rotation turns the view, if it is about +Y alone and by whole columns.
fn whole_columns(pano_from_camera: Quat, width: usize) -> Option<usize> {
    // Radians and columns that rounding in quaternions may add: 2⁻²³ times a few products, on pictures up to 32768 wide.
    const TILT: f32 = 1e-6;
    const COLUMNS: f32 = 4e-3;
    let q = pano_from_camera;
    if q.x.abs() > TILT || q.z.abs() > TILT {
        return None;
    }
    // A positive angle about +Y turns to the left.
    let columns = -2.0 * q.y.atan2(q.w) / std::f32::consts::TAU * width as f32;
    let whole = columns.round();
    ((columns - whole).abs() < COLUMNS).then(|| (whole as i64).rem_euclid(width as i64) as usize)
}

#[cfg(test)]
mod tests;
