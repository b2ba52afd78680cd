//! MR360's tracer on the GPU: [`super::render`] over proxies under an environment at infinity.
//!
//! The random numbers and what is made of them are the CPU's, so that a frame differs by rounding. Recursion is a loop from question to
//! question (`mr360.wgsl`).

use super::frame::{MAX_LIGHTS, no_darker_than_black};
use super::shade::{BEHIND_ROUGHNESS, MAX_DEPTH};
use super::{Lighting, Lit, Params};
use crate::bsdf::gpu::{BSDF, DIRECTIONS};
use crate::bvh::gpu::TRAVERSAL;
use crate::objects::gpu::OBJECTS;
use crate::tracer::gpu::scene::{GpuPixel, GpuScene, Submissions, VIEW, View};
use crate::tracer::{Frame, Pixel, Traced, layers};
use crate::world::ProxyWorld;
use crate::world::gpu::{ENVIRONMENT, PROXIES, World};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pano_core::distribution::gpu::DISTRIBUTION;
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, IMAGE, Kernel, Layout, NUMBER, Piece, RANDOM, Rows, SPHERE, Shader};
use pano_core::gpu::{Specialization, WORDS, Words, flag};
use pano_core::image::Image;
use pano_core::light::GLOSSY_ROUGHNESS;
use pano_core::progress::Progress;
use std::ops::Range;

/// Words of a lamp, and of a map.
const LAMP_WORDS: u32 = 7;
const MAP_WORDS: u32 = 4;

pano_core::uniform! {
    /// `LitFrame` of the shader.
    pub(crate) struct LitFrame {
        rows: Rows,
        view: View,
        world: World,
        map_x: Vec3,
        maps: u32,
        map_y: Vec3,
        lamps: u32,
        map_z: Vec3,
        lamp_count: u32,
        capture: Vec3,
        gloss: f32,
        gloss_roughness: f32,
        begin: u32,
        end: u32,
        pad: u32,
    }
}

/// `LitPixel` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct LitPixel {
    pixel: GpuPixel,
    photo: Vec3,
    mixed: u32,
}

/// `lighting.wgsl` and `mr360.wgsl`.
pub static SHADER: Shader = Shader {
    name: "mr360",
    pieces: &[
        NUMBER,
        SPHERE,
        IMAGE,
        RANDOM,
        WORDS,
        DISTRIBUTION,
        TRAVERSAL,
        DIRECTIONS,
        BSDF,
        OBJECTS,
        ENVIRONMENT,
        PROXIES,
        VIEW,
        Piece {
            text: include_str!("lighting.wgsl"),
            constants: || {
                vec![
                    Constant::u32("LAMP_WORDS", LAMP_WORDS),
                    Constant::u32("MAP_WORDS", MAP_WORDS),
                    // The diffuse one, the mirror and the glossy ones.
                    Constant::u32("MAPS", 2 + GLOSSY_ROUGHNESS.len() as u32),
                ]
            },
        },
        Piece {
            text: include_str!("mr360.wgsl"),
            constants: || vec![Constant::u32("MAX_DEPTH", MAX_DEPTH), Constant::f32("BEHIND_ROUGHNESS", BEHIND_ROUGHNESS)],
        },
    ],
    // Of the many combinations the ends: all effects, and none.
    specializations: &[
        Specialization { entry: "begin", constants: &[] },
        Specialization { entry: "begin", constants: NO_SURFACES },
        Specialization { entry: "shade", constants: &[] },
        Specialization { entry: "shade", constants: NO_SURFACES },
        Specialization { entry: "shade", constants: NO_EFFECTS },
    ],
};

/// Objects and proxies of the simplest kind.
const NO_SURFACES: &[(&str, f64)] =
    &[("GLOSS", 0.0), ("BODIES", 0.0), ("TEXTURES", 0.0), ("PROXY_MESHES", 0.0), ("FROM_PICTURE", 0.0)];
/// Light without shadows.
const NO_EFFECTS: &[(&str, f64)] = &[("SHADOWS", 0.0), ("AMBIENT_OCCLUSION", 0.0), ("MIRRORING", 0.0)];

/// Structures that Rust fills, with the shader that declares each.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    vec![(&SHADER, LitFrame::LAYOUT), (&SHADER, View::LAYOUT), (&SHADER, World::LAYOUT)]
}

