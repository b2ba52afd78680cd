//! Reads the pictures and meshes that a scene names.

use super::device::Device;
use super::{Error, RenderOptions, Result};
use crate::plan::SceneFacts;
use glam::{Affine3A, Vec2};
use pano_core::{
    camera::Projection,
    image::{Image, RadianceImage},
    io::{self, SourceEncoding},
    material::Material,
    mesh::read_mesh,
    scene::{Method, ProxyShape, Scene},
    sphere,
};
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Everything a scene names, in memory.
#[derive(Clone, Debug)]
pub struct Inputs {
    /// The panorama as it is shown.
    pub photo: Arc<RadianceImage>,
    /// Of LDR input: the inversely tone-mapped panorama, which lights the scene in place of the photo.
    pub lighting: Option<Arc<RadianceImage>>,
    /// How the panorama's file stored its colours.
    pub encoding: SourceEncoding,
    /// Distance along the ray in metres, infinite where nothing is.
    pub depth: Option<Arc<Image<f32>>>,
    /// The objects' meshes, in the scene's order.
    pub meshes: Vec<Arc<PreparedMesh>>,
    /// The proxies' meshes, in the scene's order; `None` for planes.
    pub proxy_meshes: Vec<Option<Arc<PreparedMesh>>>,
    /// What had to be mended.
    pub warnings: Vec<String>,
}

impl Inputs {
    /// What lights the scene.
    pub fn radiance(&self) -> &Arc<RadianceImage> {
        self.lighting.as_ref().unwrap_or(&self.photo)
    }

    /// By how much [`Self::radiance`] of LDR input would be brighter had it not been brought to the photo's scale.
    pub(super) fn expansion(&self) -> f32 {
        if self.lighting.is_some() { LEAST_EXPANSION } else { 1.0 }
    }

    /// What the effect plan wants to know.
    pub fn facts(&self, scene: &Scene, method: Method) -> SceneFacts {
        let mut facts = SceneFacts {
            objects: scene.objects.len(),
            bounces: scene.render.bounces,
            has_depth: self.depth.is_some(),
            has_proxies: !scene.proxies.is_empty() || scene.panorama.camera_height.is_some(),
            is_sequence: scene.panorama.color.is_sequence(),
            moving: scene.objects.iter().any(|o| !o.keyframes.is_empty()),
            method: method.name().to_owned(),
            ..SceneFacts::default()
        };
        for (object, mesh) in scene.objects.iter().zip(&self.meshes) {
            match &object.material {
                Some(material) => facts.note_material(material),
                None if mesh.mesh().materials.is_empty() => facts.note_material(&Material::default()),
                None => mesh.mesh().materials.iter().for_each(|m| facts.note_material(m)),
            }
        }
        facts
    }
}

/// Least factor of MR360's inverse tone mapping: what is not bright keeps its value if the map is divided by it.
const LEAST_EXPANSION: f32 = 1.8;

/// Reads what a scene names, frame after frame; what frames share is read once.
#[derive(Debug, Default)]
pub struct Loader {
    picture: Option<(PathBuf, Picture)>,
    depth: Option<(PathBuf, DepthPicture)>,
    meshes: Vec<(PathBuf, Arc<PreparedMesh>)>,
}

/// A panorama and what lights the scene in its place.
#[derive(Clone, Debug)]
struct Picture {
    photo: Arc<RadianceImage>,
    lighting: Option<Arc<RadianceImage>>,
    encoding: SourceEncoding,
    warning: Option<String>,
}

/// A depth map.
#[derive(Clone, Debug)]
struct DepthPicture {
    distance: Arc<Image<f32>>,
    warning: Option<String>,
}

impl Loader {
    /// Everything `scene` names for frame `frame`.
    ///
    /// # Errors
    /// The first file at fault.
    pub fn load(&mut self, scene: &Scene, frame: u32) -> Result<Inputs> {
        self.load_on(&mut Device::new(&RenderOptions::default()), scene, frame)
    }

    /// The same, where `device` says.
    pub(super) fn load_on(&mut self, device: &mut Device, scene: &Scene, frame: u32) -> Result<Inputs> {
        let path = scene.panorama.color.path(frame);
        let picture = last_or(&mut self.picture, path, |path| read_picture(path, device))?;
        let mut warnings: Vec<String> = picture.warning.clone().into_iter().collect();
        let depth = match &scene.panorama.depth {
            None => None,
            Some(source) => {
                let depth = last_or(&mut self.depth, source.path(frame), |path| read_depth(scene, path))?;
                warnings.extend(depth.warning.clone());
                Some(depth.distance)
            }
        };
        let meshes = scene.objects.iter().map(|o| self.mesh(&o.mesh)).collect::<Result<_>>()?;
        let proxy_meshes = scene
            .proxies
            .iter()
            .map(|p| match &p.shape {
                ProxyShape::Plane { .. } => Ok(None),
                ProxyShape::Mesh(path) => self.mesh(path).map(Some),
            })
            .collect::<Result<_>>()?;
        let Picture { photo, lighting, encoding, .. } = picture;
        Ok(Inputs { photo, lighting, encoding, depth, meshes, proxy_meshes, warnings })
    }

