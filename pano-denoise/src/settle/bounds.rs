//! What the traced layers can be: light is not negative. Noise is bounded before it is filtered, which would spread it.

use super::strays::around;
use glam::Vec3;
use pano_core::color::luminance;
use pano_core::image::{Image, RadianceImage};
use pano_core::layers::TracedLayers;

/// Sets changes that would leave less than no light to the photo's share of the pixel. Noise is what makes them: filtered as they
/// are, one such pixel blackens those around it. Takes noise's share of deep shadows, which falls with the samples.
pub(super) fn leave_no_less_than_black(layers: &mut TracedLayers, photo: &RadianceImage) {
    let shares = layers.coverage.data();
    for ((delta, photo), coverage) in layers.delta.data_mut().iter_mut().zip(photo.data()).zip(shares) {
        *delta = delta.max(photo.max(Vec3::ZERO) * (coverage - 1.0));
    }
}

/// Objects show surfaces with their change, of which each path has one estimate: where few paths meet a deep shadow, their sum may
/// be less than no light. Such pixels get what the darkest of their neighbours shows, or nothing.
pub(super) fn objects_are_not_darker_than_black(layers: &mut TracedLayers) {
    let (w, h) = layers.object.size();
    let bounded = Image::par_from_fn(w, h, |x, y| {
        let (object, coverage) = (layers.object.get(x, y), layers.coverage.get(x, y));
        if luminance(object) >= 0.0 {
            return object.max(Vec3::ZERO);
        }
        let mut darkest: Option<Vec3> = None;
        for (i, j) in around((w, h), false, (x, y), 1) {
            let (other, share) = (layers.object.get(i, j), layers.coverage.get(i, j));
            let shown = other.max(Vec3::ZERO) / share;
            if share > 0.0 && luminance(other) >= 0.0 && darkest.is_none_or(|d| luminance(shown) < luminance(d)) {
                darkest = Some(shown);
            }
        }
        darkest.map_or(Vec3::ZERO, |shown| shown * coverage)
    });
    layers.object = bounded;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_takes_no_more_light_than_the_share_of_the_photo_has() {
        let mut layers = TracedLayers::empty(4, 1);
        let photo = RadianceImage::filled(4, 1, Vec3::new(2.0, 1.0, -1.0));
        layers.delta =
            Image::from_fn(4, 1, |x, _| [Vec3::splat(-9.0), Vec3::splat(-0.5), Vec3::splat(9.0), Vec3::splat(-1.0)][x]);
        layers.coverage = Image::from_fn(4, 1, |x, _| [0.0, 0.25, 0.0, 1.0][x]);
        leave_no_less_than_black(&mut layers, &photo);
        let expected = [Vec3::new(-2.0, -1.0, 0.0), Vec3::new(-0.5, -0.5, 0.0), Vec3::splat(9.0), Vec3::ZERO];
        assert_eq!(layers.delta.data(), expected);
    }

    #[test]
    fn objects_darker_than_black_show_what_is_beside_them() {
        let mut layers = TracedLayers::empty(5, 3);
        layers.coverage = Image::from_fn(5, 3, |x, _| [0.0, 0.5, 1.0, 1.0, 1.0][x]);
        layers.object = Image::from_fn(5, 3, |x, y| {
            let noise = [(1, 1), (2, 1), (4, 0), (4, 1), (4, 2), (3, 0), (3, 1), (3, 2)].contains(&(x, y));
            Vec3::splat(layers.coverage.get(x, y)) * if noise { -2.0 } else { 0.25 + 0.25 * x as f32 + y as f32 }
        });
        // Green noise of a pixel that is not dark.
        layers.object.set(2, 2, Vec3::new(9.0, -0.1, 9.0));
        objects_are_not_darker_than_black(&mut layers);
        let at = |x: usize, y: usize| layers.object.get(x, y);
        assert_eq!((at(1, 1), at(2, 1)), (Vec3::splat(0.25), Vec3::splat(0.5)), "half and whole of (1, 0)");
        assert_eq!((at(2, 2), at(4, 1)), (Vec3::new(9.0, 0.0, 9.0), Vec3::ZERO));
        assert_eq!((at(1, 2), at(0, 1)), (Vec3::splat(1.25), Vec3::ZERO));
    }
}
