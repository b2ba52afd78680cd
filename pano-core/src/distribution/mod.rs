//! Tabulated distributions: [`Distribution1d`], and the sphere of a panorama's light, [`SphereDistribution`].

#[cfg(feature = "gpu")]
pub mod gpu;
mod one;
mod sphere;

pub use one::Distribution1d;
pub use sphere::{SphereDistribution, SphereSample};

#[cfg(test)]
mod tests;
