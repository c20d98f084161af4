//! No bytes make the importers of OBJ and PLY files panic or take unbounded memory. As `gltf.rs`: `cargo +nightly fuzz
//! run model`.

#![no_main]

use girandole_core::scene::load_model_slice;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    for kind in ["obj", "ply"] {
        if let Ok(mesh) = load_model_slice(data, kind) {
            assert!(mesh.check(1).is_ok());
        }
    }
});
