//! The filter of path-traced pictures: outliers are cut, then the cross-bilateral filter runs on ever wider lattices.

use super::survey::neighbour;
use crate::pipeline::Result;
use glam::Vec3;
use pano_core::{color::luminance, image::Image, image::RadianceImage, layers::TracedLayers};
use pano_denoise::cross_bilateral::{self, Guides, Params};

/// Distances between taps, in pixels: each pass filters every lattice of pixels that far apart by itself, so that the
/// last one removes noise eight times as coarse as the first.
const STEPS: [usize; 5] = [1, 2, 4, 8, 1];
/// A pixel may be this much brighter than the third brightest of its 24 neighbours on the same surface. At a dozen samples
/// a path that finds a lamp by chance stands out more, and texture is divided out before.
const OUTLIER: f32 = 2.0;

/// Smooths `layers.object`, guided by the other layers and by how much each pixel is worth to the others, in (0, 1]. Returns
/// the share of light that cutting outliers took away.
pub(super) fn smooth(layers: &mut TracedLayers, worth: &Image<f32>, wrap: bool) -> Result<f64> {
    let before = total(&layers.object);
    layers.object = without_outliers(layers, wrap);
    let after = total(&layers.object);
    let weigh = |layers: &mut TracedLayers, f: fn(Vec3, f32) -> Vec3| {
        layers.object.data_mut().iter_mut().zip(worth.data()).for_each(|(p, w)| *p = f(*p, *w));
    };
    weigh(layers, |p, w| p * w);
    // Texture is divided out; what is left differs between materials only by gloss.
    let params = Params { wrap, sigma_albedo: 0.5, ..Params::default() };
    for step in STEPS {
        for offset in 0..step * step {
            let at = Lattice { step, left: offset % step, top: offset / step };
            let Some(mut light) = at.part(&layers.object) else { continue };
            let [Some(share), Some(depth)] = [worth, &layers.depth].map(|image| at.part(image)) else { continue };
            let [Some(normal), Some(albedo)] = [&layers.normal, &layers.albedo].map(|image| at.part(image)) else { continue };
            let guides = Guides { depth: &depth, normal: &normal, albedo: &albedo };
            cross_bilateral::filter_layer(&params, &guides, &share, &mut light)?;
            at.put_back(&light, &mut layers.object);
        }
    }
    weigh(layers, |p, w| p / w);
    Ok(if before > 0.0 { (before - after) / before } else { 0.0 })
}

fn total(picture: &RadianceImage) -> f64 {
    picture.data().iter().map(|&p| f64::from(luminance(p))).sum()
}

/// Every `step`-th pixel of every `step`-th row.
#[derive(Clone, Copy)]
struct Lattice {
    step: usize,
    left: usize,
    top: usize,
}

impl Lattice {
    /// The lattice's pixels as a picture; `None` if there are none.
    fn part<T: Copy>(self, image: &Image<T>) -> Option<Image<T>> {
        let count = |size: usize, first: usize| size.checked_sub(first).filter(|n| *n > 0).map(|n| n.div_ceil(self.step));
        let (w, h) = (count(image.width(), self.left)?, count(image.height(), self.top)?);
        Some(Image::from_fn(w, h, |x, y| image.get(self.left + x * self.step, self.top + y * self.step)))
    }

    fn put_back<T: Copy>(self, part: &Image<T>, image: &mut Image<T>) {
        for y in 0..part.height() {
            for (x, value) in part.row(y).iter().enumerate() {
                image.set(self.left + x * self.step, self.top + y * self.step, *value);
            }
        }
    }
}

/// The light with every pixel scaled down that is too bright for its surface.
fn without_outliers(layers: &TracedLayers, wrap: bool) -> RadianceImage {
    let (w, h) = layers.size();
    RadianceImage::par_from_fn(w, h, |x, y| {
        let center: Vec3 = layers.object.get(x, y);
        let (normal, depth) = (layers.normal.get(x, y), layers.depth.get(x, y));
        // Of the same surface, and of any.
        let mut brightest = [[0.0f32; 3]; 2];
        for k in (0..25isize).filter(|k| *k != 12) {
            let (nx, ny) = (x as isize + k % 5 - 2, y as isize + k / 5 - 2);
            let Some((nx, ny)) = neighbour(nx, ny, (w, h), wrap) else { continue };
            // Rough on purpose: curved and slanted surfaces count as one.
            let same = layers.normal.get(nx, ny).dot(normal) > 0.8 && (layers.depth.get(nx, ny) / depth - 1.0).abs() < 0.1;
            let value = luminance(layers.object.get(nx, ny));
            for values in &mut brightest[usize::from(!same)..] {
                values[2] = values[2].max(value);
                values.sort_unstable_by(|a, b| b.total_cmp(a));
            }
        }
        // What is as thin as a pixel is judged by everything around it.
        let [same, any] = brightest.map(|values| OUTLIER * values[2]);
        let (value, limit) = (luminance(center), if same > 0.0 { same } else { any });
        if limit > 0.0 && value > limit { center * (limit / value) } else { center }
    })
}
