//! PLY, ASCII and binary: `vertex` (x y z, nx ny nz, texture coordinates) and `face` (lists of vertex indices).

use super::Mesh;
use crate::{Error, Result};
use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{BeginList, ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};
use std::path::Path;

const REMEDY: &str = "Export the mesh again, as a PLY of vertices and faces.";

/// Reads the PLY file `bytes`; `path` is for messages.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let fail = |problem: String| Error::file(path, problem, REMEDY);
    let mut reader = Reader::new(bytes);
    let header =
        Parser::<Skipped>::new().read_header(&mut reader).map_err(|e| fail(format!("is not a PLY file: {}", flat(&e))))?;
    let mut mesh = Mesh::default();
    for (name, element) in &header.elements {
        check_size(element, header.encoding, reader.get_ref().len()).map_err(fail)?;
        let broken = |e: &ply_rs_bw::parser::ParseError| fail(format!("element `{name}`: {}", flat(e)));
        match name.as_str() {
            "vertex" => {
                let vertices =
                    Parser::<Vertex>::new().read_payload_for_element(&mut reader, element, &header).map_err(|e| broken(&e))?;
                take_vertices(&mut mesh, element, &vertices).map_err(fail)?;
            }
            "face" => {
                let faces =
                    Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header).map_err(|e| broken(&e))?;
                take_faces(&mut mesh, &faces).map_err(fail)?;
            }
            _ => {
                Parser::<Skipped>::new().read_payload_for_element(&mut reader, element, &header).map_err(|e| broken(&e))?;
            }
        }
    }
    if mesh.positions.is_empty() {
        return Err(fail("has no vertices".into()));
    }
    Ok(mesh)
}

/// The parser's multi-line messages on one line.
fn flat(e: &ply_rs_bw::parser::ParseError) -> String {
    let line: String = e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    // A message may quote a line of the file, which in a binary file has no bounds.
    line.chars().filter(|c| !c.is_control()).take(300).collect()
}

/// Refuses a declared count that the rest of the file cannot hold, before anything is allocated for it.
fn check_size(element: &ElementDef, encoding: Encoding, left: usize) -> Result<(), String> {
    let size = |t: &ScalarType| match t {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    };
    let least: usize = match encoding {
        // A digit and a separator each.
        Encoding::Ascii => 2 * element.properties.len(),
        _ => element
            .properties
            .values()
            .map(|p| match &p.data_type {
                PropertyType::Scalar(t) | PropertyType::List(t, _) => size(t),
            })
            .sum(),
    };
    // The last ASCII line may lack its line break.
    if element.count > 0 && (least == 0 || element.count.saturating_mul(least) > left + 1) {
        return Err(format!(
            "declares {} × `{}`, but only {left} bytes are left: the file is cut off or damaged",
            element.count, element.name
        ));
    }
    Ok(())
}

fn take_vertices(mesh: &mut Mesh, element: &ElementDef, vertices: &[Vertex]) -> Result<(), String> {
    let has = |names: &[&str]| names.iter().all(|n| element.properties.contains_key(*n));
    if !has(&["x", "y", "z"]) {
        return Err("its vertices lack x, y or z".into());
    }
    mesh.positions = vertices.iter().map(|v| v.position).collect();
    if has(&["nx", "ny", "nz"]) {
        mesh.normals = vertices.iter().map(|v| v.normal).collect();
    }
    if [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]].iter().any(|names| has(names)) {
        mesh.uvs = vertices.iter().map(|v| Vec2::new(v.uv.x, 1.0 - v.uv.y)).collect();
    }
    Ok(())
}

fn take_faces(mesh: &mut Mesh, faces: &[Face]) -> Result<(), String> {
    mesh.triangles.reserve(faces.len());
    for (i, face) in faces.iter().enumerate() {
        if let Some(bad) = face.signed.iter().find(|&&v| v < 0) {
            return Err(format!("face {i} uses vertex {bad}"));
        }
        fan(&face.signed, |t| mesh.triangles.push(t.map(|v| v as u32)));
        fan(&face.unsigned, |t| mesh.triangles.push(t));
    }
    Ok(())
}

fn fan<T: Copy>(corners: &[T], mut triangle: impl FnMut([T; 3])) {
    for i in 2..corners.len() {
        triangle([corners[0], corners[i - 1], corners[i]]);
    }
}

#[derive(Default)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
}

impl Vertex {
    #[inline]
    fn set(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        match name {
            "x" => self.position.x = value,
            "y" => self.position.y = value,
            "z" => self.position.z = value,
            "nx" => self.normal.x = value,
            "ny" => self.normal.y = value,
            "nz" => self.normal.z = value,
            "u" | "s" | "texture_u" | "texture_s" => self.uv.x = value,
            "v" | "t" | "texture_v" | "texture_t" => self.uv.y = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        property.to_f32_lossy().map_or(PropertyAccessResult::Ignored, |value| self.set(name, value))
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value)
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value as f32)
    }
}

/// Corner lists by type; the usual two are filled in place.
#[derive(Default)]
struct Face {
    signed: Vec<i32>,
    unsigned: Vec<u32>,
}

fn is_corners(name: &str) -> bool {
    matches!(name, "vertex_indices" | "vertex_index")
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !is_corners(name) {
            return PropertyAccessResult::Ignored;
        }
        match property.to_u32_list() {
            Some(corners) => {
                self.unsigned = corners;
                PropertyAccessResult::Set
            }
            None => PropertyAccessResult::UnsupportedType,
        }
    }

    fn begin_list_int(&mut self, name: &str, _: usize) -> BeginList<'_, i32> {
        if is_corners(name) { BeginList::Fill(&mut self.signed) } else { BeginList::UseSetter }
    }

    fn begin_list_uint(&mut self, name: &str, _: usize) -> BeginList<'_, u32> {
        if is_corners(name) { BeginList::Fill(&mut self.unsigned) } else { BeginList::UseSetter }
    }
}

/// An element that is read only to get past it.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
