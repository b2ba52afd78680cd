//! The built command, from the outside: exit codes, output, messages.

mod compare;
mod info;
mod lights;
mod plan;
mod render;
mod support;