/// [`super::render`] on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if a table of the scene does not fit a binding, or what has become of the device.
pub fn render(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &ProxyWorld,
    lighting: &Lighting,
    params: &Params<'_>,
    progress: &dyn Progress,
) -> GpuResult<Option<Lit>> {
    let (scene, [maps, lamps]) = GpuScene::new(gpu, frame, world, |_, words, pictures| {
        [pack_maps(lighting, words, pictures), pack_lamps(lighting, words)]
    })?;
    let lamp_count = lighting.lights.len().min(MAX_LIGHTS);
    let constants = overrides(frame, world, params);
    let [map_x, map_y, map_z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| lighting.pano_from_world * axis);
    let run = |entry: &'static str, rows: Rows, held: &GpuBuffer, reached: &GpuBuffer, part: Range<u32>| {
        let uniform = LitFrame {
            rows,
            view: scene.view,
            world: scene.world,
            map_x,
            maps,
            map_y,
            lamps,
            map_z,
            lamp_count: lamp_count as u32,
            capture: lighting.capture,
            gloss: params.gloss,
            gloss_roughness: params.gloss_roughness,
            begin: part.start,
            end: part.end,
            pad: 0,
        };
        let kernel = Kernel { shader: &SHADER, entry, constants: &constants };
        let buffers: Vec<(u32, &GpuBuffer)> = scene.bindings().chain([(6, held), (7, reached)]).collect();
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())
    };
    let (width, height) = (frame.camera.width, frame.camera.height);
    // A point's ambient light and lamps, and what comes before and after it.
    let cut = Submissions::new(gpu, frame, size_of::<LitPixel>().max(4 * lamp_count), 2 + lamp_count);
    progress.begin("trace", height as u64);
    let (mut pixels, mut reached): (Vec<LitPixel>, Vec<u32>) = (Vec::with_capacity(width * height), Vec::new());
    for band in cut.bands() {
        let rows = cut.rows(&band);
        let photo = &params.photo.data()[band.start * width..band.end * width];
        let before = photo.iter().map(|&photo| LitPixel { photo, ..LitPixel::zeroed() });
        let held = gpu.upload_slice(&before.collect::<Vec<_>>())?;
        let counts = gpu.buffer::<u32>((rows.pixels() * lamp_count).max(1))?;
        run("begin", rows, &held, &counts, 0..0)?;
        for part in cut.samples(rows, params.samples) {
            if progress.cancelled() {
                return Ok(None);
            }
            run("shade", rows, &held, &counts, part)?;
        }
        pixels.extend(gpu.read_slice::<LitPixel>(&held, rows.pixels())?);
        reached.extend(gpu.read_slice::<u32>(&counts, rows.pixels() * lamp_count)?);
        progress.advance(u64::from(rows.count));
    }
    let share = 1.0 / params.samples as f32;
    let shadow = |lamp: usize| Image::from_fn(width, height, |x, y| reached[(y * width + x) * lamp_count + lamp] as f32 * share);
    let finished: Vec<Pixel> = pixels.iter().map(|p| no_darker_than_black(p.pixel.finish(params.samples))).collect();
    let traced = Traced {
        layers: layers(frame.camera, finished.iter()),
        rays: pixels.iter().map(|p| u64::from(p.pixel.rays)).sum(),
        discarded: pixels.iter().map(|p| u64::from(p.pixel.discarded)).sum(),
        sampling: None,
    };
    Ok(Some(Lit { traced, shadows: (0..lamp_count).map(shadow).collect() }))
}

/// Adds the maps' pictures and their table: where that begins.
fn pack_maps(lighting: &Lighting, words: &mut Words, pictures: &mut Vec<f32>) -> u32 {
    let maps = &lighting.maps;
    let glossy = maps.glossy.iter().zip(GLOSSY_ROUGHNESS);
    let at = words.at();
    for (map, roughness) in [(&maps.diffuse, 1.0), (&maps.mirror, 0.0)].into_iter().chain(glossy) {
        words.words([pictures.len() as u32, map.width() as u32, map.height() as u32]);
        words.number(roughness);
        pictures.extend(map.data().iter().flat_map(|p| p.to_array()));
    }
    at
}

/// Adds the lights that count: where they begin.
fn pack_lamps(lighting: &Lighting, words: &mut Words) -> u32 {
    let at = words.at();
    for light in lighting.lights.iter().take(MAX_LIGHTS) {
        words.vec3(light.direction);
        words.number(light.cos_radius().max(-1.0));
        words.vec3(light.intensity);
    }
    at
}

/// What this frame calls for; the rest is not compiled.
fn overrides(frame: &Frame<'_>, world: &ProxyWorld, params: &Params<'_>) -> Vec<(&'static str, f64)> {
    vec![
        ("GLOSS", flag(frame.objects.gloss())),
        ("BODIES", flag(frame.objects.transmit())),
        ("TEXTURES", flag(frame.objects.textured())),
        ("PROXY_MESHES", flag(world.has_meshes())),
        ("FROM_PICTURE", flag(world.reflects_picture())),
        ("SHADOWS", flag(params.shadows)),
        ("AMBIENT_OCCLUSION", flag(params.ambient_occlusion)),
        ("MIRRORING", flag(params.gloss > 0.0)),
    ]
}
