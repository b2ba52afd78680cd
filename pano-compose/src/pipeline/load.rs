//! Reads the pictures and meshes that a scene names.

use super::device::Device;
use super::{Error, RenderOptions, Result};
use crate::plan::SceneFacts;
use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::{
    camera::{Camera, Projection},
    image::{Image, RadianceImage},
    io::{self, SourceEncoding},
    material::Material,
    mesh::read_mesh,
    scene::{DepthCamera, Method, Object, ProxyShape, Scene, ViewKind},
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
    /// What a depth camera sees.
    pub camera: Option<CameraInputs>,
    /// The objects' meshes, in the scene's order.
    pub meshes: Vec<Arc<PreparedMesh>>,
    /// The proxies' meshes, in the scene's order; `None` for planes.
    pub proxy_meshes: Vec<Option<Arc<PreparedMesh>>>,
    /// Where the scene's markers lie in the world, by their ids.
    pub markers: Vec<(u32, Affine3A)>,
    /// What had to be mended.
    pub warnings: Vec<String>,
}

/// The picture of a depth camera, in memory.
#[derive(Clone, Debug)]
pub struct CameraInputs {
    /// How it sees.
    pub camera: Camera,
    /// The picture as it is shown.
    pub photo: Arc<RadianceImage>,
    /// Of LDR input: the inversely tone-mapped picture, which other surfaces mirror.
    pub lighting: Option<Arc<RadianceImage>>,
    /// How the picture's file stored its colours.
    pub encoding: SourceEncoding,
    /// Distance along the ray in metres, infinite where nothing is.
    pub depth: Arc<Image<f32>>,
}

impl CameraInputs {
    /// What other surfaces see of the picture.
    pub fn radiance(&self) -> &Arc<RadianceImage> {
        self.lighting.as_ref().unwrap_or(&self.photo)
    }
}

impl Inputs {
    /// The view's camera.
    pub fn view(&self, scene: &Scene) -> Camera {
        match (&self.camera, scene.view.kind) {
            (Some(seen), ViewKind::Camera) => seen.camera,
            _ => scene.camera(self.photo.size()),
        }
    }

