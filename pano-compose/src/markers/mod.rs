//! Printed markers in a picture, and where they lie (RT²AR: Santos et al. 2012, section III.B, which used ARToolKitPlus).
//!
//! AprilTags are found in perspective pictures. A panorama is searched through rectified views that overlap; each marker found
//! is looked at again in a view of its own, from straight on, where its corners are measured. Corners become bearing vectors, so
//! that seam and latitude do not matter, and the pose is the one whose corners are seen in those directions (least squares of
//! angles). A flat square seen from afar has two such poses. Both are fitted to the pixels of the picture itself, and the one
//! that explains it better is taken; it is told if they cannot be told apart.

mod detect;
mod fit;
mod pattern;
mod pose;

pub use pattern::Pattern;
pub use pose::{Pose, pose_from_bearings};

use detect::Detector;
use fit::{Fit, Sighting};
use glam::{Affine3A, DVec3, Quat, Vec2, Vec3};
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::image::RadianceImage;
use pano_core::scene::Marker;
use pano_core::sphere::resample::{look_up_view, view_from_panorama};
use pano_core::{Error, Result};

/// A marker and where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Its number.
    pub id: u32,
    /// Takes the marker's frame to the world: origin at its middle, +X to the print's right, +Y out of the paper, −Z to the
    /// print's top. Metres.
    pub world_from_marker: Affine3A,
    /// Metres from the camera to its middle.
    pub distance: f32,
    /// Root mean square of the angles between where its corners are seen and where the pose puts them, in degrees.
    pub error_degrees: f32,
    /// Another pose explains the picture nearly as well: the tilt is not known for sure.
    pub ambiguous: bool,
}

/// Field of view of the views that search a panorama, in degrees, and the angles between them: a marker of 35° is whole in one.
const SEARCH_FOV: f32 = 90.0;
const SEARCH_STEP: f32 = 45.0;
/// A view of its own shows this many times the marker's extent, so that its white rim is in it.
const CLOSE_UP: f32 = 3.0;
/// Pixels of a close-up.
const CLOSE_UP_SIZE: usize = 480;
/// A second pose within this factor of the first one's error is as good. Pixels are never better than a fifth of one.
const AMBIGUOUS: f64 = 1.5;
/// By how much more than the best pose another one leaves of the picture if it is not as good, in variances of a pixel: three
/// standard deviations.
const SURE: f64 = 9.0;
/// Views of a search are this much finer than the panorama: the detector's smallest squares are some pixels wide.
const FINER: f32 = 1.5;

/// Looks for `markers` in a picture of `camera`. What is not found is not in the list.
///
/// # Errors
/// [`Error::Argument`] for a family that is not known, or a picture not of the camera's size.
pub fn find(picture: &RadianceImage, camera: &Camera, markers: &[Marker]) -> Result<Vec<Found>> {
    if markers.is_empty() {
        return Ok(Vec::new());
    }
    if picture.size() != (camera.width, camera.height) {
        let size = picture.size();
        return Err(Error::argument(format!(
            "markers: the picture has {size:?} pixels, its camera {}×{}",
            camera.width, camera.height
        )));
    }
    let mut families: Vec<&str> = markers.iter().map(|marker| marker.family).collect();
    families.sort_unstable();
    families.dedup();
    let mut found = Vec::new();
    for family in families {
        let detector = Detector::new(family)?;
        let wanted = |id: u32| markers.iter().any(|m| m.family == family && m.id == id);
        let sights = if camera.projection == Projection::Panorama {
            search(picture, camera, &detector, wanted)?
        } else {
            let corners = detector.detect(picture).into_iter().filter(|c| wanted(c.id));
            corners.map(|c| (c.id, c.at.map(|at| camera.direction(at)))).collect()
        };
        let seen = sights.into_iter().map(|(id, sight)| Ok((id, close_up(picture, camera, &detector, id, sight)?)));
        let seen: Vec<(u32, [DVec3; 4])> = seen.collect::<Result<_>>()?;
        for (id, bearings) in seen {
            let Some(marker) = markers.iter().find(|m| m.family == family && m.id == id) else { continue };
            if let Some(poses) = pose_from_bearings(bearings, f64::from(marker.size)) {
                let pattern = Pattern::new(family, id)?;
                found.push(placed(marker, poses, &pattern, picture, camera));
            }
        }
    }
    Ok(found)
}

