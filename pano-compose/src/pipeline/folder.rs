//! A folder for results of many files.

use super::{Error, Result};
use std::fs;
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
