//! Over proxies under an environment at infinity: one kernel takes the samples.

use super::super::{self as mr360, Lit, Params};
use super::{Finished, LIGHTING, Lighting, LitPixel, MAPS, NO_EFFECTS, QUESTIONS, overrides};
use crate::bsdf::gpu::{BSDF, DIRECTIONS};
use crate::bvh::gpu::TRAVERSAL;
use crate::objects::gpu::OBJECTS;
use crate::tracer::Frame;
use crate::tracer::gpu::QUESTS;
use crate::tracer::gpu::scene::{GpuScene, Submissions, VIEW, View};
use crate::world::ProxyWorld;
use crate::world::gpu::{ENVIRONMENT, PROXIES, World};
use pano_core::distribution::gpu::DISTRIBUTION;
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, IMAGE, Kernel, Layout, NUMBER, Piece, RANDOM, Rows, SPHERE, Shader};
use pano_core::gpu::{Specialization, WORDS, flag};
use pano_core::progress::Progress;
use std::ops::Range;

pano_core::uniform! {
    /// `LitFrame` of the shader.
    pub(crate) struct LitFrame {
        rows: Rows,
        view: View,
        world: World,
        lighting: Lighting,
        begin: u32,
        end: u32,
        pad0: u32,
        pad1: u32,
    }
}

/// `shade.wgsl`, with what comes before it.
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
        QUESTS,
        PROXIES,
        VIEW,
        MAPS,
        LIGHTING,
        QUESTIONS,
        Piece::plain(include_str!("shade.wgsl")),
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

/// Structures of the shader.
pub(super) fn layouts() -> Vec<(&'static Shader, Layout)> {
    [LitFrame::LAYOUT, View::LAYOUT, World::LAYOUT, Lighting::LAYOUT].map(|layout| (&SHADER, layout)).to_vec()
}

/// [`mr360::render`] on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if a table of the scene does not fit a binding, or what has become of the device.
pub fn render(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &ProxyWorld,
    lighting: &mr360::Lighting,
    params: &Params<'_>,
    progress: &dyn Progress,
) -> GpuResult<Option<Lit>> {
    let (scene, lighting) =
        GpuScene::new(gpu, frame, world, |_, words, pictures| Lighting::pack(lighting, params, words, pictures))?;
    let mut constants = overrides(frame, params);
    constants.extend([("PROXY_MESHES", flag(world.has_meshes())), ("FROM_PICTURE", flag(world.reflects_picture()))]);
    let run = |entry: &'static str, rows: Rows, held: &[(u32, GpuBuffer)], part: Range<u32>| {
        let (begin, end) = (part.start, part.end);
        let uniform = LitFrame { rows, view: scene.view, world: scene.world, lighting, begin, end, pad0: 0, pad1: 0 };
        let kernel = Kernel { shader: &SHADER, entry, constants: &constants };
        let held = held.iter().map(|(number, buffer)| (*number, buffer));
        let buffers: Vec<(u32, &GpuBuffer)> = scene.bindings().chain(held).collect();
        gpu.dispatch(&kernel, bytemuck::bytes_of(&uniform), &buffers, rows.groups())
    };
    // A point's ambient light and lamps, and what comes before and after it.
    let lamps = lighting.lamps();
    let cut = Submissions::new(gpu, frame, size_of::<LitPixel>().max(4 * lamps), 2 + lamps);
    progress.begin("trace", frame.camera.height as u64);
    let mut finished = Finished::new(frame, lamps);
    let done = finished.over_bands(gpu, cut, params, |rows, held| {
        run("begin", rows, held, 0..0)?;
        for part in cut.samples(rows, params.samples) {
            if progress.cancelled() {
                return Ok(false);
            }
            run("shade", rows, held, part)?;
        }
        progress.advance(u64::from(rows.count));
        Ok(true)
    })?;
    Ok(done.then(|| finished.lit(frame, params.samples)))
}
