//! What a sequence carries from frame to frame.

use super::Frame;
use super::filter::Histories;
use pano_core::{camera::Camera, color::luminance, image::Image, image::RadianceImage};
use pano_trace::iprt::{Earlier, Update};
use std::sync::Arc;

/// Relative difference between two panoramas, as the sum of differences over the sum of values, from which on they are
/// different shots: a person walking through changes a tenth at most, another room more than half.
const CUT: f64 = 0.25;
/// Texels that are compared lie this many apart.
const STRIDE: usize = 7;

/// The past of a sequence.
#[derive(Debug)]
pub(crate) struct State {
    frame: u32,
    radiance: Arc<RadianceImage>,
    depth: Option<Arc<Image<f32>>>,
    /// Frames since anything has moved.
    pub(super) still: u32,
    pub(super) earlier: Earlier,
    pub(super) histories: Histories,
    /// What is known of the panorama's surfaces.
    pub(super) update: Update,
    /// Frames for which pixels stay active.
    pub(super) active: Image<u32>,
}

impl State {
    /// Of a frame that has just been rendered, nothing having moved for `still` frames.
    pub(super) fn new(frame: &Frame<'_>, still: u32, histories: Histories, update: Update, active: Image<u32>) -> Self {
        Self {
            frame: frame.options.frame,
            radiance: frame.inputs.radiance().clone(),
            depth: frame.inputs.depth.clone(),
            still,
            earlier: Earlier { camera: frame.camera, objects: frame.objects.clone() },
            histories,
            update,
            active,
        }
    }

    /// Whether `frame` is the next one of the same shot, in a view of the same size. A lost frame or a cut ends a history.
    pub(super) fn continues(&self, frame: &Frame<'_>) -> bool {
        let same_size = |a: &Camera, b: &Camera| (a.width, a.height, a.projection) == (b.width, b.height, b.projection);
        frame.options.frame == self.frame + 1
            && same_size(&self.earlier.camera, &frame.camera)
            && !is_cut(&self.radiance, frame.inputs.radiance())
    }

    /// How many frames nothing will have moved for in `frame`, the next one.
    pub(super) fn still_until(&self, frame: &Frame<'_>) -> u32 {
        let same_depth = match (&self.depth, &frame.inputs.depth) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        let same_world = same_depth && Arc::ptr_eq(&self.radiance, frame.inputs.radiance());
        let same = same_world && self.earlier.camera == frame.camera && frame.objects.stand_as(&self.earlier.objects);
        if same { self.still.saturating_add(1) } else { 0 }
    }
}

/// Whether two panoramas are of different shots.
fn is_cut(a: &Arc<RadianceImage>, b: &Arc<RadianceImage>) -> bool {
    if Arc::ptr_eq(a, b) {
        return false;
    }
    if a.size() != b.size() {
        return true;
    }
    let (mut apart, mut sum) = (0.0f64, 0.0f64);
    for (&x, &y) in a.data().iter().zip(b.data()).step_by(STRIDE) {
        // A sun must not outweigh the rest.
        let (x, y) = (luminance(x).min(1.0), luminance(y).min(1.0));
        apart += f64::from((x - y).abs());
        sum += f64::from(x + y);
    }
    apart > CUT * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn another_room_is_a_cut_and_a_passer_by_is_none() {
        let room = Arc::new(Image::from_fn(64, 32, |x, y| Vec3::splat(0.3 + 0.2 * ((x + y) % 5) as f32)));
        let walker = Arc::new(Image::from_fn(64, 32, |x, y| if x < 4 { Vec3::ZERO } else { room.get(x, y) }));
        let other = Arc::new(Image::from_fn(64, 32, |x, y| Vec3::splat(if (x / 8 + y / 8) % 2 == 0 { 0.9 } else { 0.05 })));
        assert!(!is_cut(&room, &room) && !is_cut(&room, &walker) && is_cut(&room, &other));
        assert!(is_cut(&room, &Arc::new(Image::filled(32, 16, Vec3::ONE))), "another size");
        assert!(!is_cut(&Arc::new(Image::filled(8, 4, Vec3::ZERO)), &Arc::new(Image::filled(8, 4, Vec3::ZERO))), "black");
    }
}
