//! glTF materials and textures as [`Material`]s. Each is translated when a primitive first asks for it, so that textures no
//! triangle shows are not decoded.

use super::super::texture_file::{self, Encoding};
use super::REMEDY;
use super::accessor::Buffers;
use crate::image::Image;
use crate::material::{Material, Texture, Wrap};
use crate::{Error, Result};
use ::gltf::json::{self, extensions, material::AlphaMode, texture::WrappingMode, validation::Checked};
use glam::{Affine2, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The materials in use so far.
pub(super) struct Materials<'a> {
    path: &'a Path,
    root: &'a json::Root,
    buffers: &'a Buffers<'a>,
    /// Index into `out` by glTF index; `None` is the material of primitives that name none.
    index: HashMap<Option<usize>, u32>,
    out: Vec<Material>,
    images: HashMap<(usize, Encoding), Arc<Image<Vec4>>>,
}

/// The texture coordinate set a material reads: a mesh has one, so the base colour's decides.
pub(super) fn texture_set(material: &json::Material) -> u32 {
    let pbr = &material.pbr_metallic_roughness;
    let infos = [&pbr.base_color_texture, &pbr.metallic_roughness_texture, &material.emissive_texture];
    let set = |info: &json::texture::Info| {
        let moved = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref()).and_then(|t| t.tex_coord);
        moved.unwrap_or(info.tex_coord)
    };
    infos.into_iter().flatten().next().map(set).or(material.normal_texture.as_ref().map(|n| n.tex_coord)).unwrap_or(0)
}

impl<'a> Materials<'a> {
    pub(super) fn new(path: &'a Path, root: &'a json::Root, buffers: &'a Buffers<'a>) -> Self {
        Self { path, root, buffers, index: HashMap::new(), out: Vec::new(), images: HashMap::new() }
    }

    /// All materials in use; empty if the file has none.
    pub(super) fn finish(self) -> Vec<Material> {
        if self.root.materials.is_empty() { Vec::new() } else { self.out }
    }

    /// The index of glTF's material `index` among those in use.
    pub(super) fn material(&mut self, index: usize) -> Result<u32> {
        if let Some(&id) = self.index.get(&Some(index)) {
            return Ok(id);
        }
        let material = self.translate(&self.root.materials[index])?;
        Ok(self.add(Some(index), material))
    }

    /// The index of glTF's default material among those in use.
    pub(super) fn default_material(&mut self) -> u32 {
        if let Some(&id) = self.index.get(&None) {
            return id;
        }
        self.add(None, Material { base_color: Vec3::ONE, metallic: 1.0, ..Material::default() })
    }

    fn add(&mut self, index: Option<usize>, material: Material) -> u32 {
        let id = self.out.len() as u32;
        self.out.push(material);
        self.index.insert(index, id);
        id
    }

