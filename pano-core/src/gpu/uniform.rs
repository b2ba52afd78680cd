//! Structures that Rust fills and shaders read.

/// Where a structure has its fields, to compare with what the shader says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The structure's name, in Rust and in the shader.
    pub name: &'static str,
    /// Bytes.
    pub bytes: usize,
    /// The fields' names and byte offsets, in order.
    pub fields: &'static [(&'static str, usize)],
}

/// Declares a plain structure of the same name and fields as one of a shader, without padding, and its
/// [`Layout`](crate::gpu::Layout), which a test compares with the shader's. The crate that uses it depends on `bytemuck`.
#[macro_export]
macro_rules! uniform {
    ($(#[$outer:meta])* $visibility:vis struct $name:ident {
        $($(#[$inner:meta])* $field_visibility:vis $field:ident: $type:ty,)+
    }) => {
        $(#[$outer])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        $visibility struct $name {
            $($(#[$inner])* $field_visibility $field: $type,)+
        }

        impl $name {
            /// Where the fields are.
            $visibility const LAYOUT: $crate::gpu::Layout = $crate::gpu::Layout {
                name: stringify!($name),
                bytes: size_of::<$name>(),
                fields: &[$((stringify!($field), std::mem::offset_of!($name, $field)),)+],
            };
        }
    };
}
