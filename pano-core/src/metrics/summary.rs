//! What a picture, a depth map or a mesh holds, in a few numbers.

use crate::{color::luminance, depth::RayDepth, image::RadianceImage, mesh::Mesh};
use std::collections::HashMap;

/// Luminances of a picture; every pixel counts alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuminanceStats {
    /// Darkest pixel.
    pub min: f32,
    /// Brightest pixel.
    pub max: f32,
    /// Mean over pixels.
    pub mean: f64,
    /// As many pixels are darker as brighter.
    pub median: f32,
    /// Share of pixels that are exactly black, [0, 1].
    pub black_share: f64,
    /// log₂ of the brightest luminance over the 1 % quantile of those that are not black; 0 for a black picture.
    pub dynamic_range_stops: f64,
}

impl LuminanceStats {
    /// Of a picture with finite values ≥ 0.
    pub fn of(image: &RadianceImage) -> Self {
        let mut values: Vec<f32> = image.data().iter().map(|p| luminance(*p)).collect();
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
        values.sort_unstable_by(f32::total_cmp);
        let (min, max, median) = (values[0], values[values.len() - 1], values[values.len() / 2]);
        let black = values.partition_point(|&v| v <= 0.0);
        let lit = &values[black..];
        let stops = lit.get(lit.len() / 100).map_or(0.0, |&dark| (f64::from(max) / f64::from(dark)).log2());
        let black_share = black as f64 / values.len() as f64;
        Self { min, max, mean, median, black_share, dynamic_range_stops: stops }
    }
}

/// Distances of a depth map, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthStats {
    /// Share of pixels at which there is something, [0, 1].
    pub valid_share: f64,
    /// Nearest, median and farthest distance; `None` if there is nothing anywhere.
    pub range: Option<[f32; 3]>,
}

impl DepthStats {
    /// Of a depth map.
    pub fn of(depth: &RayDepth) -> Self {
        let all = depth.image().data();
        let mut values: Vec<f32> = all.iter().copied().filter(|d| d.is_finite()).collect();
        values.sort_unstable_by(f32::total_cmp);
        let range = values.first().zip(values.last()).map(|(near, far)| [*near, values[values.len() / 2], *far]);
        Self { valid_share: values.len() as f64 / all.len() as f64, range }
    }
}

/// The soundness of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshStats {
    /// Triangles without area, which no ray meets.
    pub degenerate: usize,
    /// Edges that do not join exactly two faces, once vertices at the same place are one. 0: the mesh bounds a body.
    pub open_edges: usize,
}

impl MeshStats {
    /// Of a valid mesh (see [`Mesh::validate`]).
    pub fn of(mesh: &Mesh) -> Self {
        let mut places: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.positions.len());
        let mut vertex = |v: u32| {
            // Adding 0 makes −0 and 0 the same place.
            let place = (mesh.positions[v as usize] + 0.0).to_array().map(f32::to_bits);
            let next = places.len() as u32;
            *places.entry(place).or_insert(next)
        };
        let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
        let mut degenerate = 0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            degenerate += usize::from((b - a).cross(c - a) == glam::Vec3::ZERO);
            let [a, b, c] = t.map(&mut vertex);
            // A triangle with two corners at one place has no inside; its other edges cancel.
            if a != b && b != c && c != a {
                edges.extend([(a, b), (b, c), (c, a)].map(|(i, j)| (i.min(j), i.max(j))));
            }
        }
        edges.sort_unstable();
        let open_edges = edges.chunk_by(|a, b| a == b).filter(|faces| faces.len() != 2).count();
        Self { degenerate, open_edges }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use glam::Vec3;

    #[test]
    fn luminance_of_known_pictures() {
        let image = Image::from_fn(100, 3, |x, _| Vec3::splat(if x < 50 { 0.0 } else { f32::exp2((x - 50) as f32 / 8.0) }));
        let stats = LuminanceStats::of(&image);
        assert_eq!((stats.min, stats.black_share), (0.0, 0.5));
        assert!((stats.dynamic_range_stops - 49.0 / 8.0).abs() < 1e-5, "{stats:?}");
        assert!((stats.median - 1.0).abs() < 1e-6, "{stats:?}");
        let black = LuminanceStats::of(&Image::filled(1, 1, Vec3::ZERO));
        assert_eq!((black.max, black.black_share, black.dynamic_range_stops), (0.0, 1.0, 0.0));
    }

    #[test]
    fn depth_counts_what_is_there() {
        let raw = Image::from_vec(5, 1, vec![0.0, 2.0, f32::NAN, 8.0, 3.0]).unwrap();
        let stats = DepthStats::of(&RayDepth::from_metres(raw));
        assert_eq!(stats, DepthStats { valid_share: 0.6, range: Some([2.0, 3.0, 8.0]) });
        let nothing = DepthStats::of(&RayDepth::from_metres(Image::filled(2, 2, 0.0)));
        assert_eq!(nothing, DepthStats { valid_share: 0.0, range: None });
    }

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_missing() {
        // One vertex stands twice, as at a texture seam, once with −0.
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(-0.0, 0.0, -0.0)];
        let mut mesh = Mesh { positions, triangles: vec![[0, 2, 1], [4, 1, 3], [0, 3, 2], [1, 2, 3]], ..Mesh::default() };
        assert_eq!(MeshStats::of(&mesh), MeshStats { degenerate: 0, open_edges: 0 });
        mesh.triangles.push([0, 4, 1]);
        assert_eq!(MeshStats::of(&mesh), MeshStats { degenerate: 1, open_edges: 0 });
        mesh.triangles.remove(3);
        assert_eq!(MeshStats::of(&mesh), MeshStats { degenerate: 1, open_edges: 3 });
    }
}
