//! Pictures on surfaces: bilinear lookups, and filtered ones over a footprint.
//!
//! A filtered lookup averages over the parallelogram that a pixel covers on the picture: trilinear probes of a mip pyramid along
//! the parallelogram's longer axis, as wide as its shorter one (McCormack, Perry, Farkas & Jouppi 1999, "Feline: fast elliptical
//! lines for anisotropic texture mapping", with a box in place of the Gaussian, as pixels are box-filtered here). All averages are
//! running means, which keep a constant picture constant to the bit.

use crate::image::Image;
use glam::{Affine2, Mat2, Vec2, Vec4};
use std::sync::{Arc, OnceLock};

/// Most probes of a filtered lookup; beyond this ratio of its axes a footprint is filtered wider than it is.
pub const MAX_ANISOTROPY: u32 = 64;

/// What a texture shows outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second one mirrored.
    Mirror,
    /// The border pixel goes on.
    Clamp,
}

/// A picture on a surface. Values are linear (colour textures are decoded when they are loaded).
#[derive(Clone, Debug)]
pub struct Texture {
    image: Arc<Image<Vec4>>,
    /// Outside [0, 1] horizontally.
    pub wrap_u: Wrap,
    /// Outside [0, 1] vertically.
    pub wrap_v: Wrap,
    /// Applied to the mesh's (u, v) before the lookup (KHR_texture_transform).
    pub texture_from_mesh: Affine2,
    /// The picture halved again and again, from half its size on; made when it is first asked for.
    smaller: Arc<OnceLock<Vec<Image<Vec4>>>>,
}

/// What a pixel covers on a texture: how far (u, v) of the mesh moves from one side of the pixel to the other, along two axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Along x and along y of the picture that is made.
    pub axes: [Vec2; 2],
    /// Most probes along the longer axis, [1, [`MAX_ANISOTROPY`]]: 1 is isotropic; more are sharper at grazing angles.
    pub max_anisotropy: u32,
}

impl Texture {
    /// A texture that repeats, without a transform.
    pub fn new(image: Arc<Image<Vec4>>) -> Self {
        let smaller = Arc::default();
        Self { image, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat, texture_from_mesh: Affine2::IDENTITY, smaller }
    }

    /// Linear RGBA, row 0 on top, shared between materials.
    pub fn image(&self) -> &Arc<Image<Vec4>> {
        &self.image
    }

    /// The picture halved again and again, from half its size on until one texel is left.
    pub fn smaller(&self) -> &[Image<Vec4>] {
        self.smaller.get_or_init(|| pyramid(&self.image))
    }

    /// The same with another picture.
    pub fn with_image(self, image: Arc<Image<Vec4>>) -> Self {
        Self { image, smaller: Arc::default(), ..self }
    }

