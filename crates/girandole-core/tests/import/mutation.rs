//! Files broken in every way that a machine can think of: no panic, no memory beyond the limit of [`crate`]. `GIRANDOLE_MUTATIONS`
//! is how many of each kind are tried instead of the few that there is time for always.

use crate::bending::Bending;
use crate::builder::{File, container, some_of_everything};
use crate::compression::Compression;
use crate::hostile::{ETC1S, UASTC, textured, uastc};
use crate::models::{ascii, binary};
use girandole_core::scene::{Geometry, Scene, load_gltf_slice, load_model_slice};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// How many were read, and how many refused.
#[derive(Debug, Default)]
struct Tally {
    read: usize,
    refused: usize,
}

impl Tally {
    fn load(&mut self, bytes: &[u8], which: &str) {
        let result = catch_unwind(AssertUnwindSafe(|| match load_gltf_slice(bytes, None) {
            Ok(mut scene) => {
                use_all(&scene);
                // Animations may lead too far.
                let _ = scene.set_time(0.8);
                use_all(&scene);
                true
            }
            Err(error) => {
                let sentence = error.to_string();
                assert!(
                    sentence.len() < 700 && sentence.starts_with("the glTF data is not usable: "),
                    "{sentence}"
                );
                false
            }
        }));
        match result {
            Ok(true) => self.read += 1,
            Ok(false) => self.refused += 1,
            Err(_) => panic!("{which}"),
        }
    }

    /// A test that reads all or nothing tests little.
    fn assert_both(&self) {
        let least = (self.read + self.refused) / 50;
        assert!(self.read > least && self.refused > least, "{self:?}");
    }
}

/// How many files to try of a kind.
fn rounds(always: usize) -> usize {
    let asked = std::env::var("GIRANDOLE_MUTATIONS").ok();
    asked.map_or(always, |number| number.parse().expect("GIRANDOLE_MUTATIONS is a number"))
}

/// Touches everything that an index leads to.
fn use_all(scene: &Scene) {
    let geometry = Geometry::new(scene);
    for t in 0..geometry.triangles.len() as u32 {
        let middle = girandole_core::glam::Vec2::splat(0.25);
        geometry.is_cut_out(scene, t, middle);
        let surface = geometry.surface(scene, t, middle, geometry.normal(t));
        assert!(surface.albedo.is_finite() && surface.emission.is_finite(), "{surface:?}");
    }
    for mesh in &scene.meshes {
        assert!(mesh.patches.windows(2).all(|w| w[0].triangles.end == w[1].triangles.start));
        assert!(mesh.patches.iter().all(|p| p.triangles.end as usize <= mesh.triangles.len()));
    }
    for channel in scene.animations.iter().flat_map(|a| &a.channels) {
        assert!(channel.node.index() < scene.nodes.len() && !channel.times.is_empty());
    }
    assert!(
        scene
            .cameras
            .iter()
            .map(|c| c.node)
            .chain(scene.lights.iter().map(|l| l.node))
            .all(|n| n.index() < scene.nodes.len())
    );
}

#[test]
fn every_truncation() {
    let glb = some_of_everything().glb();
    let mut tally = Tally::default();
    for length in 0..glb.len() {
        tally.load(&glb[..length], "truncated");
    }
    assert_eq!((tally.read, tally.refused), (0, glb.len()));
    tally.load(&glb, "whole");
    assert_eq!(tally.read, 1);
    // Cut off, but with a header that does not know it.
    let mut tally = Tally::default();
    for length in 20..glb.len() {
        let mut cut = glb[..length].to_vec();
        cut[8..12].copy_from_slice(&(length as u32).to_le_bytes());
        tally.load(&cut, &format!("cut at {length}"));
    }
    assert_eq!(tally.read, 0);
}

#[test]
fn flipped_bytes() {
    let compressed = Compression::ALL.map(Compression::file);
    for file in [some_of_everything(), Bending::both().file()].into_iter().chain(compressed) {
        let glb = file.glb();
        let mut random = Random(1);
        let mut tally = Tally::default();
        for round in 0..rounds(12_000) {
            let mut bytes = glb.clone();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len());
                bytes[at] = random.next() as u8;
            }
            tally.load(&bytes, &format!("round {round}"));
        }
        tally.assert_both();
    }
}

/// Numbers that headers may have.
const HEADER_NUMBERS: [u64; 12] = [0, 1, 2, 4, 63, 65, 255, 1024, 8192, 65536, 1 << 31, u64::MAX];

#[test]
fn changed_pictures() {
    for (which, picture) in [ETC1S, UASTC].into_iter().enumerate() {
        let mut random = Random(7 + which as u64);
        let mut tally = Tally::default();
        for round in 0..rounds(2500) {
            let mut bytes = picture[..picture.len() - random.below(64) * (round % 5 / 4)].to_vec();
            for _ in 0..=random.below(3) {
                let at = random.below(bytes.len() - 8);
                match random.below(5) {
                    // Fields of the header, of levels and of the global data.
                    0 => {
                        let at = (12 + random.below(79) * 4).min(bytes.len() - 8);
                        let number = HEADER_NUMBERS[random.below(HEADER_NUMBERS.len())].to_le_bytes();
                        let width = 4 + random.below(2) * 4;
                        bytes[at..at + width].copy_from_slice(&number[..width]);
                    }
                    // What follows them.
                    1 => bytes[at] = random.next() as u8,
                    2 => bytes[at] ^= 1 << random.below(8),
                    3 => bytes[at..at + 8].copy_from_slice(&random.next().to_le_bytes()),
                    _ => {
                        let from = random.below(bytes.len() - 8);
                        bytes.copy_within(from..from + 8, at);
                    }
                }
            }
            tally.load(&textured(&bytes).glb(), &format!("picture {which}, round {round}"));
        }
        tally.assert_both();
    }
    // Blocks of nothing but chance: all that there may be.
    let mut blocks = uastc(64);
    let mut random = Random(9);
    for round in 0..rounds(2500) / 50 {
        let start = blocks.len() - 256 * 16;
        blocks[start..].fill_with(|| random.next() as u8);
        let mut tally = Tally::default();
        tally.load(&textured(&blocks).glb(), &format!("blocks, round {round}"));
    }
}

