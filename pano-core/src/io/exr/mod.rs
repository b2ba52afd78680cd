//! OpenEXR: any list of named channels in and out, and what a picture or a depth map is among them.

mod color;
mod decode;
mod read;
mod write;

pub use color::Chromaticities;
pub use write::{split_channels, write_exr};

use super::depth::no_depth;
use super::source::{Source, read_file};
use super::{LoadedImage, SourceEncoding};
use crate::depth::DepthKind;
use crate::image::{Image, RadianceImage};
use crate::{Error, Result};
use glam::Vec3;
use std::path::Path;

/// Name of the text attribute that states what the channel `Z` measures: a [`DepthKind::name`].
pub const DEPTH_KIND_ATTRIBUTE: &str = "pano:depth_kind";

/// The channels of an EXR file, as stored, on the file's display window.
#[derive(Clone, Debug, Default)]
pub struct ExrChannels {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Name and values of every channel, in the file's order (alphabetic within a part). Where the data window does not
    /// reach, values are 0. Of a file with several parts, the channels of the first part with colours come first; a later
    /// part's channel whose name is taken is called `part.channel`.
    pub channels: Vec<(String, Image<f32>)>,
    /// Name and value of every custom text attribute, sorted; the first part that has a name decides.
    pub attributes: Vec<(String, String)>,
    /// What R, G and B mean, if the file says; linear Rec.709 otherwise.
    pub chromaticities: Option<Chromaticities>,
}

impl ExrChannels {
    /// The channel of that name.
    pub fn get(&self, name: &str) -> Option<&Image<f32>> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, image)| image)
    }

    /// The text attribute of that name.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str())
    }

    /// The channels `layer.R`, `layer.G`, `layer.B` (`R`, `G`, `B` for an empty `layer`) as one picture, values as stored.
    pub fn rgb(&self, layer: &str) -> Option<RadianceImage> {
        let channel = |c: &str| self.get(&if layer.is_empty() { c.to_owned() } else { format!("{layer}.{c}") });
        let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
        Some(Image::from_fn(self.width, self.height, |x, y| Vec3::new(r.get(x, y), g.get(x, y), b.get(x, y))))
    }
}

/// Reads every flat channel of an EXR file: all compressions, half, float and integer, scan lines and tiles (the largest
/// level of several), layers, several parts, any data window. Deep parts are left out.
///
/// # Errors
/// [`Error::File`] if the file is missing, damaged or too large, no EXR, or has subsampled channels or nothing but deep parts.
pub fn read_exr(path: impl AsRef<Path>) -> Result<ExrChannels> {
    let path = path.as_ref();
    decode_exr(&read_file(path)?, path)
}

/// [`read_exr`] of a file in memory; `name` is for messages.
///
/// # Errors
/// As [`read_exr`].
pub fn decode_exr(bytes: &[u8], name: &Path) -> Result<ExrChannels> {
    let source = &Source::new(name, bytes);
    if source.format()? != super::source::Format::Exr {
        return Err(source.unsupported("is not an EXR file", "Name an EXR file."));
    }
    source.guard(|| read::read(source, |names| Ok((0..names.len()).collect())))
}

/// The picture in the file: R, G, B or Y, and A.
pub(super) fn read_image(source: &Source<'_>) -> Result<LoadedImage> {
    let mut has_alpha = false;
    let file = read::read(source, |names| {
        let chosen = picture(source, names)?;
        has_alpha = chosen.len() % 2 == 0;
        Ok(chosen)
    })?;
    let images: Vec<&Image<f32>> = file.channels.iter().map(|(_, image)| image).collect();
    let mut radiance = match images.as_slice() {
        [r, g, b] | [r, g, b, _] => {
            Image::from_fn(file.width, file.height, |x, y| Vec3::new(r.get(x, y), g.get(x, y), b.get(x, y)))
        }
        [y, ..] => y.map(Vec3::splat),
        [] => return Err(source.broken("holds no channel")),
    };
    if let Some(chromaticities) = file.chromaticities {
        let to_rec709 = chromaticities.to_rec709().ok_or_else(|| source.broken("declares impossible chromaticities"))?;
        if let Some(matrix) = to_rec709 {
            radiance.data_mut().iter_mut().for_each(|p| *p = (matrix * p.as_dvec3()).as_vec3());
        }
    }
    let alpha = if has_alpha { images.last().map(|a| (*a).clone()) } else { None };
    Ok(LoadedImage::new(radiance, alpha, SourceEncoding::LinearFloat))
}

/// Which channels make the picture: three or one, and then perhaps A.
fn picture(source: &Source<'_>, names: &[String]) -> Result<Vec<usize>> {
    let find = |layer: &str, channel: &str| {
        names.iter().position(|name| {
            let (prefix, last) = split_name(name);
            prefix == layer && last.eq_ignore_ascii_case(channel)
        })
    };
    let mut layers = vec![""];
    layers.extend(names.iter().map(|name| split_name(name).0));
    for layer in &layers {
        if let (Some(r), Some(g), Some(b)) = (find(layer, "R"), find(layer, "G"), find(layer, "B")) {
            return Ok([r, g, b].into_iter().chain(find(layer, "A")).collect());
        }
    }
    for layer in &layers {
        if find(layer, "RY").is_some() {
            return Err(source.unsupported("stores colour as luminance and chroma (Y, RY, BY)", "Convert it to R, G, B."));
        }
        if let Some(y) = find(layer, "Y") {
            return Ok([y].into_iter().chain(find(layer, "A")).collect());
        }
    }
    Err(source.unsupported(
        format!("holds no picture: none of its channels ({}) are R, G, B or Y", names.join(", ")),
        "Export it with channels R, G and B.",
    ))
}

/// A channel's name as layer (empty if none) and channel.
fn split_name(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// The stored depth.
pub(super) fn read_depth(source: &Source<'_>, declared: DepthKind) -> Result<Image<f32>> {
    let file = read::read(source, |names| {
        let exact = ["Z", "Y", "R"].iter().find_map(|wanted| names.iter().position(|name| name == wanted));
        let chosen = exact.or_else(|| names.iter().position(|name| split_name(name).1 == "Z"));
        match chosen {
            Some(index) => Ok(vec![index]),
            None if names.len() == 1 => Ok(vec![0]),
            None => Err(no_depth(source, &format!("holds no depth among its channels ({})", names.join(", ")))),
        }
    })?;
    if let Some(stated) = file.attribute(DEPTH_KIND_ATTRIBUTE)
        && stated != declared.name()
    {
        let problem = format!("says that its depth is of the kind {stated:?}, but it is declared as {:?}", declared.name());
        return Err(Error::file(source.path, problem, "Declare the depth format with the kind the file states."));
    }
    match file.channels.into_iter().next() {
        Some((_, image)) => Ok(image),
        None => Err(source.broken("holds no channel")),
    }
}