    /// The mesh of a file, read and given its hierarchy once.
    fn mesh(&mut self, path: &Path) -> Result<Arc<PreparedMesh>> {
        if let Some((_, mesh)) = self.meshes.iter().find(|(p, _)| p == path) {
            return Ok(mesh.clone());
        }
        let mesh = Arc::new(PreparedMesh::new(read_mesh(path)?).map_err(Error::Core)?);
        self.meshes.push((path.to_owned(), mesh.clone()));
        Ok(mesh)
    }
}

/// What was read last, if it was from `path`; otherwise what `read` makes of it.
fn last_or<T: Clone>(last: &mut Option<(PathBuf, T)>, path: PathBuf, read: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    match last {
        Some((known, value)) if *known == path => Ok(value.clone()),
        _ => {
            let value = read(&path)?;
            *last = Some((path, value.clone()));
            Ok(value)
        }
    }
}

fn read_picture(path: &Path, device: &mut Device) -> Result<Picture> {
    let picture = io::read_image(path)?;
    check_equirectangular(path, picture.radiance.size())?;
    let warning = (!picture.report.is_clean()).then(|| {
        let (negative, not_finite) = (picture.report.negative, picture.report.not_finite);
        format!("{}: {negative} negative and {not_finite} non-finite values were set to 0", path.display())
    });
    let photo = Arc::new(picture.radiance);
    let lighting = if picture.encoding == SourceEncoding::LinearFloat {
        None
    } else {
        let mut hdr = photo.as_ref().clone();
        device.expand(&photo, &mut hdr)?;
        hdr.data_mut().iter_mut().for_each(|p| *p /= LEAST_EXPANSION);
        Some(Arc::new(hdr))
    };
    Ok(Picture { photo, lighting, encoding: picture.encoding, warning })
}

fn read_depth(scene: &Scene, path: &Path) -> Result<DepthPicture> {
    let read = io::read_depth(path, &scene.panorama.depth_format, Projection::Panorama)?;
    check_equirectangular(path, read.size())?;
    let warning =
        (read.finite_pixels() == 0).then(|| format!("{}: no pixel has depth; everything is at infinity", path.display()));
    let mut image = read.into_image();
    if let Some(height) = scene.panorama.camera_height {
        add_ground(&mut image, height);
    }
    Ok(DepthPicture { distance: Arc::new(image), warning })
}

/// Fails unless a picture of this size can be a whole panorama.
fn check_equirectangular(path: &Path, (width, height): (usize, usize)) -> Result<()> {
    if width == 2 * height {
        return Ok(());
    }
    let problem = format!("it is {width}×{height}, which is not 2:1");
    Err(pano_core::Error::file(path, problem, "give an equirectangular panorama, twice as wide as high").into())
}

/// Places the scene's objects as they are at frame `frame`.
pub fn prepare_objects(scene: &Scene, inputs: &Inputs, frame: u32) -> Objects {
    let time = frame as f32 / scene.panorama.fps;
    let placements: Vec<Placement> = scene
        .objects
        .iter()
        .zip(&inputs.meshes)
        .map(|(object, mesh)| Placement {
            mesh: mesh.clone(),
            world_from_mesh: object.placement_at(time).world_from_local(),
            material: object.material.clone(),
        })
        .collect();
    Objects::new(&placements)
}

/// The ground under the capture point, where the depth map has nothing.
fn add_ground(depth: &mut Image<f32>, height: f32) {
    let (w, h) = depth.size();
    for y in 0..h {
        // The distance depends on the row only.
        let down = -sphere::direction_from_uv(Vec2::new(0.5, (y as f32 + 0.5) / h as f32)).y;
        for x in 0..w {
            if down > 1e-3 && !depth.get(x, y).is_finite() {
                depth.set(x, y, height / down);
            }
        }
    }
}

/// Where a plane proxy or the ground stands.
pub(super) fn ground_placement(scene: &Scene, height: f32) -> Affine3A {
    Affine3A::from_translation(scene.panorama.position - glam::Vec3::Y * height)
}