/// Where the numbers of a JSON text are.
fn numbers(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let mut result: Vec<std::ops::Range<usize>> = Vec::new();
    let mut quoted = false;
    for (i, c) in text.iter().enumerate() {
        quoted ^= *c == b'"';
        if !quoted && (c.is_ascii_digit() || matches!(c, b'-' | b'.' | b'+' | b'e')) {
            match result.last_mut() {
                Some(last) if last.end == i => last.end = i + 1,
                _ if c.is_ascii_digit() || *c == b'-' => result.push(i..i + 1),
                _ => {}
            }
        }
    }
    result
}

#[test]
fn changed_numbers() {
    for file in [some_of_everything(), Bending::both().file()] {
        change_numbers(&file, 100);
    }
    for compression in Compression::ALL {
        change_numbers(&compression.file(), 20);
    }
}

/// `least`: how many numbers the file has at least.
fn change_numbers(file: &File, least: usize) {
    let glb = file.glb();
    let length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    let (text, bin) = (&glb[20..20 + length], &glb[28 + length..]);
    let numbers = numbers(text);
    assert!(numbers.len() > least, "{}", numbers.len());
    let values = [
        "0",
        "1",
        "2",
        "3",
        "5",
        "-1",
        "255",
        "65535",
        "65536",
        "16777216",
        "2147483647",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "1e30",
        "-1e30",
        "3.4e38",
        "1e300",
        "1e-30",
        "0.5",
        "5121",
        "5123",
        "5125",
        "5126",
        "null",
        "[]",
        "{}",
        "\"\"",
        "true",
    ];
    let mut tally = Tally::default();
    // Each number by each value, then pairs.
    for number in &numbers {
        for value in values {
            let changed = [&text[..number.start], value.as_bytes(), &text[number.end..]].concat();
            tally.load(&container(changed, bin), &format!("{number:?} = {value}"));
        }
    }
    let mut random = Random(2);
    for _ in 0..6000 {
        let mut pick = [random.below(numbers.len()), random.below(numbers.len())];
        pick.sort_unstable();
        if pick[0] == pick[1] {
            continue;
        }
        let [a, b] = pick.map(|i| numbers[i].clone());
        let [x, y] = [random.below(values.len()), random.below(values.len())].map(|i| values[i].as_bytes());
        let changed = [&text[..a.start], x, &text[a.end..b.start], y, &text[b.end..]].concat();
        tally.load(&container(changed, bin), &format!("{a:?}, {b:?}"));
    }
    tally.assert_both();
}

#[test]
fn changed_models() {
    let obj = "v 0 0 0\nv 1 0 0 1\nv 1 1 0\nvn 0 0 1\nvt 0 1\no a\nf 1/1/1 2//1 3\nf -1 -2 -3\nl 1 2\ng x\nf 1 2 3 4\nv 1 2 3\n";
    let polygons = "mtllib a.mtl\nv 0 0 0 1 0 0\nv 4 0 0\nv 1 1 0 .1 .2 .3\nv 0 4 0\nv 0 0 3\ns 1\nusemtl a\n\
        f 1 2 3 \\\n 4\n\
        s off\nf 4 3 2 1 5 3 1\nusemtl\ncurv 0 1 1 2\nf 1 2 5 5 1\n";
    let scan = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_index\n\
        property list uchar float texcoord\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0 1 2 3\n1 0 0 9 9 9\n0 1 0 255 0 0\n1 1 0 0 0 0\n3 0 1 2 6 0 0 1 0 0 1\n6 0 1 2 -1 1 2\n";
    let files: [(&str, Vec<u8>); 6] = [
        ("ply", binary(false)),
        ("ply", binary(true)),
        ("ply", ascii().into_bytes()),
        ("ply", scan.into()),
        ("obj", obj.into()),
        ("obj", polygons.into()),
    ];
    let mut random = Random(3);
    for (kind, bytes) in files {
        let mut tally = Tally::default();
        for round in 0..rounds(3000) {
            let mut bytes = bytes[..bytes.len() - random.below(bytes.len()) * (round % 2)].to_vec();
            for _ in 0..=random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] = if random.below(2) == 0 {
                    b"0123456789-./ \n"[random.below(15)]
                } else {
                    random.next() as u8
                };
            }
            let loaded = catch_unwind(|| load_model_slice(&bytes, kind));
            match loaded {
                Ok(Ok(mesh)) => {
                    tally.read += 1;
                    assert!(
                        mesh.triangles
                            .iter()
                            .flat_map(|t| t.vertices)
                            .all(|v| (v as usize) < mesh.positions.len())
                    );
                    assert!(
                        mesh.normals.len() == mesh.positions.len()
                            && mesh.normals.iter().all(|n| n.is_finite())
                    );
                }
                Ok(Err(error)) => {
                    tally.refused += 1;
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
                Err(_) => panic!("{kind}, round {round}: {:?}", String::from_utf8_lossy(&bytes)),
            }
        }
        assert!(tally.read > 10 && tally.refused > 10, "{kind}: {tally:?}");
    }
}
