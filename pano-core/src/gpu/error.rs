//! What a GPU may answer instead of a result.

/// Result with [`GpuError`].
pub type GpuResult<T> = Result<T, GpuError>;

/// Why a stage did not run on the GPU. All but [`GpuError::Input`] are answered by running its CPU twin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no GPU to use.
    #[error("no GPU can be used: {problem}")]
    NoAdapter {
        /// Why.
        problem: String,
    },
    /// The device is gone: unplugged, reset by the driver after a hang, or destroyed. Its memory is gone with it.
    #[error("the GPU was lost: {reason}")]
    Lost {
        /// What the driver says.
        reason: String,
    },
    /// A command failed, for want of memory most of the time.
    #[error("the GPU refused a command: {problem}")]
    Refused {
        /// What the driver says.
        problem: String,
    },
    /// A buffer is larger than a binding of this GPU.
    #[error("{bytes} bytes do not fit into a binding of this GPU, which holds {limit}")]
    TooLarge {
        /// Wanted.
        bytes: u64,
        /// What there may be.
        limit: u64,
    },
    /// The input is at fault; the CPU twin would say the same.
    #[error(transparent)]
    Input(#[from] crate::Error),
}
