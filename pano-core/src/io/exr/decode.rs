//! From compressed chunks to channels of `f32`.
//!
//! The `exr` crate decompresses a chunk at a time; the loop around it is ours, so that a panic inside is an error here
//! (rayon would abort the process for one in a detached task), only the wanted channels take memory, and a file with
//! missing or doubled chunks is told from a whole one.

use super::super::source::Source;
use super::read::FileReader;
use crate::{Error, Result};
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::reader::ChunksReader;
use exr::meta::MetaData;
use exr::meta::attribute::{Compression, SampleType};
use exr::prelude::f16;
use rayon::prelude::*;
use std::collections::HashSet;

/// Chunks decompressed at a time: enough for many threads, few enough that raw pixels take little memory.
const BATCH: usize = 64;

/// A wanted channel: `index` of part `part`, whose data starts at `offset` in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) part: usize,
    pub(super) index: usize,
    pub(super) offset: [i64; 2],
}

/// Decodes the targets' channels onto pictures of `width` × `height`, 0 where no data is.
pub(super) fn decode(
    source: &Source<'_>,
    reader: FileReader<'_>,
    targets: &[Target],
    width: usize,
    height: usize,
) -> Result<Vec<Vec<f32>>> {
    let damaged = |e: exr::error::Error| source.broken(format!("is a truncated or damaged EXR: {e}"));
    let mut chunks = reader.all_chunks(false).map_err(damaged)?;
    let meta = chunks.meta_data().clone();
    let mut planes = vec![vec![0.0f32; width * height]; targets.len()];
    let mut seen = HashSet::new();
    let mut pixels = vec![0usize; meta.headers.len()];
    loop {
        let mut batch = Vec::with_capacity(BATCH);
        while batch.len() < BATCH {
            match chunks.read_next_chunk() {
                Some(chunk) => batch.push(chunk.map_err(damaged)?),
                None => break,
            }
        }
        if batch.is_empty() {
            break;
        }
        batch.retain(|chunk| targets.iter().any(|target| target.part == chunk.layer_index));
        let blocks: Vec<Result<Option<UncompressedBlock>>> =
            batch.into_par_iter().map(|chunk| source.guard(|| decompress(source, chunk, &meta))).collect();
        for block in blocks {
            let Some(block) = block? else { continue };
            if !seen.insert((block.index.layer, block.index.pixel_position.0, block.index.pixel_position.1)) {
                return Err(source.broken("is a damaged EXR: two of its chunks claim the same place"));
            }
            pixels[block.index.layer] += block.index.pixel_size.area();
            planes
                .par_iter_mut()
                .zip(targets)
                .filter(|(_, target)| target.part == block.index.layer)
                .try_for_each(|(plane, target)| place(&block, &meta, *target, plane, width))
                .ok_or_else(|| source.broken("is a damaged EXR: a chunk is shorter than its place"))?;
        }
    }
    for target in targets {
        let area = meta.headers[target.part].layer_size.area();
        if pixels[target.part] != area {
            return Err(source.broken(format!("is an incomplete EXR: {} of {area} pixels", pixels[target.part])));
        }
    }
    Ok(planes)
}

/// One chunk's pixels; `None` for the smaller levels of a mip map.
fn decompress(source: &Source<'_>, chunk: Chunk, meta: &MetaData) -> Result<Option<UncompressedBlock>> {
    let header = &meta.headers[chunk.layer_index];
    let bytes = match &chunk.compressed_block {
        CompressedBlock::Tile(tile) if tile.coordinates.level_index != exr::math::Vec2(0, 0) => return Ok(None),
        CompressedBlock::Tile(tile) => &tile.compressed_pixels_le,
        CompressedBlock::ScanLine(lines) => &lines.compressed_pixels_le,
        CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => return Ok(None),
    };
    if matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        check_dwa_counters(source, bytes, header.max_block_byte_size())?;
    }
    let damaged = |e: exr::error::Error| -> Error { source.broken(format!("is a damaged EXR: {e}")) };
    UncompressedBlock::decompress_chunk(chunk, meta, false).map(Some).map_err(damaged)
}

/// A DWA chunk starts with counters of what its sections unpack to, which the decoder allocates as they are. No section
/// unpacks to more than the pixels (in half floats, padded to blocks of 8×8) and their run-length codes need.
fn check_dwa_counters(source: &Source<'_>, chunk: &[u8], block_bytes: usize) -> Result<()> {
    // Of the eleven counters: unknown (uncompressed), RLE (uncompressed), RLE (raw), AC count, DC count.
    const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];
    let limit = (block_bytes as u64).saturating_mul(64).saturating_add(1 << 20);
    let too_large = UNPACKED.iter().any(|&i| {
        let counter = chunk.get(8 * i..8 * i + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        counter.is_some_and(|counter| counter > limit)
    });
    if too_large { Err(source.broken("is a damaged EXR: impossible sizes in a DWA chunk")) } else { Ok(()) }
}

/// Copies one channel of a block to where it belongs, cropping to the picture. `None` if the block is too short.
fn place(block: &UncompressedBlock, meta: &MetaData, target: Target, plane: &mut [f32], width: usize) -> Option<()> {
    let channels = &meta.headers[target.part].channels;
    let (columns, rows) = (block.index.pixel_size.0, block.index.pixel_size.1);
    let before: usize = channels.list[..target.index].iter().map(|c| c.sample_type.bytes_per_sample()).sum();
    let kind = channels.list[target.index].sample_type;
    let size = kind.bytes_per_sample();
    let height = plane.len() / width;
    for row in 0..rows {
        // Native-endian, line after line, channel after channel within a line.
        let start = columns * (row * channels.bytes_per_pixel + before);
        let line = block.data.get(start..start + columns * size)?;
        let y = (block.index.pixel_position.1 + row) as i64 + target.offset[1];
        if !(0..height as i64).contains(&y) {
            continue;
        }
        let left = block.index.pixel_position.0 as i64 + target.offset[0];
        let skip = (-left).clamp(0, columns as i64) as usize;
        let first = (left + skip as i64).clamp(0, width as i64) as usize;
        let count = (columns - skip).min(width - first);
        let out = &mut plane[y as usize * width + first..][..count];
        let samples = line[skip * size..].chunks_exact(size);
        for (out, sample) in out.iter_mut().zip(samples) {
            *out = match (kind, sample) {
                (SampleType::F16, &[a, b]) => f16::from_ne_bytes([a, b]).to_f32(),
                (SampleType::F32, &[a, b, c, d]) => f32::from_ne_bytes([a, b, c, d]),
                (SampleType::U32, &[a, b, c, d]) => u32::from_ne_bytes([a, b, c, d]) as f32,
                _ => return None,
            };
        }
    }
    Some(())
}
