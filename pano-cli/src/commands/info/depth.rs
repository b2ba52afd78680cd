//! What a depth map holds.

use super::{Content, FileInfo, percent};
use pano_core::{
    Result,
    camera::Projection,
    depth::{DepthFormat, DepthKind},
    io::read_depth,
    metrics::DepthStats,
};
use serde::Serialize;
use std::path::Path;

/// A depth map.
#[derive(Debug, Serialize)]
pub(super) struct DepthInfo {
    width: usize,
    height: usize,
    /// Is it 2:1, as a whole sphere is?
    pub(super) equirectangular: bool,
    /// Share of pixels at which there is something.
    valid_share: f64,
    /// Nearest, median and farthest distance in metres.
    range: Option<[f32; 3]>,
}

/// Reads the depth map of a panorama, or of a depth camera, and lists its problems. Without a `format`, values are taken as
/// metres.
pub(super) fn inspect(path: &Path, format: Option<&DepthFormat>, panorama: bool) -> Result<FileInfo> {
    let mut given = format.cloned().unwrap_or_default();
    // Distances along an axis need the camera; their own range says enough here.
    if given.kind == DepthKind::Z {
        given.kind = DepthKind::Ray;
    }
    let depth = read_depth(path, &given, Projection::Panorama)?;
    let (width, height) = depth.size();
    let DepthStats { valid_share, range } = DepthStats::of(&depth);
    let mut problems = vec![];
    if panorama && width != 2 * height {
        problems.push(format!("is {width}×{height}, not twice as wide as high: no whole panorama"));
    }
    match range {
        None => problems.push("nothing is there: every pixel is invalid".into()),
        Some([_, median, _]) if format.is_none() && median > 200.0 => {
            problems.push(format!("half of it is beyond {median} m: name its unit with --depth-format"));
        }
        Some(_) => {}
    }
    let info = DepthInfo { width, height, equirectangular: width == 2 * height, valid_share, range };
    Ok(FileInfo { path: path.to_owned(), content: Content::Depth(info), problems })
}

impl DepthInfo {
    /// `(width, height)`.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// For the text output.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let shape = if self.equirectangular { "2:1" } else { "not 2:1" };
        let mut facts = vec![
            ("size", format!("{}×{} ({shape})", self.width, self.height)),
            ("valid", format!("{} of the pixels", percent(self.valid_share))),
        ];
        facts.extend(self.range.map(|[near, median, far]| ("distance", format!("{near} to {far} m, median {median}"))));
        facts
    }
}
