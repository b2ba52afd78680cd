//! Closed forms for the change of a plane. What the estimators must agree on is tested across crates, in `tests/`.

use super::*;
use crate::bvh::Ray;
use crate::objects::{Objects, Placement, PreparedMesh};
use crate::world::{CapturedOptions, CapturedWorld, Proxy, ProxyShape, ProxyWorld, Reflectance};
use glam::{Affine3A, Quat, UVec2, Vec2, Vec3};
use pano_core::builtin::primitives;
use pano_core::camera::{Camera, Projection, rotation_from_yaw_pitch};
use pano_core::image::{Image, RadianceImage};
use pano_core::material::Material;
use pano_core::progress::{Progress, Silent};
use pano_core::random::{Sampler, Stream};
use std::sync::Arc;

const ALBEDO: Vec3 = Vec3::new(0.8, 0.5, 0.2);
const DIFFERENTIAL: [Method; 3] = [Method::Dpt, Method::OnePass, Method::TwoPass];
const ALL_MIS: [Mis; 3] = [Mis::Balance, Mis::LightOnly, Mis::BsdfOnly];

/// The plane y = 0 under `environment`.
fn plane_under(environment: RadianceImage) -> ProxyWorld {
    let plane = Proxy {
        shape: ProxyShape::Plane(Vec2::splat(20.0)),
        world_from_local: Affine3A::IDENTITY,
        reflectance: Reflectance::Known(ALBEDO),
    };
    ProxyWorld::new(Arc::new(environment), Quat::from_rotation_y(0.4), Vec3::Y, &[plane])
}

fn balls(places: &[(Vec3, f32)], material: &Material) -> Objects {
    let mesh = Arc::new(PreparedMesh::new(primitives::icosphere(1.0, 5)).unwrap());
    let placements: Vec<Placement> = places
        .iter()
        .map(|&(center, radius)| Placement {
            mesh: mesh.clone(),
            world_from_mesh: Affine3A::from_scale_rotation_translation(Vec3::splat(radius), Quat::IDENTITY, center),
            material: Some(material.clone()),
        })
        .collect();
    Objects::new(&placements)
}

/// Sixteen by sixteen pixels of the plane around (x, z), 1 mm wide in all, seen from above.
fn patch(x: f32, z: f32) -> Camera {
    Camera {
        position: Vec3::new(x, 0.05, z),
        world_from_camera: rotation_from_yaw_pitch(0.0, -90.0),
        projection: Projection::Perspective { vfov: 0.02 },
        width: 16,
        height: 16,
    }
}

/// Mean over the pixels of delta, and its standard error.
fn mean_delta(objects: &Objects, world: &ProxyWorld, camera: &Camera, params: &TraceParams) -> (Vec3, Vec3) {
    let traced = render(&Frame { camera, objects, stream: Stream::default() }, world, params, &Silent).unwrap();
    assert_eq!(traced.discarded, 0);
    let delta = traced.layers.delta.data();
    let n = delta.len() as f32;
    let mean = delta.iter().sum::<Vec3>() / n;
    let variance = delta.iter().map(|d| (d - mean) * (d - mean)).sum::<Vec3>() / (n - 1.0);
    (mean, (variance / n).map(f32::sqrt))
}

/// Share of the irradiance under a uniform sky that comes from where a ball wholly above the horizon is: cos·r²/d².
fn form_factor((center, radius): (Vec3, f32), x: f32, z: f32) -> f32 {
    let to = center - Vec3::new(x, 0.0, z);
    to.y / to.length() * radius * radius / to.length_squared()
}

