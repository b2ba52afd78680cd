//! Ray tracing for virtual objects in 360° pictures.

pub mod bsdf;
pub mod bvh;
