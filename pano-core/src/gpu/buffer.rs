//! Memory of the GPU: a pool of buffers, uploads and read-back.

use super::{Gpu, GpuError, GpuResult};
use bytemuck::Pod;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use wgpu::{Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, MapMode, PollType};

/// Smallest buffer of the pool, in bytes: sizes are powers of two from here on.
const SMALLEST: u64 = 256;
/// Bytes of free buffers that are kept for later; the rest is given back.
const KEPT: u64 = 1 << 29;

/// What a buffer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Purpose {
    Storage,
    Uniform,
    ReadBack,
}

impl Purpose {
    fn usages(self) -> BufferUsages {
        match self {
            Self::Storage => BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            Self::Uniform => BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            Self::ReadBack => BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        }
    }
}

/// Bytes that went to and from a GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// To the GPU.
    pub uploaded: u64,
    /// From the GPU.
    pub read: u64,
}

/// Buffers that are not in use, and counters.
#[derive(Debug, Default)]
pub(super) struct Pool {
    free: Mutex<Free>,
    uploaded: AtomicU64,
    read: AtomicU64,
}

#[derive(Debug, Default)]
struct Free {
    buffers: BTreeMap<(Purpose, u64), Vec<Buffer>>,
    bytes: u64,
}

impl Pool {
    fn take(&self, key: (Purpose, u64)) -> Option<Buffer> {
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let buffer = free.buffers.get_mut(&key)?.pop()?;
        free.bytes -= key.1;
        Some(buffer)
    }

    fn give(&self, key: (Purpose, u64), buffer: Buffer) {
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        if free.bytes + key.1 <= KEPT {
            free.bytes += key.1;
            free.buffers.entry(key).or_default().push(buffer);
        }
    }
}

/// Memory of the GPU. It goes back to the pool when dropped; work submitted before is done first.
#[derive(Debug)]
pub struct GpuBuffer {
    /// Taken out on dropping only.
    buffer: Option<Buffer>,
    bytes: u64,
    purpose: Purpose,
    pool: Arc<Pool>,
}

impl GpuBuffer {
    /// Bytes that are bound.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The part of the pool's buffer that is in use.
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        let size = wgpu::BufferSize::new(self.bytes);
        wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: self.raw(), offset: 0, size })
    }

    fn raw(&self) -> &Buffer {
        self.buffer.as_ref().expect("a buffer is taken out on dropping only")
    }
}

impl Drop for GpuBuffer {
    fn drop(&mut self) {
        if let Some(buffer) = self.buffer.take() {
            let class = buffer.size();
            self.pool.give((self.purpose, class), buffer);
        }
    }
}

impl Gpu {
    pub(super) fn allocate(&self, purpose: Purpose, bytes: u64) -> GpuResult<GpuBuffer> {
        // Copies come in units of four bytes, and nothing is no binding.
        let bytes = bytes.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT).max(wgpu::COPY_BUFFER_ALIGNMENT);
        if bytes > self.max_binding() {
            return Err(GpuError::TooLarge { bytes, limit: self.max_binding() });
        }
        let class = bytes.next_power_of_two().max(SMALLEST);
        let buffer = self.pool.take((purpose, class)).unwrap_or_else(|| {
            let usage = purpose.usages();
            self.device.create_buffer(&BufferDescriptor { label: None, size: class, usage, mapped_at_creation: false })
        });
        self.check()?;
        Ok(GpuBuffer { buffer: Some(buffer), bytes, purpose, pool: self.pool.clone() })
    }

    /// Storage for `count` values; what is in it is not specified.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], or what has become of the device.
    pub fn buffer<T: Pod>(&self, count: usize) -> GpuResult<GpuBuffer> {
        self.allocate(Purpose::Storage, (count * size_of::<T>()) as u64)
    }

    /// Storage that holds `values`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], or what has become of the device.
    pub fn upload_slice<T: Pod>(&self, values: &[T]) -> GpuResult<GpuBuffer> {
        let buffer = self.buffer::<T>(values.len())?;
        self.write(&buffer, bytemuck::cast_slice(values));
        Ok(buffer)
    }

    /// Fills a buffer from its start; lengths are multiples of four bytes.
    pub(super) fn write(&self, buffer: &GpuBuffer, bytes: &[u8]) {
        self.pool.uploaded.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.queue.write_buffer(buffer.raw(), 0, bytes);
    }

    /// Copies one buffer to the beginning of another.
    ///
    /// # Errors
    /// What has become of the device.
    ///
    /// # Panics
    /// If the other one is shorter.
    pub fn copy(&self, from: &GpuBuffer, to: &GpuBuffer) -> GpuResult<()> {
        assert!(from.bytes <= to.bytes, "{} bytes into {}", from.bytes, to.bytes);
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("copy") });
        encoder.copy_buffer_to_buffer(from.raw(), 0, to.raw(), 0, from.bytes);
        self.submit(encoder.finish())
    }

    /// The first `count` values of a buffer, once all work submitted is done.
    ///
    /// # Errors
    /// What has become of the device.
    ///
    /// # Panics
    /// If the buffer is shorter.
    pub fn read_slice<T: Pod>(&self, buffer: &GpuBuffer, count: usize) -> GpuResult<Vec<T>> {
        self.read_part(buffer, 0, count)
    }

    /// `count` values of a buffer from the one with index `start` on.
    pub(super) fn read_part<T: Pod>(&self, buffer: &GpuBuffer, start: usize, count: usize) -> GpuResult<Vec<T>> {
        let (offset, bytes) = ((start * size_of::<T>()) as u64, (count * size_of::<T>()) as u64);
        assert!(offset + bytes <= buffer.bytes, "{bytes} bytes from {offset} on of a buffer of {}", buffer.bytes);
        if count == 0 {
            return Ok(Vec::new());
        }
        let staging = self.allocate(Purpose::ReadBack, bytes)?;
        let mut encoder = self.device.create_command_encoder(&CommandEncoderDescriptor { label: Some("read back") });
        encoder.copy_buffer_to_buffer(buffer.raw(), offset, staging.raw(), 0, bytes);
        self.submit(encoder.finish())?;
        self.pool.read.fetch_add(bytes, Ordering::Relaxed);

        let refused = |problem: String| self.refusal(problem);
        let (done, told) = mpsc::channel();
        staging.raw().slice(0..bytes).map_async(MapMode::Read, move |result| {
            // The receiver is gone only if waiting failed, which is told there.
            let _ = done.send(result);
        });
        let waited = self.device.poll(PollType::wait_indefinitely());
        self.check()?;
        waited.map_err(|e| refused(e.to_string()))?;
        told.recv().map_err(|e| refused(e.to_string()))?.map_err(|e| refused(e.to_string()))?;
        let values = {
            let view = staging.raw().slice(0..bytes).get_mapped_range().map_err(|e| refused(e.to_string()))?;
            bytemuck::pod_collect_to_vec(&view)
        };
        staging.raw().unmap();
        self.check()?;
        Ok(values)
    }

    /// Bytes moved so far.
    pub fn traffic(&self) -> Traffic {
        Traffic { uploaded: self.pool.uploaded.load(Ordering::Relaxed), read: self.pool.read.load(Ordering::Relaxed) }
    }
}
