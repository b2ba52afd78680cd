//! Which GPU is used.

use super::{GpuError, GpuResult};
use wgpu::{Adapter, DeviceType, Instance, InstanceDescriptor, PowerPreference, RequestAdapterOptions};

/// A GPU, as it is told to users.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterDescription {
    /// Its name.
    pub name: String,
    /// The interface it is driven through: `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// Driver and version.
    pub driver: String,
    /// It is a program on the CPU, such as Mesa's lavapipe: right, but slower than the CPU twins.
    pub software: bool,
}

impl std::fmt::Display for AdapterDescription {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = if self.software { ", software" } else { "" };
        write!(f, "{} ({}{kind})", self.name, self.backend)
    }
}

/// Environment variable that names the adapter, as wgpu's examples read it: a part of the name, in any case.
const NAME_VARIABLE: &str = "WGPU_ADAPTER_NAME";

/// The adapter the environment asks for (`WGPU_BACKEND`, `WGPU_ADAPTER_NAME`, `WGPU_POWER_PREF`), otherwise the fastest.
///
/// wgpu's own helper for the name panics if nothing matches, so that the search is done here.
pub(super) fn choose() -> GpuResult<Adapter> {
    let descriptor = InstanceDescriptor::new_without_display_handle_from_env();
    let backends = descriptor.backends;
    let instance = Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    if adapters.is_empty() {
        return Err(GpuError::NoAdapter { problem: "there is no driver for Vulkan, Metal or DirectX 12 with a device".into() });
    }
    if let Ok(wanted) = std::env::var(NAME_VARIABLE) {
        let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        let found = adapters.into_iter().find(|a| a.get_info().name.to_lowercase().contains(&wanted.to_lowercase()));
        return found.ok_or_else(|| GpuError::NoAdapter {
            problem: format!("{NAME_VARIABLE} is `{wanted}`, and there is only {}", names.join(", ")),
        });
    }
    let power_preference = PowerPreference::from_env().unwrap_or(PowerPreference::HighPerformance);
    let options = RequestAdapterOptions { power_preference, ..Default::default() };
    pollster::block_on(instance.request_adapter(&options)).map_err(|e| GpuError::NoAdapter { problem: e.to_string() })
}

/// What users are told of an adapter.
pub(super) fn describe(adapter: &Adapter) -> AdapterDescription {
    let info = adapter.get_info();
    AdapterDescription {
        name: info.name,
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        software: info.device_type == DeviceType::Cpu,
    }
}