/// The pose that explains the picture best, of those near the two that the corners tell.
fn placed(
    marker: &Marker,
    (mut pose, mut other): (Pose, Option<Pose>),
    pattern: &Pattern,
    picture: &RadianceImage,
    camera: &Camera,
) -> Found {
    let pixel = pixel_angle(camera);
    let size = f64::from(marker.size);
    let mut ambiguous = other.is_some_and(|other| other.error < AMBIGUOUS * pose.error.max(0.2 * pixel));
    if let Some(sighting) = Sighting::new(picture, camera, pixel, pattern, &pose, size) {
        let mut fits: Vec<Fit> = [Some(pose), other.take()].into_iter().flatten().filter_map(|p| sighting.fit(p)).collect();
        fits.sort_by(|a, b| a.left.total_cmp(&b.left));
        if let Some(best) = fits.first() {
            let normal = |pose: &Pose| pose.world_from_marker * DVec3::Y;
            let apart = |fit: &&Fit| normal(&fit.pose).angle_between(normal(&best.pose)) > 1f64.to_radians();
            // Noise leaves the variance of one pixel for each degree of freedom.
            let noise = best.left / best.freedom;
            ambiguous = fits.iter().find(apart).is_some_and(|fit| fit.left - best.left < SURE * noise);
            pose = best.pose;
        }
    }
    Found {
        id: marker.id,
        world_from_marker: Affine3A::from_rotation_translation(
            pose.world_from_marker.as_quat(),
            camera.position + pose.position.as_vec3(),
        ),
        distance: pose.position.length() as f32,
        error_degrees: pose.error.to_degrees() as f32,
        ambiguous,
    }
}

/// Radians a pixel at the picture's middle.
fn pixel_angle(camera: &Camera) -> f64 {
    let middle = Vec2::new(0.5 * camera.width as f32, 0.5 * camera.height as f32);
    f64::from(camera.direction(middle).angle_between(camera.direction(middle + Vec2::X)))
}

/// What `camera`'s picture shows in a square view, turned by `rotation`; black where it shows nothing.
fn rectified(picture: &RadianceImage, camera: &Camera, rotation: Quat, fov: f32, size: usize) -> Result<(Camera, RadianceImage)> {
    let projection = Projection::Perspective { vfov: fov };
    let view = Camera { position: Vec3::ZERO, world_from_camera: rotation, projection, width: size, height: size };
    let mut shown = RadianceImage::filled(size, size, Vec3::ZERO);
    if camera.projection == Projection::Panorama {
        view_from_panorama(picture, camera.world_from_camera, &view, &mut shown)?;
    } else {
        shown = RadianceImage::par_from_fn(size, size, |x, y| {
            look_up_view(picture, camera, view.direction(Vec2::new(x as f32, y as f32) + 0.5)).unwrap_or(Vec3::ZERO)
        });
    }
    Ok((view, shown))
}

/// The corners of a marker, seen in these directions in the world, measured in a view of its own.
fn close_up(picture: &RadianceImage, camera: &Camera, detector: &Detector, id: u32, sight: [Vec3; 4]) -> Result<[DVec3; 4]> {
    let middle = middle_of(&sight);
    let reach = sight.iter().map(|d| d.angle_between(middle)).fold(0.0, f32::max);
    let rotation = Quat::from_rotation_arc(Vec3::NEG_Z, middle);
    let (view, shown) = rectified(picture, camera, rotation, (2.0 * CLOSE_UP * reach).min(2.0), CLOSE_UP_SIZE)?;
    let close = detector.detect(&shown).into_iter().find(|c| c.id == id).map(|c| c.at.map(|at| view.direction(at)));
    Ok(close.unwrap_or(sight).map(|d| d.as_dvec3()))
}

/// The corners of each marker in a panorama, as directions in the world.
fn search(
    panorama: &RadianceImage,
    camera: &Camera,
    detector: &Detector,
    wanted: impl Fn(u32) -> bool,
) -> Result<Vec<(u32, [Vec3; 4])>> {
    let fov = SEARCH_FOV.to_radians();
    let size = (FINER * panorama.width() as f32 / std::f32::consts::TAU * 2.0 * (0.5 * fov).tan()).clamp(64.0, 4096.0) as usize;
    // The best sight of each: the one nearest to the middle of its view.
    let mut best: Vec<(u32, f32, [Vec3; 4])> = Vec::new();
    let around = (360.0 / SEARCH_STEP) as usize;
    for pitch in [-90.0, -SEARCH_STEP, 0.0, SEARCH_STEP, 90.0] {
        let turns = if f32::abs(pitch) == 90.0 { 1 } else { around };
        for i in 0..turns {
            let rotation = rotation_from_yaw_pitch(i as f32 * SEARCH_STEP, pitch);
            let (view, shown) = rectified(panorama, camera, rotation, fov, size)?;
            for c in detector.detect(&shown).into_iter().filter(|c| wanted(c.id)) {
                let seen = c.at.map(|at| view.direction(at));
                let off = middle_of(&seen).angle_between(rotation * Vec3::NEG_Z);
                match best.iter_mut().find(|(id, ..)| *id == c.id) {
                    Some(known) if known.1 <= off => {}
                    Some(known) => *known = (c.id, off, seen),
                    None => best.push((c.id, off, seen)),
                }
            }
        }
    }
    Ok(best.into_iter().map(|(id, _, seen)| (id, seen)).collect())
}

fn middle_of(directions: &[Vec3; 4]) -> Vec3 {
    directions.iter().sum::<Vec3>().normalize()
}

#[cfg(test)]
pub(crate) mod tests;
