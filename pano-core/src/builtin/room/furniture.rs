//! What stands in the room.

use super::build::Builder;
use super::textures::{discs, fields, landscape, paint, random, table_wood, textured};
use super::{CEILING, DEPTH, TABLE_SIZE, TABLE_TOP, WIDTH};
use crate::builtin::primitives::{cuboid, cylinder, icosphere, lathe, quad, uv_sphere};
use crate::image::Image;
use crate::material::Material;
use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};

/// Book covers.
const COVERS: [u32; 9] =
    [0x8c_2b_24, 0x1f_3f_66, 0xd1_9a_33, 0x2e_5d_4b, 0xe2_d6_bd, 0x57_3a_5e, 0xb7_5a_2c, 0x33_33_38, 0x6f_91_a6];

/// Adds all furniture.
pub(super) fn add(b: &mut Builder) {
    table(b);
    let beech = b.material(Material::diffuse(paint(0xb9_85_52)));
    let seat = b.material(Material::diffuse(paint(0x3e_5f_73)));
    chair(b, Vec3::new(-0.30, 0.0, -0.62), 0.0, beech, seat);
    chair(b, Vec3::new(0.98, 0.0, -0.05), -80.0, beech, seat);
    sofa(b);
    bookshelf(b);
    sideboard(b);
    pictures(b);
    floor_lamp(b, Vec3::new(-2.05, 0.0, -1.55));
    pendant(b, Vec3::new(0.0, 2.0, 0.0));
}

fn points(list: &[(f32, f32)]) -> Vec<Vec2> {
    list.iter().map(|&(r, y)| Vec2::new(r, y)).collect()
}

fn table(b: &mut Builder) {
    let top = b.material(textured(table_wood(TABLE_SIZE)));
    let legs = b.material(Material::diffuse(paint(0x8e_62_3c)));
    let half = 0.5 * TABLE_SIZE;
    let low = Vec3::new(-half.x, TABLE_TOP - 0.035, -half.y);
    b.block(low, Vec3::new(half.x, TABLE_TOP, half.y), 0.006, top, Affine3A::IDENTITY);
    let inset = half - 0.07;
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let at = Vec2::new(sx, sz) * inset;
        let leg = points(&[(0.0, 0.0), (0.02, 0.0), (0.034, TABLE_TOP - 0.03), (0.0, TABLE_TOP - 0.03)]);
        b.put(lathe(&leg, 16), legs, Vec3::new(at.x, 0.01, at.y));
    }
    for s in [-1.0, 1.0] {
        let (low, high) = (Vec3::new(-inset.x, TABLE_TOP - 0.105, -0.012), Vec3::new(inset.x, TABLE_TOP - 0.035, 0.012));
        b.block(low, high, 0.003, legs, Affine3A::from_translation(Vec3::Z * s * inset.y));
        let (low, high) = (Vec3::new(-0.012, TABLE_TOP - 0.105, -inset.y), Vec3::new(0.012, TABLE_TOP - 0.035, inset.y));
        b.block(low, high, 0.003, legs, Affine3A::from_translation(Vec3::X * s * inset.x));
    }
    vase(b, Vec3::new(-0.53, TABLE_TOP, -0.20));
    bowl(b, Vec3::new(0.50, TABLE_TOP, -0.20));
    books(b, Vec3::new(-0.06, TABLE_TOP, -0.28));
}

