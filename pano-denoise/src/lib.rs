//! Edge-preserving filters for path-traced layers.
//!
//! Each stage is a folder with its parameters and entry points in `mod.rs` and the algorithm in `cpu.rs`. Stages work in
//! place on [`pano_core::layers::TracedLayers`] or on one layer with its guides, and know nothing of files.
//!
//! ```
//! use pano_core::layers::TracedLayers;
//! use glam::Vec3;
//! use pano_denoise::cross_bilateral::{self, Params};
//!
//! let mut layers = TracedLayers::empty(16, 16);
//! layers.delta.set(8, 8, Vec3::splat(-0.1));
//! let report = cross_bilateral::filter(&Params::default(), &mut layers)?;
//! assert_eq!(report.object.before, 0.0);
//! # Ok::<(), pano_core::Error>(())
//! ```

pub mod cross_bilateral;
