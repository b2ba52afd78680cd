//! The cases of RT²AR's figures 10 and 11 in the built-in room: occlusion, reflection, recursion, refraction, soft shadows.
//! Each with the panorama's depth, through a depth camera, and path-traced with the objects really in the room.

use super::place::{Place, SCENE_FILE};
use super::reference::{self, Quality};
use super::{CAPTURE_FILTER, Step, TRUTH_FILTER};
use crate::pipeline::{self, CameraInputs, Clock, Frame, Inputs, RenderOptions, Rendered, Result};
use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::{primitives, room::RoomObject};
use pano_core::camera::Camera;
use pano_core::depth::RayDepth;
use pano_core::image::{Image, RadianceImage};
use pano_core::io::SourceEncoding;
use pano_core::material::Material;
use pano_core::mesh::Mesh;
use pano_core::progress::Progress;
use pano_core::random::Stream;
use pano_core::scene::{Method, Scene};
use std::sync::Arc;

/// Sizes and samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CaseParams {
    /// Columns of the captured panorama, even and ≥ 2.
    pub panorama_width: usize,
    /// Samples a pixel of the panorama and of the depth camera's picture, ≥ 1.
    pub captured_samples: u32,
    /// Width and height of each picture, ≥ 1.
    pub size: (usize, usize),
    /// Primary rays a pixel of rt2ar, ≥ 1.
    pub samples: u32,
    /// Samples a pixel of the truth, ≥ 1.
    pub truth_samples: u32,
}

/// One case.
#[derive(Clone, Debug)]
pub struct Case {
    /// What it shows, in a word or two.
    pub name: &'static str,
    /// Path-traced with the objects really in the room; filtered.
    pub truth: RadianceImage,
    /// By rt2ar from the panorama and its depth.
    pub panorama: Rendered,
    /// By rt2ar from a depth camera's picture, z in whole millimetres, and the panorama without depth.
    pub camera: Rendered,
}

/// Height of the table that objects stand on.
const TABLE: f32 = 0.75;
/// The case with a varnished table, and how rough that is.
const GLOSSY: &str = "glossy table";
const VARNISH: f32 = 0.2;

/// The case with a printed marker on the table (feature `markers`): where it lies, turned by these degrees, how large and which
/// it is.
const MARKED: &str = "marker";
#[cfg(feature = "markers")]
const PRINT: (Vec3, f32, f32, u32) = (Vec3::new(0.12, TABLE + 0.0005, -0.02), 35.0, 0.3, 7);

/// Renders the cases, or the one that is called `only`.
///
/// # Errors
/// [`pipeline::Error::Cancelled`], or [`pipeline::Error::Core`] if a size or a number of samples is 0.
pub fn cases(params: &CaseParams, only: Option<&str>, progress: &dyn Progress) -> Result<Vec<Case>> {
    let counts = [params.captured_samples, params.samples, params.truth_samples];
    if params.panorama_width < 2 || counts.contains(&0) || params.size.0 == 0 || params.size.1 == 0 {
        return Err(pano_core::Error::argument(format!("cases need pixels and samples: {params:?}")).into());
    }
    let place = Place::new()?;
    let quality = |samples: u32, coarsest: isize, picture: u32| Quality {
        samples: samples.div_ceil(2),
        bounces: 6,
        coarsest,
        streams: [2 * picture - 1, 2 * picture].map(|frame| Stream { frame, seed: 0 }),
    };
    let panorama = place.panorama(params.panorama_width);
    let captured = quality(params.captured_samples, CAPTURE_FILTER, 1);
    let mut photos: Vec<(&str, Arc<RadianceImage>)> = Vec::new();
    let depth = Arc::new(reference::depth(&place.without_objects(), &panorama, |triangle| place.is_window(triangle)));
    let mut cases = Vec::new();
    for (i, (name, view, objects)) in contents(&place).into_iter().enumerate() {
        if only.is_some_and(|only| only != name) {
            continue;
        }
        let place = place.furnished(objects, view)?;
        let place = if name == GLOSSY { place.varnished(VARNISH)? } else { place };
        #[cfg(feature = "markers")]
        let place = if name == MARKED { place.with_print(&print()?)? } else { place };
        let empty = place.without_objects();
        let room = if [GLOSSY, MARKED].contains(&name) { name } else { "room" };
        let photo = match photos.iter().find(|(of, _)| *of == room) {
            Some((_, photo)) => photo.clone(),
            None => {
                let step = Step { progress, name: "capture" };
                let photo = Arc::new(reference::trace(&empty, &panorama, &captured, &step)?.radiance);
                photos.push((room, photo.clone()));
                photo
            }
        };
        let camera = place.view(params.size);
        let step = Step { progress, name };
        let sharp = |picture: u32| quality(params.truth_samples, TRUTH_FILTER, 2 + 2 * i as u32 + picture);
        let truth = reference::trace(&place.with_objects(), &camera, &sharp(0), &step)?.radiance;
        let seen = reference::trace(&empty, &camera, &sharp(1), &step)?.radiance;
        let with_depth = inputs(&place, photo.clone(), Some(depth.clone()), None);
        let distance = millimetres(&reference::depth(&empty, &camera, |triangle| place.is_window(triangle)), &camera);
        let seen = CameraInputs {
            camera,
            photo: Arc::new(seen),
            lighting: None,
            encoding: SourceEncoding::LinearFloat,
            depth: Arc::new(distance),
        };
        let with_camera = inputs(&place, photo.clone(), None, Some(seen));
        cases.push(Case {
            name,
            truth,
            panorama: render(&place, params, with_depth, name, &step)?,
            camera: render(&place, params, with_camera, name, &step)?,
        });
    }
    Ok(cases)
}

