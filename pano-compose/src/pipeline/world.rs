//! From inputs to the world that rays ask, and to the method that runs.

use super::load::ground_placement;
use super::{Error, Inputs, RenderOptions, Result, Settings};
use glam::{Vec2, Vec3};
use pano_core::{
    io::SourceEncoding,
    progress::Progress,
    scene::{Method, ProxyShape as SceneShape, Scene},
};
use pano_trace::bvh::Ray;
use pano_trace::objects::Objects;
use pano_trace::tracer;
use pano_trace::world::{
    CameraWorld, CapturedOptions, CapturedWorld, LayeredWorld, Proxy, ProxyShape, ProxyWorld, RealWorld, Reflectance,
};
use std::sync::Arc;

/// Metres along each side of the ground plane that `camera_height` stands for: the horizon for a standing viewer.
const GROUND_SIZE: f32 = 400.0;

/// The world of a scene.
#[derive(Clone, Debug)]
pub enum World {
    /// Proxies (or nothing) under an environment at infinity.
    Proxies(Box<ProxyWorld>),
    /// A panorama with depth.
    Captured(Box<CapturedWorld>),
    /// Several of them, of rt2ar: a panorama with or without depth, ghosts, a depth camera.
    Layered(Box<LayeredWorld>),
}

impl World {
    /// Where a ray first meets a real surface.
    pub fn hit_position(&self, origin: Vec3, direction: Vec3) -> Option<Vec3> {
        let ray = Ray::new(origin, direction);
        match self {
            Self::Proxies(world) => world.hit(&ray),
            Self::Captured(world) => world.hit(&ray),
            Self::Layered(world) => world.hit(&ray),
        }
        .map(|hit| hit.position)
    }

    /// Whether reflectance is read off the picture.
    pub fn reflects_picture(&self) -> bool {
        match self {
            Self::Proxies(world) => world.reflects_picture(),
            Self::Captured(_) => true,
            // Only rt2ar has layers, and it shades by the photo.
            Self::Layered(_) => false,
        }
    }
}

/// What `auto` stands for in this scene, with reasons in `warnings` where it is not what the user may expect.
///
/// # Errors
/// [`Error::Unsupported`] for a method that this version does not have.
pub fn resolve_method(scene: &Scene, inputs: &Inputs, warnings: &mut Vec<String>) -> Result<Method> {
    match scene.render.method {
        Method::Auto | Method::Rt2ar if inputs.camera.is_some() => Ok(Method::Rt2ar),
        method if inputs.camera.is_some() => Err(Error::unsupported(
            format!("method `{}` cannot use a depth camera", method.name()),
            "use rt2ar or auto, or leave [camera] out",
        )),
        Method::Auto => {
            if inputs.depth.is_none() && scene.proxies.is_empty() && scene.panorama.camera_height.is_none() {
                warnings.push("no depth, no proxy and no camera_height: nothing real receives shadows".into());
            } else if inputs.depth.is_none() && inputs.encoding != SourceEncoding::LinearFloat {
                warnings.push("an LDR panorama lights the scene by inverse tone mapping; shadows are estimates".into());
                return Ok(Method::Mr360);
            }
            let is_video = scene.panorama.color.is_sequence() && inputs.depth.is_some();
            Ok(if is_video { Method::Iprt } else { Method::Dpt })
        }
        method @ (Method::Dpt | Method::Onepass | Method::Twopass | Method::Ibl | Method::Mr360 | Method::Rt2ar) => Ok(method),
        Method::Iprt if inputs.depth.is_some() => Ok(Method::Iprt),
        Method::Iprt => Err(Error::unsupported(
            "method `iprt` traces rays against the panorama's depth, and there is none",
            "give the panorama a `depth`, or use dpt",
        )),
    }
}

/// The tracer's name for a method that [`resolve_method`] has let through.
pub(super) fn tracer_method(method: Method) -> tracer::Method {
    match method {
        Method::Onepass => tracer::Method::OnePass,
        Method::Twopass => tracer::Method::TwoPass,
        Method::Ibl => tracer::Method::Ibl,
        _ => tracer::Method::Dpt,
    }
}

