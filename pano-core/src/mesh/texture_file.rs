//! Texture pictures: PNG, JPEG and Radiance HDR to linear RGBA.

use crate::color::srgb_to_linear;
use crate::image::Image;
use crate::{Error, Result};
use glam::Vec4;
use std::{io::Cursor, path::Path};

/// What a texture's numbers mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Encoding {
    /// sRGB-encoded colour; becomes linear. Alpha is linear already.
    Color,
    /// Plain numbers (roughness, normals); become code / largest code.
    Data,
}

/// Pixels a texture may have: 16 bytes each once decoded.
const MAX_PIXELS: u64 = 1 << 26;

/// Reads the texture `file`, which the mesh `path` names.
pub(super) fn read(path: &Path, file: &Path, encoding: Encoding) -> Result<Image<Vec4>> {
    let bytes = std::fs::read(file).map_err(|e| {
        Error::file(
            path,
            format!("its texture {} cannot be read: {e}", file.display()),
            "Put the texture where the mesh expects it, or take it out of the material.",
        )
    })?;
    decode(&bytes, encoding).map_err(|problem| {
        Error::file(path, format!("its texture {} {problem}", file.display()), "Save the texture as PNG or JPEG.")
    })
}

/// Decodes a picture held in memory; the error continues the sentence "the texture …".
pub(super) fn decode(bytes: &[u8], encoding: Encoding) -> Result<Image<Vec4>, String> {
    let unreadable = |e: image::ImageError| format!("is not a readable picture: {e}");
    let reader = || image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string());
    let (w, h) = reader()?.into_dimensions().map_err(unreadable)?;
    if u64::from(w) * u64::from(h) > MAX_PIXELS || w == 0 || h == 0 {
        return Err(format!("has {w}×{h} pixels; 1 to {MAX_PIXELS} are possible"));
    }
    let picture = reader()?.decode().map_err(unreadable)?;
    let curve = |v: f32| if encoding == Encoding::Color { srgb_to_linear(v) } else { v };
    use image::DynamicImage as D;
    let pixels: Vec<Vec4> = match picture {
        D::ImageRgb32F(_) | D::ImageRgba32F(_) => {
            let finite = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
            picture.to_rgba32f().pixels().map(|p| Vec4::from(p.0.map(finite))).collect()
        }
        D::ImageLuma16(_) | D::ImageLumaA16(_) | D::ImageRgb16(_) | D::ImageRgba16(_) => {
            let color = |p: [u16; 4]| {
                let [r, g, b, a] = p.map(|c| f32::from(c) / 65535.0);
                Vec4::new(curve(r), curve(g), curve(b), a)
            };
            picture.to_rgba16().pixels().map(|p| color(p.0)).collect()
        }
        _ => {
            let table: Vec<f32> = (0..=255u8).map(|c| curve(f32::from(c) / 255.0)).collect();
            let color = |p: &[u8; 4]| {
                let [r, g, b] = [p[0], p[1], p[2]].map(|c| table[usize::from(c)]);
                Vec4::new(r, g, b, f32::from(p[3]) / 255.0)
            };
            picture.to_rgba8().pixels().map(|p| color(&p.0)).collect()
        }
    };
    Image::from_vec(w as usize, h as usize, pixels).map_err(|e| e.to_string())
}
