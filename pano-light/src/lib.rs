//! Light from a 360° picture: inverse tone mapping, light detection, image-based lighting.
//!
//! The crate needs neither a ray tracer nor a GPU. Each stage is a folder with its parameters and entry points in
//! `mod.rs` and the algorithm in `cpu.rs`, and in `gpu.rs` for the GPU (feature `gpu`, on by default); stages take and give
//! plain pictures and know nothing of files.
//!
//! ```
//! use glam::Vec3;
//! use pano_core::image::Image;
//!
//! let ldr = Image::filled(4, 2, Vec3::ONE);
//! let mut hdr = Image::filled(4, 2, Vec3::ZERO);
//! pano_light::expand::expand(&ldr, &mut hdr)?;
//! assert_eq!(hdr.get(0, 0), Vec3::splat(11.8));
//! # Ok::<(), pano_core::Error>(())
//! ```

pub mod clipped;
pub mod detect;
pub mod expand;
mod grid;
pub mod ibl;
pub mod remap;
#[cfg(test)]
mod test_maps;
pub mod track;
mod working;

pub use working::WorkingMap;

/// Every shader of this crate, for the checks that need no GPU.
#[cfg(feature = "gpu")]
pub fn shaders() -> Vec<&'static pano_core::gpu::Shader> {
    vec![&expand::gpu::SHADER, &detect::gpu::SHADER, &ibl::gpu::SHADER]
}

/// Structures that Rust fills for them, with the shader that declares each.
#[cfg(feature = "gpu")]
pub fn layouts() -> Vec<(&'static pano_core::gpu::Shader, pano_core::gpu::Layout)> {
    vec![(&detect::gpu::SHADER, detect::gpu::Blur::LAYOUT), (&ibl::gpu::SHADER, ibl::gpu::Ibl::LAYOUT)]
}
