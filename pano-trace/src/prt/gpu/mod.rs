//! Marching on the GPU: the nearest surface along each ray.
//!
//! Departures from the CPU: a ray that passes behind a layer stops there until the back face has been looked for, in place of a call
//! within a call. The field's largest part, the samples at the corners of its cells, must fit a binding: depth of up to 6272 columns
//! does, larger ones stay on the CPU.

use super::answer::{Answer, FieldHit, HiddenSide};
use super::march::{CLEAR, NEAREST, NUDGE};
use super::pyramid::{BIAS, Level, SHIFT, TILE};
use super::slopes::{EVEN, RIM_REACH, SLOPE_REACH, SORTING_NETWORK};
use super::{DepthField, field::Face};
use crate::bvh::Ray;
use crate::bvh::gpu::{RAY, RayKernel};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, Kernel, Layout, NUMBER, Piece, Shader, Specialization, Value};

/// Rays of one submission: some ten milliseconds of a slow GPU.
const BATCH: usize = 1 << 17;

/// Levels above the cells that a shader knows the beginnings of: a face of 2¹⁵ cells.
const LEVELS: usize = 15;

pano_core::uniform! {
    /// `Field` of the shader.
    pub(crate) struct Field {
        cells: u32,
        levels: u32,
        steps: u32,
        back_faces: u32,
        nearest: [[f32; 4]; 2],
        begins: [[u32; 4]; 4],
    }
}

pano_core::uniform! {
    /// `March` of the shader.
    pub(crate) struct March {
        field: Field,
        count: u32,
        pad0: u32,
        pad1: u32,
        pad2: u32,
    }
}

/// `Marched` of the shader, with what it met unfolded.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Marched {
    normal: Vec3,
    t: f32,
    what: u32,
    at_gap: u32,
    back: u32,
    pad1: u32,
    shown: Vec3,
    pad2: u32,
    smoothed: Vec3,
    pad3: u32,
}

/// What a ray met on the GPU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GpuAnswer {
    /// As [`DepthField::march`] tells it.
    pub answer: Answer,
    /// [`DepthField::smooth_normal`] of a surface; 0 if there is none.
    pub smooth_normal: Vec3,
}

/// `what` of a surface, of a ray that was given up, and of what is assumed.
const SURFACE: u32 = 1;
const OUT_OF_STEPS: u32 = 2;
const BACK_FACE: u32 = 3;
const BACK_LAYER: u32 = 4;

/// The depth field and marching through it, for shaders to include after [`NUMBER`] and [`RAY`]; field.wgsl tells what they bring.
pub(crate) const MARCHING: Piece = Piece {
    text: concat!(include_str!("field.wgsl"), include_str!("march.wgsl")),
    constants: || {
        vec![
            Constant::u32("SHIFT", SHIFT),
            Constant::u32("BIAS", BIAS),
            Constant::u32("TILE", TILE as u32),
            Constant::f32("EVEN", EVEN),
            Constant::u32("SLOPE_REACH", SLOPE_REACH as u32),
            Constant::u32("SORTING_PAIRS", SORTING_NETWORK.len() as u32),
            Constant { name: "SORTING_NETWORK", value: Value::U32s(SORTING_NETWORK.as_flattened()) },
            Constant::f32("NEAREST", NEAREST),
            Constant::f32("NUDGE", NUDGE),
            Constant::f32("CLEAR", CLEAR),
            Constant::u32("RIM_REACH", RIM_REACH as u32),
        ]
    },
};

/// `rays.wgsl`.
pub static SHADER: Shader = Shader {
    name: "march",
    pieces: &[NUMBER, RAY, MARCHING, Piece::plain(include_str!("rays.wgsl"))],
    specializations: &[Specialization { entry: "march", constants: &[] }],
};

/// A depth field in the GPU's memory.
#[derive(Debug)]
pub struct GpuDepthField {
    uniform: Field,
    inverse: GpuBuffer,
    gaps: GpuBuffer,
    base: GpuBuffer,
    upper: GpuBuffer,
}

