//! Adapters: which there are, and which one is taken.

use crate::error::GpuError;

/// Which adapter is taken.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The fastest real GPU; where there is none, a software one.
    #[default]
    Best,
    /// The first whose name contains this, whatever its letters' case.
    Named(String),
}

/// What is to be known of an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its name, as the driver tells it.
    pub name: String,
    /// The driver and its version, where they are told.
    pub driver: String,
    /// The interface that it is spoken to through: `Vulkan`, `Metal`, `Dx12`.
    pub backend: String,
    /// Whether it is a processor that plays GPU.
    pub software: bool,
    kind: wgpu::DeviceType,
}

impl AdapterSummary {
    /// What there is to know of one.
    pub fn of(adapter: &wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        let driver = [info.driver, info.driver_info].join(" ").trim().to_owned();
        let software = info.device_type == wgpu::DeviceType::Cpu;
        Self { name: info.name, driver, backend: info.backend.to_string(), software, kind: info.device_type }
    }

    /// What sort of device it is, in words.
    pub fn kind(&self) -> &'static str {
        match self.kind {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "unknown kind",
        }
    }

    /// Its place among others: the better ones first.
    pub fn rank(&self) -> u32 {
        match self.kind {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        }
    }
}

/// All adapters of this machine, the best one first.
pub fn adapters() -> Vec<AdapterSummary> {
    pollster::block_on(available()).iter().map(AdapterSummary::of).collect()
}

/// OpenGL is left out: it writes only the first slice of 3D textures and cannot read depths back.
const BACKENDS: wgpu::Backends = wgpu::Backends::PRIMARY;

async fn available() -> Vec<wgpu::Adapter> {
    let descriptor = wgpu::InstanceDescriptor {
        backends: BACKENDS,
        // Where the system tells what memory is left, running out of it is found before the driver, or the system, fails.
        memory_budget_thresholds: wgpu::MemoryBudgetThresholds {
            for_resource_creation: Some(95),
            for_device_loss: None,
        },
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    };
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = instance.enumerate_adapters(BACKENDS).await;
    // Stable: of equal ones the driver's first.
    adapters.sort_by_key(|a| AdapterSummary::of(a).rank());
    adapters
}

pub(super) async fn choose(choice: &AdapterChoice) -> Result<wgpu::Adapter, GpuError> {
    let mut adapters = available().await;
    let position = match choice {
        AdapterChoice::Best => 0,
        AdapterChoice::Named(wanted) => {
            let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
            let like = |name: &String| name.to_lowercase().contains(&wanted.to_lowercase());
            names.iter().position(like).ok_or_else(|| GpuError::UnknownAdapter {
                wanted: wanted.clone(),
                found: if names.is_empty() { "none".to_owned() } else { names.join(", ") },
            })?
        }
    };
    if position < adapters.len() {
        return Ok(adapters.swap_remove(position));
    }
    Err(GpuError::NoAdapter { reason: "the system lists none".to_owned() })
}