/// The marker of that case, lying in the room.
#[cfg(feature = "markers")]
fn print() -> Result<Mesh> {
    let (_, _, size, id) = PRINT;
    let mut mesh = crate::markers::Pattern::new("tag36h11", id)?.mesh(size);
    mesh.transform(&world_from_print());
    Ok(mesh)
}

#[cfg(feature = "markers")]
fn world_from_print() -> Affine3A {
    Affine3A::from_rotation_translation(Quat::from_rotation_y(PRINT.1.to_radians()), PRINT.0)
}

/// Says of the objects where they are relative to the marker, and looks for that in the picture.
#[cfg(feature = "markers")]
fn place_by_marker(scene: &mut Scene, inputs: &mut Inputs) -> Result<()> {
    use pano_core::scene::{Marker, Rotation};
    let (_, yaw, size, id) = PRINT;
    scene.markers = vec![Marker { family: "tag36h11", id, size }];
    for object in &mut scene.objects {
        object.marker = Some(id);
        object.placement.position = world_from_print().inverse().transform_point3(object.placement.position);
        if let Rotation::Yaw(degrees) = &mut object.placement.rotation {
            *degrees -= yaw;
        }
    }
    inputs.markers = pipeline::find_markers(scene, inputs)?;
    Ok(())
}

fn inputs(place: &Place, photo: Arc<RadianceImage>, depth: Option<Arc<Image<f32>>>, camera: Option<CameraInputs>) -> Inputs {
    Inputs {
        photo,
        lighting: None,
        encoding: SourceEncoding::LinearFloat,
        depth,
        camera,
        meshes: place.objects.clone(),
        proxy_meshes: Vec::new(),
        markers: Vec::new(),
        warnings: Vec::new(),
    }
}

fn render(
    place: &Place,
    params: &CaseParams,
    #[cfg_attr(not(feature = "markers"), expect(unused_mut, reason = "only a marker adds to them"))] mut inputs: Inputs,
    name: &str,
    progress: &dyn Progress,
) -> Result<Rendered> {
    let demo = super::DemoParams { view: params.size, samples: params.samples, bounces: 6, ..super::DemoParams::quick() };
    let mut scene = Scene::parse(&place.scene_file(&demo), SCENE_FILE)?;
    scene.render.method = Method::Rt2ar;
    // The file says less of materials than there is.
    scene.objects.iter_mut().zip(place.contents()).for_each(|(o, known)| o.material = Some(known.material.clone()));
    #[cfg(feature = "markers")]
    if name == MARKED {
        place_by_marker(&mut scene, &mut inputs)?;
    }
    let inputs = &inputs;
    let objects = pipeline::prepare_objects(&scene, inputs, 0);
    let mut options = RenderOptions::default();
    (options.settings.gloss, options.settings.gloss_roughness) = (if name == GLOSSY { 1.0 } else { 0.0 }, VARNISH);
    let world = pipeline::build_world(&scene, inputs, &objects, &options, &mut Vec::new(), progress)?;
    Frame::new(&scene, inputs, &objects, &world, &options).render(Clock::new(), progress)
}

