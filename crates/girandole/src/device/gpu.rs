//! Adapters, what the renderer asks of them, and a device of one's own for programs without a window.

use crate::{Error, Result};
use std::future::Future;
use std::pin::pin;
use std::sync::{Arc, OnceLock};
use std::task::{Context, Poll, Waker};

/// Features that the renderer uses where a device has them. None is required.
pub const WANTED_FEATURES: wgpu::Features =
    wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::FLOAT32_BLENDABLE);

/// The limits to ask of an adapter: WebGPU's defaults, and where the adapter has more, larger buffers and textures.
pub fn wanted_limits(adapter: &wgpu::Adapter) -> wgpu::Limits {
    let has = adapter.limits();
    wgpu::Limits {
        max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
        max_buffer_size: has.max_buffer_size,
        max_texture_dimension_2d: has.max_texture_dimension_2d,
        // One more than the default is used where it is there.
        max_storage_buffers_per_shader_stage: has.max_storage_buffers_per_shader_stage.min(16),
        ..wgpu::Limits::default()
    }
}

/// What an adapter is and can do.
#[derive(Clone, Debug)]
pub struct AdapterReport {
    /// Its name.
    pub name: String,
    /// Vulkan, Metal, Dx12 or BrowserWebGpu.
    pub backend: String,
    /// DiscreteGpu, IntegratedGpu, VirtualGpu, Cpu or Other.
    pub kind: String,
    /// Driver and its version.
    pub driver: String,
    /// Whether the renderer runs on it: it meets WebGPU's default limits and can compute.
    pub usable: bool,
    /// Whether passes can be timed on the device.
    pub timestamps: bool,
    /// Largest texture, texels across.
    pub max_texture: u32,
    /// Largest buffer that a shader can see, bytes.
    pub max_storage: u64,
}

impl AdapterReport {
    fn new(adapter: &wgpu::Adapter) -> Self {
        let (info, features, limits) = (adapter.get_info(), adapter.features(), adapter.limits());
        Self {
            backend: format!("{:?}", info.backend),
            kind: format!("{:?}", info.device_type),
            driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
            name: info.name,
            usable: is_usable(adapter),
            timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
            max_texture: limits.max_texture_dimension_2d,
            max_storage: limits.max_storage_buffer_binding_size,
        }
    }
}

fn is_usable(adapter: &wgpu::Adapter) -> bool {
    adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        && wgpu::Limits::default().check_limits(&adapter.limits())
}

/// All adapters of this machine, the ones that the renderer would choose first.
pub async fn adapters() -> Vec<AdapterReport> {
    enumerate().await.iter().map(AdapterReport::new).collect()
}

/// Vulkan, Metal and Direct3D 12. OpenGL is left out: its shaders cannot read texels of depth textures.
fn backends() -> wgpu::Backends {
    wgpu::Backends::all() - wgpu::Backends::GL
}

/// An instance with the backends that the renderer runs on, for programs that make a surface for [`Gpu::for_surface`].
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends();
    // Indirect calls take what the renderer's own kernels count: no need to check each before it is made.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    wgpu::Instance::new(descriptor)
}

async fn enumerate() -> Vec<wgpu::Adapter> {
    sorted(instance().enumerate_adapters(backends()).await)
}

/// Usable ones first, then real GPUs before software.
fn sorted(mut adapters: Vec<wgpu::Adapter>) -> Vec<wgpu::Adapter> {
    adapters.sort_by_key(|a| {
        let info = a.get_info();
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        };
        (!is_usable(a), kind)
    });
    adapters
}

/// A device of the renderer's own, with or without a window.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What it is.
    pub info: wgpu::AdapterInfo,
    failures: Arc<Failures>,
}

/// What no call returned.
#[derive(Debug, Default)]
struct Failures {
    /// The first error, such as a lack of memory.
    error: OnceLock<String>,
    /// Why the device was lost.
    lost: OnceLock<String>,
    /// What is called then.
    on_loss: OnceLock<OnLoss>,
}

struct OnLoss(Box<dyn Fn() + Send + Sync>);

impl std::fmt::Debug for OnLoss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("OnLoss")
    }
}

impl Gpu {
    /// Opens the best adapter, or the best one whose name contains `name` (case does not matter).
    ///
    /// # Errors
    /// [`Error::NoAdapter`], [`Error::UnknownAdapter`], or [`Error::Unsupported`] where the best one that has the name
    /// cannot do it.
    pub async fn new(name: Option<&str>) -> Result<Self> {
        Self::with_features(name, WANTED_FEATURES).await
    }