/// A ball that emits E instead of letting through the sky's L changes the plane by ρ·F·(E − L); one that reflects gives
/// less away.
#[test]
fn balls_over_a_plane_change_it_by_their_form_factor() {
    // More balls than clusters, near and far, so that bounds of several balls overlap and balls lie inside other's cones.
    let many: Vec<(Vec3, f32)> = (0..12)
        .map(|i| {
            let angle = i as f32 * 0.524;
            (Vec3::new(angle.cos() * 1.5, 0.45 + 0.02 * i as f32, angle.sin() * 1.5), 0.3)
        })
        .collect();
    let one = [(Vec3::new(0.0, 0.8, 0.0), 0.5)];
    let sky = Vec3::new(0.5, 1.0, 1.5);
    let world = plane_under(RadianceImage::filled(8, 4, sky));
    for (places, x, z) in [(&one[..], 0.0, 0.0), (&one, 1.0, 0.3), (&many, 0.0, 0.0), (&one, 9.0, 0.0)] {
        for emission in [Vec3::ZERO, Vec3::new(3.0, 4.0, 0.2)] {
            let objects = balls(places, &Material::emitter(emission));
            let factor: f32 = places.iter().map(|&b| form_factor(b, x, z)).sum();
            let expected = ALBEDO * (emission - sky) * factor;
            for method in DIFFERENTIAL {
                for (mis, everywhere) in ALL_MIS.into_iter().flat_map(|mis| [(mis, false), (mis, true)]) {
                    let params =
                        TraceParams { method, samples: 64, bounces: 1, mis, second_order: true, everywhere, error_target: None };
                    let (mean, error) = mean_delta(&objects, &world, &patch(x, z), &params);
                    // The meshes are inscribed: less than 0.1 % smaller in outline than their balls. Channels scale alike.
                    if (method, mis, everywhere) == (Method::Dpt, Mis::Balance, false) {
                        // Small changes take fewer samples, so that all leave about the same noise beside the light there is.
                        let most = (0.02 * expected.y.abs()).max(0.004 * ALBEDO.y * sky.y);
                        assert!(error.y < most, "{mean} ± {error} tells too little of {expected}");
                    }
                    let apart = (mean - expected).abs() - 4.0 * error - 0.001 * expected.abs();
                    assert!(
                        apart.max_element() <= 2e-6,
                        "{method:?}, {mis:?}, everywhere {everywhere}, {} balls from ({x}, {z}), emission {emission}: {mean} ± {error}, expected {expected}",
                        places.len()
                    );
                }
            }
        }
    }
}

/// In a sky that is black but for a sun behind the ball the shadow takes all its light away, and only there.
#[test]
fn a_sun_behind_a_ball_leaves_an_umbra() {
    let sun = Vec3::new(0.3, 1.0, -0.2).normalize();
    let (w, h) = (256, 128);
    let sky = RadianceImage::from_fn(w, h, |x, y| {
        let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
        let d = Quat::from_rotation_y(0.4) * pano_core::sphere::direction_from_uv(uv);
        if d.dot(sun) > 0.9986 { Vec3::splat(1000.0) } else { Vec3::ZERO }
    });
    let irradiance: f64 = (0..h)
        .flat_map(|y| (0..w).map(move |x| (x, y)))
        .map(|(x, y)| {
            let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
            let up = pano_core::sphere::direction_from_uv(uv).y.max(0.0);
            f64::from(sky.get(x, y).x * up) * pano_core::sphere::pixel_solid_angle(w, h, y)
        })
        .sum();
    let world = plane_under(sky);
    let center = Vec3::new(0.0, 1.0, 0.0);
    let objects = balls(&[(center, 0.4)], &Material::diffuse(Vec3::ZERO));
    let umbra = center - sun * (center.y / sun.y);
    let expected = -ALBEDO * irradiance as f32 / std::f32::consts::PI;
    for mis in [Mis::Balance, Mis::LightOnly] {
        for method in DIFFERENTIAL {
            let params = TraceParams { method, samples: 64, bounces: 1, mis, ..TraceParams::default() };
            let (mean, error) = mean_delta(&objects, &world, &patch(umbra.x, umbra.z), &params);
            // Sums over texels and over interpolated texels differ by what sin θ varies within a texel.
            let apart = (mean - expected).abs() - 0.01 * expected.abs() - 4.0 * error;
            assert!(apart.max_element() <= 0.0, "{method:?}, {mis:?}: {mean} ± {error}, expected {expected}");
            let (lit, error) = mean_delta(&objects, &world, &patch(umbra.x + 1.5, umbra.z), &params);
            // Two-pass has noise where nothing changes; the others have none.
            assert!(lit.abs().cmple(4.0 * error).all(), "{method:?}, {mis:?}: {lit} ± {error}");
        }
    }
}

