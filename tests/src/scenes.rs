//! Scenes made in code for tests and benchmarks.

use crate::random::Random;
use crate::rooms::{Cuboid, Room, captured, texel_direction};
use glam::{Affine3A, Quat, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::image::RadianceImage;
use pano_core::material::Material;
use pano_core::mesh::Mesh;
use pano_core::progress::Silent;
use pano_core::sphere::resample::view_from_panorama;
use pano_light::{WorkingMap, detect, ibl};
use pano_trace::mr360::Lighting;
use pano_trace::objects::{Objects, Placement, PreparedMesh};
use pano_trace::rt2ar;
use pano_trace::tracer::{self, Frame, TraceParams, Traced};
use pano_trace::world::{CapturedOptions, CapturedWorld, Proxy, ProxyShape, ProxyWorld, RealWorld, Reflectance};
use std::sync::Arc;

/// A world, what is put into it, and who looks.
#[derive(Clone, Debug)]
pub struct TestScene<W> {
    /// The real world.
    pub world: W,
    /// The virtual objects.
    pub objects: Objects,
    /// The view.
    pub camera: Camera,
}

impl<W: RealWorld> TestScene<W> {
    /// Traces the frame with that seed.
    pub fn trace(&self, params: &TraceParams, seed: u32) -> Traced {
        let stream = pano_core::random::Stream { frame: 0, seed };
        let frame = Frame { camera: &self.camera, objects: &self.objects, stream };
        tracer::render(&frame, &self.world, params, &pano_core::progress::Silent).expect("nobody cancels")
    }
}

/// `mesh`, ready for rays.
///
/// # Panics
/// If the mesh is not valid.
pub fn prepared(mesh: Mesh) -> Arc<PreparedMesh> {
    Arc::new(PreparedMesh::new(mesh).expect("a valid mesh"))
}

/// One object of `mesh` and `material`.
pub fn placed(mesh: &Arc<PreparedMesh>, place: Affine3A, material: Material) -> Placement {
    Placement { mesh: mesh.clone(), world_from_mesh: place, material: Some(material) }
}

/// A perspective view from `position` towards `target`, `vfov` in degrees.
pub fn view(position: Vec3, target: Vec3, vfov: f32, width: usize, height: usize) -> Camera {
    let to = (target - position).normalize();
    let (yaw, pitch) = (to.x.atan2(-to.z).to_degrees(), to.y.clamp(-1.0, 1.0).asin().to_degrees());
    Camera {
        position,
        world_from_camera: rotation_from_yaw_pitch(yaw, pitch),
        projection: Projection::Perspective { vfov: vfov.to_radians() },
        width,
        height,
    }
}

/// The whole sphere around `position`.
pub fn panorama_view(position: Vec3, width: usize) -> Camera {
    Camera { position, world_from_camera: Quat::IDENTITY, projection: Projection::Panorama, width, height: width / 2 }
}

/// A lamp in an environment: where, how large (cosine of its angular radius), how bright.
#[derive(Clone, Copy, Debug)]
pub struct Lamp {
    /// Unit direction towards it.
    pub direction: Vec3,
    /// Cosine of its angular radius.
    pub cos_radius: f32,
    /// Its radiance.
    pub radiance: Vec3,
}

/// An environment of colours that change smoothly from below to above, with lamps.
pub fn sky(width: usize, below: Vec3, above: Vec3, lamps: &[Lamp]) -> RadianceImage {
    let height = width / 2;
    RadianceImage::from_fn(width, height, |x, y| {
        let d = texel_direction(width, height, x, y);
        let base = below.lerp(above, 0.5 + 0.5 * d.y);
        lamps.iter().filter(|l| l.direction.dot(d) > l.cos_radius).fold(base, |sum, l| sum + l.radiance)
    })
}

/// A material without a sharp lobe, so that no sample stands out.
fn rough_material(random: &mut Random) -> Material {
    match random.below(5) {
        0 => Material::diffuse(random.color(0.2, 0.95)),
        1 => Material { base_color: random.color(0.2, 0.9), roughness: random.between(0.5, 1.0), ..Material::default() },
        2 => Material::metal(random.color(0.4, 0.95), random.between(0.55, 1.0)),
        3 => Material { emissive: random.color(0.0, 1.5), ..Material::diffuse(random.color(0.1, 0.8)) },
        _ => Material { base_color: random.color(0.6, 1.0), ..Material::glass(random.between(1.2, 1.7), 0.6) },
    }
}

/// Rectangles and meshes that see one another, one to three objects among them, an HDR environment with a sun, all random.
pub fn random_proxies(seed: u32) -> TestScene<ProxyWorld> {
    let mut random = Random::new(seed);
    let mut proxies = vec![Proxy {
        shape: ProxyShape::Plane(Vec2::new(random.between(4.0, 8.0), random.between(4.0, 8.0))),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(random.color(0.1, 0.9)),
    }];
    for _ in 0..1 + random.below(3) {
        let place = random.rotation();
        let at = Vec3::new(random.between(-1.5, 1.5), random.between(0.3, 1.6), random.between(-2.0, 0.3));
        let shape = match random.below(3) {
            0 => ProxyShape::Mesh(prepared(primitives::icosphere(random.between(0.2, 0.5), 2))),
            1 => ProxyShape::Mesh(prepared(primitives::cuboid(random.color(0.2, 1.0)))),
            _ => ProxyShape::Plane(Vec2::new(random.between(0.5, 3.0), random.between(0.5, 3.0))),
        };
        proxies.push(Proxy {
            shape,
            world_from_local: Affine3A::from_rotation_translation(place, at),
            reflectance: Reflectance::Known(random.color(0.1, 0.9)),
        });
    }
    let sun = {
        let d = random.direction();
        Lamp {
            direction: Vec3::new(d.x, 0.3 + d.y.abs(), d.z).normalize(),
            cos_radius: random.between(5.0, 15.0).to_radians().cos(),
            radiance: random.color(10.0, 40.0),
        }
    };
    let environment = sky(64, random.color(0.0, 0.5), random.color(0.1, 1.0), &[sun]);
    let placements: Vec<Placement> = (0..1 + random.below(3))
        .map(|_| {
            let mesh = match random.below(3) {
                0 => primitives::icosphere(1.0, 3),
                1 => primitives::cuboid(Vec3::new(1.5, 1.0, 1.2)),
                _ => primitives::torus(0.8, 0.3, 24, 12),
            };
            let at = Vec3::new(random.between(-1.0, 1.0), random.between(0.1, 0.9), random.between(-1.2, 0.8));
            let place = Affine3A::from_scale_rotation_translation(Vec3::splat(random.between(0.2, 0.5)), random.rotation(), at);
            placed(&prepared(mesh), place, rough_material(&mut random))
        })
        .collect();
    let camera = view(
        Vec3::new(random.between(-1.5, 1.5), random.between(1.5, 2.5), random.between(2.5, 3.5)),
        Vec3::new(0.0, 0.3, -0.1),
        random.between(30.0, 40.0),
        32,
        24,
    );
    let world = ProxyWorld::new(Arc::new(environment), random.rotation(), Vec3::Y, &proxies);
    TestScene { world, objects: Objects::new(&placements), camera }
}

/// A captured room with a table, a window and a lamp, and one to three objects in it, all random.
pub fn random_room(seed: u32) -> TestScene<CapturedWorld> {
    let mut random = Random::new(seed);
    let walls = Cuboid {
        lo: Vec3::new(random.between(-3.0, -2.0), -1.5, random.between(-3.0, -2.2)),
        hi: Vec3::new(random.between(2.0, 3.0), random.between(1.0, 1.5), random.between(2.0, 3.0)),
    };
    let table = Cuboid { lo: Vec3::new(-0.9, -1.5, -2.0), hi: Vec3::new(0.2, random.between(-1.0, -0.6), -1.2) };
    let room = Room {
        walls,
        table: Some(table),
        window: Some((Vec2::new(-0.5, -0.4), Vec2::new(1.2, 0.6))),
        colors: [random.color(0.2, 0.8), random.color(0.2, 0.8)],
        lights: [random.color(2.0, 6.0), random.color(5.0, 15.0)],
    };
    let turn = Quat::from_rotation_y(random.between(0.0, 6.0));
    let capture = Vec3::new(0.4, 1.5, -0.2);
    let placements: Vec<Placement> = (0..1 + random.below(3))
        .map(|_| {
            let at = Vec3::new(random.between(-1.0, 1.0), random.between(-1.3, -0.7), random.between(-1.1, -0.4));
            let place =
                Affine3A::from_scale_rotation_translation(Vec3::splat(random.between(0.2, 0.35)), turn, capture + turn * at);
            let mesh = if random.below(2) == 0 { primitives::icosphere(1.0, 3) } else { primitives::cuboid(Vec3::ONE) };
            placed(&prepared(mesh), place, rough_material(&mut random))
        })
        .collect();
    let world = captured(&room.radiance(256), &room.depth(256), turn, capture);
    let camera = view(capture, capture + turn * Vec3::new(0.0, -1.1, -1.0), 75.0, 32, 24);
    TestScene { world, objects: Objects::new(&placements), camera }
}

/// A diffuse plane with three objects on it under an HDR environment with two bright windows, after the plane scenes of the
/// DPT paper. The objects cover an eighth of the view, as there.
pub fn plane_with_two_windows(width: usize, height: usize) -> TestScene<ProxyWorld> {
    let window = |azimuth: f32, radiance: Vec3| Lamp {
        direction: Vec3::new(azimuth.sin(), 0.7, -azimuth.cos()).normalize(),
        cos_radius: 12.0f32.to_radians().cos(),
        radiance,
    };
    let lamps = [window(0.8, Vec3::new(30.0, 28.0, 24.0)), window(-2.0, Vec3::new(12.0, 14.0, 18.0))];
    let environment = sky(512, Vec3::new(0.15, 0.12, 0.1), Vec3::new(0.35, 0.4, 0.5), &lamps);
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(12.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(Vec3::splat(0.5)),
    };
    let at = |x, y, z| Affine3A::from_translation(Vec3::new(x, y, z));
    let placements = [
        placed(&prepared(primitives::icosphere(0.5, 5)), at(-0.7, 0.5, 0.1), Material::diffuse(Vec3::new(0.8, 0.5, 0.4))),
        placed(
            &prepared(primitives::torus_knot(2, 3, 0.35, 0.1, 400, 25)),
            at(0.6, 0.4, 0.3),
            Material::metal(Vec3::new(0.9, 0.8, 0.6), 0.3),
        ),
        placed(&prepared(primitives::rounded_box(Vec3::splat(0.7), 0.05, 3)), at(0.1, 0.35, -0.9), Material::default()),
    ];
    let world = ProxyWorld::new(Arc::new(environment), Quat::IDENTITY, Vec3::Y, std::slice::from_ref(&plane));
    let camera = view(Vec3::new(0.0, 2.6, 3.6), Vec3::new(0.0, 0.0, 0.0), 45.0, width, height);
    TestScene { world, objects: Objects::new(&placements), camera }
}

/// A scene of rt2ar: what lights it, and what the view shows without the objects.
#[derive(Clone, Debug)]
pub struct LitScene<W> {
    /// The world, the objects, the view.
    pub scene: TestScene<W>,
    /// Lights detected in the panorama, and maps of what is left.
    pub lighting: Lighting,
    /// The photo.
    pub photo: RadianceImage,
}

impl<W: RealWorld> LitScene<W> {
    /// What a panorama taken at `capture`, upright and looking to −Z, shows of the world and lights it with.
    fn new(scene: TestScene<W>, panorama: &RadianceImage, capture: Vec3) -> Self {
        let map = WorkingMap::from_hdr(panorama);
        let detection = detect::detect(&map, &detect::Params::default());
        let maps = ibl::radiance_maps(&detection.clamped(&map));
        let lighting = Lighting { maps, lights: detection.lights, pano_from_world: Quat::IDENTITY, capture };
        let mut photo = RadianceImage::filled(scene.camera.width, scene.camera.height, Vec3::ZERO);
        view_from_panorama(panorama, Quat::IDENTITY, &scene.camera, &mut photo).expect("the photo has the view's size");
        Self { scene, lighting, photo }
    }

    /// Traces the frame by rt2ar.
    pub fn trace(&self, change: impl Fn(&mut rt2ar::Params<'_>)) -> rt2ar::Rendered {
        let mut params = rt2ar::Params::new(&self.photo);
        change(&mut params);
        let TestScene { world, objects, camera } = &self.scene;
        let frame = Frame { camera, objects, stream: pano_core::random::Stream::default() };
        let lights = rt2ar::place_lights(world, &self.lighting);
        rt2ar::render(&frame, world, &self.lighting, &lights, &params, &pano_core::progress::Silent).expect("nobody cancels")
    }
}

/// `objects` on the table of a captured room under a lamp of 4° radius on its ceiling; the table's middle is at (0, 0.7, −1.2).
pub fn table_under_a_lamp(objects: &[Placement], width: usize, height: usize) -> LitScene<CapturedWorld> {
    let capture = Vec3::new(0.0, 1.5, 0.0);
    let room = Room {
        walls: Cuboid { lo: Vec3::new(-2.5, -1.5, -3.5), hi: Vec3::new(2.5, 2.0, 2.5) },
        table: Some(Cuboid { lo: Vec3::new(-0.8, -0.85, -1.7), hi: Vec3::new(0.8, -0.8, -0.7) }),
        window: None,
        colors: [Vec3::splat(0.2), Vec3::splat(0.6)],
        lights: [Vec3::ZERO, Vec3::splat(0.6)],
    };
    let direction = Vec3::new(0.25, 1.0, -0.5).normalize();
    let lamp = Lamp { direction, cos_radius: 4f32.to_radians().cos(), radiance: Vec3::splat(200.0) };
    let width_of_panorama = 1024;
    let (mut radiance, depth) = (room.radiance(width_of_panorama), room.depth(width_of_panorama));
    let lit = sky(width_of_panorama, Vec3::ZERO, Vec3::ZERO, &[lamp]);
    radiance.data_mut().iter_mut().zip(lit.data()).for_each(|(p, lamp)| *p += *lamp);
    // Rays of rt2ar see what the panorama shows: no reflectance is asked for.
    let options = CapturedOptions { irradiance_width: 0, ..CapturedOptions::default() };
    let world = CapturedWorld::new(Arc::new(radiance.clone()), &depth, Quat::IDENTITY, capture, &[], &options, &Silent);
    let camera = view(capture, Vec3::new(0.0, 0.75, -1.2), 45.0, width, height);
    let scene = TestScene { world: world.expect("nobody cancels"), objects: Objects::new(objects), camera };
    LitScene::new(scene, &radiance, capture)
}

/// Matt and reddish.
pub fn clay() -> Material {
    Material::diffuse(Vec3::new(0.72, 0.34, 0.22))
}

/// A teapot-sized knot of clay on that table, as in the paper's figure 12, of twice (along · around) triangles.
pub fn knot_on_a_table((along, around): (usize, usize), width: usize, height: usize) -> LitScene<CapturedWorld> {
    let knot = prepared(primitives::torus_knot(2, 3, 0.12, 0.035, along, around));
    let place = Affine3A::from_translation(Vec3::new(0.0, 0.87, -1.2));
    table_under_a_lamp(&[placed(&knot, place, clay())], width, height)
}

/// A knot, a teapot-sized figure of clay, a mirror ball and a glass ball on that table: a fifth of the view.
pub fn furnished_table(width: usize, height: usize) -> LitScene<CapturedWorld> {
    let at = |x: f32, y: f32, z: f32| Affine3A::from_translation(Vec3::new(x, 0.7 + y, -1.2 + z));
    let knot = primitives::torus_knot(2, 3, 0.12, 0.035, 300, 24);
    let ball = prepared(primitives::icosphere(0.09, 5));
    let figure = prepared(primitives::rounded_box(Vec3::new(0.18, 0.24, 0.18), 0.04, 6));
    let objects = [
        placed(&prepared(knot), at(0.05, 0.17, -0.05), Material::metal(Vec3::new(0.93, 0.66, 0.42), 0.3)),
        placed(&figure, at(-0.38, 0.12, 0.0), clay()),
        placed(&ball, at(0.38, 0.09, 0.12), Material::metal(Vec3::splat(0.95), 0.0)),
        placed(&ball, at(-0.12, 0.09, 0.25), Material::glass(1.5, 0.0)),
    ];
    table_under_a_lamp(&objects, width, height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plane_scene_shows_what_it_says() {
        let traced = plane_with_two_windows(64, 48).trace(&TraceParams { samples: 4, bounces: 1, ..TraceParams::default() }, 0);
        let n = 64.0 * 48.0;
        let covered = traced.layers.coverage.data().iter().sum::<f32>() / n;
        let real = traced.layers.normal.data().iter().filter(|m| **m != Vec3::ZERO).count() as f32 / n;
        assert!((0.08..0.17).contains(&covered) && real > 0.9, "objects {covered}, surfaces {real}");
        assert!(traced.layers.delta.data().iter().any(|d| d.y < -0.05));
    }
}
