//! The room itself: floor, walls, ceiling, window, door, skirting boards and curtains.

use super::build::Builder;
use super::textures::{paint, planks, rug, textured};
use super::{CEILING, DEPTH, WIDTH};
use crate::builtin::primitives::{cuboid, cylinder, plane, quad};
use crate::material::Material;
use crate::mesh::Mesh;
use glam::{Affine3A, Quat, Vec2, Vec3};

/// The sky's radiance: a bright, slightly blue overcast.
const SKY: Vec3 = Vec3::new(8.4, 9.6, 11.2);

/// The window's opening in the left wall: z from … to …, y from … to …; and the wall's thickness.
const WINDOW_Z: [f32; 2] = [-0.8, 1.0];
const WINDOW_Y: [f32; 2] = [0.85, 2.25];
const WALL: f32 = 0.15;

/// Adds the shell; returns the materials that are openings to the sky.
pub(super) fn add(b: &mut Builder) -> Vec<u32> {
    let floor = b.material(textured(planks(Vec2::new(WIDTH, DEPTH))));
    b.put(plane(Vec2::new(WIDTH, DEPTH)), floor, Vec3::ZERO);
    let rug = b.material(textured(rug(Vec2::new(2.7, 1.9))));
    b.put(cuboid(Vec3::new(2.7, 0.01, 1.9)), rug, Vec3::new(0.0, 0.005, 0.05));
    let (wall, accent, white) = (
        b.material(Material::diffuse(paint(0xd9_d0_c3))),
        b.material(Material::diffuse(paint(0x8f_a3_9a))),
        b.material(Material::diffuse(paint(0xea_e8_e2))),
    );
    let (x, z) = (0.5 * WIDTH, 0.5 * DEPTH);
    let up = Vec3::Y * CEILING;
    b.put(quad(Vec3::new(-x, CEILING, -z), Vec3::X * WIDTH, Vec3::Z * DEPTH), white, Vec3::ZERO);
    b.put(quad(Vec3::new(-x, 0.0, -z), Vec3::X * WIDTH, up), accent, Vec3::ZERO);
    b.put(quad(Vec3::new(x, 0.0, z), Vec3::NEG_X * WIDTH, up), wall, Vec3::ZERO);
    b.put(quad(Vec3::new(x, 0.0, -z), Vec3::Z * DEPTH, up), wall, Vec3::ZERO);
    let sky = window(b, wall, white);
    skirting(b, white);
    door(b, white);
    curtains(b);
    vec![sky]
}

fn window(b: &mut Builder, wall: u32, white: u32) -> u32 {
    let (x, z) = (-0.5 * WIDTH, 0.5 * DEPTH);
    let ([z0, z1], [y0, y1]) = (WINDOW_Z, WINDOW_Y);
    // The wall around the opening, facing +X; the strips share whole edges with the opening.
    for (from, to, low, high) in [(z, z1, 0.0, CEILING), (z0, -z, 0.0, CEILING), (z1, z0, 0.0, y0), (z1, z0, y1, CEILING)] {
        b.put(quad(Vec3::new(x, low, from), Vec3::Z * (to - from), Vec3::Y * (high - low)), wall, Vec3::ZERO);
    }
    let (deep, wide, high) = (Vec3::NEG_X * WALL, Vec3::Z * (z1 - z0), Vec3::Y * (y1 - y0));
    let corner = Vec3::new(x, y0, z0);
    for (corner, u, v) in [(corner, deep, wide), (corner + high, wide, deep), (corner, high, deep), (corner + wide, deep, high)] {
        b.put(quad(corner, u, v), white, Vec3::ZERO);
    }
    // The sky: it closes the opening's outer end, so every way out of the room meets it.
    let sky = b.material(Material::emitter(SKY));
    b.put(quad(corner + deep + wide, -wide, high), sky, Vec3::ZERO);
    let bar = |b: &mut Builder, z: [f32; 2], y: [f32; 2]| {
        b.block(Vec3::new(x - 0.12, y[0], z[0]), Vec3::new(x - 0.07, y[1], z[1]), 0.006, white, Affine3A::IDENTITY);
    };
    let (middle, transom) = (0.5 * (z0 + z1), y0 + 0.68 * (y1 - y0));
    bar(b, [z0, z0 + 0.06], [y0, y1]);
    bar(b, [z1 - 0.06, z1], [y0, y1]);
    bar(b, [z0, z1], [y0, y0 + 0.06]);
    bar(b, [z0, z1], [y1 - 0.06, y1]);
    bar(b, [middle - 0.035, middle + 0.035], [y0, y1]);
    bar(b, [z0, z1], [transom - 0.025, transom + 0.025]);
    b.block(Vec3::new(x - 0.06, y0, z0 - 0.06), Vec3::new(x + 0.12, y0 + 0.03, z1 + 0.06), 0.01, white, Affine3A::IDENTITY);
    sky
}

