//! Small files that promise much: refused in a sentence, before memory is taken.

use crate::builder::{File, container};
use girandole_core::Error;
use girandole_core::scene::{Scene, load_gltf_slice};
use serde_json::json;

/// 32 × 32 texels by ETC1S, with an alpha of 255 everywhere; and by UASTC, compressed by Zstandard.
pub const ETC1S: &[u8] = include_bytes!("data/etc1s.ktx2");
pub const UASTC: &[u8] = include_bytes!("data/uastc_zstd.ktx2");

/// Where fields of a KTX 2.0 file are.
const HEADER: usize = 80;
const DESCRIPTOR: usize = 224;
const WIDTH: usize = 20;
const UNCOMPRESSED: usize = 96;

/// A square with a picture on it.
pub fn textured(picture: &[u8]) -> File {
    let mut file = File::with_square();
    let view = file.view(picture);
    let image = file.push("images", json!({"bufferView": view, "mimeType": "image/ktx2"}));
    file.push("textures", json!({"extensions": {"KHR_texture_basisu": {"source": image}}}));
    file.push("materials", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    file
}

/// A square picture by UASTC whose blocks are empty, not compressed.
pub fn uastc(side: u32) -> Vec<u8> {
    let blocks = vec![0; (side.div_ceil(4) as usize).pow(2) * 16];
    let mut file = UASTC[..HEADER].to_vec();
    let descriptor = Vec::from(&UASTC[DESCRIPTOR..DESCRIPTOR + 44]);
    let start = HEADER + 24 + descriptor.len();
    let mut put = |at: usize, value: u32| file[at..at + 4].copy_from_slice(&value.to_le_bytes());
    // One level, at once, behind its descriptor; no keys.
    for (at, value) in [(WIDTH, side), (24, side), (40, 1), (44, 0), (48, 104), (56, 0), (60, 0)] {
        put(at, value);
    }
    for number in [start, blocks.len(), blocks.len()] {
        file.extend((number as u64).to_le_bytes());
    }
    file.extend(descriptor);
    file.extend(blocks);
    file
}

fn load(file: &File) -> Scene {
    load_gltf_slice(&file.glb(), None).expect("a scene")
}

fn refused(file: &File, words: &str) {
    match load_gltf_slice(&file.glb(), None) {
        Err(Error::Broken { reason, .. }) => {
            assert!(reason.contains(words), "`{reason}` does not say `{words}`");
            assert!(!reason.contains('\n') && reason.len() < 400, "not a sentence: {reason}");
        }
        other => panic!("not refused: {other:?}"),
    }
}

fn changed(picture: &[u8], at: usize, bytes: &[u8]) -> File {
    let mut picture = picture.to_vec();
    picture[at..at + bytes.len()].copy_from_slice(bytes);
    textured(&picture)
}

#[test]
fn pictures_are_as_large_as_their_headers_say() {
    for picture in [ETC1S, UASTC] {
        let scene = load(&textured(picture));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let texture = &scene.textures[0];
        assert_eq!((texture.width, texture.height, texture.texels.len()), (32, 32, 1024));
        assert!(texture.texels.iter().any(|texel| *texel != texture.texels[0]));
    }
    // What Zstandard is said to make of it: as much as memory, more than that, and a little more or less than there are blocks.
    for length in [1_u64 << 47, 1 << 63, u64::MAX, 2 << 30, 1 << 20, 1025, 1023, 1040, 0] {
        refused(&changed(UASTC, UNCOMPRESSED, &length.to_le_bytes()), "KTX 2.0");
    }
    // Sizes beyond what follows.
    for side in [36_u32, 64, 100, 1024, 4096, 8192, 8193, u32::MAX, 0] {
        let both = [side, side].map(u32::to_le_bytes).concat();
        for size in [both, side.to_le_bytes().to_vec()] {
            for picture in [ETC1S, UASTC] {
                let file = changed(picture, WIDTH, &size);
                let words = if side == 0 || side > 8192 { "image 0" } else { "KTX 2.0" };
                refused(&file, words);
            }
        }
    }
    // What lies beyond the end: data format, key and values, global data, levels.
    for (at, width) in [(48, 4), (52, 4), (56, 4), (60, 4), (64, 8), (72, 8), (80, 8), (88, 8)] {
        for value in [0x7fff_ffff_u64, u64::MAX, u64::MAX - 100] {
            refused(&changed(ETC1S, at, &value.to_le_bytes()[..width]), "KTX 2.0");
        }
    }
    // Pictures that there are not so many of, and code books without end.
    refused(&changed(ETC1S, 40, &[16]), "KTX 2.0");
    let global = 304;
    for at in 0..16 {
        refused(&changed(ETC1S, global + at / 4 * 4, &[0xff; 4]), "KTX 2.0");
    }
    // Cut off anywhere.
    for length in 12..ETC1S.len() {
        refused(&textured(&ETC1S[..length]), "KTX 2.0");
    }
}

#[test]
fn what_is_no_basis_universal_is_left_out() {
    for (at, value, words) in [
        (12, 23_u32, "format 23"),
        (36, 6, "more than one picture"),
        (32, 3, "more than one"),
        (44, 3, "supercompression 3"),
    ] {
        let scene = load(&changed(UASTC, at, &value.to_le_bytes()));
        assert!(scene.warnings[0].contains(words), "{:?}", scene.warnings);
        assert!(scene.materials[0].base_color_texture.is_none() && !scene.objects.is_empty());
    }
}

/// Points without data, so many of them, each primitive a mesh of its own.
fn unbacked(count: u32, meshes: usize) -> File {
    let mut file = File::with_square();
    let nowhere = file.push("accessors", json!({"componentType": 5126, "count": count, "type": "VEC3"}));
    for _ in 0..meshes {
        let mesh = file.mesh(json!({"attributes": {"POSITION": nowhere}}));
        file.node(json!({"mesh": mesh}));
    }
    file
}

#[test]
fn memory_is_what_limits_a_file() {
    refused(&unbacked(1_000_000, 100), "MiB of memory");
    refused(&unbacked(999_999, 20), "MiB of memory");
    assert!(load_gltf_slice(&unbacked(30_000, 3).glb(), None).is_ok());
    // The same by instances.
    let instances = |count: u32| {
        let mut file = File::new();
        let strip: Vec<f32> = (0..102).flat_map(|i| [i as f32, (i % 2) as f32, 0.0]).collect();
        let positions = file.floats(&strip, "VEC3");
        let mesh = file.mesh(json!({"attributes": {"POSITION": positions}, "mode": 5}));
        let nowhere = file.push("accessors", json!({"componentType": 5126, "count": count, "type": "VEC3"}));
        let places = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": nowhere}}});
        file.node(json!({"mesh": mesh, "extensions": places}));
        file
    };
    refused(&instances(1_000_000), "MiB of memory");
    assert_eq!(load(&instances(1000)).objects.len(), 1000);
    // JSON of nothing but nodes.
    let file = File::with_square();
    let text =
        file.json.to_string().replace("\"nodes\":[{", &format!("\"nodes\":[{}{{", "{},".repeat(4_000_000)));
    match load_gltf_slice(&container(text.into_bytes(), &file.bin), None) {
        Err(Error::Broken { reason, .. }) => assert!(reason.contains("MiB of memory"), "{reason}"),
        other => panic!("not refused: {}", other.is_ok()),
    }
}
