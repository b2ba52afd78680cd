//! The crate's one error type. Variants are sorted by whose fault it is; every message ends with the remedy.

use std::path::{Path, PathBuf};

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong with input. No variant is raised for valid data.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read or written, or holds something that cannot be used.
    #[error("{}: {problem}", path.display())]
    File {
        /// The file as the caller named it.
        path: PathBuf,
        /// What is wrong, and where in the file.
        problem: String,
        /// What to do about it, one sentence.
        remedy: String,
    },
    /// A scene file breaks the format.
    #[error("{0}")]
    Scene(Box<SceneError>),
    /// A caller passed values that do not fit together (sizes, ranges).
    #[error("{problem}")]
    Argument {
        /// What does not fit, with the values.
        problem: String,
    },
}

/// What is wrong with a scene file, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}:{line}:{column}: {problem}", path.display())]
pub struct SceneError {
    /// The scene file.
    pub path: PathBuf,
    /// The scene file's text, for showing the line.
    pub text: String,
    /// Byte range of the offending key or value in `text`, on character boundaries; empty where something is missing.
    pub span: std::ops::Range<usize>,
    /// 1-based line of the span's start.
    pub line: usize,
    /// 1-based column (in characters) of the span's start.
    pub column: usize,
    /// What is wrong.
    pub problem: String,
    /// What to do about it, one sentence.
    pub remedy: String,
}

impl Error {
    /// A [`Error::File`] about `path`.
    pub fn file(path: impl AsRef<Path>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::File { path: path.as_ref().to_owned(), problem: problem.into(), remedy: remedy.into() }
    }

    /// A [`Error::Argument`].
    pub fn argument(problem: impl Into<String>) -> Self {
        Self::Argument { problem: problem.into() }
    }

    /// What the user can do about it, if the error knows.
    pub fn remedy(&self) -> Option<&str> {
        match self {
            Self::File { remedy, .. } => Some(remedy),
            Self::Scene(error) => Some(&error.remedy),
            Self::Argument { .. } => None,
        }
    }
}