fn vase(b: &mut Builder, at: Vec3) {
    let glaze = b.material(Material { specular: 1.0, roughness: 0.25, ..Material::diffuse(paint(0x2d_6f_86)) });
    let outside = (0..=16).map(|i| {
        let t = i as f32 / 16.0;
        (0.038 + 0.036 * (t * 3.4).sin().max(-0.55) * (1.0 - 0.2 * t), 0.24 * t)
    });
    let outline: Vec<(f32, f32)> = outside.collect();
    let inside: Vec<(f32, f32)> = outline.iter().rev().take(15).map(|&(r, y)| (r - 0.005, y)).collect();
    let profile = [vec![(0.0, 0.0)], outline, inside, vec![(0.0, 0.03)]].concat();
    b.put(lathe(&points(&profile), 40), glaze, at);
    let stem = b.material(Material::diffuse(paint(0x5c_4a_2c)));
    let leaf = b.material(Material::diffuse(paint(0x5f_86_46)));
    for i in 0..5 {
        let (turn, lean) = (i as f32 * 2.4, 0.13 + 0.05 * random(i, 0, 61));
        let twig = Affine3A::from_rotation_translation(Quat::from_euler(EulerRot::YXZ, turn, 0.0, lean), at + Vec3::Y * 0.03);
        b.add(cylinder(0.0018, 0.36, 6), stem, twig);
        for k in 0..5 {
            let h = 0.24 + 0.028 * k as f32;
            let place = Affine3A::from_scale_rotation_translation(
                Vec3::new(0.022, 0.003, 0.011),
                Quat::from_euler(EulerRot::YXZ, k as f32 * 2.4, 0.0, 0.5),
                Vec3::Y * h + Quat::from_rotation_y(k as f32 * 2.4) * Vec3::X * 0.018,
            );
            b.add(uv_sphere(1.0, 8, 5), leaf, twig * place);
        }
    }
}

fn bowl(b: &mut Builder, at: Vec3) {
    let china = b.material(Material { specular: 0.8, roughness: 0.35, ..Material::diffuse(paint(0xe4_df_d3)) });
    let arc = |r: f32, lift: f32| {
        (0..=10).map(move |i| {
            let t = 0.25 + 1.15 * i as f32 / 10.0;
            (r * t.sin(), lift + r * (1.0 - t.cos()))
        })
    };
    let outside: Vec<(f32, f32)> = arc(0.125, 0.006).collect();
    let inside: Vec<(f32, f32)> = arc(0.119, 0.012).collect::<Vec<_>>().into_iter().rev().collect();
    let profile = [vec![(0.0, 0.0), (0.045, 0.0), (0.045, 0.008)], outside[1..].to_vec(), inside, vec![(0.0, 0.012)]].concat();
    b.put(lathe(&points(&profile), 48), china, at);
    let orange = b.material(Material { specular: 0.5, roughness: 0.5, ..Material::diffuse(paint(0xe0_7f_1c)) });
    let apple = b.material(Material { specular: 0.7, roughness: 0.35, ..Material::diffuse(paint(0xa8_24_1e)) });
    for (x, y, z, r, material) in [
        (0.045, 0.062, 0.020, 0.038, orange),
        (-0.040, 0.062, 0.032, 0.038, orange),
        (-0.005, 0.064, -0.048, 0.040, apple),
        (0.002, 0.118, 0.006, 0.036, apple),
    ] {
        b.put(uv_sphere(r, 28, 16), material, at + Vec3::new(x, y, z));
    }
}

/// A pile of three books.
fn books(b: &mut Builder, at: Vec3) {
    let paper = b.material(Material::diffuse(paint(0xe9_e2_cf)));
    let mut y = 0.0;
    for (size, turn, color) in [
        (Vec3::new(0.25, 0.032, 0.18), 4.0f32, COVERS[1]),
        (Vec3::new(0.22, 0.026, 0.16), -7.0, COVERS[0]),
        (Vec3::new(0.19, 0.022, 0.13), 15.0, COVERS[2]),
    ] {
        let cover = b.material(Material::diffuse(paint(color)));
        let place = Affine3A::from_rotation_translation(Quat::from_rotation_y(turn.to_radians()), at + Vec3::Y * y);
        let (half, board) = (0.5 * size, 0.003);
        let mut part = |low: [f32; 3], high: [f32; 3], material| b.block(low.into(), high.into(), 0.001, material, place);
        part([-half.x, 0.0, -half.z], [half.x, board, half.z], cover);
        part([-half.x, size.y - board, -half.z], [half.x, size.y, half.z], cover);
        part([-half.x, board, -half.z], [half.x, size.y - board, -half.z + board], cover);
        part([-half.x + 0.004, board, -half.z + board], [half.x - 0.004, size.y - board, half.z - 0.004], paper);
        y += size.y;
    }
}