    /// How the file of the picture that the view shows stored its colours.
    pub fn view_encoding(&self, scene: &Scene) -> SourceEncoding {
        match (&self.camera, scene.view.kind) {
            (Some(seen), ViewKind::Camera) => seen.encoding,
            _ => self.encoding,
        }
    }

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
            has_depth: self.depth.is_some() || self.camera.is_some(),
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
    camera: Option<(PathBuf, Seen)>,
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

/// What a depth camera has seen, and of a camera by itself the panorama that stands for its surroundings.
#[derive(Clone, Debug)]
struct Seen {
    inputs: CameraInputs,
    surroundings: Option<Picture>,
    warnings: Vec<String>,
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
        let seen = match &scene.camera {
            None => None,
            Some(camera) => Some(last_or(&mut self.camera, camera.color.path(frame), |_| read_camera(camera, frame, device))?),
        };
        let picture = match seen.as_ref().and_then(|seen| seen.surroundings.clone()) {
            Some(surroundings) => surroundings,
            None => {
                let exposure = scene.camera.as_ref().map_or(1.0, |camera| camera.exposure);
                last_or(&mut self.picture, scene.panorama.color.path(frame), |path| read_panorama(path, exposure, device))?
            }
        };
        let mut warnings: Vec<String> = picture.warning.clone().into_iter().collect();
        warnings.extend(seen.iter().flat_map(|seen| seen.warnings.clone()));
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
        let camera = seen.map(|seen| seen.inputs);
        let mut inputs = Inputs { photo, lighting, encoding, depth, camera, meshes, proxy_meshes, markers: Vec::new(), warnings };
        inputs.markers = find_markers(scene, &mut inputs)?;
        Ok(inputs)
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

/// A panorama, its radiance multiplied by `exposure`.
fn read_panorama(path: &Path, exposure: f32, device: &mut Device) -> Result<Picture> {
    let mut picture = read_picture(path, device)?;
    check_equirectangular(path, picture.photo.size())?;
    if exposure != 1.0 {
        let exposed = |image: &Arc<RadianceImage>| Arc::new(image.map(|p| p * exposure));
        (picture.photo, picture.lighting) = (exposed(&picture.photo), picture.lighting.as_ref().map(exposed));
    }
    Ok(picture)
}

fn read_picture(path: &Path, device: &mut Device) -> Result<Picture> {
    let picture = io::read_image(path)?;
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

/// Columns of the panorama that is made up around a camera by itself.
const SURROUNDINGS_WIDTH: usize = 512;

fn read_camera(scene: &DepthCamera, frame: u32, device: &mut Device) -> Result<Seen> {
    let (color_path, depth_path) = (scene.color.path(frame), scene.depth.path(frame));
    let Picture { photo, lighting, encoding, warning } = read_picture(&color_path, device)?;
    let camera = scene.camera(photo.size());
    let read = io::read_depth(&depth_path, &scene.depth_format, camera.projection)?;
    let (size, depth_size) = (photo.size(), read.size());
    if depth_size != size {
        let problem = format!("it is {}×{}, and the camera's color {}×{}", depth_size.0, depth_size.1, size.0, size.1);
        let remedy = "give depth of the same size, aligned with the color picture";
        return Err(pano_core::Error::file(&depth_path, problem, remedy).into());
    }
    let mut warnings: Vec<String> = warning.into_iter().collect();
    if read.finite_pixels() == 0 {
        warnings.push(format!("{}: no pixel has depth", depth_path.display()));
    }
    let depth = Arc::new(read.into_image());
    let inputs = CameraInputs { camera, photo, lighting, encoding, depth };
    let surroundings = if scene.alone {
        warnings.push("without a [panorama], what the camera does not see is taken to be as bright as its picture's rim".into());
        let around = |image: &Arc<RadianceImage>| surroundings(image, &camera).map(Arc::new);
        let lighting = inputs.lighting.as_ref().map(around).transpose()?;
        Some(Picture { photo: around(&inputs.photo)?, lighting, encoding, warning: None })
    } else {
        None
    };
    Ok(Seen { inputs, surroundings, warnings })
}

/// A panorama that shows a camera's picture where the camera looks, and the mean of the picture's rim elsewhere.
fn surroundings(picture: &RadianceImage, camera: &Camera) -> Result<RadianceImage> {
    let (w, h) = picture.size();
    let rim = (0..w).flat_map(|x| [(x, 0), (x, h - 1)]).chain((0..h).flat_map(|y| [(0, y), (w - 1, y)]));
    let mean = rim.map(|(x, y)| picture.get(x, y)).sum::<Vec3>() / (2 * (w + h)) as f32;
    let mut panorama = RadianceImage::filled(SURROUNDINGS_WIDTH, SURROUNDINGS_WIDTH / 2, mean);
    let mut shown = panorama.clone();
    let mut coverage = Image::filled(SURROUNDINGS_WIDTH, SURROUNDINGS_WIDTH / 2, 0.0);
    sphere::resample::panorama_from_view(picture, camera, Quat::IDENTITY, &mut shown, &mut coverage)?;
    for ((out, shown), covered) in panorama.data_mut().iter_mut().zip(shown.data()).zip(coverage.data()) {
        *out = if *covered > 0.0 { *shown } else { *out };
    }
    Ok(panorama)
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
            world_from_mesh: base_of(object, inputs) * object.placement_at(time).world_from_local(),
            material: object.material.clone(),
        })
        .collect();
    Objects::new(&placements)
}

/// What an object's placement is relative to.
fn base_of(object: &Object, inputs: &Inputs) -> Affine3A {
    let found = |id: u32| inputs.markers.iter().find(|(known, _)| *known == id).map(|(_, place)| *place);
    object.marker.and_then(found).unwrap_or(Affine3A::IDENTITY)
}

/// Looks for the scene's markers, in the depth camera's picture or else in the panorama, and tells how well they were found.
#[cfg(feature = "markers")]
pub(crate) fn find_markers(scene: &Scene, inputs: &mut Inputs) -> Result<Vec<(u32, Affine3A)>> {
    let (picture, camera, path) = match (&inputs.camera, &scene.camera) {
        (Some(seen), Some(camera)) => (&seen.photo, seen.camera, camera.color.path(0)),
        _ => {
            let (width, height) = inputs.photo.size();
            let panorama = Camera {
                position: scene.panorama.position,
                world_from_camera: scene.panorama.world_from_pano(),
                projection: Projection::Panorama,
                width,
                height,
            };
            (&inputs.photo, panorama, scene.panorama.color.path(0))
        }
    };
    let found = crate::markers::find(picture, &camera, &scene.markers)?;
    let mut places = Vec::new();
    for marker in &scene.markers {
        let Some(found) = found.iter().find(|found| found.id == marker.id) else {
            let problem = format!("marker {} ({}) is not in the picture", marker.id, marker.family);
            let remedy = "check its family and id; it must be flat, whole and at least some 20 pixels wide, with a white rim";
            return Err(pano_core::Error::file(&path, problem, remedy).into());
        };
        inputs.warnings.push(format!(
            "marker {} is {:.3} m away, found to {:.3}° in the picture{}",
            marker.id,
            found.distance,
            found.error_degrees,
            if found.ambiguous { "; it is too small or seen too flat to tell its tilt for sure" } else { "" }
        ));
        places.push((marker.id, found.world_from_marker));
    }
    Ok(places)
}

/// Without the feature `markers` there is nothing to look with.
#[cfg(not(feature = "markers"))]
pub(crate) fn find_markers(scene: &Scene, _inputs: &mut Inputs) -> Result<Vec<(u32, Affine3A)>> {
    if scene.markers.is_empty() {
        return Ok(Vec::new());
    }
    Err(Error::unsupported("this build cannot look for markers", "build it with `--features markers`, or leave [[marker]] out"))
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
