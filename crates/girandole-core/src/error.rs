//! One error type: each message is a sentence that says what is wrong and what to do.

use std::path::PathBuf;

/// What can go wrong with a scene, a file or a setting.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read.
    #[error("cannot read {path}: {source}; check the path and its permissions", path = .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("cannot write {path}: {source}; check that its folder exists, is writable and has room", path = .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file's content is broken or not what its name promises.
    #[error("{path} is not usable: {reason}", path = .path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do, as the rest of the sentence.
        reason: String,
    },
    /// A name that does not exist.
    #[error("there is no {kind} called `{name}`; choose one of: {known}")]
    Unknown {
        /// The kind of thing that is named (scene, camera, object, …).
        kind: &'static str,
        /// The name that was given.
        name: String,
        /// The names that exist, separated by commas.
        known: String,
    },
    /// A value outside of what is possible.
    #[error("{0}")]
    Invalid(String),
}

/// The result of whatever may fail in this crate.
pub type Result<T> = std::result::Result<T, Error>;
