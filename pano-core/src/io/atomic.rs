//! Writing that either replaces a file as a whole or leaves everything as it was.

use crate::{Error, Result};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// What [`write_atomically`] hands to its closure: a buffered file that can seek.
pub type AtomicFile<'a> = BufWriter<&'a mut File>;

/// Writes `path` through a temporary file in the same folder, which then takes the name. If `write` fails, or the folder
/// cannot be written, nothing is left behind and a file already at `path` keeps its contents. A symbolic link is followed; an
/// existing file's permissions are kept.
///
/// # Errors
/// [`Error::File`] if the folder is missing or not writable, if `path` is a folder or a device, if `write` fails.
pub fn write_atomically(path: impl AsRef<Path>, write: impl FnOnce(&mut AtomicFile<'_>) -> io::Result<()>) -> Result<()> {
    let path = path.as_ref();
    let target = target_of(path)?;
    // "out.png" has the parent "", which stands for the current folder.
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let problem = format!("cannot be written: the folder {} does not exist", folder.display());
        return Err(Error::file(path, problem, "Create the folder first, or write somewhere else."));
    }
    let failed = |action: &str, error: io::Error| {
        Error::file(path, format!("{action}: {error}"), "Check that the folder is writable and the disk not full.")
    };
    let mut temporary = builder(&target).tempfile_in(folder).map_err(|e| failed("cannot be written", e))?;
    let mut file = BufWriter::new(temporary.as_file_mut());
    write(&mut file).and_then(|()| file.flush()).map_err(|e| failed("writing failed", e))?;
    drop(file);
    temporary.persist(&target).map_err(|e| failed("cannot be replaced", e.error))?;
    Ok(())
}

/// Writes a text file, whole or not at all.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_text(path: impl AsRef<Path>, text: &str) -> Result<()> {
    write_atomically(path, |file| file.write_all(text.as_bytes()))
}

/// The file that writing to `path` replaces.
fn target_of(path: &Path) -> Result<PathBuf> {
    let Ok(metadata) = fs::metadata(path) else {
        return Ok(path.to_owned());
    };
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "a folder" } else { "not a regular file" };
        let problem = format!("cannot be written: it is {what}");
        return Err(Error::file(path, problem, "Name a file, with its extension."));
    }
    fs::canonicalize(path).map_err(|e| Error::file(path, format!("cannot be found: {e}"), "Check the path."))
}

/// A temporary file with the permissions the target has, or would have if it were created anew.
fn builder(target: &Path) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".pano-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // 0o666 less the umask is what creating a file gives; the default of temporary files, 0o600, would lock others out.
        let permissions = fs::metadata(target).map_or_else(|_| fs::Permissions::from_mode(0o666), |m| m.permissions());
        builder.permissions(permissions);
    }
    #[cfg(not(unix))]
    let _ = target;
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn writes_and_replaces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for text in ["first", "second, longer"] {
            write_atomically(&path, |f| f.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let result = write_atomically(&path, |f| f.write_all(b"new").and(Err(io::Error::other("no more"))));
        assert!(result.unwrap_err().to_string().contains("no more"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn missing_folders_and_folders_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no").join("a.txt");
        let error = write_atomically(&missing, |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("does not exist") && error.remedy().is_some(), "{error}");
        let error = write_atomically(folder.path(), |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("a folder"), "{error}");
        assert!(names(folder.path()).is_empty());
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_not_replaced_and_links_are_followed() {
        assert!(write_atomically("/dev/null", |_| Ok(())).is_err());
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_atomically(&link, |f| f.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&real).unwrap(), "new");
    }
}
