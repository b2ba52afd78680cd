//! Wavefront MTL material libraries, with the PBR keys (`Pr Pm map_Pr map_Pm norm`), as [`Material`]s.
//!
//! MTL says how a surface looks in a Phong renderer; the translation is by convention: `Ns` becomes the GGX width of the same
//! highlight, α = √(2 / (Ns + 2)); `Ks` of ½ is the usual dielectric's highlight; a black `Kd` under a bright `Ks` is a metal;
//! `d` below 1 lets light through, bent by `Ni` where `illum` asks for refraction (4, 6, 7, 9).

use super::Files;
use super::obj::{joined_lines, split_keyword};
use super::texture_file::{self, Encoding};
use crate::image::Image;
use crate::material::{Material, Texture, Wrap};
use crate::{Error, Result};
use glam::{Affine2, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// One `newmtl` as written.
#[derive(Default)]
struct Entry {
    values: HashMap<String, Vec<f32>>,
    maps: HashMap<&'static str, Map>,
}

/// A texture statement: the file and its options.
#[derive(Clone)]
struct Map {
    file: PathBuf,
    scale: Vec2,
    offset: Vec2,
    clamp: bool,
    strength: f32,
}

/// Statement names, and the one each stands for.
const MAPS: [(&str, &str); 9] = [
    ("map_kd", "map_Kd"),
    ("map_ke", "map_Ke"),
    ("map_bump", "normal"),
    ("bump", "normal"),
    ("norm", "normal"),
    ("map_kn", "normal"),
    ("map_pr", "map_Pr"),
    ("map_pm", "map_Pm"),
    ("map_normal", "normal"),
];

/// Appends the materials of the library `name` (relative to the OBJ file `obj`), and their indices by name.
pub(super) fn read(
    obj: &Path,
    name: &str,
    files: &Files<'_>,
    materials: &mut Vec<Material>,
    ids: &mut HashMap<String, u32>,
) -> Result<()> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let library = |name: &str| {
        let file = folder.join(portable(name));
        files(&file).map(|bytes| (file.clone(), bytes)).map_err(|e| {
            let problem = format!("its material library {} cannot be read: {e}", file.display());
            Error::file(obj, problem, "Put the MTL file beside the OBJ file, or delete the `mtllib` line.")
        })
    };
    // The name may hold spaces, or be several names.
    let libraries = match library(name) {
        Err(_) if name.contains(char::is_whitespace) => name.split_whitespace().map(library).collect::<Result<_>>()?,
        single => vec![single?],
    };
    let mut textures = Textures { files, images: HashMap::new() };
    for (file, bytes) in libraries {
        let mut entry: Option<(String, Entry)> = None;
        let mut finish = |entry: Option<(String, Entry)>| -> Result<()> {
            if let Some((name, entry)) = entry {
                ids.insert(name, materials.len() as u32);
                materials.push(entry.into_material(&file, &mut textures)?);
            }
            Ok(())
        };
        for (i, line) in joined_lines(&String::from_utf8_lossy(&bytes)) {
            let (keyword, rest) = split_keyword(&line);
            if keyword == "newmtl" {
                finish(entry.replace((rest.to_owned(), Entry::default())))?;
            } else if let Some((_, entry)) = &mut entry {
                entry.statement(keyword, rest, file.parent().unwrap_or(Path::new(""))).map_err(|problem| {
                    Error::file(&file, format!("line {i}: {problem}"), "Correct the line, or export the materials again.")
                })?;
            }
        }
        finish(entry)?;
    }
    Ok(())
}

/// File names in MTL files often come from Windows.
fn portable(name: &str) -> PathBuf {
    if cfg!(windows) { PathBuf::from(name) } else { PathBuf::from(name.replace('\\', "/")) }
}

impl Entry {
    fn statement(&mut self, keyword: &str, rest: &str, folder: &Path) -> Result<(), String> {
        let lower = keyword.to_ascii_lowercase();
        if let Some((_, map)) = MAPS.iter().find(|(name, _)| *name == lower) {
            self.maps.insert(map, Map::parse(rest, folder)?);
        } else if ["kd", "ks", "ke", "tf", "ns", "ni", "d", "tr", "illum", "pr", "pm"].contains(&lower.as_str()) {
            // `Kd spectral file` and `Kd xyz …` are legal and rare; the colour is then left at its default.
            let values = rest.split_whitespace().map_while(|w| w.parse::<f32>().ok()).collect::<Vec<_>>();
            if rest.is_empty() || values.iter().any(|v| !v.is_finite()) {
                return Err(format!("`{keyword} {rest:.60}` does not give a number"));
            }
            self.values.insert(lower, values);
        }
        Ok(())
    }