/// Builds the world of a scene, with the settings and the seed of `options`.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn build_world(
    scene: &Scene,
    inputs: &Inputs,
    objects: &Objects,
    options: &RenderOptions,
    warnings: &mut Vec<String>,
    progress: &dyn Progress,
) -> Result<World> {
    let RenderOptions { settings, seed, .. } = options;
    let turn = scene.panorama.world_from_pano();
    let capture = scene.panorama.position;
    let radiance = inputs.radiance().clone();
    let method = resolve_method(scene, inputs, &mut Vec::new())?;
    if method == Method::Rt2ar && (inputs.camera.is_some() || (inputs.depth.is_some() && !scene.proxies.is_empty())) {
        return layered_world(scene, inputs, settings, progress);
    }
    if let Some(depth) = &inputs.depth {
        if !scene.proxies.is_empty() {
            warnings.push("the panorama has depth: proxies are not used".into());
        }
        let mut options = CapturedOptions { seed: *seed, ..settings.captured };
        // iprt has the fewest rays, and mirrors show each of them.
        options.hidden_samples =
            settings.hidden_samples.unwrap_or(if method == Method::Iprt { 4 } else { options.hidden_samples });
        let mut bounds = objects.clusters();
        match method {
            // Nothing real changes, or the method has irradiance of its own: no reflectance is asked for.
            Method::Ibl | Method::Rt2ar => options.irradiance_width = 0,
            // It estimates the irradiance of what it changes itself; only back faces are left.
            Method::Iprt => (bounds, options.mirrors) = (&[], false),
            // Its objects look mirror images up in maps.
            Method::Mr360 => options.mirrors = false,
            _ => {}
        }
        let world = CapturedWorld::new(radiance, depth, turn, capture, bounds, &options, progress).ok_or(Error::Cancelled)?;
        return Ok(World::Captured(Box::new(world)));
    }
    Ok(World::Proxies(Box::new(ProxyWorld::new(radiance, turn, capture, &proxies(scene, inputs, settings)))))
}

/// The panorama's depth, the ghosts in front of it, and what a depth camera sees.
fn layered_world(scene: &Scene, inputs: &Inputs, settings: &Settings, progress: &dyn Progress) -> Result<World> {
    let turn = scene.panorama.world_from_pano();
    let capture = scene.panorama.position;
    let radiance = inputs.radiance().clone();
    let ghosts = ProxyWorld::new(radiance.clone(), turn, capture, &proxies(scene, inputs, settings));
    let mut layers: Vec<Arc<dyn RealWorld + Send>> = Vec::new();
    if let Some(depth) = &inputs.depth {
        let options = CapturedOptions { irradiance_width: 0, ..settings.captured };
        let captured = CapturedWorld::new(radiance, depth, turn, capture, &[], &options, progress).ok_or(Error::Cancelled)?;
        layers.push(Arc::new(captured));
        if !scene.proxies.is_empty() {
            layers.push(Arc::new(ghosts));
        }
    } else {
        layers.push(Arc::new(ghosts));
    }
    let mut eye = capture;
    if let Some(seen) = &inputs.camera {
        eye = seen.camera.position;
        let world = CameraWorld::new(seen.radiance().clone(), &seen.depth, seen.camera, &settings.captured.field)?;
        layers.push(Arc::new(world));
    }
    let base = layers.remove(0);
    Ok(World::Layered(Box::new(LayeredWorld::new(base, layers, eye))))
}

/// The known geometry of a scene, the ground included where no depth stands for it.
fn proxies(scene: &Scene, inputs: &Inputs, settings: &Settings) -> Vec<Proxy> {
    let from_picture = Reflectance::FromPicture { cap: settings.captured.reflectance_cap };
    let mut proxies: Vec<Proxy> = scene
        .proxies
        .iter()
        .zip(&inputs.proxy_meshes)
        .map(|(p, mesh)| Proxy {
            shape: match (&p.shape, mesh) {
                (SceneShape::Plane { size }, _) => ProxyShape::Plane(*size),
                (SceneShape::Mesh(_), Some(mesh)) => ProxyShape::Mesh(mesh.clone()),
                (SceneShape::Mesh(path), None) => unreachable!("{} was read with the inputs", path.display()),
            },
            world_from_local: p.placement.world_from_local(),
            reflectance: p.albedo.map_or(from_picture, Reflectance::Known),
        })
        .collect();
    if let Some(height) = scene.panorama.camera_height.filter(|_| inputs.depth.is_none()) {
        proxies.push(Proxy {
            shape: ProxyShape::Plane(Vec2::splat(GROUND_SIZE)),
            world_from_local: ground_placement(scene, height),
            reflectance: from_picture,
        });
    }
    proxies
}
