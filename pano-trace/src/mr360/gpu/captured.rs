//! Over a captured radiance field: small kernels that take turns.

use super::super::{self as mr360, Lit, Params};
use super::{Finished, LIGHTING, Lighting, LitPixel, MAPS, NO_EFFECTS, PIXELS, QUESTIONS, REACHED, overrides};
use crate::prt::gpu::Field;
use crate::tracer::Frame;
use crate::tracer::gpu::scene::{GpuScene, Submissions, View};
use crate::tracer::gpu::wave::follow::{
    self, ASKED, Asked, Entry, FIELD, Kernels, RELITS, Relit, SIGHT, STILL, pieces_that_follow,
};
use crate::world::captured::gpu::World;
use crate::world::{CapturedWorld, RealWorld};
use bytemuck::bytes_of;
use pano_core::gpu::{Gpu, GpuBuffer, GpuResult, Layout, Piece, Rows, Shader, Specialization, flag};
use pano_core::progress::Progress;

pano_core::uniform! {
    /// `LitWave` of the shader.
    pub(crate) struct LitWave {
        rows: Rows,
        view: View,
        world: World,
        field: Field,
        lighting: Lighting,
        samples: u32,
        turn: u32,
        pad0: u32,
        pad1: u32,
    }
}

pano_core::uniform! {
    /// `Sample` of the shader; only its size matters here.
    pub(crate) struct Sample {
        point: [u32; 60],
        scale: [u32; 3],
        question: u32,
        total: [u32; 3],
        lamp: u32,
        without: [u32; 3],
        shown: u32,
        change: [u32; 3],
        number: u32,
        numbers: [u32; 3],
        pad: u32,
    }
}

/// `captured.wgsl`, with what comes before it.
pub static SHADER: Shader = Shader {
    name: "mr360 captured",
    pieces: pieces_that_follow![MAPS, LIGHTING, QUESTIONS, STILL, Piece::plain(include_str!("captured.wgsl"))],
    // Of the many combinations the ends: all effects, and none.
    specializations: &[
        Specialization { entry: "sight", constants: &[] },
        Specialization { entry: "encounter", constants: &[] },
        Specialization { entry: "march", constants: &[] },
        Specialization { entry: "tell", constants: &[] },
        Specialization { entry: "tell", constants: &[("LIT", 0.0)] },
        Specialization { entry: "begin", constants: &[] },
        Specialization { entry: "begin", constants: NO_SURFACES },
        Specialization { entry: "advance", constants: &[] },
        Specialization { entry: "advance", constants: NO_SURFACES },
        Specialization { entry: "advance", constants: NO_EFFECTS },
    ],
};

/// Objects of the simplest kind.
const NO_SURFACES: &[(&str, f64)] = &[("GLOSS", 0.0), ("BODIES", 0.0), ("TEXTURES", 0.0)];

const BEGIN: Entry = ("begin", &[4, PIXELS, ASKED, SAMPLES, REACHED], None);
const ADVANCE: Entry = ("advance", &[4, 5, PIXELS, ASKED, SAMPLES, REACHED], None);

const SAMPLES: u32 = 8;

/// Structures of the shader.
pub(super) fn layouts() -> Vec<(&'static Shader, Layout)> {
    let layouts = [LitWave::LAYOUT, View::LAYOUT, World::LAYOUT, Field::LAYOUT, Lighting::LAYOUT, Sample::LAYOUT];
    layouts.into_iter().chain(follow::LAYOUTS).map(|layout| (&SHADER, layout)).collect()
}

/// [`mr360::render`] of a captured field on the GPU, in bands of rows. `None` if `progress` cancels.
///
/// # Errors
/// [`pano_core::gpu::GpuError::TooLarge`] if the panorama, its depth or a table of the scene does not fit a binding, or what has become
/// of the device.
pub fn render_captured(
    gpu: &Gpu,
    frame: &Frame<'_>,
    world: &CapturedWorld,
    lighting: &mr360::Lighting,
    params: &Params<'_>,
    progress: &dyn Progress,
) -> GpuResult<Option<Lit>> {
    let (scene, lighting) =
        GpuScene::new(gpu, frame, world, |_, words, pictures| Lighting::pack(lighting, params, words, pictures))?;
    let field = world.field_on(gpu)?;
    let mut constants = overrides(frame, params);
    constants.push(("LIT", flag(world.environment().light.is_some())));
    let lamps = lighting.lamps();
    let bytes = size_of::<Sample>().max(size_of::<Asked>()).max(size_of::<LitPixel>()).max(4 * lamps);
    let cut = Submissions::new(gpu, frame, bytes, 1);
    progress.begin("trace", frame.camera.height as u64);
    let mut finished = Finished::new(frame, lamps);
    let done = finished.over_bands(gpu, cut, params, |rows, held| {
        let count = rows.pixels();
        let rays = [
            (ASKED, gpu.buffer::<Asked>(count)?),
            (RELITS, gpu.buffer::<Relit>(count)?),
            (SAMPLES, gpu.buffer::<Sample>(count)?),
        ];
        let own = held.iter().chain(&rays).map(|(number, buffer): &(u32, GpuBuffer)| (*number, buffer));
        let buffers = scene.bindings().chain(field.bindings(FIELD)).chain(own).collect();
        let kernels = Kernels { gpu, shader: &SHADER, constants: &constants, buffers, rows };
        let uniform = |turn| LitWave {
            rows,
            view: scene.view,
            world: scene.world,
            field: field.uniform(),
            lighting,
            samples: params.samples,
            turn,
            pad0: 0,
            pad1: 0,
        };
        kernels.run(SIGHT, bytes_of(&uniform(0)))?;
        if !kernels.follow(&[], uniform, progress)? {
            return Ok(false);
        }
        kernels.run(BEGIN, bytes_of(&uniform(0)))?;
        let done = kernels.follow(&[ADVANCE], uniform, progress)?;
        progress.advance(u64::from(rows.count));
        Ok(done)
    })?;
    Ok(done.then(|| finished.lit(frame, params.samples)))
}