    fn number(&self, name: &str) -> Option<f32> {
        self.values.get(name)?.first().copied()
    }

    /// One number is a grey.
    fn color(&self, name: &str) -> Option<Vec3> {
        match self.values.get(name)?.as_slice() {
            [r, g, b, ..] => Some(Vec3::new(*r, *g, *b).max(Vec3::ZERO)),
            [grey, ..] => Some(Vec3::splat(grey.max(0.0))),
            [] => None,
        }
    }

    fn into_material(self, mtl: &Path, textures: &mut Textures<'_>) -> Result<Material> {
        let mut m = Material::default();
        let illum = self.number("illum").unwrap_or(2.0) as i32;
        let unit = |v: f32| v.clamp(0.0, 1.0);
        if let Some(kd) = self.color("kd") {
            m.base_color = kd.min(Vec3::ONE);
        }
        if let Some(map) = self.maps.get("map_Kd") {
            // Exporters leave Kd black under a texture that is meant to show.
            m.base_color = if m.base_color == Vec3::ZERO { Vec3::ONE } else { m.base_color };
            m.base_color_texture = Some(map.texture(mtl, Encoding::Color, textures)?);
        }
        let ks = self.color("ks").unwrap_or(Vec3::ZERO);
        let peak = ks.max_element();
        m.specular = if illum < 2 { 0.0 } else { unit(2.0 * peak) };
        if m.specular > 0.0 {
            m.specular_color = ks / peak;
            // α = roughness².
            m.roughness = self.number("ns").map_or(1.0, |ns| unit((2.0 / (ns.max(0.0) + 2.0)).powf(0.25)));
        }
        let pbr = self.values.contains_key("pr") || self.values.contains_key("pm");
        if pbr || self.maps.contains_key("map_Pr") || self.maps.contains_key("map_Pm") {
            (m.specular, m.specular_color) = (1.0, Vec3::ONE);
            m.roughness = unit(self.number("pr").unwrap_or(1.0));
            // A map is scaled by its number, and a number left out lets the map pass.
            m.metallic = unit(self.number("pm").unwrap_or(f32::from(u8::from(self.maps.contains_key("map_Pm")))));
            let map =
                |name: &str, t: &mut Textures<'_>| self.maps.get(name).map(|m| m.texture(mtl, Encoding::Data, t)).transpose();
            m.metallic_roughness_texture = merge(map("map_Pr", textures)?, map("map_Pm", textures)?);
        } else if m.base_color == Vec3::ZERO && peak > 0.2 && illum >= 2 && self.opacity() >= 1.0 {
            (m.metallic, m.base_color, m.specular_color) = (1.0, ks.min(Vec3::ONE), Vec3::ONE);
        }
        m.ior = self.number("ni").filter(|&n| n >= 1.0).unwrap_or(1.5);
        m.transmission = unit(1.0 - self.opacity());
        if m.transmission > 0.0 {
            m.thin = !matches!(illum, 4 | 6 | 7 | 9);
            let tint = self.color("tf").filter(|t| *t != Vec3::ZERO).map(|t| t.min(Vec3::ONE));
            if m.base_color == Vec3::ZERO || tint.is_some_and(|t| t != Vec3::ONE) {
                m.base_color = tint.unwrap_or(Vec3::ONE);
            }
            if m.specular == 0.0 {
                (m.specular, m.specular_color, m.roughness) = (1.0, Vec3::ONE, 0.0);
            }
        }
        m.emissive = self.color("ke").unwrap_or(Vec3::ZERO);
        if let Some(map) = self.maps.get("map_Ke") {
            m.emissive = if m.emissive == Vec3::ZERO { Vec3::ONE } else { m.emissive };
            m.emissive_texture = Some(map.texture(mtl, Encoding::Color, textures)?);
        }
        if let Some(map) = self.maps.get("normal") {
            let texture = map.texture(mtl, Encoding::Data, textures)?;
            // A grey picture is a height map, whose scale in metres the format does not tell: left out.
            if texture.image().data().iter().any(|p| p.x != p.y || p.y != p.z) {
                (m.normal_texture, m.normal_scale) = (Some(texture), map.strength);
            }
        }
        Ok(m)
    }

