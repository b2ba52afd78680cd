//! Scenes made in code: primitive shapes, and the furnished room of `pano demo` and the tests. No file is read, and the same
//! call gives the same bytes everywhere.

pub mod primitives;
pub mod room;
