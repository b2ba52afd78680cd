//! Reading files whole.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// The bytes of a regular file. Devices and pipes, which may have no end, are refused before they are opened, as are files of
/// more than `most` bytes.
pub(crate) fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
    }
    if metadata.len() > most {
        return Err(Error::new(ErrorKind::FileTooLarge, format!("{} bytes are more than {most}", metadata.len())));
    }
    std::fs::read(path)
}
