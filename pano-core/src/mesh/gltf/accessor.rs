//! Buffers, and typed reading from them, every range checked.

use super::super::Files;
use super::{REMEDY, uri};
use crate::{Error, Result};
use ::gltf::json::accessor::{Accessor, ComponentType, Type};
use ::gltf::json::{self, validation::Checked};
use std::borrow::Cow;
use std::path::Path;

/// The file's buffers, all loaded.
pub(super) struct Buffers<'a> {
    path: &'a Path,
    root: &'a json::Root,
    files: &'a Files<'a>,
    data: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    /// Loads every buffer: the GLB's own chunk, data URIs and files.
    pub(super) fn load_all(path: &'a Path, root: &'a json::Root, blob: Option<&'a [u8]>, files: &'a Files<'a>) -> Result<Self> {
        let mut data = Vec::with_capacity(root.buffers.len());
        for (i, buffer) in root.buffers.iter().enumerate() {
            let broken = |problem: String| Error::file(path, format!("buffer {i} {problem}"), REMEDY);
            let bytes = match &buffer.uri {
                None if i == 0 => Cow::Borrowed(blob.ok_or_else(|| broken("has neither a URI nor a binary chunk".into()))?),
                None => return Err(broken("has no URI".into())),
                Some(uri) => Cow::Owned(load(path, uri, files, &format!("buffer {i}"))?),
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                return Err(broken(format!("declares {} bytes and has {}", buffer.byte_length.0, bytes.len())));
            }
            data.push(bytes);
        }
        Ok(Self { path, root, files, data })
    }

    /// The data that `uri` stands for; `what` names its user.
    pub(super) fn load(&self, uri: &str, what: &str) -> Result<Vec<u8>> {
        load(self.path, uri, self.files, what)
    }

    fn broken(&self, what: &str, problem: impl std::fmt::Display) -> Error {
        Error::file(self.path, format!("{what}: {problem}"), REMEDY)
    }

    /// Vertices, and faces, that a file with this much data may unfold to: nodes can repeat a mesh, and accessors zeros, without end. 256
    /// vertices a byte are 3000 copies of a mesh without indices, normals or texture coordinates.
    pub(super) fn most_unfolded(&self) -> usize {
        let bytes: usize = self.data.iter().map(|data| data.len()).sum();
        (bytes.saturating_mul(256)).clamp(1 << 16, 1 << 28)
    }

    /// The bytes of buffer view `index`, and the distance between its elements if it states one.
    pub(super) fn view(&self, index: usize, what: &str) -> Result<(&[u8], Option<usize>)> {
        let view = &self.root.buffer_views[index];
        let bytes = &self.data[view.buffer.value()];
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok();
        start
            .and_then(|start| bytes.get(start..start.checked_add(usize::try_from(view.byte_length.0).ok()?)?))
            .map(|bytes| (bytes, view.byte_stride.map(|s| s.0)))
            .ok_or_else(|| self.broken(what, format_args!("buffer view {index} goes beyond its buffer of {} bytes", bytes.len())))
    }

    /// `count` elements of `size` bytes in a buffer view.
    fn elements(&self, view: usize, offset: u64, count: usize, size: usize, what: &str) -> Result<Vec<&[u8]>> {
        let (bytes, stride) = self.view(view, what)?;
        let stride = stride.unwrap_or(size);
        let end = (count.max(1) - 1).checked_mul(stride).and_then(|n| n.checked_add(size));
        let bytes = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..)).unwrap_or_default();
        if count > 0 && end.is_none_or(|end| end > bytes.len()) || stride < size {
            return Err(self.broken(what, format_args!("{count} elements of {size} bytes do not fit into buffer view {view}")));
        }
        Ok((0..count).map(|i| &bytes[i * stride..i * stride + size]).collect())
    }

    /// Reads accessor `index` as vectors of `N` numbers; integers are normalised if the accessor says so.
    pub(super) fn read<const N: usize>(&self, index: usize, what: &str) -> Result<Vec<[f32; N]>> {
        let accessor = &self.root.accessors[index];
        let (component, normalized) = (self.component(accessor, what)?, accessor.normalized);
        let kind = [Type::Scalar, Type::Vec2, Type::Vec3, Type::Vec4][N - 1];
        if accessor.type_ != Checked::Valid(kind) {
            return Err(self.broken(what, format_args!("accessor {index} does not hold vectors of {N} numbers")));
        }
        let decode = |bytes: &[u8]| {
            let size = component.size();
            std::array::from_fn(|i| number(&bytes[i * size..], component, normalized))
        };
        self.gather(accessor, component.size() * N, [0.0; N], decode, what)
    }

    /// Reads accessor `index` as vertex indices.
    pub(super) fn read_indices(&self, index: usize, what: &str) -> Result<Vec<u32>> {
        let accessor = &self.root.accessors[index];
        let component = self.component(accessor, what)?;
        if accessor.type_ != Checked::Valid(Type::Scalar)
            || !matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
        {
            return Err(self.broken(what, format_args!("accessor {index} does not hold unsigned integers")));
        }
        self.gather(accessor, component.size(), 0, |bytes| unsigned(bytes, component), what)
    }

    fn component(&self, accessor: &Accessor, what: &str) -> Result<ComponentType> {
        match accessor.component_type {
            Checked::Valid(component) => Ok(component.0),
            Checked::Invalid => Err(self.broken(what, "unknown component type")),
        }
    }

    /// All elements of an accessor, the sparse ones put in their places.
    fn gather<T: Clone>(
        &self,
        accessor: &Accessor,
        size: usize,
        zero: T,
        decode: impl Fn(&[u8]) -> T,
        what: &str,
    ) -> Result<Vec<T>> {
        let too_many = || self.broken(what, format_args!("{} elements", accessor.count.0));
        let count = usize::try_from(accessor.count.0).map_err(|_| too_many())?;
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let mut values: Vec<T> = match accessor.buffer_view {
            Some(view) => self.elements(view.value(), offset, count, size, what)?.into_iter().map(&decode).collect(),
            // All zero but for sparse exceptions, and so not bounded by any data.
            None if count > self.most_unfolded() => return Err(too_many()),
            None => vec![zero; count],
        };
        if let Some(sparse) = &accessor.sparse {
            let Checked::Valid(kind) = sparse.indices.component_type else {
                return Err(self.broken(what, "unknown component type of sparse indices"));
            };
            let n = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            let (i, v) = (&sparse.indices, &sparse.values);
            let places = self.elements(i.buffer_view.value(), i.byte_offset.0, n, kind.0.size(), what)?;
            let replacements = self.elements(v.buffer_view.value(), v.byte_offset.0, n, size, what)?;
            for (place, replacement) in places.into_iter().zip(replacements) {
                let place = unsigned(place, kind.0);
                let slot = values.get_mut(place as usize);
                *slot.ok_or_else(|| self.broken(what, format_args!("sparse element {place} of {count}")))? = decode(replacement);
            }
        }
        Ok(values)
    }
}

