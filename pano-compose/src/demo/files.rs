//! The demo's files.

use super::Demo;
use super::place::{COLOR_FILE, DEPTH_FILE, SCENE_FILE};
use crate::exposure::exposed;
use crate::pipeline::{Folder, Result};
use pano_core::{image::RadianceImage, io, mesh::Mesh};
use std::io::Write;
use std::path::Path;

impl Demo {
    /// Writes the pictures, the numbers and a scene to render again. Returns the files' names in the order they were
    /// written; each is either written whole or not at all.
    ///
    /// # Errors
    /// [`crate::pipeline::Error::Core`] names the first file that cannot be written.
    pub fn write(&self, folder: &Folder) -> Result<Vec<String>> {
        let mut names = Vec::new();
        let mut path = |name: &str| {
            names.push(name.to_owned());
            folder.path().join(name)
        };
        let white = self.numbers.white;
        io::write_image(path(COLOR_FILE), &self.panorama, None)?;
        io::write_exr(path(DEPTH_FILE), &[("Z", &self.depth)], &[(io::DEPTH_KIND_ATTRIBUTE, "ray")])?;
        for (name, mesh) in self.place.mesh_files() {
            write_ply(&path(&name), mesh)?;
        }
        io::write_text(path(SCENE_FILE), &self.scene_text)?;
        io::write_image(path("pano.png"), &exposed(&self.panorama, white), None)?;
        let mut pictures: Vec<(&str, &RadianceImage)> =
            vec![("photo", self.photo()), ("truth", &self.truth), ("truth-without", &self.truth_without)];
        pictures.extend(self.composites.iter().map(|(method, rendered)| (method.name(), &rendered.composite.color)));
        for (name, picture) in pictures {
            io::write_image(path(&format!("{name}.png")), &exposed(picture, white), None)?;
        }
        let json = serde_json::to_string_pretty(&self.numbers)
            .map_err(|e| pano_core::Error::argument(format!("the numbers cannot be written as JSON: {e}")))?;
        io::write_text(path("numbers.json"), &(json + "\n"))?;
        io::write_image(path("contact-sheet.png"), &self.contact_sheet(), None)?;
        Ok(names)
    }
}

/// Writes positions, normals and faces as ASCII PLY, in as many digits as reading the same numbers takes.
fn write_ply(path: &Path, mesh: &Mesh) -> Result<()> {
    let normals = mesh.normals.len() == mesh.positions.len();
    let write = |file: &mut io::AtomicFile<'_>| {
        writeln!(file, "ply\nformat ascii 1.0\nelement vertex {}", mesh.positions.len())?;
        let properties: &[&str] = if normals { &["x", "y", "z", "nx", "ny", "nz"] } else { &["x", "y", "z"] };
        properties.iter().try_for_each(|name| writeln!(file, "property float {name}"))?;
        writeln!(file, "element face {}\nproperty list uchar uint vertex_indices\nend_header", mesh.triangles.len())?;
        for (i, p) in mesh.positions.iter().enumerate() {
            write!(file, "{} {} {}", p.x, p.y, p.z)?;
            match mesh.normals.get(i).filter(|_| normals) {
                Some(n) => writeln!(file, " {} {} {}", n.x, n.y, n.z)?,
                None => writeln!(file)?,
            }
        }
        mesh.triangles.iter().try_for_each(|[a, b, c]| writeln!(file, "3 {a} {b} {c}"))
    };
    Ok(io::write_atomically(path, write)?)
}