/// Which strategies find the light is a matter of noise only.
#[test]
fn strategies_agree() {
    let sky = RadianceImage::from_fn(32, 16, |x, y| Vec3::new(0.2, 0.4, 0.6) + if x == 9 && y == 4 { 20.0 } else { 0.0 });
    let world = plane_under(sky);
    for material in [Material::diffuse(Vec3::new(0.7, 0.8, 0.9)), Material { roughness: 0.6, ..Material::default() }] {
        let objects = balls(&[(Vec3::new(0.0, 0.55, 0.0), 0.5), (Vec3::new(0.9, 0.4, 0.3), 0.35)], &material);
        for method in DIFFERENTIAL {
            let [a, b, c] = ALL_MIS.map(|mis| {
                let params = TraceParams { method, samples: 256, bounces: 3, mis, ..TraceParams::default() };
                mean_delta(&objects, &world, &patch(0.4, 0.7), &params)
            });
            for other in [b, c] {
                let (apart, error2) = ((a.0 - other.0).abs(), a.1 * a.1 + other.1 * other.1);
                assert!((apart * apart).cmplt(16.0 * error2).all(), "{method:?}: {a:?} {b:?} {c:?}");
            }
        }
    }
}

/// Points that cannot see an object change by exactly nothing, and cost nothing.
#[test]
fn dpt_leaves_alone_what_no_object_can_change() {
    let world = plane_under(RadianceImage::filled(8, 4, Vec3::ONE));
    // Below the plane, as seen from its upper side.
    let objects = balls(&[(Vec3::new(0.0, -0.8, 0.0), 0.5)], &Material::default());
    let params = TraceParams { samples: 16, ..TraceParams::default() };
    let frame = Frame { camera: &patch(0.0, 0.0), objects: &objects, stream: Stream::default() };
    let traced = render(&frame, &world, &params, &Silent).unwrap();
    assert!(traced.layers.delta.data().iter().all(|d| *d == Vec3::ZERO));
    assert!(traced.rays <= 16 * 256, "{} rays for 16 samples of 256 pixels", traced.rays);
}

#[test]
fn image_based_lighting_changes_nothing_real() {
    let world = plane_under(RadianceImage::filled(8, 4, Vec3::ONE));
    let objects = balls(&[(Vec3::new(0.0, 0.8, 0.0), 0.5)], &Material::default());
    let params = TraceParams { method: Method::Ibl, samples: 4, ..TraceParams::default() };
    assert_eq!(mean_delta(&objects, &world, &patch(0.0, 0.0), &params).0, Vec3::ZERO);
}

#[test]
fn a_cancelled_render_gives_nothing() {
    struct Cancel;
    impl Progress for Cancel {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let world = plane_under(RadianceImage::filled(8, 4, Vec3::ONE));
    let objects = balls(&[(Vec3::Y, 0.5)], &Material::default());
    let frame = Frame { camera: &patch(0.0, 0.0), objects: &objects, stream: Stream::default() };
    assert!(render(&frame, &world, &TraceParams::default(), &Cancel).is_none());
}

/// A captured box, 2 m to each side, 1.5 m below and above the capture point, whose floor sends out `floor` and all else `rest`.
fn captured_box(floor: f32, rest: f32) -> CapturedWorld {
    captured_box_of(|at| if at.y < -1.499 { floor } else { rest })
}

/// The same, with the radiance told by the place.
fn captured_box_of(radiance: impl Fn(Vec3) -> f32 + Sync) -> CapturedWorld {
    let (w, h) = (256, 128);
    let half = Vec3::new(2.0, 1.5, 2.0);
    let direction = |x: usize, y: usize| {
        pano_core::sphere::direction_from_uv(Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32))
    };
    let distance = |d: Vec3| (half / d.abs()).min_element();
    let depth = Image::from_fn(w, h, |x, y| distance(direction(x, y)));
    let radiance = RadianceImage::from_fn(w, h, |x, y| {
        let d = direction(x, y);
        Vec3::splat(radiance(d * distance(d)))
    });
    let options = CapturedOptions { irradiance_width: 128, irradiance_samples: 64, ..CapturedOptions::default() };
    CapturedWorld::new(Arc::new(radiance), &depth, Quat::IDENTITY, Vec3::ZERO, &[], &options, &Silent).unwrap()
}

