//! The demo's files.

use super::Demo;
use super::numbers::exposed;
use super::place::{COLOR_FILE, DEPTH_FILE, SCENE_FILE};
use crate::pipeline::{Error, Result};
use pano_core::{image::RadianceImage, io, mesh::Mesh};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A folder to write into, checked before the work begins. If nothing is written, dropping it removes what was created.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Folders that did not exist, innermost first.
    created: Vec<PathBuf>,
}

impl Folder {
    /// Creates the folder, with its parents, unless it is there.
    ///
    /// # Errors
    /// [`Error::Core`] if it cannot be created or written, or is a file.
    pub fn create(path: impl Into<PathBuf>) -> Result<Self> {
        let path: PathBuf = path.into();
        if path.exists() && !path.is_dir() {
            return Err(
                pano_core::Error::file(&path, "is a file, and a folder is needed", "name a folder, or one to create").into()
            );
        }
        let missing = path.ancestors().take_while(|p| !p.as_os_str().is_empty() && !p.exists());
        let folder = Self { created: missing.map(Path::to_owned).collect(), path };
        let failed = |problem: &str, e: std::io::Error| {
            let problem = format!("{problem}: {e}");
            Error::Core(pano_core::Error::file(&folder.path, problem, "check that its parent is a folder that can be written"))
        };
        fs::create_dir_all(&folder.path).map_err(|e| failed("cannot be created", e))?;
        let probe = folder.path.join(".pano-probe.tmp");
        fs::write(&probe, "").and_then(|()| fs::remove_file(&probe)).map_err(|e| failed("cannot be written", e))?;
        Ok(folder)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that holds something stays: removing it fails, which is what is wanted.
        let _ = self.created.iter().try_for_each(fs::remove_dir);
    }
}

impl Demo {
    /// Writes the pictures, the numbers and a scene to render again. Returns the files' names in the order they were
    /// written; each is either written whole or not at all.
    ///
    /// # Errors
    /// [`Error::Core`] names the first file that cannot be written.
    pub fn write(&self, folder: &Folder) -> Result<Vec<String>> {
        let mut names = Vec::new();
        let mut path = |name: &str| {
            names.push(name.to_owned());
            folder.path.join(name)
        };
        let white = self.numbers.white;
        io::write_image(path(COLOR_FILE), &self.panorama, None)?;
        io::write_exr(path(DEPTH_FILE), &[("Z", &self.depth)], &[(io::DEPTH_KIND_ATTRIBUTE, "ray")])?;
        for (name, mesh) in self.place.mesh_files() {
            write_ply(&path(&name), mesh)?;
        }
        write_text(&path(SCENE_FILE), &self.scene_text)?;
        io::write_image(path("pano.png"), &exposed(&self.panorama, white), None)?;
        let mut pictures: Vec<(&str, &RadianceImage)> =
            vec![("photo", self.photo()), ("truth", &self.truth), ("truth-without", &self.truth_without)];
        pictures.extend(self.composites.iter().map(|(method, rendered)| (method.name(), &rendered.composite.color)));
        for (name, picture) in pictures {
            io::write_image(path(&format!("{name}.png")), &exposed(picture, white), None)?;
        }
        let json = serde_json::to_string_pretty(&self.numbers)
            .map_err(|e| pano_core::Error::argument(format!("the numbers cannot be written as JSON: {e}")))?;
        write_text(&path("numbers.json"), &(json + "\n"))?;
        io::write_image(path("contact-sheet.png"), &self.contact_sheet(), None)?;
        Ok(names)
    }
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    Ok(io::write_atomically(path, |file| file.write_all(text.as_bytes()))?)
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
