//! What can go wrong on the GPU's side: each message is a sentence that says what to do.

/// An error of the renderer.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene, file or setting is wrong.
    #[error(transparent)]
    Scene(#[from] girandole_core::Error),
    /// No adapter, or not the one that was asked for.
    #[error("{0}")]
    NoAdapter(String),
    /// The adapter lacks what the renderer needs.
    #[error(
        "the adapter {adapter} lacks {what}; choose another one with --adapter, or render with --engine cpu"
    )]
    Unsupported {
        /// The adapter's name.
        adapter: String,
        /// What it lacks.
        what: String,
    },
    /// Something is larger than the device or the memory budget allows.
    #[error("{0}")]
    TooLarge(String),
    /// The device failed in the middle.
    #[error("the GPU failed: {0}; try a smaller --memory or another --adapter")]
    Device(String),
}

/// The result of whatever may fail in this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A scene, file or setting is wrong: a sentence that says what to do.
    pub(crate) fn invalid(sentence: impl Into<String>) -> Self {
        Self::Scene(girandole_core::Error::Invalid(sentence.into()))
    }
}
