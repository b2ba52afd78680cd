//! Panoramic ray tracing (PRT): rays against a panorama's depth.
//!
//! The panorama sees a ray as a great-circle arc. On the faces of a cube around the capture point — gnomonic projections —
//! the arc is a straight line and the inverse depth along it is linear, so that marching needs no trigonometry, planes stay
//! planes between the samples, and a crossing is the root of a quadratic. The field is therefore kept on a cube of about
//! the panorama's resolution; seam and poles are places like any other.
//!
//! The surface is thin. Where neighbouring samples belong to different surfaces (a *gap*) nothing is stretched between
//! them: each sample keeps its half of the cell at its own depth, and a ray may pass between.

mod answer;
mod back_face;
mod field;
#[cfg(feature = "gpu")]
pub mod gpu;
mod linear;
mod march;
mod perspective;
mod pyramid;
mod slopes;

pub use answer::{Answer, FieldHit, HiddenSide};
pub use field::{DepthField, FieldOptions};
pub use linear::march_linear;
pub use perspective::{PerspectiveField, PerspectiveHit};

#[cfg(test)]
mod back_face_tests;
#[cfg(test)]
mod perspective_tests;
#[cfg(test)]
mod tests;