/// A chair at `at`, turned `yaw` degrees; at 0 it faces +Z.
fn chair(b: &mut Builder, at: Vec3, yaw: f32, wood: u32, cushion: u32) {
    let place = Affine3A::from_rotation_translation(Quat::from_rotation_y(yaw.to_radians()), at);
    for (x, z, height) in [(-0.19, 0.18, 0.43), (0.19, 0.18, 0.43), (-0.19, -0.19, 0.86), (0.19, -0.19, 0.86)] {
        b.block(Vec3::new(x - 0.018, 0.01, z - 0.018), Vec3::new(x + 0.018, height, z + 0.018), 0.006, wood, place);
    }
    b.block(Vec3::new(-0.215, 0.42, -0.21), Vec3::new(0.215, 0.445, 0.215), 0.008, wood, place);
    b.block(Vec3::new(-0.20, 0.445, -0.17), Vec3::new(0.20, 0.48, 0.20), 0.017, cushion, place);
    for y in [0.60, 0.70, 0.80] {
        b.block(Vec3::new(-0.175, y, -0.20), Vec3::new(0.175, y + 0.05, -0.18), 0.006, wood, place);
    }
}

fn sofa(b: &mut Builder) {
    let teal = b.material(Material::diffuse(paint(0x3f_6b_6b)));
    let mustard = b.material(Material::diffuse(paint(0xd0_9a_2c)));
    let rust = b.material(Material::diffuse(paint(0xb0_50_30)));
    let feet = b.material(Material::diffuse(paint(0x4a_33_22)));
    let place = Affine3A::from_translation(Vec3::new(-0.70, 0.0, -0.5 * DEPTH + 0.47));
    let mut part = |low: [f32; 3], high: [f32; 3], r: f32, m: u32| b.block(low.into(), high.into(), r, m, place);
    part([-0.92, 0.10, -0.42], [0.92, 0.30, 0.42], 0.04, teal);
    part([-0.76, 0.30, -0.20], [-0.005, 0.45, 0.43], 0.05, teal);
    part([0.005, 0.30, -0.20], [0.76, 0.45, 0.43], 0.05, teal);
    part([-0.92, 0.28, -0.43], [0.92, 0.84, -0.20], 0.08, teal);
    part([-0.95, 0.10, -0.43], [-0.76, 0.62, 0.43], 0.07, teal);
    part([0.76, 0.10, -0.43], [0.95, 0.62, 0.43], 0.07, teal);
    for (x, z) in [(-0.86, -0.36), (0.86, -0.36), (-0.86, 0.36), (0.86, 0.36)] {
        part([x - 0.03, 0.0, z - 0.03], [x + 0.03, 0.11, z + 0.03], 0.005, feet);
    }
    for (x, tilt, color) in [(-0.52, 0.12, mustard), (0.50, -0.1, rust)] {
        let lean = Quat::from_euler(EulerRot::YXZ, tilt, -0.35, tilt);
        let at = place * Affine3A::from_rotation_translation(lean, Vec3::new(x, 0.655, -0.11));
        b.block(Vec3::new(-0.2, -0.2, -0.055), Vec3::new(0.2, 0.2, 0.055), 0.054, color, at);
    }
}