/// Depth as a sensor stores it: z in whole millimetres.
fn millimetres(distance: &Image<f32>, camera: &Camera) -> Image<f32> {
    let axis = camera.world_from_camera * Vec3::NEG_Z;
    let z = Image::from_fn(distance.width(), distance.height(), |x, y| {
        let cos = camera.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)).dot(axis);
        let t = (distance.get(x, y) * cos * 1000.0).round() / 1000.0 / cos;
        if t.is_finite() { t } else { f32::INFINITY }
    });
    RayDepth::from_metres(z).into_image()
}

/// Name, view (degrees to the right, up, of height) and objects of each case.
fn contents(place: &Place) -> Vec<(&'static str, [f32; 3], Vec<RoomObject>)> {
    let on_table = |name, mesh: Mesh, material, x: f32, z: f32| RoomObject {
        name,
        mesh,
        material,
        position: Vec3::new(x, TABLE, z),
        yaw: 20.0,
    };
    let known = |name: &str, scale: f32| {
        let object = place.contents().iter().find(|o| o.name == name);
        let mut mesh = object.map_or_else(|| primitives::icosphere(0.1, 4), |o| o.mesh.clone());
        mesh.transform(&Affine3A::from_scale(Vec3::splat(scale)));
        mesh
    };
    let ball = |radius: f32| {
        let mut mesh = primitives::icosphere(radius, 6);
        mesh.transform(&Affine3A::from_translation(Vec3::Y * radius));
        mesh
    };
    let mut pane = primitives::cuboid(Vec3::new(0.26, 0.2, 0.008));
    pane.transform(&Affine3A::from_rotation_translation(Quat::from_rotation_y(0.3), Vec3::Y * 0.1));
    let clay = Material::diffuse(Vec3::new(0.72, 0.34, 0.22));
    let white = Material::diffuse(Vec3::splat(0.75));
    let silver = Material::metal(Vec3::splat(0.95), 0.0);
    let bottle_glass = Material { base_color: Vec3::new(0.6, 0.95, 0.75), ..Material::glass(1.5, 0.0) };
    let mut cases = vec![
        (
            "occlusion",
            [-24.0, -32.0, 36.0],
            vec![
                on_table("figure", known("figure", 1.5), clay.clone(), -0.60, -0.29),
                on_table("knot", known("knot", 1.0), white.clone(), 0.44, -0.02),
            ],
        ),
        (
            "reflection",
            [-10.0, -36.0, 30.0],
            vec![
                on_table("ball", ball(0.12), silver.clone(), 0.20, -0.10),
                on_table("figure", known("figure", 1.0), clay.clone(), 0.40, 0.10),
            ],
        ),
        (
            GLOSSY,
            [-16.0, -36.0, 30.0],
            vec![
                on_table("ball", ball(0.10), clay.clone(), 0.26, -0.06),
                on_table("figure", known("figure", 1.2), white.clone(), -0.12, -0.06),
            ],
        ),
        (
            "recursion",
            [-22.0, -38.0, 28.0],
            vec![
                on_table("left", ball(0.10), silver.clone(), -0.12, 0.05),
                on_table("right", ball(0.10), Material::metal(Vec3::new(1.0, 0.78, 0.34), 0.0), 0.12, 0.0),
                on_table("small", ball(0.04), clay.clone(), 0.02, 0.17),
            ],
        ),
        (
            "refraction",
            [-14.0, -36.0, 32.0],
            vec![
                on_table("ball", ball(0.10), Material::glass(1.5, 0.0), 0.36, 0.0),
                on_table("pane", pane, bottle_glass, -0.03, -0.08),
            ],
        ),
        (
            "soft shadows",
            [-22.0, -38.0, 28.0],
            vec![
                on_table("figure", known("figure", 1.4), white.clone(), -0.10, 0.08),
                on_table("knot", known("knot", 1.2), clay, 0.22, 0.08),
            ],
        ),
    ];
    if cfg!(feature = "markers") {
        let things = vec![
            on_table("figure", known("figure", 1.2), white.clone(), 0.30, 0.12),
            on_table("ball", ball(0.07), silver.clone(), -0.12, 0.10),
        ];
        cases.push((MARKED, [-16.0, -36.0, 32.0], things));
    }
    cases
}
