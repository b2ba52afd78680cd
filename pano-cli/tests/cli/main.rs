//! The built command, from the outside: exit codes, output, messages.

mod compare;
mod info;
mod lights;
mod render;
mod support;
