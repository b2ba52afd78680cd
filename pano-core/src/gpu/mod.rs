//! The GPU: adapter, buffers, pictures, kernels, and the shader text that all stages share (feature `gpu`).
//!
//! Compute only, through wgpu's safe interface, on Vulkan, Metal and DirectX 12. A stage's GPU twin takes and gives handles
//! ([`GpuImage`]); [`Gpu::upload`] and [`Gpu::read`] are steps of their own, so that pictures stay where they are between
//! stages. Pictures larger than a binding may be go through in bands of rows ([`Gpu::bands`]).
//!
//! Nothing here panics on what a driver does: a device that is lost, memory that runs out and commands that are refused
//! are a [`GpuError`], which a caller answers by finishing on the CPU. docs/gpu.md tells how a stage is written.

mod adapter;
mod buffer;
mod context;
mod error;
mod image;
mod kernel;
mod layers;
mod prelude;
mod shader;
mod timing;
mod uniform;
mod words;

pub use adapter::AdapterDescription;
pub use buffer::{GpuBuffer, Traffic};
pub use context::{Gpu, GpuOptions};
pub use error::{GpuError, GpuResult};
pub use image::{Band, GpuImage, Rows};
pub use kernel::{Kernel, flag};
pub use layers::GpuLayers;
pub use prelude::{COLOR, IMAGE, LARGEST, NUMBER, RANDOM, SPHERE, WORDS};
pub use shader::{Constant, Piece, Shader, Specialization, Value};
pub use timing::Timing;
pub use uniform::Layout;
pub use words::Words;

/// Every shader of this crate, for the checks that need no GPU.
pub fn shaders() -> Vec<&'static Shader> {
    vec![&crate::sphere::resample::gpu::SHADER]
}

/// Structures that Rust fills for them, with the shader that declares each.
pub fn layouts() -> Vec<(&'static Shader, Layout)> {
    vec![
        (&crate::sphere::resample::gpu::SHADER, Rows::LAYOUT),
        (&crate::sphere::resample::gpu::SHADER, crate::sphere::resample::gpu::Resample::LAYOUT),
    ]
}
