//! Marching on the GPU: the nearest surface along each ray.
//!
//! Departures from the CPU: surfaces only. What is assumed behind them (`back_face.rs`) and the side of a surface that a ray
//! meets (`slopes.rs`) is found on the host, the latter from the place that the GPU gives. The field's largest part, a
//! range for each cell of the cube, must fit a binding: panoramas of up to 4096 columns do, larger ones stay on the CPU.

use super::answer::{Answer, FieldHit};
use super::march::{NEAREST, NUDGE};
use super::pyramid::{BIAS, Level, SHIFT, TILE};
use super::{DepthField, field::Face};
use crate::bvh::Ray;
use crate::bvh::gpu::{RAY, RayKernel};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use pano_core::gpu::{Constant, Gpu, GpuBuffer, GpuResult, Kernel, NUMBER, Piece, Shader, Specialization};

/// Rays of one submission: some ten milliseconds of a slow GPU.
const BATCH: usize = 1 << 17;

/// Levels above the cells that a shader knows the beginnings of: a face of 2¹⁵ cells.
const LEVELS: usize = 15;

pano_core::uniform! {
    /// `March` of the shader.
    pub(crate) struct March {
        count: u32,
        cells: u32,
        levels: u32,
        steps: u32,
        nearest: [[f32; 4]; 2],
        begins: [[u32; 4]; 4],
    }
}

/// `Met` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Met {
    at: Vec2,
    t: f32,
    face: u32,
    what: u32,
    at_gap: u32,
}

/// `what` of a surface, and of a ray that was given up.
const SURFACE: u32 = 1;
const OUT_OF_STEPS: u32 = 2;

/// `march.wgsl`.
pub static SHADER: Shader = Shader {
    name: "march",
    pieces: &[
        NUMBER,
        RAY,
        Piece {
            text: include_str!("march.wgsl"),
            constants: || {
                vec![
                    Constant::f32("NEAREST", NEAREST),
                    Constant::f32("NUDGE", NUDGE),
                    Constant::u32("SHIFT", SHIFT),
                    Constant::u32("BIAS", BIAS),
                    Constant::u32("TILE", TILE as u32),
                ]
            },
        },
    ],
    specializations: &[Specialization { entry: "march", constants: &[] }],
};

/// A depth field in the GPU's memory.
#[derive(Debug)]
pub struct GpuDepthField<'a> {
    field: &'a DepthField,
    uniform: March,
    inverse: GpuBuffer,
    gaps: GpuBuffer,
    base: GpuBuffer,
    upper: GpuBuffer,
}

impl<'a> GpuDepthField<'a> {
    /// Copies a field to the GPU.
    ///
    /// # Errors
    /// [`pano_core::gpu::GpuError::TooLarge`] if it does not fit a binding, or what has become of the device.
    pub fn new(gpu: &Gpu, field: &'a DepthField) -> GpuResult<Self> {
        let n = field.n;
        let levels = field.faces[0].pyramid.levels();
        assert!(levels.len() <= LEVELS + 1, "a face of {n} cells has {} levels", levels.len());
        let mut uniform = March {
            count: 0,
            cells: n as u32,
            levels: levels.len() as u32,
            steps: field.max_steps,
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
        let above = |f: &'a Face| f.pyramid.levels()[1..].iter().flat_map(Level::packed);
        let mut upper: Vec<u32> = field.faces.iter().flat_map(above).copied().collect();
        if upper.is_empty() {
            // A face of one cell has nothing above it, and nothing cannot be bound.
            upper.push(0);
        }
        Ok(Self {
            field,
            uniform,
            inverse: gpu.upload_slice(&inverse)?,
            gaps: gpu.upload_slice(&gaps)?,
            base: gpu.upload_slice(&base)?,
            upper: gpu.upload_slice(&upper)?,
        })
    }

    /// [`DepthField::march`] of each ray, without back faces.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn march(&self, gpu: &Gpu, rays: &[Ray]) -> GpuResult<Vec<Answer>> {
        let rays_kernel = RayKernel {
            kernel: Kernel { shader: &SHADER, entry: "march", constants: &[] },
            buffers: &[(1, &self.inverse), (2, &self.gaps), (3, &self.base), (4, &self.upper)],
            bindings: [5, 6],
            batch: BATCH,
        };
        let met: Vec<Met> = rays_kernel.run(gpu, |count| March { count, ..self.uniform }, rays)?;
        Ok(met.iter().zip(rays).map(|(met, ray)| self.answer(met, ray)).collect())
    }

    /// With the side of the surface, which follows from the place.
    fn answer(&self, met: &Met, ray: &Ray) -> Answer {
        if met.what == OUT_OF_STEPS {
            return Answer::OutOfSteps;
        }
        if met.what != SURFACE {
            return Answer::Left;
        }
        let side = self.field.side(met.face as usize, met.at, ray.direction);
        // A surface through the capture point has no side.
        let Some((normal, back)) = side else { return Answer::Left };
        Answer::Surface(FieldHit { t: met.t, normal, back, at_gap: met.at_gap != 0, hidden_side: None })
    }
}
