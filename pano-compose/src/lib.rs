//! Differential compositing, the effect plan, and the frame pipeline that joins Pano's stages.
//!
//! - [`composite`] puts traced layers over the photo, builds the channels of a layered picture, and encodes 8-bit output.
//! - [`lens`] adds bloom and glare.
//! - `markers` finds printed markers in a picture (feature `markers`).
//! - [`plan`] says which effects a scene calls for, and why.
//! - [`pipeline`] joins the stages of all crates to frames.
//! - [`annotate`] writes on pictures and marks lights (feature `annotate`).
//! - [`demo`] does all of it in a room made in code, and compares with the truth (feature `demo`).
//! - [`tradeoff`] measures what accuracy costs in time (feature `tradeoff`).
//!
//! Without the default feature `pipeline` the crate depends on `pano-core` alone.

#[cfg(feature = "annotate")]
pub mod annotate;
pub mod composite;
#[cfg(feature = "demo")]
pub mod demo;
#[cfg(any(feature = "demo", feature = "tradeoff"))]
mod exposure;
pub mod lens;
#[cfg(feature = "markers")]
pub mod markers;
#[cfg(feature = "pipeline")]
pub mod pipeline;
pub mod plan;
#[cfg(feature = "tradeoff")]
pub mod tradeoff;

/// From numbers to radiances, for shaders; it needs `NUMBER`.
#[cfg(feature = "gpu")]
const RADIANCE: pano_core::gpu::Piece = pano_core::gpu::Piece::plain(include_str!("radiance.wgsl"));

/// Every shader of this crate, for the checks that need no GPU.
#[cfg(feature = "gpu")]
pub fn shaders() -> Vec<&'static pano_core::gpu::Shader> {
    vec![&composite::gpu::SHADER, &lens::gpu::SHADER]
}

/// Structures that Rust fills for them, with the shader that declares each.
#[cfg(feature = "gpu")]
pub fn layouts() -> Vec<(&'static pano_core::gpu::Shader, pano_core::gpu::Layout)> {
    vec![
        (&composite::gpu::SHADER, composite::gpu::Uniform::LAYOUT),
        (&lens::gpu::SHADER, lens::gpu::Lens::LAYOUT),
        (&lens::gpu::SHADER, lens::gpu::Line::LAYOUT),
    ]
}
