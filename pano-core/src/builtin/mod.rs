//! Scenes made in code: primitive shapes, and the furnished room of `pano demo` and the tests. No file is read, and a program
//! makes the same bytes at every call, whatever the number of threads.

pub mod primitives;
pub mod room;
