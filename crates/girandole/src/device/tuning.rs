//! Which variants of the kernels suit a device.

/// Which variants of the kernels suit a device. All give the same picture up to rounding; [`DeviceTuning::for_device`]
/// chooses. Gains are those measured on lavapipe, Mesa's software driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DeviceTuning {
    /// Points and candidates are fetched from a work queue by few small workgroups, rather than dispatched one an
    /// invocation. Software drivers assign each thread a run of workgroups beforehand and wait for the slowest: on them
    /// threads stay busy. GPUs balance workgroups by themselves.
    pub persistent_threads: bool,
    /// Shadow maps are read as storage textures. Software devices need a third of the instructions for that: mode naive takes a sixth
    /// less time, mode full a quarter.
    pub maps_as_images: bool,
    /// Branches on uniform values depend on an index as well. Mesa's software driver recompiles a kernel whenever it is
    /// bound with other uniforms that decide a branch; elsewhere uniform branches are the cheapest.
    pub non_uniform_branches: bool,
    /// Texels of shadow maps are loaded only when the addresses of all four that an invocation needs next are known, so that
    /// their latencies overlap: a tenth less time for mode full. GPUs' compilers see to that by themselves.
    pub batched_loads: bool,
    /// Pixels at edges are interpolated in runs of eight an invocation, which share half of what they read: a tenth
    /// less time with `samples_per_axis` 2 where invocations are executed one after another. GPUs need the parallelism more.
    pub edge_runs: bool,
    /// In the low-resolution modes, 16 lanes share each point. Faster where there are thousands of lanes for few
    /// points, slower on software devices.
    pub cooperative_points: bool,
    /// Where lanes read different lights at once, the lights are in a storage buffer rather than a uniform one: faster on
    /// GPUs, slower on software devices. It takes a storage buffer more.
    pub lights_in_storage: bool,
}

impl DeviceTuning {
    /// For GPUs.
    pub const GPU: Self = Self {
        persistent_threads: false,
        maps_as_images: false,
        non_uniform_branches: false,
        batched_loads: false,
        edge_runs: false,
        cooperative_points: true,
        lights_in_storage: true,
    };

    /// For Mesa's software driver.
    pub const SOFTWARE: Self = Self {
        persistent_threads: true,
        maps_as_images: true,
        non_uniform_branches: true,
        batched_loads: true,
        edge_runs: true,
        cooperative_points: false,
        lights_in_storage: false,
    };

    /// By the driver of the device: kernels for Mesa's software driver are too large for others. On GPUs lights are in storage where the
    /// device was created with more storage buffers a stage than the eight of WebGPU's defaults
    /// ([`wanted_limits`](crate::wanted_limits)).
    pub fn for_device(device: &wgpu::Device) -> Self {
        let info = device.adapter_info();
        if [&info.driver, &info.name].into_iter().any(|name| name.contains("llvmpipe")) {
            return Self::SOFTWARE;
        }
        let lights_in_storage = device.limits().max_storage_buffers_per_shader_stage > 8;
        Self { lights_in_storage, ..Self::GPU }
    }
}
