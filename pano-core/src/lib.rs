//! Geometry of panoramas, images, cameras, scene files, meshes, randomness and metrics.
//!
//! This crate holds the plain types that Pano's stages hand to each other, and the few algorithms every stage needs.
//! Conventions, everywhere:
//!
//! - World: right-handed, +Y up, metres. Radiance: linear Rec.709 RGB in `f32`.
//! - Equirectangular pictures: u ∈ [0, 1) left to right, v ∈ [0, 1] top to bottom, pixel centres at +½; the picture's
//!   centre looks to −Z and u grows to the right (see [`sphere`]).
//! - Depth is the distance along the ray in metres; 0, negative, NaN, infinite and ≥ 10⁹ mean that nothing is there.
//!
//! Features: `io` (pictures and meshes), `scene` (the TOML scene file), `metrics` (picture comparison), `gpu`
//! (what stages need to run on a GPU). Each builds alone.

pub mod builtin;
pub mod camera;
pub mod color;
pub mod depth;
pub mod distribution;
mod error;
#[cfg(any(feature = "io", feature = "scene"))]
mod file;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod image;
#[cfg(feature = "io")]
pub mod io;
pub mod layers;
pub mod light;
pub mod material;
pub mod mesh;
#[cfg(feature = "metrics")]
pub mod metrics;
pub mod progress;
pub mod random;
#[cfg(feature = "scene")]
pub mod scene;
pub mod sphere;
pub mod texture;

pub use error::{Error, Result, SceneError};
