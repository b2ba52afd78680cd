//! What a scene file names, and whether it is there and sound.

use super::{Content, FileInfo, depth, mesh, picture};
use pano_core::{
    Result,
    mesh::Mesh,
    scene::{Object, PicturePath, Placement, ProxyShape, Scene, ViewKind},
};
use serde::Serialize;
use std::path::Path;

/// A scene file.
#[derive(Debug, Serialize)]
pub(super) struct SceneInfo {
    method: &'static str,
    samples: u32,
    bounces: u32,
    /// `panorama` or `perspective`.
    view: &'static str,
    /// Size of the output, where the scene gives it.
    size: Option<(usize, usize)>,
    /// Frames that are there, for a sequence.
    frames: Option<usize>,
    proxies: usize,
    objects: usize,
    /// The files it names.
    pub(super) parts: Vec<Part>,
}

/// A file that the scene names.
#[derive(Debug, Serialize)]
pub(super) struct Part {
    /// Where in the scene: `panorama.color`, `object 1`.
    role: String,
    #[serde(flatten)]
    pub(super) info: FileInfo,
}

/// Reads a scene and everything it names (of a sequence, the first frame).
pub(super) fn inspect(path: &Path) -> Result<FileInfo> {
    let scene = Scene::load(path)?;
    let mut problems = vec![];
    let mut parts = vec![];
    let mut add = |role: &str, path: &Path, info: Result<FileInfo>| {
        let info = info.unwrap_or_else(|error| FileInfo::unreadable(path, &error));
        parts.push(Part { role: role.to_owned(), info });
    };

    let frames = match &scene.panorama.color {
        PicturePath::Still(_) => None,
        PicturePath::Frames(pattern) => Some(pattern.existing()),
    };
    if frames.as_ref().is_some_and(Vec::is_empty) {
        problems.push(format!("no frame of the sequence is there, such as {}", scene.panorama.color.path(0).display()));
    }
    let first = frames.as_ref().map_or(Some(0), |frames| frames.first().copied());
    if let Some(first) = first {
        let color = scene.panorama.color.path(first);
        let role = if scene.camera.as_ref().is_some_and(|camera| camera.alone) { "camera.color" } else { "panorama.color" };
        add(role, &color, picture::inspect(&color));
        if let Some(depth) = scene.panorama.depth.as_ref().map(|depth| depth.path(first)) {
            add("panorama.depth", &depth, depth::inspect(&depth, Some(&scene.panorama.depth_format), true));
        }
        if let Some(camera) = &scene.camera {
            let (color, depth) = (camera.color.path(first), camera.depth.path(first));
            if !camera.alone {
                add("camera.color", &color, picture::inspect(&color));
            }
            add("camera.depth", &depth, depth::inspect(&depth, Some(&camera.depth_format), false));
        }
    }
    for (i, proxy) in scene.proxies.iter().enumerate() {
        if let ProxyShape::Mesh(path) = &proxy.shape {
            add(&format!("proxy {}", i + 1), path, mesh::inspect(path).map(|(info, _)| info));
        }
    }
    for (i, object) in scene.objects.iter().enumerate() {
        let info = mesh::inspect(&object.mesh).map(|(mut info, mesh)| {
            info.problems.extend(object_problems(&scene, object, &mesh, &info.content));
            info
        });
        add(&format!("object {}", i + 1), &object.mesh, info);
    }
    problems.extend(scene_problems(&scene, &parts));
    let info = SceneInfo {
        method: scene.render.method.name(),
        samples: scene.render.samples,
        bounces: scene.render.bounces,
        view: match scene.view.kind {
            ViewKind::Panorama => "panorama",
            ViewKind::Perspective { .. } => "perspective",
            ViewKind::Camera => "camera",
        },
        size: scene.view.size,
        frames: frames.map(|frames| frames.len()),
        proxies: scene.proxies.len(),
        objects: scene.objects.len(),
        parts,
    };
    Ok(FileInfo { path: path.to_owned(), content: Content::Scene(info), problems })
}

/// Problems that show only once everything is known.
fn scene_problems(scene: &Scene, parts: &[Part]) -> Vec<String> {
    let mut problems = vec![];
    let unreadable = parts.iter().filter(|part| matches!(part.info.content, Content::Error { .. })).count();
    if unreadable > 0 {
        problems.push(format!("{unreadable} of the {} files it names cannot be read", parts.len()));
    }
    if scene.objects.is_empty() {
        problems.push("has no [[object]]: the output will be the photo".into());
    }
    let p = &scene.panorama;
    if p.depth.is_none() && scene.camera.is_none() && scene.proxies.is_empty() && p.camera_height.is_none() {
        let remedy = "give `depth`, a [[proxy]] or `camera_height`";
        problems.push(format!("nothing is known of the place, so that no shadow can fall: {remedy}"));
    }
    let depth_size = parts.iter().find_map(|part| match &part.info.content {
        Content::Depth(info) if !info.equirectangular && part.role == "panorama.depth" => Some(info.size()),
        _ => None,
    });
    if let Some((w, h)) = depth_size {
        problems.push(format!("its depth map of {w}×{h} does not cover the panorama"));
    }
    problems
}

/// Problems of an object in its place.
fn object_problems(scene: &Scene, object: &Object, mesh: &Mesh, content: &Content) -> Vec<String> {
    let mut problems = vec![];
    if let (Some(material), Content::Mesh(info)) = (&object.material, content)
        && mesh::is_body(material)
        && info.open_edges > 0
    {
        problems.push(mesh::open_body(info.open_edges));
    }
    let eye = scene.view.position.unwrap_or(scene.panorama.position);
    if surrounds(&object.placement, mesh, eye) {
        problems.push(format!("its bounds enclose the view's position {eye}"));
    }
    problems
}

/// Does the placed mesh's bounding box hold the point?
fn surrounds(placement: &Placement, mesh: &Mesh, point: glam::Vec3) -> bool {
    let local = placement.world_from_local().inverse().transform_point3(point);
    mesh.bounds().is_some_and(|(lo, hi)| local.cmpge(lo).all() && local.cmple(hi).all())
}

impl SceneInfo {
    /// For the text output.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let size = self.size.map_or(String::new(), |(w, h)| format!(", {w}×{h}"));
        let mut facts = vec![
            ("render", format!("{}, {} samples, {} bounces", self.method, self.samples, self.bounces)),
            ("view", format!("{}{size}", self.view)),
            ("holds", format!("objects: {}, proxies: {}", self.objects, self.proxies)),
        ];
        facts.extend(self.frames.map(|n| ("frames", format!("{n} on disk"))));
        facts
    }
}
