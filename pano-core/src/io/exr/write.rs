//! From channels to a file: `f32`, ZIP, one part. The same channels give the same bytes.

use super::super::write::check_side;
use super::super::write_atomically;
use crate::image::{Image, RadianceImage};
use crate::{Error, Result};
use exr::block::UncompressedBlock;
use exr::block::writer::ChunksWriter;
use exr::meta::BlockDescription;
use exr::meta::attribute::{AttributeValue, ChannelDescription, Compression, LineOrder, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use std::io::{self, Cursor, Write};
use std::path::Path;

/// Longest name of a channel or an attribute, in bytes, in the EXR format.
const MAX_NAME: usize = 255;

/// Writes named channels of one size as an EXR file: `f32`, ZIP-compressed, sorted by name (as the format asks), with custom
/// text attributes. Names may have layers (`delta.R`). If a channel `Z` holds depth, state its kind in the attribute
/// [`DEPTH_KIND_ATTRIBUTE`](super::DEPTH_KIND_ATTRIBUTE).
///
/// # Errors
/// [`Error::Argument`] if there is no channel, if sizes differ, if a name is empty, too long, doubled or reserved;
/// [`Error::File`] if the file cannot be written.
pub fn write_exr<N: AsRef<str>>(
    path: impl AsRef<Path>,
    channels: &[(N, &Image<f32>)],
    attributes: &[(&str, &str)],
) -> Result<()> {
    let path = path.as_ref();
    let mut channels: Vec<(&str, &Image<f32>)> = channels.iter().map(|(name, image)| (name.as_ref(), *image)).collect();
    channels.sort_by_key(|(name, _)| *name);
    let Some(&(_, first)) = channels.first() else {
        return Err(Error::argument("an EXR file needs at least one channel"));
    };
    check_side(path, first)?;
    check_names("channel", channels.iter().map(|(name, _)| *name))?;
    if let Some((name, other)) = channels.iter().find(|(_, image)| image.size() != first.size()) {
        let sizes = format!("channel {name} has {:?} pixels, the others {:?}", other.size(), first.size());
        return Err(Error::argument(sizes));
    }
    let mut sorted = attributes.to_vec();
    sorted.sort_unstable();
    check_names("attribute", sorted.iter().map(|(name, _)| *name))?;
    if let Some((name, _)) = sorted.iter().find(|(name, _)| is_reserved(name)) {
        return Err(Error::argument(format!("the EXR attribute {name} has a meaning of its own; choose another name")));
    }
    let bytes = encode(&channels, &sorted)
        .map_err(|e| Error::file(path, format!("cannot be encoded as EXR: {e}"), "Check the channels' and attributes' names."))?;
    write_atomically(path, |file| file.write_all(&bytes))
}

/// The red, green and blue values of a picture, as [`write_exr`] takes them.
pub fn split_channels(image: &RadianceImage) -> [Image<f32>; 3] {
    [image.map(|p| p.x), image.map(|p| p.y), image.map(|p| p.z)]
}

/// Names, sorted, that the format can hold.
fn check_names<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut previous = None;
    for name in names {
        if name.is_empty() || name.len() > MAX_NAME || name.contains('\0') {
            return Err(Error::argument(format!("{name:?} is no name of an EXR {what}: 1 to {MAX_NAME} bytes, no NUL")));
        }
        if previous == Some(name) {
            return Err(Error::argument(format!("the EXR {what} {name} is given twice")));
        }
        previous = Some(name);
    }
    Ok(())
}

/// Whether the format itself gives an attribute of that name a type and a meaning.
fn is_reserved(name: &str) -> bool {
    exr::meta::header::standard_names::ALL.contains(&name.as_bytes()) || name == "chromaticities" || name == "timeCode"
}

/// The file's bytes.
fn encode(channels: &[(&str, &Image<f32>)], attributes: &[(&str, &str)]) -> exr::error::Result<Vec<u8>> {
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    let size = channels[0].1.size();
    let descriptions = channels
        .iter()
        .map(|(name, _)| ChannelDescription {
            name: text(name),
            sample_type: SampleType::F32,
            quantize_linearly: false,
            sampling: exr::math::Vec2(1, 1),
        })
        .collect();
    let mut own = LayerAttributes::default();
    own.other.extend(attributes.iter().map(|(name, value)| (text(name), AttributeValue::Text(text(value)))));
    let header = Header::new(text(""), size, descriptions)
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(own);
    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, std::iter::once(header).collect(), true, |meta, writer| {
        let blocks = meta.collect_ordered_blocks(|index| {
            let (left, top) = (index.pixel_position.0, index.pixel_position.1);
            let mut data = Vec::with_capacity(index.pixel_size.area() * channels.len() * 4);
            for y in top..top + index.pixel_size.1 {
                for (_, image) in channels {
                    let row = &image.row(y)[left..left + index.pixel_size.0];
                    data.extend_from_slice(bytemuck::cast_slice(row));
                }
            }
            UncompressedBlock { index, data }
        });
        writer.on_progress(|_| {}).compress_all_blocks_parallel(&meta, blocks)
    })?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).map_err(exr::error::Error::Io)?;
    Ok(bytes)
}

/// Puts the header's attributes in the order of their names. The `exr` crate keeps custom ones in a hash map, whose order
/// differs from run to run. The header's length stays the same, so the offsets that follow stay true.
fn sort_attributes(file: &mut [u8]) -> io::Result<()> {
    // Magic and version, 4 bytes each; then name, NUL, type, NUL, length (i32), value; an empty name ends the list.
    const START: usize = 8;
    let mut attributes = Vec::new();
    let mut at = START;
    let unexpected = || io::Error::other("unexpected header layout");
    while *file.get(at).ok_or_else(unexpected)? != 0 {
        let end_of_text = |from: usize| file[from..].iter().position(|&b| b == 0).map(|n| from + n + 1);
        let value = end_of_text(at).and_then(end_of_text).ok_or_else(unexpected)?;
        let length = file.get(value..value + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        let end = value + 4 + length.ok_or_else(unexpected)? as usize;
        attributes.push(file.get(at..end).ok_or_else(unexpected)?.to_vec());
        at = end;
    }
    attributes.sort_unstable();
    (&mut file[START..at]).write_all(&attributes.concat())
}
