//! `pano info`: what files hold, and what is wrong with them.

mod depth;
mod mesh;
mod picture;
mod scene;

use crate::{failure::Failure, output};
use pano_core::{Error, Result, depth::DepthFormat};
use serde::Serialize;
use std::{
    fmt::Write,
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

/// Arguments of `pano info`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Problems that are found do not make the command fail; a file that cannot be read does. JSON: \
{\"files\": [{\"path\", \"kind\", …, \"problems\"}]}, kind being panorama, depth, mesh, scene or error.")]
pub(crate) struct Args {
    /// Pictures, depth maps, meshes and scene files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// What depth maps hold; a scene file says so itself
    #[arg(long, value_name = "PRESET", value_parser = clap::builder::PossibleValuesParser::new(DepthFormat::PRESETS))]
    depth_format: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What `pano info --json` prints.
#[derive(Debug, Serialize)]
struct Listing {
    files: Vec<FileInfo>,
}

/// One file.
#[derive(Debug, Serialize)]
struct FileInfo {
    path: PathBuf,
    #[serde(flatten)]
    content: Content,
    problems: Vec<String>,
}

/// What a file holds.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Content {
    Panorama(picture::PictureInfo),
    Depth(depth::DepthInfo),
    Mesh(mesh::MeshInfo),
    Scene(scene::SceneInfo),
    Error { message: String, remedy: Option<String> },
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let format = args.depth_format.as_deref().and_then(DepthFormat::preset);
    let mut failed = false;
    let mut files = vec![];
    for path in &args.files {
        let info = inspect(path, format.as_ref()).unwrap_or_else(|error| {
            failed = true;
            let info = FileInfo::unreadable(path, &error);
            Failure::from(error).print();
            info
        });
        if !args.json && !matches!(info.content, Content::Error { .. }) {
            output::print(&info.to_text(0))?;
        }
        files.push(info);
    }
    if args.json {
        output::print_json(&Listing { files })?;
    }
    if failed { Err(Failure::Reported) } else { Ok(()) }
}

/// Looks into a file of any kind.
fn inspect(path: &Path, depth_format: Option<&DepthFormat>) -> Result<FileInfo> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "toml" => scene::inspect(path),
        "ply" | "obj" | "gltf" | "glb" => mesh::inspect(path).map(|(info, _)| info),
        _ if is_depth(path) => depth::inspect(path, depth_format, true),
        _ => picture::inspect(path),
    }
}

/// Does the file's head say that it can only be a depth map: a gray PNG with 16 bits, a gray PFM, an EXR without colours? An
/// unreadable file is no depth map.
fn is_depth(path: &Path) -> bool {
    let mut head = [0; 26];
    // A device may block or never end; the readers refuse it.
    let regular = std::fs::metadata(path).is_ok_and(|m| m.is_file());
    let read = regular && File::open(path).is_ok_and(|mut file| file.read_exact(&mut head).is_ok());
    match &head {
        _ if !read => false,
        // The first chunk of a PNG holds the bit depth and the colour type (0: gray) in its bytes 24 and 25.
        [0x89, b'P', b'N', b'G', .., bits, color_type] => (*bits, *color_type) == (16, 0),
        [b'P', b'f', ..] => true,
        [0x76, 0x2f, 0x31, 0x01, ..] => pano_core::io::read_exr(path).is_ok_and(|exr| {
            let is_color = |name: &str| matches!(name.rsplit('.').next(), Some("R" | "G" | "B" | "RY" | "BY"));
            !exr.channels.iter().any(|(name, _)| is_color(name))
        }),
        _ => false,
    }
}

impl FileInfo {
    fn unreadable(path: &Path, error: &Error) -> Self {
        let content = Content::Error { message: error.to_string(), remedy: error.remedy().map(str::to_owned) };
        Self { path: path.to_owned(), content, problems: vec![] }
    }

    /// Lines of text, indented by `indent` steps.
    fn to_text(&self, indent: usize) -> String {
        let (kind, facts) = match &self.content {
            Content::Panorama(info) => (if info.equirectangular { "panorama" } else { "picture" }, info.facts()),
            Content::Depth(info) => ("depth map", info.facts()),
            Content::Mesh(info) => ("mesh", info.facts()),
            Content::Scene(info) => ("scene", info.facts()),
            Content::Error { message, .. } => ("unreadable", vec![("because", message.clone())]),
        };
        let pad = "  ".repeat(indent);
        let mut text = format!("{pad}{}: {kind}\n", self.path.display());
        for (name, fact) in facts {
            let _ = writeln!(text, "{pad}  {name:<12} {fact}");
        }
        if let Content::Scene(info) = &self.content {
            info.parts.iter().for_each(|part| text += &part.info.to_text(indent + 1));
        }
        for problem in &self.problems {
            let _ = writeln!(text, "{pad}  problem      {problem}");
        }
        text
    }
}

/// A share in [0, 1] as text.
fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}
