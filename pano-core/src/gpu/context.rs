//! The device and what belongs to it.

use super::buffer::Pool;
use super::kernel::Pipelines;
use super::timing::Timer;
use super::{AdapterDescription, GpuError, GpuResult, adapter};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::{Device, DeviceDescriptor, Features, Limits, Queue};

/// How a device is set up.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Largest binding in bytes, below the device's own: larger pictures go in bands. For tests, and to save memory. Default
    /// `None`.
    pub max_binding: Option<u64>,
    /// A test hook: after so many submissions the device is destroyed, as if the driver had reset it. Default `None`.
    pub lose_after: Option<u32>,
    /// Measure how long each dispatch takes on the GPU, where it can tell; see [`Gpu::take_timings`]. Default false.
    pub timestamps: bool,
}

/// What a device has come to, told by callbacks on any thread.
#[derive(Debug, Default)]
struct Fate {
    lost: Mutex<Option<String>>,
    refused: Mutex<Option<String>>,
}

/// A GPU, ready for work. All methods may be called from any thread; work is done in the order in which it is submitted.
#[derive(Debug)]
pub struct Gpu {
    adapter: AdapterDescription,
    pub(super) device: Device,
    pub(super) queue: Queue,
    pub(super) pool: Arc<Pool>,
    pub(super) pipelines: Mutex<Pipelines>,
    pub(super) timer: Option<Mutex<Timer>>,
    fate: Arc<Fate>,
    submissions: AtomicU32,
    max_binding: u64,
    lose_after: Option<u32>,
}

impl Gpu {
    /// Sets up the GPU that the environment asks for (`WGPU_BACKEND`, `WGPU_ADAPTER_NAME`), otherwise the fastest.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] if there is none, or none with what WebGPU promises everywhere: bindings of 128 MiB and eight
    /// storage buffers a stage.
    pub fn new(options: &GpuOptions) -> GpuResult<Self> {
        let chosen = adapter::choose()?;
        let adapter = adapter::describe(&chosen);
        // No more than what every GPU has: what passes here passes everywhere.
        let required_limits = Limits::default();
        let mut missing = Vec::new();
        required_limits.check_limits_with_fail_fn(&chosen.limits(), false, |name, wanted, allowed| {
            missing.push(format!("{name} is {allowed}, not {wanted}"));
        });
        if !missing.is_empty() {
            return Err(GpuError::NoAdapter { problem: format!("{adapter} is too small: {}", missing.join(", ")) });
        }
        let timed = options.timestamps && chosen.features().contains(Features::TIMESTAMP_QUERY);
        let descriptor = DeviceDescriptor {
            label: Some("pano"),
            required_features: if timed { Features::TIMESTAMP_QUERY } else { Features::empty() },
            required_limits,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(chosen.request_device(&descriptor))
            .map_err(|e| GpuError::NoAdapter { problem: format!("{adapter}: {e}") })?;

        let fate = Arc::new(Fate::default());
        let told = fate.clone();
        device.set_device_lost_callback(move |reason, message| {
            keep_first(&told.lost, format!("{reason:?} {message}").trim().to_lowercase());
        });
        let told = fate.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| keep_first(&told.refused, error.to_string())));
        let limit = device.limits().max_storage_buffer_binding_size;
        Ok(Self {
            adapter,
            pool: Arc::new(Pool::default()),
            pipelines: Mutex::default(),
            timer: timed.then(|| Mutex::new(Timer::new(&device, queue.get_timestamp_period()))),
            fate,
            submissions: AtomicU32::new(0),
            max_binding: options.max_binding.map_or(limit, |wanted| wanted.min(limit)),
            lose_after: options.lose_after,
            device,
            queue,
        })
    }

    /// What it is.
    pub fn adapter(&self) -> &AdapterDescription {
        &self.adapter
    }

    /// Bytes that one binding may have.
    pub fn max_binding(&self) -> u64 {
        self.max_binding
    }

    /// How often work was submitted.
    pub fn submissions(&self) -> u32 {
        self.submissions.load(Ordering::Relaxed)
    }

    /// Destroys the device, as if the driver had reset it: a test hook.
    pub fn lose(&self) {
        self.device.destroy();
        // The callback tells the reason, now if there is no work left, otherwise when it has ended.
        let _ = self.device.poll(wgpu::PollType::Poll);
    }

    /// Whether the device can still be used.
    ///
    /// # Errors
    /// [`GpuError::Lost`] or [`GpuError::Refused`], whichever came first.
    pub fn check(&self) -> GpuResult<()> {
        self.lost()?;
        match self.fate.refused.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(problem) => Err(self.refusal(problem)),
            None => Ok(()),
        }
    }

    /// What is behind a refused command: a lost device refuses all of them, but says that it is lost only when its work has ended.
    pub(super) fn refusal(&self, problem: String) -> GpuError {
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.lost().err().unwrap_or(GpuError::Refused { problem })
    }

    fn lost(&self) -> GpuResult<()> {
        match self.fate.lost.lock().unwrap_or_else(PoisonError::into_inner).clone() {
            Some(reason) => Err(GpuError::Lost { reason }),
            None => Ok(()),
        }
    }

    /// Submits what was recorded.
    pub(super) fn submit(&self, commands: wgpu::CommandBuffer) -> GpuResult<()> {
        let done = self.submissions.fetch_add(1, Ordering::Relaxed);
        if self.lose_after.is_some_and(|most| done >= most) {
            self.lose();
        }
        self.check()?;
        self.queue.submit([commands]);
        self.check()
    }
}

/// Later errors are consequences of the first one.
fn keep_first(slot: &Mutex<Option<String>>, text: String) {
    slot.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
}
