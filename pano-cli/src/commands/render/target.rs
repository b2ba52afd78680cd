//! Where the frames go.

use pano_core::{
    Error, Result,
    io::IMAGE_EXTENSIONS,
    scene::{FramePattern, PicturePath},
};
use std::path::{Path, PathBuf};

/// A file, or a file a frame.
pub(super) struct Target(PicturePath);

impl Target {
    /// For `frames` frames.
    ///
    /// # Errors
    /// If the name's extension means no picture format, or more than one frame would go to one file.
    pub(super) fn new(path: &Path, frames: usize) -> Result<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        if !IMAGE_EXTENSIONS.contains(&extension.as_str()) {
            let problem = "its extension means no picture format that can be written";
            return Err(Error::file(path, problem, format!("end it in one of: .{}", IMAGE_EXTENSIONS.join(", ."))));
        }
        match FramePattern::new(path) {
            Some(pattern) => Ok(Self(PicturePath::Frames(pattern))),
            None if frames > 1 => {
                let problem = format!("{frames} frames do not go into one file");
                Err(Error::file(path, problem, "put a frame number into the name, e.g. out_%04d.exr"))
            }
            None => Ok(Self(PicturePath::Still(path.to_owned()))),
        }
    }

    /// The file of a frame.
    pub(super) fn path(&self, frame: u32) -> PathBuf {
        self.0.path(frame)
    }

    /// Can the files be written?
    pub(super) fn check(&self, frames: &[u32]) -> Result<()> {
        // All lie in one folder; what may differ is that a folder stands in a name's place.
        frames.first().map_or(Ok(()), |&first| check_writable(&self.path(first)))
    }
}

/// Fails if `path` is a folder, or if no file can be made beside it.
pub(super) fn check_writable(path: &Path) -> Result<()> {
    let fail = |problem: String, remedy: &str| Err(Error::file(path, problem, remedy));
    if path.is_dir() {
        return fail("cannot be written: it is a folder".into(), "name a file, with its extension");
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let problem = format!("cannot be written: the folder {} does not exist", folder.display());
        return fail(problem, "create the folder first, or write somewhere else");
    }
    match tempfile::tempfile_in(folder) {
        Ok(_) => Ok(()),
        Err(e) => fail(format!("cannot be written: {e}"), "check that the folder is writable and the disk not full"),
    }
}
