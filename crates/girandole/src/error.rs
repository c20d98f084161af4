//! What can go wrong on the GPU's side: each message is a sentence that says what to do, in the library's terms.

/// An error of the renderer.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene, file or setting is wrong.
    #[error(transparent)]
    Scene(#[from] girandole_core::Error),
    /// There is no adapter at all.
    #[error(
        "there is no GPU adapter; install a driver (on Debian or Ubuntu without a GPU: apt-get install \
         mesa-vulkan-drivers)"
    )]
    NoAdapter,
    /// No adapter has the name that was asked for.
    #[error("there is no adapter called `{name}`; choose one of: {known}")]
    UnknownAdapter {
        /// The name that was given.
        name: String,
        /// The names that exist, separated by commas.
        known: String,
    },
    /// The adapter lacks what the renderer needs.
    #[error("the adapter {adapter} lacks {what}; choose another one")]
    Unsupported {
        /// The adapter's name.
        adapter: String,
        /// What it lacks.
        what: String,
    },
    /// Something is larger than the device or the memory budget allows.
    #[error("{what}; {remedy}")]
    TooLarge {
        /// What is too large, as the first half of the sentence.
        what: String,
        /// What to do about it, the second half.
        remedy: Remedy,
    },
    /// The device failed in the middle.
    #[error("the GPU failed: {0}; lower `RendererOptions::memory_mib`, or choose another adapter")]
    Device(String),
}

impl Error {
    pub(crate) fn too_large(what: String, remedy: Remedy) -> Self {
        Self::TooLarge { what, remedy }
    }
}

/// What helps where something is too large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// A larger memory budget, or fewer light samples.
    MemoryOrFewerLights {
        /// The least budget, MiB.
        mib: u64,
    },
    /// A larger memory budget, or smaller shadow maps.
    MemoryOrSmallerMaps {
        /// The least budget, MiB.
        mib: u64,
    },
    /// Fewer light samples.
    FewerLights,
    /// Smaller shadow maps.
    SmallerMaps,
    /// Shadow maps of another size.
    MapSize {
        /// Least texels across.
        from: u32,
        /// Most texels across.
        to: u32,
    },
    /// A narrower percentage-closer filter.
    NarrowerFilter {
        /// Widest filter, texels.
        to: u32,
    },
    /// A picture of another size.
    PictureSize {
        /// Most pixels along a side.
        to: u32,
    },
    /// A smaller picture, or the naive mode.
    SmallerPictureOrNaive,
    /// The naive mode.
    Naive,
    /// A smaller scene.
    SmallerScene,
    /// A smaller texture.
    TextureSize {
        /// Most texels along a side.
        to: u32,
    },
}

impl std::fmt::Display for Remedy {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::MemoryOrFewerLights { mib } => {
                write!(f, "set `RendererOptions::memory_mib` to {mib} or more, or sample fewer lights")
            }
            Self::MemoryOrSmallerMaps { mib } => {
                write!(f, "set `RendererOptions::memory_mib` to {mib} or more, or lower `map_size`")
            }
            Self::FewerLights => write!(f, "sample fewer lights"),
            Self::SmallerMaps => write!(f, "lower `RendererOptions::map_size`"),
            Self::MapSize { from, to } => write!(f, "`RendererOptions::map_size` takes {from} to {to}"),
            Self::NarrowerFilter { to } => write!(f, "`RendererOptions::pcf` takes 0 to {to}"),
            Self::PictureSize { to } => write!(f, "each side takes 1 to {to}"),
            Self::SmallerPictureOrNaive => write!(f, "render a smaller picture, or in `Mode::Naive`"),
            Self::Naive => write!(f, "render in `Mode::Naive`"),
            Self::SmallerScene => write!(f, "load a smaller scene"),
            Self::TextureSize { to } => write!(f, "scale it to {to} at the most"),
        }
    }
}

/// The result of whatever may fail in this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A scene, file or setting is wrong: a sentence that says what to do.
    pub(crate) fn invalid(sentence: impl Into<String>) -> Self {
        Self::Scene(girandole_core::Error::Invalid(sentence.into()))
    }
}