/// A floor brighter than the room can light it mirrors the room, up to what the room shows: there a black ball takes away just
/// the light beyond diffuse, in the mirror's direction only. A floor brighter than the room is a lamp.
#[test]
fn bright_floors_mirror_objects_and_lamps_do_not() {
    // Halfway up to the ceiling's point that the floor mirrors towards the capture point.
    let seen = Vec3::new(0.4, -1.5, 0.3);
    let objects = balls(&[(Vec3::new(0.8, 0.0, 0.6), 0.2)], &Material::diffuse(Vec3::ZERO));
    let params = TraceParams::default();
    for (floor, rest, mirrors) in [(1.4, 1.5, true), (4.0, 1.5, false), (0.5, 1.5, false)] {
        let world = captured_box(floor, rest);
        let tracer = Tracer { objects: &objects, world: &world, params: &params };
        let change = |at: Vec3| {
            let mut walk = Walk { sampler: Sampler::new(UVec2::ZERO, 0, Stream::default()), rays: 0 };
            let ray = Ray::new(Vec3::ZERO, at.normalize());
            let hit = world.hit(&ray).unwrap();
            (tracer.mirror_change(&hit, ray.direction, 3, &mut walk), world.beyond_diffuse(&hit).x)
        };
        let ((inside, beyond), (outside, _)) = (change(seen), change(Vec3::new(-0.4, -1.5, 0.3)));
        let expected = if mirrors { -beyond } else { 0.0 };
        assert!((inside - expected).abs().max_element() < 1e-4, "floor {floor}: {inside} for {expected}");
        assert!(!mirrors || beyond > 0.02, "floor {floor}: {beyond}");
        assert_eq!(outside, Vec3::ZERO);
    }
}

/// An object sees another part of the room in a floor that mirrors than the panorama has seen, at most twice as bright; in the
/// panorama's own view nothing changes, and a lamp looks the same from everywhere.
#[test]
fn objects_see_the_mirror_image_that_shows_from_where_they_are() {
    let (at, other) = (Vec3::new(0.4, -1.5, 0.3), Vec3::new(-1.2, 1.5, -0.9));
    for (floor, patch, mirrors) in [(1.4, 0.1, true), (1.4, 2.0, true), (1.4, 5.0, true), (4.0, 0.1, false)] {
        let world = captured_box_of(|p| match p {
            p if p.y < -1.499 => floor,
            p if p.distance(other) < 0.3 => patch,
            _ => 1.5,
        });
        let hit = world.hit(&Ray::new(Vec3::ZERO, at.normalize())).unwrap();
        let beyond = world.beyond_diffuse(&hit).x;
        let sent = |direction: Vec3| world.sent_back(&hit, direction.normalize()).unwrap().x;
        assert!(!mirrors || beyond > 0.02, "{beyond}");
        assert!((sent(at) - floor).abs() < 0.01 * floor, "{} for {floor}", sent(at));
        let toward_patch = sent((other - at) * Vec3::new(1.0, -1.0, 1.0));
        let expected = if mirrors { floor - beyond + beyond * (patch / 1.5_f32).min(2.0) } else { floor };
        assert!((toward_patch - expected).abs() < 0.1 * beyond, "{toward_patch} for {expected}, beyond {beyond}");
    }
}