    /// The same, using only these of the features that the adapter has.
    ///
    /// # Errors
    /// As for [`Gpu::new`].
    pub async fn with_features(name: Option<&str>, wanted: wgpu::Features) -> Result<Self> {
        Self::choose(enumerate().await, name, wanted).await
    }

    /// Opens the best adapter that can show pictures on a surface, or the best such one whose name contains `name`. The
    /// surface is one of the [`instance`].
    ///
    /// # Errors
    /// As for [`Gpu::new`].
    pub async fn for_surface(
        instance: &wgpu::Instance,
        surface: &wgpu::Surface<'_>,
        name: Option<&str>,
    ) -> Result<Self> {
        let mut all = sorted(instance.enumerate_adapters(backends()).await);
        all.retain(|adapter| adapter.is_surface_supported(surface));
        Self::choose(all, name, WANTED_FEATURES).await
    }

    async fn choose(all: Vec<wgpu::Adapter>, name: Option<&str>, wanted: wgpu::Features) -> Result<Self> {
        let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
        let matches = |a: &wgpu::Adapter| {
            name.is_none_or(|n| a.get_info().name.to_lowercase().contains(&n.to_lowercase()))
        };
        let Some(adapter) = all.into_iter().find(matches) else {
            return Err(match name {
                Some(name) if !names.is_empty() => {
                    Error::UnknownAdapter { name: name.into(), known: names.join(", ") }
                }
                _ => Error::NoAdapter,
            });
        };
        Self::open(adapter, wanted).await
    }

    async fn open(adapter: wgpu::Adapter, wanted: wgpu::Features) -> Result<Self> {
        let info = adapter.get_info();
        if !is_usable(&adapter) {
            let what = "compute shaders or WebGPU's default limits".into();
            return Err(Error::Unsupported { adapter: info.name, what });
        }
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("girandole"),
                required_features: adapter.features() & wanted,
                required_limits: wanted_limits(&adapter),
                ..Default::default()
            })
            .await
            .map_err(|e| Error::Device(e.to_string()))?;
        let failures = Arc::<Failures>::default();
        let held = failures.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let _ = held.error.set(error.to_string());
        }));
        let held = failures.clone();
        device.set_device_lost_callback(move |_, message| {
            let _ = held.lost.set(match message.trim_end_matches('.') {
                "" => "the device was lost".into(),
                why => format!("the device was lost: {why}"),
            });
            held.on_loss.get().into_iter().for_each(|on_loss| (on_loss.0)());
        });
        Ok(Self { adapter, device, queue, info, failures })
    }

    /// Completes what is done by now, without waiting: for programs that draw frame by frame.
    ///
    /// # Errors
    /// As for [`Gpu::wait`].
    pub fn poll(&self) -> Result<()> {
        self.device.poll(wgpu::PollType::Poll).map_err(|e| Error::Device(e.to_string()))?;
        self.failure()
    }

    /// Waits until everything submitted so far is done.
    ///
    /// # Errors
    /// [`Error::Device`] where the device was lost, or anything before went wrong on it.
    pub fn wait(&self) -> Result<()> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| Error::Device(e.to_string()))?;
        self.failure()
    }

    /// Whether the device was lost: nothing works on it any more, but another one may be opened.
    pub fn is_lost(&self) -> bool {
        self.failures.lost.get().is_some()
    }

    /// Has something called once the device is lost, such as what wakes a program that waits for events. The first one counts.
    pub fn on_loss(&self, call: impl Fn() + Send + Sync + 'static) {
        let _ = self.failures.on_loss.set(OnLoss(Box::new(call)));
    }

    fn failure(&self) -> Result<()> {
        // Errors that follow a loss say less.
        let failure = self.failures.lost.get().or(self.failures.error.get());
        failure.map_or(Ok(()), |failure| Err(Error::Device(failure.clone())))
    }

    /// Runs a future to its end, polling the device in between: for programs that have nothing else to do.
    ///
    /// # Errors
    /// [`Error::Device`] where the device was lost.
    pub fn block_on<T>(&self, future: impl Future<Output = T>) -> Result<T> {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        loop {
            if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
                return Ok(value);
            }
            self.wait()?;
        }
    }
}
