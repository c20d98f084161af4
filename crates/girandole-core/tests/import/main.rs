//! The importers: what they read, what they refuse, and what they do to planar surfaces.

mod added_light;
#[cfg(feature = "import")]
mod bending;
#[cfg(feature = "import")]
mod builder;
#[cfg(feature = "import")]
mod coats;
#[cfg(feature = "import")]
mod compression;
mod defaults;
#[cfg(feature = "import")]
mod deformation;
#[cfg(feature = "import")]
mod gltf_content;
#[cfg(feature = "import")]
mod gltf_errors;
#[cfg(feature = "import")]
mod hostile;
#[cfg(feature = "import")]
mod materials;
#[cfg(feature = "import")]
mod model_scenes;
#[cfg(feature = "import")]
mod models;
#[cfg(feature = "import")]
mod mutation;
mod patches;
#[cfg(feature = "import")]
mod placing;
#[cfg(feature = "import")]
mod polygons;

/// No file of a few kilobytes may make an importer ask for more memory than this.
const MEMORY_LIMIT: usize = 256 << 20;

#[global_allocator]
static ALLOCATOR: cap::Cap<std::alloc::System> = cap::Cap::new(std::alloc::System, MEMORY_LIMIT);

#[test]
fn the_memory_limit_is_in_force() {
    assert!(Vec::<u8>::new().try_reserve_exact(MEMORY_LIMIT + 1).is_err());
    assert!(Vec::<u8>::new().try_reserve_exact(1 << 20).is_ok());
}
