//! From a file to channels: which parts and channels there are, where they lie, and the checks before any memory is taken.

use super::super::source::{MAX_SIDE, Source};
use super::decode::{Target, decode, failure};
use super::{Chromaticities, ExrChannels, split_name};
use crate::Result;
use crate::image::Image;
use exr::block::reader::Reader;
use exr::meta::BlockDescription;
use exr::meta::attribute::{AttributeValue, Compression, Text};
use exr::meta::header::Header;
use glam::Vec2;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Most channels a file may have.
const MAX_CHANNELS: usize = 4096;

/// A flat channel of some part.
#[derive(Debug)]
struct Channel {
    part: usize,
    /// Index among the part's channels.
    index: usize,
}

/// Reads the channels that `select` picks from the list of names, in the order it gives them.
pub(super) fn read(source: &Source<'_>, select: impl FnOnce(&[String]) -> Result<Vec<usize>>) -> Result<ExrChannels> {
    let reader = exr::block::read(Cursor::new(source.bytes), false).map_err(|e| failure(source, e))?;
    check(source, reader.headers())?;
    let (names, channels) = channels(source, reader.headers())?;
    let selected = select(&names)?;
    let display = reader.headers()[0].shared_attributes.display_window;
    let (width, height) = display.size.into();
    let targets: Vec<Target> = selected
        .iter()
        .map(|&i| {
            let Channel { part, index } = channels[i];
            let position = reader.headers()[part].own_attributes.layer_position;
            // i64: the difference of two i32 may not fit.
            let offset = [(position.0, display.position.0), (position.1, display.position.1)];
            Target { part, index, offset: offset.map(|(data, display)| i64::from(data) - i64::from(display)) }
        })
        .collect();
    let attributes = attributes(reader.headers());
    let first = channels.first().map_or(0, |channel| channel.part);
    let chromaticities = reader.headers()[first].shared_attributes.chromaticities.map(|c| {
        let xy = |p: exr::math::Vec2<f32>| Vec2::new(p.0, p.1);
        Chromaticities { red: xy(c.red), green: xy(c.green), blue: xy(c.blue), white: xy(c.white) }
    });
    let planes = decode(source, reader, &targets, width, height)?;
    let images = planes.into_iter().map(|plane| Image::from_vec(width, height, plane)).collect::<Result<Vec<_>>>()?;
    let names = selected.iter().map(|&i| names[i].clone());
    Ok(ExrChannels { width, height, channels: names.zip(images).collect(), attributes, chromaticities })
}

/// Refuses what cannot be read, and what would take more memory than a file of this length can be worth.
fn check(source: &Source<'_>, headers: &[Header]) -> Result<()> {
    let Some(first) = headers.first() else {
        return Err(source.broken("is an EXR without a part"));
    };
    let count: usize = headers.iter().map(|h| h.channels.list.len()).sum();
    if count > MAX_CHANNELS {
        return Err(source.unsupported(format!("declares {count} channels"), "Leave out what is not needed."));
    }
    let flat: Vec<&Header> = headers.iter().filter(|h| !h.deep).collect();
    for header in &flat {
        let (w, h) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
        let bits = 8 * header.channels.bytes_per_pixel as u64;
        source.check_size(w, h, bits, ratio(header.compression))?;
        if let BlockDescription::Tiles(tiles) = header.blocks
            && (tiles.tile_size.0 > MAX_SIDE || tiles.tile_size.1 > MAX_SIDE)
        {
            return Err(source.broken(format!("declares tiles of {:?} pixels", tiles.tile_size)));
        }
        if let Some(channel) = header.channels.list.iter().find(|c| c.sampling != exr::math::Vec2(1, 1)) {
            let problem = format!("has the subsampled channel {}", channel.name);
            return Err(source.unsupported(problem, "Export it with all channels at full resolution."));
        }
    }
    // The display window costs no bytes in the file, so it is held against the data it frames: more than 64 times as many
    // pixels (and more than a 4k panorama) is no picture with a margin.
    let (w, h) = (first.shared_attributes.display_window.size.0, first.shared_attributes.display_window.size.1);
    source.check_size(w as u64, h as u64, 0, 0)?;
    let data = flat.iter().map(|h| h.layer_size.area()).max().unwrap_or(0);
    if w * h > (64 * data).max(1 << 23) {
        return Err(source.broken(format!("frames {data} pixels of data by a display window of {w}×{h} pixels")));
    }
    Ok(())
}

/// How many bytes a byte of compressed data can stand for, at most.
fn ratio(compression: Compression) -> u64 {
    match compression {
        Compression::Uncompressed => 1,
        // Runs of 128 bytes in 2.
        Compression::RLE => 64,
        // 4×4 half floats (32 bytes) in 3.
        Compression::B44 | Compression::B44A => 11,
        // PIZ: 256 half floats in a run of 10 bits. The others are zlib; PXR24 drops a byte in four first.
        Compression::ZIP1 | Compression::ZIP16 | Compression::PIZ => 1032,
        Compression::PXR24 => 2 * 1032,
        // A block of 8×8 half floats in two numbers of 2 bytes, which go through zlib. Anything else: the same.
        _ => 32 * 1032,
    }
}

/// Every flat channel with its name, parts with colours first.
fn channels(source: &Source<'_>, headers: &[Header]) -> Result<(Vec<String>, Vec<Channel>)> {
    let name_of = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
    let mut parts: Vec<usize> = (0..headers.len()).filter(|&part| !headers[part].deep).collect();
    let has_color = |part: &usize| {
        let has = |wanted: &str| headers[*part].channels.list.iter().any(|c| split_name(&name_of(&c.name)).1 == wanted);
        (has("R") && has("G") && has("B")) || has("Y")
    };
    if let Some(at) = parts.iter().position(has_color) {
        parts[..=at].rotate_right(1);
    }
    if parts.is_empty() {
        return Err(source.unsupported("holds deep data only", "Flatten it to one value a pixel."));
    }
    let (mut names, mut channels) = (Vec::<String>::new(), Vec::new());
    for part in parts {
        for (index, channel) in headers[part].channels.list.iter().enumerate() {
            let mut name = name_of(&channel.name);
            if names.contains(&name) {
                let label = headers[part].own_attributes.layer_name.as_ref().map_or_else(|| part.to_string(), name_of);
                name = format!("{label}.{name}");
            }
            names.push(name);
            channels.push(Channel { part, index });
        }
    }
    Ok((names, channels))
}

/// The custom text attributes, sorted by name.
fn attributes(headers: &[Header]) -> Vec<(String, String)> {
    let mut texts = BTreeMap::new();
    for header in headers {
        for (name, value) in header.own_attributes.other.iter().chain(&header.shared_attributes.other) {
            if let AttributeValue::Text(text) = value {
                let lossy = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
                texts.entry(lossy(name)).or_insert_with(|| lossy(text));
            }
        }
    }
    texts.into_iter().collect()
}

/// What [`read`] hands to the decoder.
pub(super) type FileReader<'a> = Reader<Cursor<&'a [u8]>>;
