//! Shader text: shared pieces put one after the other, with constants whose home is Rust.

use glam::Vec3;
use std::fmt::Write;

/// A value of a [`Constant`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// `f32`.
    F32(f32),
    /// `u32`.
    U32(u32),
    /// `vec3f`.
    Vec3(Vec3),
    /// `array<u32, N>`.
    U32s(&'static [u32]),
}

/// A constant of the shader that is one of Rust's: `const NAME`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Its name in the shader.
    pub name: &'static str,
    /// Its value.
    pub value: Value,
}

impl Constant {
    /// A number.
    pub const fn f32(name: &'static str, value: f32) -> Self {
        Self { name, value: Value::F32(value) }
    }

    /// A whole number.
    pub const fn u32(name: &'static str, value: u32) -> Self {
        Self { name, value: Value::U32(value) }
    }

    /// Three numbers.
    pub const fn vec3(name: &'static str, value: Vec3) -> Self {
        Self { name, value: Value::Vec3(value) }
    }

    /// Its declaration. Numbers are written with all their digits: the shader has the same bits.
    fn declaration(&self) -> String {
        let name = self.name;
        match self.value {
            Value::F32(v) => format!("const {name}: f32 = {v:e}f;\n"),
            Value::U32(v) => format!("const {name}: u32 = {v}u;\n"),
            Value::Vec3(v) => format!("const {name}: vec3f = vec3f({:e}f, {:e}f, {:e}f);\n", v.x, v.y, v.z),
            Value::U32s(list) => {
                let mut text = format!("const {name} = array<u32, {}>(", list.len());
                list.iter().for_each(|v| write!(text, "{v}u, ").expect("writing to a string does not fail"));
                text + ");\n"
            }
        }
    }
}

/// A part of a shader's text.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// WGSL.
    pub text: &'static str,
    /// Constants that stand before it.
    pub constants: fn() -> Vec<Constant>,
}

impl Piece {
    /// Text that needs no constant of Rust's.
    pub const fn plain(text: &'static str) -> Self {
        Self { text, constants: Vec::new }
    }
}

/// One way in which a shader is compiled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specialization {
    /// The entry point.
    pub entry: &'static str,
    /// Values of its `override` constants.
    pub constants: &'static [(&'static str, f64)],
}

/// A shader.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Its name, different from all others'.
    pub name: &'static str,
    /// Shared text first, its own last.
    pub pieces: &'static [Piece],
    /// Every way in which it is compiled, for the check that needs no GPU.
    pub specializations: &'static [Specialization],
}

impl Shader {
    /// The whole text.
    pub fn source(&self) -> String {
        let mut source = String::new();
        for piece in self.pieces {
            (piece.constants)().iter().for_each(|c| source += &c.declaration());
            source += piece.text;
        }
        source
    }
}
