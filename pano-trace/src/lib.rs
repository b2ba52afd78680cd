//! Ray tracing for virtual objects in 360° pictures.

pub mod bsdf;
pub mod bvh;
mod directions;
pub mod iprt;
pub mod mr360;
pub mod objects;
pub mod prt;
pub mod rt2ar;
pub mod sparse;
#[cfg(test)]
mod test_scenes;
pub mod tracer;
pub mod world;
