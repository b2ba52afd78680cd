//! Kernels: entry points of shaders, compiled once for each specialisation.

use super::buffer::Purpose;
use super::{Gpu, GpuBuffer, GpuResult, Shader};
use std::collections::HashMap;
use std::sync::PoisonError;
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, CommandEncoderDescriptor, ComputePassDescriptor, ComputePipeline,
    ComputePipelineDescriptor, PipelineCompilationOptions, ShaderModule, ShaderModuleDescriptor, ShaderSource,
};

/// An entry point of a shader with its specialisation.
#[derive(Clone, Copy, Debug)]
pub struct Kernel<'a> {
    /// The shader.
    pub shader: &'static Shader,
    /// The entry point's name.
    pub entry: &'static str,
    /// Values of its `override` constants.
    pub constants: &'a [(&'static str, f64)],
}

/// A switch as the value of an `override` constant.
pub const fn flag(on: bool) -> f64 {
    if on { 1.0 } else { 0.0 }
}

/// Shader, entry point and the constants' bits.
type Key = (&'static str, &'static str, Vec<(&'static str, u64)>);

/// What has been compiled.
#[derive(Debug, Default)]
pub(super) struct Pipelines {
    modules: HashMap<&'static str, ShaderModule>,
    pipelines: HashMap<Key, ComputePipeline>,
}

impl Gpu {
    /// The kernel's pipeline, compiled on first use.
    fn pipeline(&self, kernel: &Kernel<'_>) -> ComputePipeline {
        let mut compiled = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let Pipelines { modules, pipelines } = &mut *compiled;
        let bits = kernel.constants.iter().map(|&(name, value)| (name, value.to_bits())).collect();
        let key = (kernel.shader.name, kernel.entry, bits);
        let make = || {
            let module = modules.entry(kernel.shader.name).or_insert_with(|| {
                let source = ShaderSource::Wgsl(kernel.shader.source().into());
                self.device.create_shader_module(ShaderModuleDescriptor { label: Some(kernel.shader.name), source })
            });
            self.device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(kernel.entry),
                layout: None,
                module,
                entry_point: Some(kernel.entry),
                compilation_options: PipelineCompilationOptions { constants: kernel.constants, ..Default::default() },
                cache: None,
            })
        };
        pipelines.entry(key).or_insert_with(make).clone()
    }

    /// Pipelines compiled so far.
    pub fn compiled(&self) -> usize {
        self.pipelines.lock().unwrap_or_else(PoisonError::into_inner).pipelines.len()
    }

    /// Runs a kernel: `uniform` is bound at 0, the buffers at the numbers beside them. Work is done in the order of the calls;
    /// each is a submission of its own, so that none is long.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn dispatch(
        &self,
        kernel: &Kernel<'_>,
        uniform: &[u8],
        buffers: &[(u32, &GpuBuffer)],
        groups: [u32; 3],
    ) -> GpuResult<()> {
        let parameters = self.allocate(Purpose::Uniform, uniform.len() as u64)?;
        self.write(&parameters, uniform);
        let pipeline = self.pipeline(kernel);
        self.check()?;
        let entries: Vec<BindGroupEntry<'_>> = std::iter::once((0, &parameters))
            .chain(buffers.iter().copied())
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.binding() })
            .collect();
        let group = self.device.create_bind_group(&BindGroupDescriptor {
            label: Some(kernel.entry),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut timer = self.timer.as_ref().map(|t| t.lock().unwrap_or_else(PoisonError::into_inner));
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some(kernel.entry) });
        {
            let timestamp_writes = timer.as_deref_mut().and_then(|t| t.begin(kernel));
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor { label: Some(kernel.entry), timestamp_writes });
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            let [x, y, z] = groups;
            pass.dispatch_workgroups(x, y, z);
        }
        self.submit(encoder.finish())
    }
}
