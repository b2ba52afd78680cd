//! Wavefront OBJ: `v vt vn f s usemtl mtllib`; other statements (names, points, lines, curves) are passed over.

use super::{Files, Mesh, mtl};
use crate::{Error, Result, material::Material};
use glam::{Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Stands for an index that a face's corner does not give.
const NONE: u32 = u32::MAX;

/// One corner of a face: indices of position, texture coordinate and normal.
type Corner = [u32; 3];

/// A polygon: its corners are a range of [`Obj::corners`].
struct Polygon {
    first: usize,
    len: usize,
    material: u32,
    /// Smoothing group, 0 for none.
    smoothing: u32,
    line: usize,
}

/// The file's statements, indices made absolute.
#[derive(Default)]
struct Obj {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    corners: Vec<Corner>,
    polygons: Vec<Polygon>,
    materials: Vec<Material>,
    material_of_name: HashMap<String, u32>,
}

/// Reads the OBJ file `bytes`; `path` is for messages and for finding the MTL files it names, which `files` reads.
pub(super) fn read(path: &Path, bytes: &[u8], files: &Files<'_>) -> Result<Mesh> {
    // Only names and comments can hold other bytes than ASCII.
    let text = String::from_utf8_lossy(bytes);
    let mut obj = Obj::default();
    let (mut material, mut smoothing) = (NONE, 0);
    // Each is read once, however often it is named.
    let mut libraries = HashSet::new();
    for (i, line) in joined_lines(&text) {
        let (keyword, rest) = split_keyword(&line);
        let done = match keyword {
            "v" => numbers(rest).map(|v| obj.positions.push(Vec3::from(v))),
            "vn" => numbers(rest).map(|n| obj.normals.push(Vec3::from(n))),
            "vt" => texture_coordinate(rest).map(|t| obj.uvs.push(t)),
            "f" | "fo" => obj.face(rest, material, smoothing, i),
            "s" => {
                smoothing = rest.parse().unwrap_or(u32::from(rest == "on"));
                Ok(())
            }
            "usemtl" => {
                material = obj.material_of_name.get(rest).copied().unwrap_or(NONE);
                Ok(())
            }
            "mtllib" => {
                if libraries.insert(rest.to_owned()) {
                    mtl::read(path, rest, files, &mut obj.materials, &mut obj.material_of_name)?;
                }
                Ok(())
            }
            _ => Ok(()),
        };
        done.map_err(|problem| error_at(path, i, &problem))?;
    }
    obj.into_mesh(path)
}

fn error_at(path: &Path, line: usize, problem: &str) -> Error {
    Error::file(path, format!("line {line}: {problem}"), "Correct the line, or export the mesh again.")
}

/// Statements with their 1-based line numbers, without comments; a backslash at a line's end joins the next one to it.
pub(super) fn joined_lines(text: &str) -> impl Iterator<Item = (usize, String)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (i, first) = lines.next()?;
        let mut line = first.split('#').next().unwrap_or_default().trim().to_owned();
        while line.ends_with('\\') {
            line.pop();
            let Some((_, next)) = lines.next() else { break };
            line.push_str(next.split('#').next().unwrap_or_default().trim());
        }
        Some((i + 1, line))
    })
}

/// A statement's first word and the rest.
pub(super) fn split_keyword(line: &str) -> (&str, &str) {
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim()))
}

/// The first three numbers; more (weights, vertex colours) are allowed.
fn numbers(text: &str) -> Result<[f32; 3], String> {
    let mut words = text.split_whitespace();
    let mut next =
        || words.next().and_then(|w| w.parse().ok()).ok_or_else(|| format!("`{text:.60}` does not hold three numbers"));
    Ok([next()?, next()?, next()?])
}

fn texture_coordinate(text: &str) -> Result<Vec2, String> {
    let mut words = text.split_whitespace().map(str::parse::<f32>);
    match (words.next(), words.next()) {
        (Some(Ok(u)), None) => Ok(Vec2::new(u, 1.0)),
        // glTF's v points down.
        (Some(Ok(u)), Some(Ok(v))) => Ok(Vec2::new(u, 1.0 - v)),
        _ => Err(format!("`{text:.60}` is not a texture coordinate")),
    }
}

/// An index as written (1 is the first, −1 the latest) made absolute.
fn absolute(word: &str, count: usize, of: &str) -> Result<u32, String> {
    let index: i64 = word.parse().map_err(|_| format!("`{word:.30}` is not an index"))?;
    let absolute = if index < 0 { count as i64 + index } else { index - 1 };
    // Faces may come before what they use; the upper bound is checked at the end.
    match u32::try_from(absolute) {
        Ok(i) if i != NONE && index != 0 => Ok(i),
        _ => Err(format!("index {index} into {count} {of}")),
    }
}