fn skirting(b: &mut Builder, white: u32) {
    let (x, z, thick) = (0.5 * WIDTH, 0.5 * DEPTH, 0.015);
    for (low, high) in [
        ([-x, -z], [x, -z + thick]),
        ([-x, -z], [-x + thick, z]),
        ([x - thick, -z], [x, z]),
        ([-x, z - thick], [-1.98, z]),
        ([-0.97, z - thick], [x, z]),
    ] {
        b.block(Vec3::new(low[0], 0.0, low[1]), Vec3::new(high[0], 0.09, high[1]), 0.004, white, Affine3A::IDENTITY);
    }
}

/// A panelled door in the wall behind the capture point.
fn door(b: &mut Builder, white: u32) {
    let z = 0.5 * DEPTH;
    let wood = b.material(Material { specular: 0.4, roughness: 0.5, ..Material::diffuse(paint(0x8a_5a_3a)) });
    let brass = b.material(Material::metal(Vec3::new(0.75, 0.58, 0.3), 0.35));
    let mut part = |x: [f32; 2], y: [f32; 2], thick: f32, material: u32| {
        b.block(Vec3::new(x[0], y[0], z - thick), Vec3::new(x[1], y[1], z), 0.006, material, Affine3A::IDENTITY);
    };
    part([-1.90, -1.05], [0.0, 2.02], 0.02, wood);
    for (x, y) in
        [([-1.78, -1.53], [0.2, 0.95]), ([-1.42, -1.17], [0.2, 0.95]), ([-1.78, -1.53], [1.1, 1.9]), ([-1.42, -1.17], [1.1, 1.9])]
    {
        part(x, y, 0.03, wood);
    }
    part([-1.98, -1.90], [0.0, 2.1], 0.035, white);
    part([-1.05, -0.97], [0.0, 2.1], 0.035, white);
    part([-1.90, -1.05], [2.02, 2.1], 0.035, white);
    b.block(Vec3::new(-1.84, 1.0, z - 0.075), Vec3::new(-1.73, 1.02, z - 0.055), 0.008, brass, Affine3A::IDENTITY);
    b.block(Vec3::new(-1.85, 1.0, z - 0.075), Vec3::new(-1.83, 1.02, z - 0.01), 0.008, brass, Affine3A::IDENTITY);
}

/// A hanging cloth with folds: `width` along Z, `height` along Y, both from the origin; closed, 4 mm thick.
fn cloth(width: f32, height: f32, folds: f32) -> Mesh {
    const STEPS: usize = 48;
    let line = |i: usize, side: f32| {
        let t = i as f32 / STEPS as f32;
        Vec3::new(0.035 * (t * folds * std::f32::consts::TAU).sin() + side * 0.002, 0.0, t * width)
    };
    let mut mesh = Mesh::default();
    let up = Vec3::Y * height;
    let mut side = |a: Vec3, u: Vec3, v: Vec3, ends: Option<[Vec3; 2]>| {
        let mut part = quad(a, u, v);
        if let Some([left, right]) = ends {
            part.normals = vec![left, right, right, left];
        }
        mesh.append(&part);
    };
    let normal = |i: usize, s: f32| {
        let along = line((i + 1).min(STEPS), s) - line(i.saturating_sub(1), s);
        Vec3::Y.cross(along).normalize() * s
    };
    for i in 0..STEPS {
        let [front, front_next, back, back_next] = [line(i, 1.0), line(i + 1, 1.0), line(i, -1.0), line(i + 1, -1.0)];
        side(front_next, front - front_next, up, Some([normal(i + 1, 1.0), normal(i, 1.0)]));
        side(back, back_next - back, up, Some([normal(i, -1.0), normal(i + 1, -1.0)]));
        side(back, front - back, front_next - front, None);
        side(front + up, back - front, front_next - front, None);
    }
    for (i, turn) in [(0, 1.0), (STEPS, -1.0)] {
        let (a, b) = if turn > 0.0 { (line(i, 1.0), line(i, -1.0)) } else { (line(i, -1.0), line(i, 1.0)) };
        side(b, a - b, up, None);
    }
    mesh
}

fn curtains(b: &mut Builder) {
    let linen = b.material(Material::diffuse(paint(0xd8_c9_a6)));
    let rod = b.material(Material::metal(Vec3::new(0.45, 0.4, 0.36), 0.4));
    let x = -0.5 * WIDTH + 0.09;
    b.put(cloth(0.36, 2.28, 5.0), linen, Vec3::new(x, 0.06, 0.98));
    b.put(cloth(0.36, 2.28, 5.0), linen, Vec3::new(x, 0.06, -1.14));
    let along =
        Affine3A::from_rotation_translation(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2), Vec3::new(x, 2.36, -1.25));
    b.add(cylinder(0.012, 2.7, 12), rod, along);
}