impl GpuDepthField {
    /// Copies a field to the GPU.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`] if it does not fit a binding, or what has become of the device.
    pub fn new(gpu: &Gpu, field: &DepthField) -> GpuResult<Self> {
        let n = field.n;
        let levels = field.faces[0].pyramid.levels();
        assert!(levels.len() <= LEVELS + 1, "a face of {n} cells has {} levels", levels.len());
        let mut uniform = Field {
            cells: n as u32,
            levels: levels.len() as u32,
            steps: field.max_steps,
            back_faces: u32::from(field.back_faces),
            nearest: [[0.0; 4]; 2],
            begins: [[0; 4]; 4],
        };
        for (k, face) in field.faces.iter().enumerate() {
            uniform.nearest[k / 4][k % 4] = face.nearest().min(f32::MAX);
        }
        let mut begin = 0;
        for (k, level) in levels[1..].iter().enumerate() {
            uniform.begins[k / 4][k % 4] = begin;
            begin += level.packed().len() as u32;
        }
        uniform.begins[3][3] = begin;

        let inverse: Vec<f32> = field.faces.iter().flat_map(|f| f.inverse.iter().copied()).collect();
        let bits = |face: &Face, k: usize| {
            let (i, j) = (k % (n + 1), k / (n + 1));
            let cell = i < n && j < n && face.gap[j * n + i];
            let right = i < n && face.gap_right[j * n + i];
            let below = j < n && face.gap_below[k];
            u32::from(cell) | u32::from(right) << 1 | u32::from(below) << 2
        };
        let gaps: Vec<u32> = field.faces.iter().flat_map(|f| (0..(n + 1) * (n + 1)).map(move |k| bits(f, k))).collect();
        let base: Vec<u32> = field.faces.iter().flat_map(|f| f.pyramid.levels()[0].packed()).copied().collect();
        let above = field.faces.iter().flat_map(|f| f.pyramid.levels()[1..].iter()).flat_map(Level::packed);
        let mut upper: Vec<u32> = above.copied().collect();
        if upper.is_empty() {
            // A face of one cell has nothing above it, and nothing cannot be bound.
            upper.push(0);
        }
        Ok(Self {
            uniform,
            inverse: gpu.upload_slice(&inverse)?,
            gaps: gpu.upload_slice(&gaps)?,
            base: gpu.upload_slice(&base)?,
            upper: gpu.upload_slice(&upper)?,
        })
    }

    /// `Field` of a shader's uniform.
    pub(crate) fn uniform(&self) -> Field {
        self.uniform
    }

    /// What a shader with [`MARCHING`] binds: samples, gaps, ranges of cells and of the levels above them, from number `first` on.
    pub(crate) fn bindings(&self, first: u32) -> [(u32, &GpuBuffer); 4] {
        [(first, &self.inverse), (first + 1, &self.gaps), (first + 2, &self.base), (first + 3, &self.upper)]
    }

    /// [`DepthField::march`] of each ray.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn march(&self, gpu: &Gpu, rays: &[Ray]) -> GpuResult<Vec<GpuAnswer>> {
        let rays_kernel = RayKernel {
            kernel: Kernel { shader: &SHADER, entry: "march", constants: &[] },
            buffers: &self.bindings(1),
            bindings: [5, 6],
            batch: BATCH,
        };
        let uniform = |count| March { field: self.uniform, count, pad0: 0, pad1: 0, pad2: 0 };
        let met: Vec<Marched> = rays_kernel.run(gpu, uniform, rays)?;
        Ok(met.iter().map(Marched::answer).collect())
    }
}

impl Marched {
    fn answer(&self) -> GpuAnswer {
        let Self { normal, t, at_gap, back, .. } = *self;
        let hit = FieldHit { t, normal, back: back != 0, at_gap: at_gap != 0, hidden_side: None };
        let hidden = |side| Answer::BackFace(FieldHit { hidden_side: Some(side), ..hit });
        let answer = match self.what {
            SURFACE => Answer::Surface(hit),
            OUT_OF_STEPS => Answer::OutOfSteps,
            BACK_FACE => hidden(HiddenSide::BackFace(self.shown)),
            BACK_LAYER => hidden(HiddenSide::BackLayer(self.shown)),
            _ => Answer::Left,
        };
        GpuAnswer { answer, smooth_normal: self.smoothed }
    }
}

/// Structures that Rust fills, with the shader that declares each.
pub(crate) fn layouts() -> Vec<(&'static Shader, Layout)> {
    vec![(&SHADER, Field::LAYOUT), (&SHADER, March::LAYOUT)]
}