    fn opacity(&self) -> f32 {
        self.number("d").or(self.number("tr").map(|tr| 1.0 - tr)).unwrap_or(1.0)
    }
}

/// Where textures come from, and those that are decoded already.
struct Textures<'a> {
    files: &'a Files<'a>,
    images: HashMap<(PathBuf, Encoding), Arc<Image<Vec4>>>,
}

impl Map {
    /// `-option value… file name`.
    fn parse(text: &str, folder: &Path) -> Result<Self, String> {
        let mut map = Map { file: PathBuf::new(), scale: Vec2::ONE, offset: Vec2::ZERO, clamp: false, strength: 1.0 };
        let mut rest = text;
        while let Some((option, after)) = rest.strip_prefix('-').map(split_keyword) {
            rest = after;
            let mut values: [Option<f32>; 3] = [None; 3];
            let most = match option {
                "s" | "o" | "t" => 3,
                "mm" => 2,
                "bm" | "boost" | "texres" => 1,
                _ => 0,
            };
            for value in values.iter_mut().take(most) {
                let (word, after) = split_keyword(rest);
                // A file name may be a number too: the last word is never an option's.
                match word.parse::<f32>() {
                    Ok(v) if !after.is_empty() && v.is_finite() => (*value, rest) = (Some(v), after),
                    _ => break,
                }
            }
            let word = |rest: &mut &str| {
                let (word, after) = split_keyword(rest);
                *rest = after;
                word.to_owned()
            };
            match option {
                "s" => map.scale = Vec2::new(values[0].unwrap_or(1.0), values[1].unwrap_or(1.0)),
                "o" => map.offset = Vec2::new(values[0].unwrap_or(0.0), values[1].unwrap_or(0.0)),
                "bm" => map.strength = values[0].unwrap_or(1.0),
                "clamp" => map.clamp = word(&mut rest) == "on",
                "blendu" | "blendv" | "cc" | "imfchan" | "type" => drop(word(&mut rest)),
                "t" | "mm" | "boost" | "texres" => {}
                _ => return Err(format!("`-{option:.30}` is not an option of a texture")),
            }
        }
        if rest.is_empty() {
            return Err(format!("`{text:.60}` names no texture file"));
        }
        map.file = folder.join(portable(rest));
        Ok(map)
    }

    fn texture(&self, mtl: &Path, encoding: Encoding, textures: &mut Textures<'_>) -> Result<Texture> {
        let key = (self.file.clone(), encoding);
        let image = match textures.images.get(&key) {
            Some(image) => image.clone(),
            None => {
                let image = Arc::new(texture_file::read(mtl, &self.file, textures.files, encoding)?);
                textures.images.insert(key, image.clone());
                image
            }
        };
        let wrap = if self.clamp { Wrap::Clamp } else { Wrap::Repeat };
        // v_up·s + o, in terms of v = 1 − v_up.
        let offset = Vec2::new(self.offset.x, 1.0 - self.scale.y - self.offset.y);
        let texture_from_mesh = Affine2::from_scale_angle_translation(self.scale, 0.0, offset);
        let mut texture = Texture::new(image);
        (texture.wrap_u, texture.wrap_v, texture.texture_from_mesh) = (wrap, wrap, texture_from_mesh);
        Ok(texture)
    }
}

/// One texture with roughness in G and metalness in B, as glTF has it, from two grey ones; the larger's size, and the
/// roughness's placement where both have one.
fn merge(roughness: Option<Texture>, metallic: Option<Texture>) -> Option<Texture> {
    let pixels = |t: &Option<Texture>| t.as_ref().map_or((0, 0), |t| t.image().size());
    let (w, h) = pixels(&roughness).max(pixels(&metallic));
    let texture = roughness.clone().or(metallic.clone())?;
    let read = |t: &Option<Texture>, uv: Vec2| t.as_ref().map_or(1.0, |t| Texture::new(t.image().clone()).sample(uv).x);
    let merged = Image::from_fn(w, h, |x, y| {
        let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
        Vec4::new(1.0, read(&roughness, uv), read(&metallic, uv), 1.0)
    });
    Some(texture.with_image(Arc::new(merged)))
}