fn bookshelf(b: &mut Builder) {
    let wood = b.material(Material::diffuse(paint(0x9a_6f_47)));
    let covers = COVERS.map(|c| b.material(Material::diffuse(paint(c))));
    let (low, high) = (Vec3::new(1.25, 0.0, -0.5 * DEPTH + 0.016), Vec3::new(2.25, 1.92, -0.5 * DEPTH + 0.316));
    let mut board = |a: [f32; 3], z: [f32; 3]| b.block(a.into(), z.into(), 0.002, wood, Affine3A::IDENTITY);
    board([low.x, 0.0, low.z], [low.x + 0.022, high.y, high.z]);
    board([high.x - 0.022, 0.0, low.z], [high.x, high.y, high.z]);
    board([low.x, 0.0, low.z], [high.x, high.y, low.z + 0.008]);
    let shelves = [0.06, 0.43, 0.80, 1.17, 1.54, 1.898];
    for y in shelves {
        board([low.x + 0.02, y, low.z], [high.x - 0.02, y + 0.022, high.z]);
    }
    for (k, y) in shelves[..5].iter().enumerate() {
        let k = k as i32;
        let mut x = low.x + 0.026;
        // Some shelves are not full.
        let end = high.x - 0.026 - 0.35 * random(k, 99, 71);
        for i in 0.. {
            let [w, h, d] = [0, 1, 2].map(|j| random(i, k * 3 + j, 73));
            let (width, height, depth) = (0.018 + 0.032 * w, 0.20 + 0.10 * h, 0.15 + 0.08 * d);
            if x + width > end {
                break;
            }
            let material = covers[(random(i, k, 79) * 9.0) as usize];
            let size = Vec3::new(width - 0.001, height, depth);
            b.put(cuboid(size), material, Vec3::new(x + 0.5 * width, y + 0.022 + 0.5 * height, high.z - 0.03 - 0.5 * depth));
            x += width;
        }
    }
}

/// A sideboard by the right wall, with a plant.
fn sideboard(b: &mut Builder) {
    let body = b.material(Material { specular: 0.4, roughness: 0.4, ..Material::diffuse(paint(0xe2_dd_d2)) });
    let top = b.material(Material::diffuse(paint(0xa9_78_4a)));
    let dark = b.material(Material::diffuse(paint(0x3a_34_30)));
    let x = 0.5 * WIDTH - 0.02;
    let mut part = |low: [f32; 3], high: [f32; 3], m: u32| b.block(low.into(), high.into(), 0.006, m, Affine3A::IDENTITY);
    part([x - 0.40, 0.14, 0.15], [x, 0.74, 1.55], body);
    part([x - 0.42, 0.74, 0.13], [x, 0.765, 1.57], top);
    for (i, z) in [0.17, 0.63, 1.09].into_iter().enumerate() {
        part([x - 0.412, 0.17, z], [x - 0.40, 0.71, z + 0.44], body);
        part(
            [x - 0.425, 0.42, z + if i == 2 { 0.03 } else { 0.38 }],
            [x - 0.412, 0.48, z + if i == 2 { 0.06 } else { 0.41 }],
            dark,
        );
    }
    for z in [0.2, 1.5] {
        for dx in [0.36, 0.04] {
            part([x - dx - 0.02, 0.0, z - 0.02], [x - dx + 0.02, 0.15, z + 0.02], dark);
        }
    }
    let pot = b.material(Material::diffuse(paint(0xb5_61_3c)));
    let soil = b.material(Material::diffuse(paint(0x3b_2c_20)));
    let leaf = b.material(Material { specular: 0.5, roughness: 0.45, ..Material::diffuse(paint(0x3f_7a_3a)) });
    let at = Vec3::new(x - 0.2, 0.765, 1.25);
    let outline = points(&[(0.0, 0.0), (0.075, 0.0), (0.10, 0.17), (0.108, 0.17), (0.108, 0.19), (0.094, 0.19), (0.094, 0.165)]);
    b.put(lathe(&[outline, points(&[(0.0, 0.165)])].concat(), 32), pot, at);
    b.put(lathe(&points(&[(0.0, 0.1651), (0.0935, 0.1651), (0.0, 0.1751)]), 24), soil, at);
    for i in 0..22 {
        let (turn, t) = (i as f32 * 2.39996, i as f32 / 21.0);
        let lean = 0.15 + 0.95 * t;
        let length = 0.20 - 0.05 * t;
        let out = Quat::from_euler(EulerRot::YXZ, turn, 0.0, -lean);
        let blade = Affine3A::from_scale_rotation_translation(
            Vec3::new(0.008, length, 0.035),
            out,
            at + Vec3::Y * 0.16 + out * Vec3::Y * length * 0.9,
        );
        b.add(uv_sphere(1.0, 10, 8), leaf, blade);
    }
}

