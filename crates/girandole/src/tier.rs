//! Which kernels suit a device.

/// Which of two sets of kernels suits a device. Both give the same picture up to rounding; [`Tier::for_device`] chooses. What the
/// kernels of software drivers have for themselves is in `shaders/software`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Tier {
    /// For GPUs: workgroups are balanced by the device, lanes share points, branches are uniform.
    Gpu,
    /// For Mesa's software driver, lavapipe, on which gains were measured. Points and candidates are fetched from a work queue by few
    /// small workgroups, as the driver assigns each thread a run of workgroups beforehand and waits for the slowest. Shadow maps are read
    /// as storage textures, in a third of the instructions, four texels together: mode full takes a third less time. Branches on
    /// uniform values depend on an index as well, as the driver compiles kernels anew for other values. Pixels at edges are
    /// interpolated in runs of eight an invocation.
    Software,
}

impl Tier {
    /// By the driver of the device: kernels for Mesa's software driver are too large for others.
    pub fn for_device(device: &wgpu::Device) -> Self {
        let info = device.adapter_info();
        let is_lavapipe = [&info.driver, &info.name].into_iter().any(|name| name.contains("llvmpipe"));
        if is_lavapipe { Self::Software } else { Self::Gpu }
    }

    /// Of a kernel or a setting for GPUs and one for software drivers, that for this one.
    pub(crate) fn choose<T>(self, gpu: T, software: T) -> T {
        match self {
            Self::Gpu => gpu,
            Self::Software => software,
        }
    }
}

/// Which variants of kernels: by the tier, the device, and what a pass or a scene needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Kernels {
    pub tier: Tier,
    /// Whether kernels whose lanes read different lights have them in a storage buffer, not in a uniform one: faster on GPUs. With it some
    /// kernels have nine storage buffers, one more than WebGPU's default limit: the device has to be created with
    /// [`wanted_limits`](crate::wanted_limits).
    pub lights_in_storage: bool,
    /// Whether pixels show the ends of mirrored rays, not what the camera sees.
    pub mirrored: bool,
    /// Whether surfaces show an environment beyond what light samples resolve.
    pub reflects_environment: bool,
}

impl Kernels {
    pub fn new(tier: Tier, device: &wgpu::Device) -> Self {
        let has_room = device.limits().max_storage_buffers_per_shader_stage > 8;
        Self::of(tier, tier == Tier::Gpu && has_room, [false, false])
    }

    const fn of(tier: Tier, lights_in_storage: bool, [mirrored, reflects_environment]: [bool; 2]) -> Self {
        Self { tier, lights_in_storage, mirrored, reflects_environment }
    }

    /// All that there are.
    pub const ALL: [Self; 12] = [
        Self::of(Tier::Gpu, true, [false, false]),
        Self::of(Tier::Gpu, false, [false, false]),
        Self::of(Tier::Gpu, true, [false, true]),
        Self::of(Tier::Gpu, false, [false, true]),
        Self::of(Tier::Gpu, true, [true, false]),
        Self::of(Tier::Gpu, false, [true, false]),
        Self::of(Tier::Gpu, true, [true, true]),
        Self::of(Tier::Gpu, false, [true, true]),
        Self::of(Tier::Software, false, [false, false]),
        Self::of(Tier::Software, false, [false, true]),
        Self::of(Tier::Software, false, [true, false]),
        Self::of(Tier::Software, false, [true, true]),
    ];
}