impl Obj {
    fn face(&mut self, text: &str, material: u32, smoothing: u32, line: usize) -> Result<(), String> {
        let first = self.corners.len();
        for word in text.split_whitespace() {
            let mut parts = word.split('/');
            let mut part = |count: usize, of: &str| match parts.next() {
                None | Some("") => Ok(NONE),
                Some(word) => absolute(word, count, of),
            };
            let corner = [
                part(self.positions.len(), "positions")?,
                part(self.uvs.len(), "texture coordinates")?,
                part(self.normals.len(), "normals")?,
            ];
            if corner[0] == NONE {
                return Err(format!("the corner `{word:.30}` has no position"));
            }
            self.corners.push(corner);
        }
        self.polygons.push(Polygon { first, len: self.corners.len() - first, material, smoothing, line });
        Ok(())
    }

    fn check_ranges(&self, path: &Path) -> Result<()> {
        for polygon in &self.polygons {
            for corner in &self.corners[polygon.first..polygon.first + polygon.len] {
                let counts =
                    [("position", self.positions.len()), ("texture coordinate", self.uvs.len()), ("normal", self.normals.len())];
                for (&index, (name, count)) in corner.iter().zip(counts) {
                    if index != NONE && index as usize >= count {
                        return Err(error_at(
                            path,
                            polygon.line,
                            &format!("the face uses {name} {} of {count}", u64::from(index) + 1),
                        ));
                    }
                }
            }
        }
        Ok(())
    }

    fn into_mesh(mut self, path: &Path) -> Result<Mesh> {
        self.check_ranges(path)?;
        if self.polygons.iter().any(|p| p.material == NONE) && !self.materials.is_empty() {
            let default = self.materials.len() as u32;
            self.materials.push(Material::default());
            self.polygons.iter_mut().filter(|p| p.material == NONE).for_each(|p| p.material = default);
        }
        let shaded = self.polygons.iter().any(|p| p.smoothing != 0) || self.corners.iter().any(|c| c[2] != NONE);
        let textured = self.corners.iter().any(|c| c[1] != NONE);
        let mut mesh = Mesh::default();
        // What a vertex without a normal of its own shares its normal with: all corners at this position in this
        // smoothing group, or in this flat face.
        let mut shared_normals: HashMap<(u32, u64), Vec3> = HashMap::new();
        let mut to_fill: Vec<(usize, (u32, u64))> = Vec::new();
        let mut vertex_of: HashMap<(Corner, u64), u32> = HashMap::new();
        for (i, polygon) in self.polygons.iter().enumerate() {
            let corners = &self.corners[polygon.first..polygon.first + polygon.len];
            if corners.len() < 3 {
                continue;
            }
            let group = match polygon.smoothing {
                _ if !shaded => 0,
                0 => (1 << 32) + i as u64,
                s => u64::from(s),
            };
            let at = |c: &Corner| self.positions[c[0] as usize];
            let area = (2..corners.len())
                .map(|k| (at(&corners[k - 1]) - at(&corners[0])).cross(at(&corners[k]) - at(&corners[0])))
                .sum::<Vec3>();
            let mut vertex = |corner: &Corner| {
                let group = if corner[2] == NONE { group } else { 0 };
                *vertex_of.entry((*corner, group)).or_insert_with(|| {
                    mesh.positions.push(at(corner));
                    if textured {
                        mesh.uvs.push(self.uvs.get(corner[1] as usize).copied().unwrap_or_default());
                    }
                    if shaded {
                        mesh.normals.push(self.normals.get(corner[2] as usize).copied().unwrap_or_default());
                        if corner[2] == NONE {
                            to_fill.push((mesh.positions.len() - 1, (corner[0], group)));
                        }
                    }
                    mesh.positions.len() as u32 - 1
                })
            };
            let ids: Vec<u32> = corners.iter().map(&mut vertex).collect();
            if shaded {
                for corner in corners.iter().filter(|c| c[2] == NONE) {
                    *shared_normals.entry((corner[0], group)).or_default() += area;
                }
            }
            for k in 2..ids.len() {
                mesh.triangles.push([ids[0], ids[k - 1], ids[k]]);
                if !self.materials.is_empty() {
                    mesh.material_ids.push(polygon.material);
                }
            }
        }
        for (vertex, key) in to_fill {
            mesh.normals[vertex] = shared_normals[&key].try_normalize().unwrap_or(Vec3::Y);
        }
        mesh.materials = self.materials;
        Ok(mesh)
    }
}