/// The data a URI of the glTF file `path` stands for; `what` names its user.
fn load(path: &Path, uri: &str, files: &Files<'_>, what: &str) -> Result<Vec<u8>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    match uri::resolve(uri, folder).map_err(|problem| Error::file(path, format!("{what}: the URI {problem}"), REMEDY))? {
        uri::Source::Inline(bytes) => Ok(bytes),
        uri::Source::File(file) => files(&file).map_err(|e| {
            let problem = format!("{what}: {} cannot be read: {e}", file.display());
            Error::file(path, problem, "Keep the files that belong to a .gltf beside it, or export a .glb, which holds all.")
        }),
    }
}

/// The first number in `bytes`, which are long enough.
fn number(bytes: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let scaled = |v: f32, max: f32| if normalized { (v / max).max(-1.0) } else { v };
    match component {
        ComponentType::I8 => scaled(f32::from(bytes[0] as i8), 127.0),
        ComponentType::U8 => scaled(f32::from(bytes[0]), 255.0),
        ComponentType::I16 => scaled(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        ComponentType::U16 => scaled(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        ComponentType::U32 => unsigned(bytes, component) as f32,
        ComponentType::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// The first unsigned integer in `bytes`, which are long enough.
fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    match component.size() {
        1 => u32::from(bytes[0]),
        2 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}
