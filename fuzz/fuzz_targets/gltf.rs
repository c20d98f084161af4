//! No bytes make the glTF importer panic or take unbounded memory. Run, with `cargo install cargo-fuzz`, from the
//! repository's root: `cargo +nightly fuzz run gltf -- -rss_limit_mb=2048`; put some `.glb` files in
//! `fuzz/corpus/gltf` to start from.

#![no_main]

use girandole_core::scene::{Geometry, load_gltf_slice};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(scene) = load_gltf_slice(data, None) {
        let geometry = Geometry::new(&scene);
        assert!(geometry.triangles.iter().all(|t| (t.material as usize) < scene.materials.len()));
    }
});
