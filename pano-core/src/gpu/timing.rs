//! How long dispatches take on the GPU, where it can tell.

use super::{Gpu, GpuResult, Kernel};
use std::sync::PoisonError;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, ComputePassTimestampWrites, Device, MapMode, PollType,
    QuerySet, QuerySetDescriptor, QueryType,
};

/// Dispatches that are remembered between two calls of [`Gpu::take_timings`]; later ones are not timed.
const MOST: u32 = 1024;
/// Bytes of a timestamp.
const STAMP: u64 = 8;

/// How long one dispatch took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// The shader.
    pub shader: &'static str,
    /// The entry point.
    pub entry: &'static str,
    /// Milliseconds on the GPU.
    pub ms: f64,
}

/// Timestamps that were asked for.
#[derive(Debug)]
pub(super) struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    readable: Buffer,
    /// Nanoseconds a tick.
    period: f32,
    begun: Vec<(&'static str, &'static str)>,
}

impl Timer {
    pub(super) fn new(device: &Device, period: f32) -> Self {
        let count = 2 * MOST;
        let buffer = |usage| {
            let size = STAMP * u64::from(count);
            device.create_buffer(&BufferDescriptor { label: Some("timestamps"), size, usage, mapped_at_creation: false })
        };
        Self {
            queries: device.create_query_set(&QuerySetDescriptor { label: Some("timestamps"), ty: QueryType::Timestamp, count }),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            readable: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            period,
            begun: Vec::new(),
        }
    }

    /// Where a dispatch notes its times, if there is room.
    pub(super) fn begin(&mut self, kernel: &Kernel<'_>) -> Option<ComputePassTimestampWrites<'_>> {
        let at = self.begun.len() as u32;
        if at == MOST {
            return None;
        }
        self.begun.push((kernel.shader.name, kernel.entry));
        Some(ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * at),
            end_of_pass_write_index: Some(2 * at + 1),
        })
    }
}

impl Gpu {
    /// Times of the dispatches since the last call, in order, once they are done; empty unless
    /// [`super::GpuOptions::timestamps`] was set and the GPU can tell.
    ///
    /// # Errors
    /// What has become of the device.
    pub fn take_timings(&self) -> GpuResult<Vec<Timing>> {
        let Some(timer) = &self.timer else { return Ok(Vec::new()) };
        let mut timer = timer.lock().unwrap_or_else(PoisonError::into_inner);
        let begun = std::mem::take(&mut timer.begun);
        if begun.is_empty() {
            return Ok(Vec::new());
        }
        let count = 2 * begun.len() as u32;
        let bytes = STAMP * u64::from(count);
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("timestamps") });
        encoder.resolve_query_set(&timer.queries, 0..count, &timer.resolved, 0);
        encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.readable, 0, bytes);
        self.submit(encoder.finish())?;
        let refused = |problem: String| self.refusal(problem);
        timer.readable.slice(0..bytes).map_async(MapMode::Read, |_| {});
        let waited = self.device.poll(PollType::wait_indefinitely());
        self.check()?;
        waited.map_err(|e| refused(e.to_string()))?;
        let stamps: Vec<u64> = {
            let view = timer.readable.slice(0..bytes).get_mapped_range().map_err(|e| refused(e.to_string()))?;
            bytemuck::pod_collect_to_vec(&view)
        };
        timer.readable.unmap();
        let ms = |pair: &[u64]| pair[1].saturating_sub(pair[0]) as f64 * f64::from(timer.period) * 1e-6;
        Ok(begun.iter().zip(stamps.chunks(2)).map(|(&(shader, entry), pair)| Timing { shader, entry, ms: ms(pair) }).collect())
    }
}
