//! A panorama has no first column: rolled input gives rolled output.

use glam::{Affine3A, Quat, Vec3};
use pano_core::builtin::primitives;
use pano_core::image::{Image, RadianceImage};
use pano_core::material::Material;
use pano_tests::rooms::{Cuboid, Room, captured};
use pano_tests::scenes::{Lamp, TestScene, panorama_view, placed, prepared, sky};
use pano_tests::statistics::{Estimate, sidak_bound};
use pano_trace::objects::{Objects, Placement};
use pano_trace::tracer::{Method, TraceParams};
use pano_trace::world::{Proxy, ProxyShape, ProxyWorld, RealWorld, Reflectance};
use std::f32::consts::TAU;
use std::sync::Arc;

const VIEW_WIDTH: usize = 64;
const BLOCK: usize = 8;
const REPETITIONS: u32 = 20;

/// The picture moved `columns` to the right; what leaves comes in on the left.
fn rolled<T: Copy>(image: &Image<T>, columns: usize) -> Image<T> {
    let (w, h) = image.size();
    Image::from_fn(w, h, |x, y| image.get((x + w - columns % w) % w, y))
}

/// Objects over the pole, across the seam, and beside them.
fn objects() -> Objects {
    let ball = prepared(primitives::icosphere(0.3, 3));
    let at = |x, y, z| Affine3A::from_translation(Vec3::new(x, y, z));
    let placements: Vec<Placement> = vec![
        placed(&ball, at(0.0, -0.9, 0.0), Material::diffuse(Vec3::new(0.8, 0.4, 0.3))),
        placed(&ball, at(0.0, -0.5, 1.2), Material::metal(Vec3::new(0.9, 0.8, 0.6), 0.6)),
        placed(&ball, at(0.9, 0.8, -0.5), Material::default()),
    ];
    Objects::new(&placements)
}

/// Block means of object and delta, output rolled back by `shift` blocks.
fn blocks<W: RealWorld>(scene: &TestScene<W>, method: Method, shift: usize, first_seed: u32) -> Vec<Estimate> {
    let params = TraceParams { method, samples: 4, bounces: 2, ..TraceParams::default() };
    let (columns, rows) = (VIEW_WIDTH / BLOCK, VIEW_WIDTH / 2 / BLOCK);
    let mut values = vec![Vec::new(); 2 * columns * rows];
    for seed in 0..REPETITIONS {
        let layers = scene.trace(&params, first_seed + seed).layers;
        for (layer, image) in [&layers.object, &layers.delta].into_iter().enumerate() {
            for b in 0..columns * rows {
                let (column, row) = ((b % columns + shift) % columns, b / columns);
                let mean = (0..BLOCK * BLOCK)
                    .map(|i| f64::from(image.get(column * BLOCK + i % BLOCK, row * BLOCK + i / BLOCK).element_sum()))
                    .sum::<f64>();
                values[layer * columns * rows + b].push(mean / (BLOCK * BLOCK) as f64);
            }
        }
    }
    values.iter().map(|v| Estimate::of(v)).collect()
}

/// Renders the world of the picture as it is and rolled by three of eight blocks and by half, which puts the seam elsewhere.
fn roll<W: RealWorld>(slack: f64, methods: &[Method], world: impl Fn(usize, Quat) -> W) {
    for &method in methods {
        let scene = |shift: usize| {
            // Turned against the roll, the picture shows the same world.
            let turn = Quat::from_rotation_y(shift as f32 / 8.0 * TAU);
            let mut camera = panorama_view(Vec3::ZERO, VIEW_WIDTH);
            camera.world_from_camera = turn;
            TestScene { world: world(shift, turn), objects: objects(), camera }
        };
        let straight = blocks(&scene(0), method, 0, 0);
        // Objects cover a quarter of the blocks, delta is found in another; image-based lighting has no delta.
        assert!(straight.iter().filter(|e| e.mean != 0.0).count() > straight.len() / 6);
        for shift in [3, 4] {
            let other = blocks(&scene(shift), method, shift, 1000);
            // Student's t of 38 degrees of freedom is a seventh wider out there.
            let bound = 1.15 * sidak_bound(straight.len(), 1e-3);
            for (b, (a, o)) in straight.iter().zip(&other).enumerate() {
                let apart = (a.mean - o.mean).abs();
                assert!(
                    apart <= bound * a.error.hypot(o.error) + slack * a.mean.abs() + 1e-6,
                    "{method:?}, rolled by {shift}/8, block {b}: {a:?} {o:?}"
                );
            }
        }
    }
}

#[test]
fn rolled_environments_give_rolled_pictures() {
    let lamp = Lamp { direction: Vec3::new(0.1, 0.5, 1.0).normalize(), cos_radius: 0.97, radiance: Vec3::new(8.0, 7.0, 5.0) };
    let picture = sky(64, Vec3::new(0.3, 0.2, 0.2), Vec3::new(0.3, 0.5, 0.9), &[lamp]);
    let floor = Proxy {
        shape: ProxyShape::Plane(glam::Vec2::splat(5.0)),
        world_from_local: Affine3A::from_translation(Vec3::NEG_Y * 1.25),
        reflectance: Reflectance::Known(Vec3::splat(0.6)),
    };
    roll(1e-3, &[Method::Dpt, Method::OnePass, Method::TwoPass, Method::Ibl], |shift, turn| {
        let picture: RadianceImage = rolled(&picture, shift * 64 / 8);
        ProxyWorld::new(Arc::new(picture), turn, Vec3::ZERO, std::slice::from_ref(&floor))
    });
}

#[test]
fn rolled_captures_give_rolled_pictures() {
    let room = Room {
        walls: Cuboid { lo: Vec3::new(-2.0, -1.25, -1.8), hi: Vec3::new(2.2, 1.3, 2.1) },
        table: Some(Cuboid { lo: Vec3::new(-1.6, -1.25, 0.9), hi: Vec3::new(-0.8, -0.7, 1.6) }),
        window: Some((glam::Vec2::new(-0.8, -0.4), glam::Vec2::new(0.8, 0.6))),
        colors: [Vec3::new(0.3, 0.3, 0.4), Vec3::new(0.7, 0.6, 0.5)],
        lights: [Vec3::new(2.0, 3.0, 4.0), Vec3::splat(6.0)],
    };
    let (radiance, depth) = (room.radiance(256), room.depth(256));
    // The cube on which the depth is kept turns with the picture: quarter turns leave it as it is, an eighth does not.
    roll(0.02, &[Method::Dpt, Method::OnePass], |shift, turn| {
        let columns = shift * 256 / 8;
        captured(&rolled(&radiance, columns), &rolled(&depth, columns), turn, Vec3::ZERO)
    });
}
