//! What can go wrong between reading a scene and having its picture.

/// Result with the pipeline's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A frame that could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Input at fault, or output that cannot be written.
    #[error(transparent)]
    Core(#[from] pano_core::Error),
    /// Something was asked for that this version does not do.
    #[error("{problem}")]
    Unsupported {
        /// What.
        problem: String,
        /// What to do instead.
        remedy: String,
    },
    /// The caller cancelled.
    #[error("interrupted; nothing was written")]
    Cancelled,
}

impl Error {
    pub(crate) fn unsupported(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unsupported { problem: problem.into(), remedy: remedy.into() }
    }

    /// What the user can do about it, if the error knows.
    pub fn remedy(&self) -> Option<&str> {
        match self {
            Self::Core(e) => e.remedy(),
            Self::Unsupported { remedy, .. } => Some(remedy),
            Self::Cancelled => None,
        }
    }
}
