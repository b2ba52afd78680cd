//! Pictures on the GPU, and bands of pictures that are too large for a binding.

use super::{Gpu, GpuBuffer, GpuError, GpuResult};
use crate::image::Image;
use bytemuck::Pod;
use std::marker::PhantomData;
use std::ops::Range;

crate::uniform! {
    /// Which rows of a picture a buffer holds; `Rows` of the shared shader text.
    pub struct Rows {
        /// Pixels in a row.
        pub width: u32,
        /// Rows of the whole picture.
        pub height: u32,
        /// The first row that is held.
        pub first: u32,
        /// Rows that are held.
        pub count: u32,
    }
}

impl Rows {
    /// All rows of a picture.
    pub fn all((width, height): (usize, usize)) -> Self {
        Self { width: width as u32, height: height as u32, first: 0, count: height as u32 }
    }

    /// Some of them.
    pub fn of((width, height): (usize, usize), rows: &Range<usize>) -> Self {
        Self { width: width as u32, height: height as u32, first: rows.start as u32, count: rows.len() as u32 }
    }

    /// Pixels that are held.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.count as usize
    }

    /// Workgroups of 8×8 that cover the rows that are held.
    pub fn groups(&self) -> [u32; 3] {
        [self.width.div_ceil(8), self.count.div_ceil(8), 1]
    }
}

/// A picture, or a band of rows of one, in the GPU's memory: row-major, without padding.
#[derive(Debug)]
pub struct GpuImage<T> {
    rows: Rows,
    buffer: GpuBuffer,
    pixel: PhantomData<T>,
}

impl<T> GpuImage<T> {
    /// What it holds.
    pub fn rows(&self) -> Rows {
        self.rows
    }

    /// Its memory.
    pub fn buffer(&self) -> &GpuBuffer {
        &self.buffer
    }

    /// That another picture holds the same rows.
    ///
    /// # Errors
    /// [`GpuError::Input`] with both sizes.
    pub fn check_like<U>(&self, what: &str, other: &GpuImage<U>) -> GpuResult<()> {
        let (a, b) = (self.rows, other.rows);
        if a == b {
            return Ok(());
        }
        let problem = format!("the {what} has {}×{} pixels, beside {}×{}", b.width, b.height, a.width, a.height);
        Err(GpuError::Input(crate::Error::argument(problem)))
    }
}

/// Some rows of a picture that is worked on in parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Band {
    /// Rows whose result counts.
    pub keep: Range<usize>,
    /// Rows that are needed for it: `keep` and the halo.
    pub hold: Range<usize>,
}

impl Gpu {
    /// Cuts a picture so that each part with its halo of `halo` rows on both sides fits a binding, at `pixel_bytes` for the
    /// largest of a stage's pictures.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] if not even one row with its halo fits.
    pub fn bands(&self, (width, height): (usize, usize), pixel_bytes: usize, halo: usize) -> GpuResult<Vec<Band>> {
        let row = (width * pixel_bytes) as u64;
        let most = usize::try_from(self.max_binding() / row).unwrap_or(usize::MAX);
        if most >= height {
            return Ok(vec![Band { keep: 0..height, hold: 0..height }]);
        }
        let step = most.saturating_sub(2 * halo);
        if step == 0 {
            return Err(GpuError::TooLarge { bytes: row * (2 * halo as u64 + 1), limit: self.max_binding() });
        }
        let band = |start: usize| {
            let keep = start..(start + step).min(height);
            let hold = keep.start.saturating_sub(halo)..(keep.end + halo).min(height);
            Band { keep, hold }
        };
        Ok((0..height).step_by(step).map(band).collect())
    }

    /// A picture of the GPU; what is in it is not specified.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], or what has become of the device.
    pub fn image<T: Pod>(&self, rows: Rows) -> GpuResult<GpuImage<T>> {
        Ok(GpuImage { rows, buffer: self.buffer::<T>(rows.pixels())?, pixel: PhantomData })
    }

    /// A whole picture, copied to the GPU. Pixels are multiples of four bytes.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], or what has become of the device.
    pub fn upload<T: Pod>(&self, image: &Image<T>) -> GpuResult<GpuImage<T>> {
        self.upload_rows(image, &(0..image.height()))
    }

    /// Some rows of a picture, copied to the GPU.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], or what has become of the device.
    ///
    /// # Panics
    /// If the picture has not so many rows.
    pub fn upload_rows<T: Pod>(&self, image: &Image<T>, rows: &Range<usize>) -> GpuResult<GpuImage<T>> {
        let pixels = &image.data()[rows.start * image.width()..rows.end * image.width()];
        let buffer = self.upload_slice(pixels)?;
        Ok(GpuImage { rows: Rows::of(image.size(), rows), buffer, pixel: PhantomData })
    }

    /// Copies a whole picture back.
    ///
    /// # Errors
    /// What has become of the device.
    ///
    /// # Panics
    /// If it is a band.
    pub fn read<T: Pod>(&self, image: &GpuImage<T>) -> GpuResult<Image<T>> {
        let rows = image.rows;
        assert_eq!(rows.count, rows.height, "a band is read row by row");
        let pixels = self.read_slice(&image.buffer, rows.pixels())?;
        Ok(Image::from_vec(rows.width as usize, rows.height as usize, pixels)?)
    }

    /// Copies the rows `keep` of a picture or band back into their places in `out`.
    ///
    /// # Errors
    /// What has become of the device.
    ///
    /// # Panics
    /// If the rows are not held, or `out` is of another size.
    pub fn read_rows<T: Pod>(&self, image: &GpuImage<T>, keep: &Range<usize>, out: &mut Image<T>) -> GpuResult<()> {
        let (rows, width) = (image.rows, image.rows.width as usize);
        assert_eq!(out.size(), (width, rows.height as usize), "the picture that is read into");
        let first = rows.first as usize;
        let pixels = self.read_part(&image.buffer, (keep.start - first) * width, keep.len() * width)?;
        out.data_mut()[keep.start * width..keep.end * width].copy_from_slice(&pixels);
        Ok(())
    }
}
