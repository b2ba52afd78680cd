//! Marks on pictures: words, and the lights of a panorama (feature `annotate`).

mod lights;
pub(crate) mod text;

pub use lights::{LightMark, draw_lights};
