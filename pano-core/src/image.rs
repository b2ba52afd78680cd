//! Row-major pictures of any pixel type.

use crate::{Error, Result};
use glam::Vec3;

/// A picture: `width` × `height` pixels, row-major, row 0 on top. Never empty: both sides are at least 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

/// Linear Rec.709 radiance, finite and ≥ 0 once loaded by [`crate::io`](crate) readers.
pub type RadianceImage = Image<Vec3>;

impl<T: Copy> Image<T> {
    /// A picture with every pixel set to `value`.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        assert!(width > 0 && height > 0, "an image has at least one pixel, got {width}×{height}");
        Self { width, height, data: vec![value; width * height] }
    }

    /// A picture computed pixel by pixel from `(x, y)`.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn from_fn(width: usize, height: usize, mut pixel: impl FnMut(usize, usize) -> T) -> Self {
        assert!(width > 0 && height > 0, "an image has at least one pixel, got {width}×{height}");
        let data = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
        Self { width, height, data }
    }

    /// As [`Image::from_fn`], rows computed in parallel.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn par_from_fn(width: usize, height: usize, pixel: impl Fn(usize, usize) -> T + Sync) -> Self
    where
        T: Send + Sync + Default,
    {
        use rayon::prelude::*;
        let mut image = Self::filled(width, height, T::default());
        image.data.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, p) in row.iter_mut().enumerate() {
                *p = pixel(x, y);
            }
        });
        image
    }

    /// Takes `data` as a picture, row-major.
    ///
    /// # Errors
    /// [`Error::Argument`] if a side is 0 or the length is not `width * height`.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Result<Self> {
        if width == 0 || height == 0 || width.checked_mul(height) != Some(data.len()) {
            return Err(Error::argument(format!("{} values do not make a {width}×{height} image", data.len())));
        }
        Ok(Self { width, height, data })
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// `(width, height)`.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// All pixels, row-major.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row-major.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The pixels, row-major, without the size.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Row `y`.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// The pixel at `(x, y)`.
    #[inline]
    pub fn get(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// Sets the pixel at `(x, y)`.
    #[inline]
    pub fn set(&mut self, x: usize, y: usize, value: T) {
        self.data[y * self.width + x] = value;
    }

    /// A picture of the same size with `f` applied to every pixel.
    pub fn map<U: Copy>(&self, f: impl FnMut(T) -> U) -> Image<U> {
        Image { width: self.width, height: self.height, data: self.data.iter().copied().map(f).collect() }
    }
}