fn pictures(b: &mut Builder) {
    let frame = b.material(Material::diffuse(paint(0x2b_24_1f)));
    let (x, z) = (0.5 * WIDTH, 0.5 * DEPTH);
    let mut hang = |size: Vec2, at: Vec3, turn: f32, image: Image<Vec3>| {
        let canvas = b.material(textured(image));
        let place = Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), at);
        let (half, rim) = (0.5 * size, 0.025);
        let (w, h) = (half.x + rim, half.y + rim);
        for (low, high) in [
            ([-w, half.y], [w, h]),
            ([-w, -h], [w, -half.y]),
            ([-w, -half.y], [-half.x, half.y]),
            ([half.x, -half.y], [w, half.y]),
        ] {
            b.block(Vec3::new(low[0], low[1], 0.0), Vec3::new(high[0], high[1], 0.025), 0.004, frame, place);
        }
        b.add(quad(Vec3::new(-half.x, -half.y, 0.012), Vec3::X * size.x, Vec3::Y * size.y), canvas, place);
    };
    let quarter = std::f32::consts::FRAC_PI_2;
    let size = Vec2::new(1.05, 0.66);
    hang(size, Vec3::new(-0.70, 1.52, -z), 0.0, landscape(size));
    let size = Vec2::new(0.5, 0.62);
    hang(size, Vec3::new(0.62, 1.50, -z), 0.0, fields(size));
    let size = Vec2::new(0.7, 0.7);
    hang(size, Vec3::new(x, 1.50, 0.75), -quarter, discs(size));
    let size = Vec2::new(0.6, 0.8);
    hang(size, Vec3::new(0.6, 1.5, z), 2.0 * quarter, discs(size));
}

/// A standing lamp: a shade that glows, and the bulb in it.
fn floor_lamp(b: &mut Builder, at: Vec3) {
    let steel = b.material(Material::metal(Vec3::new(0.5, 0.47, 0.43), 0.35));
    let foot = points(&[(0.0, 0.0), (0.14, 0.0), (0.14, 0.012), (0.02, 0.03), (0.011, 0.04), (0.011, 1.40), (0.0, 1.40)]);
    b.put(lathe(&foot, 24), steel, at);
    let cloth = b.material(Material { emissive: Vec3::new(3.3, 2.2, 1.2), ..Material::diffuse(paint(0xd9_c3_9a)) });
    let lining = b.material(Material::diffuse(paint(0xea_e4_d6)));
    b.put(lathe(&points(&[(0.21, 1.34), (0.15, 1.64)]), 20), cloth, at);
    b.put(lathe(&points(&[(0.15, 1.64), (0.145, 1.64), (0.205, 1.34), (0.21, 1.34)]), 20), lining, at);
    let bulb = b.material(Material::emitter(Vec3::new(140.0, 98.0, 54.0)));
    b.put(icosphere(0.045, 1), bulb, at + Vec3::Y * 1.455);
}

/// A glass globe hanging from the ceiling.
fn pendant(b: &mut Builder, at: Vec3) {
    let globe = b.material(Material::emitter(Vec3::new(90.0, 65.0, 41.0)));
    let brass = b.material(Material::metal(Vec3::new(0.75, 0.58, 0.3), 0.35));
    b.put(icosphere(0.13, 1), globe, at);
    let holder = points(&[(0.0, 0.115), (0.055, 0.115), (0.05, 0.15), (0.02, 0.17), (0.004, 0.18), (0.004, 0.0), (0.0, 0.0)]);
    let top = CEILING - at.y;
    let holder: Vec<Vec2> =
        holder.into_iter().take(5).chain(points(&[(0.004, top - 0.03), (0.045, top - 0.03), (0.05, top), (0.0, top)])).collect();
    b.put(lathe(&holder, 20), brass, at);
}