    fn translate(&mut self, m: &json::Material) -> Result<Material> {
        let pbr = &m.pbr_metallic_roughness;
        let unit = |v: f32| v.clamp(0.0, 1.0);
        let color = |c: [f32; 3]| Vec3::from_array(c).clamp(Vec3::ZERO, Vec3::ONE);
        let [r, g, b, alpha] = pbr.base_color_factor.0;
        let mut out = Material {
            base_color: color([r, g, b]),
            base_color_texture: self.texture(pbr.base_color_texture.as_ref(), Encoding::Color)?,
            metallic: unit(pbr.metallic_factor.0),
            roughness: unit(pbr.roughness_factor.0),
            metallic_roughness_texture: self.texture(pbr.metallic_roughness_texture.as_ref(), Encoding::Data)?,
            emissive: color(m.emissive_factor.0),
            emissive_texture: self.texture(m.emissive_texture.as_ref(), Encoding::Color)?,
            ..Material::default()
        };
        if let Some(normal) = &m.normal_texture {
            // The crate leaves this texture's extensions as plain JSON.
            let transform = normal.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
            let transform = transform.and_then(|t| json::deserialize::from_value(t.clone()).ok());
            out.normal_texture = Some(self.sampled(normal.index.value(), transform.as_ref(), Encoding::Data)?);
            out.normal_scale = if normal.scale.is_finite() { normal.scale } else { 1.0 };
        }
        let ext = m.extensions.as_ref();
        if let Some(ior) = ext.and_then(|e| e.ior.as_ref()) {
            // 0 asks for a mirror at all angles, for converted legacy materials; there is no such dielectric.
            out.ior = if ior.ior.0 >= 1.0 && ior.ior.0.is_finite() { ior.ior.0 } else { 1.5 };
        }
        if let Some(specular) = ext.and_then(|e| e.specular.as_ref()) {
            out.specular = unit(specular.specular_factor.0);
            out.specular_color = color(specular.specular_color_factor.0);
        }
        if let Some(transmission) = ext.and_then(|e| e.transmission.as_ref()) {
            out.transmission = unit(transmission.transmission_factor.0);
            // Without a volume the surface is an infinitely thin sheet.
            out.thin = true;
        } else if matches!(m.alpha_mode, Checked::Valid(AlphaMode::Blend)) {
            // See-through by alpha is a sheet that passes light straight on.
            out.transmission = unit(1.0 - alpha);
            out.thin = true;
        }
        if let Some(volume) = ext.and_then(|e| e.volume.as_ref()) {
            out.thin &= volume.thickness_factor.0 <= 0.0;
            out.attenuation_color = color(volume.attenuation_color.0);
            let distance = volume.attenuation_distance.0;
            out.attenuation_distance = if distance > 0.0 { distance } else { f32::INFINITY };
        }
        if let Some(strength) = ext.and_then(|e| e.emissive_strength.as_ref()).map(|e| e.emissive_strength.0) {
            out.emissive *= if strength >= 0.0 && strength.is_finite() { strength } else { 1.0 };
        }
        if ext.is_some_and(|e| e.others.contains_key("KHR_materials_unlit")) {
            // Shown as it is, whatever light there is: it can only be glowing.
            (out.emissive, out.emissive_texture) = (out.base_color, out.base_color_texture.take());
            (out.base_color, out.metallic, out.specular) = (Vec3::ZERO, 0.0, 0.0);
        }
        Ok(out)
    }

    fn texture(&mut self, info: Option<&json::texture::Info>, encoding: Encoding) -> Result<Option<Texture>> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        self.sampled(info.index.value(), transform, encoding).map(Some)
    }

    fn sampled(
        &mut self,
        texture: usize,
        transform: Option<&extensions::texture::TextureTransform>,
        encoding: Encoding,
    ) -> Result<Texture> {
        let texture = &self.root.textures[texture];
        let mut out = Texture::new(self.image(texture.source.value(), encoding)?);
        if let Some(sampler) = texture.sampler {
            let sampler = &self.root.samplers[sampler.value()];
            let wrap = |mode: Checked<WrappingMode>| match mode {
                Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                _ => Wrap::Repeat,
            };
            (out.wrap_u, out.wrap_v) = (wrap(sampler.wrap_s), wrap(sampler.wrap_t));
        }
        if let Some(t) = transform {
            // Counter-clockwise as seen, in coordinates whose v points down: the negative angle.
            let moved =
                Affine2::from_scale_angle_translation(Vec2::from_array(t.scale.0), -t.rotation.0, Vec2::from_array(t.offset.0));
            out.texture_from_mesh = if moved.is_finite() { moved } else { Affine2::IDENTITY };
        }
        Ok(out)
    }

    fn image(&mut self, index: usize, encoding: Encoding) -> Result<Arc<Image<Vec4>>> {
        if let Some(image) = self.images.get(&(index, encoding)) {
            return Ok(image.clone());
        }
        let json = &self.root.images[index];
        let what = format!("image {index}");
        let decode = |bytes: &[u8]| {
            texture_file::decode(bytes, encoding).map_err(|problem| {
                let name = json.uri.as_deref().filter(|u| !u.starts_with("data:")).unwrap_or("held in the file");
                let remedy = "Convert its textures to PNG: `gltf-transform png in.glb out.glb`.";
                Error::file(self.path, format!("{what} ({name:.80}) {problem}"), remedy)
            })
        };
        let image = match (&json.buffer_view, &json.uri) {
            (Some(view), _) => decode(self.buffers.view(view.value(), &what)?.0)?,
            (None, Some(uri)) => decode(&self.buffers.load(uri, &what)?)?,
            (None, None) => return Err(Error::file(self.path, format!("{what} has no source"), REMEDY)),
        };
        let image = Arc::new(image);
        self.images.insert((index, encoding), image.clone());
        Ok(image)
    }
}