    /// Bilinear lookup; (0, 0) is the picture's top left corner, as in glTF. A non-finite `uv` reads the corner.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        self.bilinear(&self.image, self.at(uv))
    }

    /// The mean over a footprint about `uv`. One that is not finite counts as a point.
    pub fn sample_over(&self, uv: Vec2, footprint: &Footprint) -> Vec4 {
        let (w, h) = self.image.size();
        let linear = self.texture_from_mesh.matrix2;
        // In texels.
        let size = Vec2::new(w as f32, h as f32);
        let [x, y] = footprint.axes.map(|axis| (linear * axis) * size);
        let (long, short) = axes_of_ellipse(Mat2::from_cols(x, y));
        if !(long.is_finite() && short.is_finite()) || long.length() <= 1.0 {
            return self.sample(uv);
        }
        let most = footprint.max_anisotropy.clamp(1, MAX_ANISOTROPY) as f32;
        let width = short.max(long.length() / most).max(1.0);
        let probes = (long.length() / width).ceil().clamp(1.0, most);
        let level = (long.length() / probes).max(width).log2();
        let at = self.at(uv);
        let step = long / size / probes;
        let mut mean = Vec4::ZERO;
        for i in 0..probes as u32 {
            let value = self.trilinear(at + step * (i as f32 + 0.5 - 0.5 * probes), level);
            mean += (value - mean) / (i + 1) as f32;
        }
        mean
    }

    /// Where the picture is looked at; a place that is not finite is the corner.
    fn at(&self, uv: Vec2) -> Vec2 {
        let uv = self.texture_from_mesh.transform_point2(uv);
        if uv.is_finite() { uv } else { Vec2::ZERO }
    }

    /// Between the two pictures of the pyramid whose texels are nearest to 2^`level` wide.
    fn trilinear(&self, at: Vec2, level: f32) -> Vec4 {
        let smaller = self.smaller();
        let of = |level: usize| if level == 0 { &self.image } else { &smaller[level - 1] };
        let level = level.clamp(0.0, smaller.len() as f32);
        let (below, share) = (level as usize, level.fract());
        let fine = self.bilinear(of(below), at);
        if share == 0.0 { fine } else { mix(fine, self.bilinear(of(below + 1), at), share) }
    }

    fn bilinear(&self, image: &Image<Vec4>, uv: Vec2) -> Vec4 {
        let (w, h) = image.size();
        // One period is enough and keeps the float → integer conversion exact for far-away coordinates.
        let fold = |t: f32, wrap: Wrap, n: usize| match wrap {
            Wrap::Repeat => t.rem_euclid(1.0) * n as f32 - 0.5,
            Wrap::Mirror => t.rem_euclid(2.0) * n as f32 - 0.5,
            Wrap::Clamp => t.clamp(0.0, 1.0) * n as f32 - 0.5,
        };
        let index = |i: isize, wrap: Wrap, n: usize| match wrap {
            Wrap::Repeat => i.rem_euclid(n as isize) as usize,
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n as isize) as usize;
                i.min(2 * n - 1 - i)
            }
            Wrap::Clamp => i.clamp(0, n as isize - 1) as usize,
        };
        let (x, y) = (fold(uv.x, self.wrap_u, w), fold(uv.y, self.wrap_v, h));
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at =
            |dx: isize, dy: isize| image.get(index(x0 as isize + dx, self.wrap_u, w), index(y0 as isize + dy, self.wrap_v, h));
        mix(mix(at(0, 0), at(1, 0), fx), mix(at(0, 1), at(1, 1), fx), fy)
    }
}

/// From `a` to `b`; where they are the same, that, to the bit.
#[inline]
fn mix(a: Vec4, b: Vec4, share: f32) -> Vec4 {
    a + (b - a) * share
}

/// The longer axis of the ellipse that a matrix makes of the unit circle, and the length of the shorter one.
fn axes_of_ellipse(m: Mat2) -> (Vec2, f32) {
    // Scaled, or squares overflow.
    let scale = m.x_axis.abs().max(m.y_axis.abs()).max_element();
    if !(scale > 0.0 && scale.is_finite()) {
        return (Vec2::splat(scale), scale);
    }
    let (x, y) = (m.x_axis / scale, m.y_axis / scale);
    // Eigenvalues of M·Mᵀ.
    let (a, b, c) = (x.x * x.x + y.x * y.x, x.x * x.y + y.x * y.y, x.y * x.y + y.y * y.y);
    let (mean, difference) = (0.5 * (a + c), 0.5 * (a - c));
    let root = difference.hypot(b);
    let (major, minor) = (mean + root, (mean - root).max(0.0));
    let angle = 0.5 * b.atan2(difference);
    (Vec2::from_angle(angle) * (major.sqrt() * scale), minor.sqrt() * scale)
}

/// Halves a picture until one texel is left: each texel of a smaller picture is the mean of what it covers.
fn pyramid(image: &Image<Vec4>) -> Vec<Image<Vec4>> {
    let mut levels: Vec<Image<Vec4>> = Vec::new();
    loop {
        let last = levels.last().unwrap_or(image);
        let (w, h) = last.size();
        if w.max(h) <= 1 {
            return levels;
        }
        let (nw, nh) = ((w / 2).max(1), (h / 2).max(1));
        let next = Image::from_fn(nw, nh, |x, y| {
            let (mut mean, mut weights) = (Vec4::ZERO, 0.0);
            for (j, wy) in covered(y, nh, h) {
                for (i, wx) in covered(x, nw, w) {
                    weights += wx * wy;
                    mean += (last.get(i, j) - mean) * (wx * wy / weights);
                }
            }
            mean
        });
        levels.push(next);
    }
}

/// The texels of `from` that texel `i` of `to` covers, each with its share in texels; two, or three where `from` is odd.
fn covered(i: usize, to: usize, from: usize) -> impl Iterator<Item = (usize, f32)> {
    let (lo, hi) = (i * from, (i + 1) * from);
    (lo / to..hi.div_ceil(to)).map(move |k| (k, ((hi.min((k + 1) * to) - lo.max(k * to)) as f32) / to as f32))
}

#[cfg(test)]
mod tests;
