//! The real picture in the view.

use super::device::Device;
use super::{CameraInputs, Inputs, Result, World};
use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::{Image, RadianceImage};
use pano_core::{camera::Camera, layers::TracedLayers, scene::Scene, sphere};

/// The photo in the view and, for LDR input, the inversely tone-mapped one that lights the objects.
pub(super) fn view_of_photo(
    scene: &Scene,
    inputs: &Inputs,
    world: &World,
    camera: &Camera,
    device: &mut Device,
) -> Result<(RadianceImage, Option<RadianceImage>)> {
    let turn = scene.panorama.world_from_pano();
    let capture = scene.panorama.position;
    let moved = camera.position.distance(capture) > 1e-4;
    if let Some(seen) = &inputs.camera {
        return Ok((through_depth_camera(scene, inputs, seen, world, camera), None));
    }
    let mut view = |picture: &RadianceImage| -> Result<RadianceImage> {
        if moved {
            // Another place sees the surface from elsewhere: each pixel shows what the panorama shows of its point.
            return Ok(RadianceImage::par_from_fn(camera.width, camera.height, |x, y| {
                let d = camera.direction(glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                let seen = world.hit_position(camera.position, d).map_or(d, |p| p - capture);
                sphere::bilinear(picture, sphere::uv_from_direction(turn.inverse() * seen))
            }));
        }
        let mut out = RadianceImage::filled(camera.width, camera.height, Vec3::ZERO);
        device.view(picture, turn, camera, &mut out)?;
        Ok(out)
    };
    let lighting = match &inputs.lighting {
        Some(lighting) if world.reflects_picture() => Some(view(lighting)?),
        _ => None,
    };
    Ok((view(&inputs.photo)?, lighting))
}

/// A view of what a depth camera and, beside it, the panorama have seen; the camera's own view is its picture.
fn through_depth_camera(scene: &Scene, inputs: &Inputs, seen: &CameraInputs, world: &World, camera: &Camera) -> RadianceImage {
    if *camera == seen.camera {
        return seen.photo.as_ref().clone();
    }
    let pano_from_world = scene.panorama.world_from_pano().inverse();
    RadianceImage::par_from_fn(camera.width, camera.height, |x, y| {
        let d = camera.direction(glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
        let at = world.hit_position(camera.position, d);
        // The camera knows a point that it sees at about its own distance, or further: nothing nearer was there.
        let by_camera = at.map_or(d, |p| p - seen.camera.position);
        let shown = sphere::resample::look_up_view(&seen.photo, &seen.camera, by_camera).filter(|_| match at {
            None => true,
            Some(p) => world.hit_position(seen.camera.position, by_camera).is_some_and(|first| {
                let to = by_camera.length();
                first.distance(p) < 0.02 * to
            }),
        });
        shown.unwrap_or_else(|| {
            let by_panorama = at.map_or(d, |p| p - scene.panorama.position);
            sphere::bilinear(&inputs.photo, sphere::uv_from_direction(pano_from_world * by_panorama))
        })
    })
}

/// The error of [`rescale_delta`]'s result, to call after it: that of what the pixel shows of objects stays.
pub(super) fn rescale_error(error: &mut Image<f32>, layers: &TracedLayers, photo: &RadianceImage, lighting: &RadianceImage) {
    let pictures = photo.data().iter().zip(lighting.data()).zip(layers.coverage.data());
    for (error, ((photo, lighting), coverage)) in error.data_mut().iter_mut().zip(pictures) {
        let (photo, lighting) = (luminance(*photo), luminance(*lighting));
        let ratio = if lighting > 0.0 { photo / lighting } else { 1.0 };
        *error *= coverage + (1.0 - coverage) * ratio;
    }
}

/// Where reflectance was read off an inversely tone-mapped picture, the change is relative to that picture: brings it to the
/// photo's scale, L_photo·ΔE/E.
pub(super) fn rescale_delta(layers: &mut TracedLayers, photo: &RadianceImage, lighting: &RadianceImage) {
    for ((delta, photo), lighting) in layers.delta.data_mut().iter_mut().zip(photo.data()).zip(lighting.data()) {
        let ratio = |p: f32, l: f32| if l > 0.0 { p / l } else { 1.0 };
        *delta *= Vec3::new(ratio(photo.x, lighting.x), ratio(photo.y, lighting.y), ratio(photo.z, lighting.z));
    }
}
