//! Portable float maps: a header in text, then rows of `f32` from bottom to top.
//!
//! The third number of the header tells the byte order by its sign (negative: little-endian). Its magnitude has no agreed
//! meaning and is not applied.

use super::source::Source;
use crate::Result;
use crate::image::{Image, RadianceImage};
use glam::Vec3;
use std::io::{self, Write};

/// What a file holds.
#[derive(Debug)]
pub(crate) enum Pfm {
    Gray(Image<f32>),
    Color(RadianceImage),
}

/// Reads either kind.
pub(crate) fn read(source: &Source<'_>) -> Result<Pfm> {
    let mut rest = source.bytes;
    let mut token = || -> Result<&str> {
        let start = rest.iter().position(|c| !c.is_ascii_whitespace()).unwrap_or(rest.len());
        // No number is longer than that; a missing blank must not make the whole file one token.
        let length = rest[start..].iter().take(40).position(u8::is_ascii_whitespace);
        let length = length.ok_or_else(|| source.broken("has a damaged PFM header"))?;
        let (word, tail) = rest[start..].split_at(length);
        // Exactly one blank ends a word: the next byte may be a pixel's that looks like another.
        rest = &tail[1..];
        std::str::from_utf8(word).map_err(|_| source.broken("has a damaged PFM header"))
    };
    let color = token()? == "PF";
    let (width, height, order) = (token()?, token()?, token()?);
    let (Ok(width), Ok(height), Ok(order)) = (width.parse::<u32>(), height.parse::<u32>(), order.parse::<f32>()) else {
        return Err(source.broken("has a damaged PFM header: it needs width, height and byte order"));
    };
    if order == 0.0 || !order.is_finite() {
        return Err(source.broken(format!("has a damaged PFM header: byte order {order}")));
    }
    let channels = if color { 3 } else { 1 };
    source.check_size(width.into(), height.into(), 32 * channels as u64, 1)?;
    let (width, height) = (width as usize, height as usize);
    let needed = width * height * channels * 4;
    if rest.len() < needed {
        return Err(source.broken(format!("is truncated: {} of {needed} bytes of pixels", rest.len())));
    }
    let value = |i: usize| {
        let bytes = [rest[4 * i], rest[4 * i + 1], rest[4 * i + 2], rest[4 * i + 3]];
        if order < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let index = |x: usize, y: usize| channels * ((height - 1 - y) * width + x);
    Ok(if color {
        Pfm::Color(Image::from_fn(width, height, |x, y| Vec3::from_array([0, 1, 2].map(|c| value(index(x, y) + c)))))
    } else {
        Pfm::Gray(Image::from_fn(width, height, |x, y| value(index(x, y))))
    })
}

/// Writes colour, little-endian.
pub(crate) fn write(file: &mut impl Write, image: &RadianceImage) -> io::Result<()> {
    write!(file, "PF\n{} {}\n-1.0\n", image.width(), image.height())?;
    for y in (0..image.height()).rev() {
        for value in image.row(y).iter().flat_map(|p| p.to_array()) {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(())
}
