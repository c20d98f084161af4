//! Girandole for browsers: its window as a page and its component as a package, built, served and tested.
//! `cargo xtask web` and `cargo xtask test-web` call this.
//!
//! A [`Toolchain`](toolchain::Toolchain) compiles for WebAssembly, [`package`] makes of that what browsers load, a
//! [`Server`](serve::Server) hands it out, and [`checks`] drive a [`Browser`](browser::Browser) to look at it.

pub mod browser;
pub mod checks;
pub mod difference;
pub mod package;
pub mod serve;
pub mod sizes;
pub mod test;
pub mod toolchain;

use std::path::PathBuf;

/// The workspace's root.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}
