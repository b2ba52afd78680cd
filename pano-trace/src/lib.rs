//! Ray tracing for virtual objects in 360° pictures.

pub mod bsdf;
pub mod bvh;
pub mod iprt;
pub mod mr360;
pub mod objects;
pub mod prt;
pub mod sparse;
pub mod tracer;
pub mod world;
