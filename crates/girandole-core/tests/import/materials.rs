//! What extensions make of materials, vertices' colours, and pictures of other formats.

use crate::builder::File;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{Geometry, Material, Scene, load_gltf_slice};
use serde_json::{Value, json};
use std::io::Cursor;

fn load(file: &File) -> Scene {
    let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// A square with a material.
fn square(material: Value) -> File {
    let mut file = File::new();
    file.push("materials", material);
    let mut primitive = file.square();
    primitive["material"] = json!(0);
    let mesh = file.mesh(primitive);
    file.node(json!({"mesh": mesh}));
    file
}

fn material(json: Value) -> Material {
    load(&square(json)).materials[0].clone()
}

fn is_near(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-5
}

#[test]
fn refractive_index_is_reflectance() {
    let of = |ior: f32| {
        material(json!({"extensions": {"KHR_materials_ior": {"ior": ior}}})).specular_color.x * 0.04
    };
    assert!(
        is_near(of(1.5), 0.04) && is_near(of(1.0), 0.0) && is_near(of(3.0), 0.25) && is_near(of(0.0), 1.0)
    );
    let usual = material(json!({"extensions": {"KHR_materials_ior": {}}}));
    assert!(usual.specular_color.abs_diff_eq(Vec3::ONE, 1e-5));
    let file = square(json!({"extensions": {"KHR_materials_ior": {"ior": 0.5}}}));
    let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
    assert!(scene.warnings.iter().any(|w| w.contains("refractive")), "{:?}", scene.warnings);
    let file = square(json!({"extensions": {"KHR_materials_ior": {"ior": "glass"}}}));
    let warnings = load_gltf_slice(&file.glb(), None).expect("a scene").warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("KHR_materials_ior"), "{warnings:?}");
}

#[test]
fn clear_coats_sharpen_rough_dielectrics() {
    let base = json!({"metallicFactor": 0.0, "roughnessFactor": 0.9});
    let coated = |factor: f32| {
        let coat = json!({"clearcoatFactor": factor, "clearcoatRoughnessFactor": 0.1});
        material(json!({"pbrMetallicRoughness": base, "extensions": {"KHR_materials_clearcoat": coat}}))
    };
    let (without, half, all) = (coated(0.0), coated(0.5), coated(1.0));
    assert!(is_near(without.roughness, 0.9) && without.specular_color.abs_diff_eq(Vec3::ONE, 1e-5));
    assert!(all.roughness < half.roughness && half.roughness < without.roughness);
    // Two surfaces of 4 %, one behind the other.
    let both = 0.04 + 0.04 * 0.96 * 0.96;
    assert!(is_near(all.specular_color.x * all.specular * 0.04, both), "{all:?}");
}

#[test]
fn sheen_brightens_what_is_dark() {
    let dark = json!({"metallicFactor": 0.0, "baseColorFactor": [0.0, 0.5, 1.0, 1.0]});
    let of = |roughness: f32| {
        let sheen = json!({"sheenColorFactor": [1.0, 1.0, 1.0], "sheenRoughnessFactor": roughness});
        material(json!({"pbrMetallicRoughness": dark, "extensions": {"KHR_materials_sheen": sheen}}))
            .base_color
    };
    let (sharp, soft) = (of(0.2), of(0.8));
    assert!(0.0 < sharp.x && sharp.x < soft.x && soft.x < 0.5, "{sharp} {soft}");
    // White stays white: what the sheen takes it gives.
    assert!(is_near(soft.z, 1.0) && soft.y > 0.5, "{soft}");
}

#[test]
fn specular_glossiness_is_a_coloured_dielectric() {
    let mut file = square(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.1, 0.2, 0.3, 1.0], "specularFactor": [0.5, 0.25, 0.1], "glossinessFactor": 0.5,
    }}}));
    let m = load(&file).materials[0].clone();
    assert_eq!((m.base_color, m.metallic, m.roughness), (Vec3::new(0.1, 0.2, 0.3), 0.0, 0.5));
    assert!((m.specular_color * 0.04).abs_diff_eq(Vec3::new(0.5, 0.25, 0.1), 1e-5));
    // Glossiness is alpha, and roughness is what is left of it.
    let texture = file.texture(2, 1, |x, _| [255, 255, 255, if x == 0 { 255 } else { 64 }]);
    file.json["materials"][0]["extensions"]["KHR_materials_pbrSpecularGlossiness"]["specularGlossinessTexture"] =
        json!({"index": texture});
    let scene = load(&file);
    let geometry = Geometry::new(&scene);
    let rough = |u: f32| {
        let m = scene.materials[0].metallic_roughness_texture.expect("a texture");
        scene.textures[m.texture as usize].sample(Vec2::new(u, 0.5)).y
    };
    assert!((rough(0.25) - 0.5).abs() < 0.01 && (rough(0.75) - (1.0 - 32.0 / 255.0)).abs() < 0.01);
    let surface = geometry.surface(&scene, 0, Vec2::splat(0.3), Vec3::Z);
    assert!(surface.f0.abs_diff_eq(Vec3::new(0.5, 0.25, 0.1), 1e-4), "{surface:?}");
}

#[test]
fn unlit_surfaces_show_their_colour_and_nothing_else() {
    let scene = load(&square(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.5, 0.9, 1.0], "metallicFactor": 1.0},
        "emissiveFactor": [1.0, 1.0, 1.0],
        "extensions": {"KHR_materials_unlit": {}},
    })));
    assert!(scene.materials[0].unlit && !scene.materials[0].emits());
    let surface = Geometry::new(&scene).surface(&scene, 0, Vec2::splat(0.3), Vec3::Z);
    assert_eq!(surface.emission, Vec3::new(0.1, 0.5, 0.9));
    assert_eq!((surface.albedo, surface.f0, surface.f90), (Vec3::ZERO, Vec3::ZERO, 0.0));
}

#[test]
fn colours_of_vertices_multiply_the_base_colour() {
    let mut file = square(
        json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorFactor": [0.5, 1.0, 1.0, 1.0]},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}}}),
    );
    // Red, green, blue and white, as bytes, four a vertex.
    let corners: [[u8; 4]; 4] = [[255, 0, 0, 9], [0, 255, 0, 9], [0, 0, 255, 9], [255, 255, 255, 9]];
    let view = file.view(&corners.concat());
    let colors = file.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC4"}),
    );
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    // Another mesh of the same material has none.
    let mut plain = file.square();
    plain["material"] = json!(0);
    let mesh = file.mesh(plain);
    file.node(json!({"mesh": mesh, "translation": [3.0, 0.0, 0.0]}));
    let scene = load(&file);
    let geometry = Geometry::new(&scene);
    let albedo =
        |triangle: u32, u: f32, v: f32| geometry.surface(&scene, triangle, Vec2::new(u, v), Vec3::Z).albedo;
    let base = Vec3::new(0.5, 1.0, 1.0);
    assert!(albedo(0, 0.25, 0.25).abs_diff_eq(base * Vec3::new(0.5, 0.25, 0.25), 1e-5));
    assert!(albedo(0, 1.0, 0.0).abs_diff_eq(base * Vec3::Y, 1e-5));
    assert!(albedo(1, 0.0, 1.0).abs_diff_eq(base, 1e-5));
    assert!(albedo(2, 0.25, 0.25).abs_diff_eq(base, 1e-5), "the other mesh");
    // What is wrong is said.
    file.json["accessors"][colors]["type"] = json!("VEC2");
    let scene = load_gltf_slice(&file.glb(), None).expect("the other mesh");
    assert!(
        scene.objects.len() == 1 && scene.warnings[0].contains("its colours are of type"),
        "{:?}",
        scene.warnings
    );
}

/// Texels of a file's only texture.
fn texels(bytes: &[u8], mime: &str, extension: Option<&str>) -> Result<Vec<[u8; 4]>, String> {
    let mut file = square(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let view = file.view(bytes);
    let image = file.push("images", json!({"bufferView": view, "mimeType": mime}));
    let texture = match extension {
        Some(name) => json!({"extensions": {name: {"source": image}}}),
        None => json!({"source": image}),
    };
    file.push("textures", texture);
    match load_gltf_slice(&file.glb(), None) {
        Ok(scene) => match scene.textures.first() {
            Some(texture) => {
                assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
                Ok(texture.texels.clone())
            }
            None => Err(scene.warnings.join("; ")),
        },
        Err(error) => Err(error.to_string()),
    }
}

/// Four squares of 4 × 4 texels.
const COLORS: [[u8; 4]; 4] = [[255, 0, 10, 255], [0, 200, 20, 255], [9, 30, 255, 128], [77, 88, 99, 255]];

fn picture() -> image::RgbaImage {
    image::RgbaImage::from_fn(8, 8, |x, y| image::Rgba(COLORS[(x / 4 + y / 4 * 2) as usize]))
}

/// The same in KTX 2.0: UASTC blocks of a colour each (Basis Universal's UASTC texture specification, mode 8).
fn ktx2() -> Vec<u8> {
    let block = |[r, g, b, a]: [u8; 4]| {
        let bits = 0x17 | u128::from(u32::from_le_bytes([r, g, b, a])) << 5;
        bits.to_le_bytes()
    };
    let blocks = COLORS.map(block).concat();
    let words = |words: &[u32]| words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
    let mut file = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    // No format, bytes, 8 × 8 × 0, no layers, a face, a level, no supercompression; descriptor at 104, no more data.
    file.extend(words(&[0, 1, 8, 8, 0, 0, 1, 1, 0, 104, 44, 0, 0, 0, 0, 0, 0]));
    for number in [148u64, blocks.len() as u64, blocks.len() as u64] {
        file.extend(number.to_le_bytes());
    }
    // UASTC of sRGB, blocks of 4 × 4, one sample of RGBA.
    file.extend(words(&[
        44,
        0,
        2 | 40 << 16,
        166 | 1 << 8 | 2 << 16,
        3 | 3 << 8,
        16,
        0,
        127 << 16 | 3 << 24,
        0,
        0,
        u32::MAX,
    ]));
    assert_eq!(file.len(), 148);
    file.extend(blocks);
    file
}

#[test]
fn pictures_of_other_formats_are_their_twins() {
    let wanted: Vec<[u8; 4]> = picture().pixels().map(|p| p.0).collect();
    let mut webp = Cursor::new(Vec::new());
    picture().write_to(&mut webp, image::ImageFormat::WebP).expect("a WebP");
    assert_eq!(texels(webp.get_ref(), "image/webp", Some("EXT_texture_webp")), Ok(wanted.clone()));
    assert_eq!(texels(&ktx2(), "image/ktx2", Some("KHR_texture_basisu")), Ok(wanted.clone()));
    assert_eq!(texels(&ktx2(), "image/ktx2", None), Ok(wanted.clone()));
    // Blocks that lie over the picture's edges.
    let mut cut = ktx2();
    (cut[20], cut[24]) = (7, 5);
    let within: Vec<[u8; 4]> = wanted[..40].chunks_exact(8).flat_map(|row| row[..7].to_vec()).collect();
    assert_eq!(texels(&cut, "image/ktx2", Some("KHR_texture_basisu")), Ok(within));
    // Broken ones are refused with a sentence, whatever is broken.
    for at in 0..148 {
        let mut broken = ktx2();
        broken[at] ^= 0x5b;
        if let Err(sentence) = texels(&broken, "image/ktx2", Some("KHR_texture_basisu")) {
            assert!(sentence.contains("image 0"), "{at}: {sentence}");
        }
        assert!(texels(&ktx2()[..at], "image/ktx2", Some("KHR_texture_basisu")).is_err());
    }
    assert!(texels(&ktx2()[..160], "image/ktx2", Some("KHR_texture_basisu")).is_err());
    // R8G8B8_UNORM, as tools write it that do not encode.
    let mut plain = ktx2();
    plain[12] = 23;
    let sentence = texels(&plain, "image/ktx2", Some("KHR_texture_basisu")).expect_err("no Basis Universal");
    assert!(sentence.contains("format 23") && sentence.contains("only Basis Universal"), "{sentence}");
}

#[test]
fn pictures_that_are_cut_off_are_refused() {
    let mut jpeg = Cursor::new(Vec::new());
    let picture = image::RgbImage::from_fn(40, 40, |x, y| image::Rgb([x as u8 * 6, y as u8 * 6, 255]));
    picture.write_to(&mut jpeg, image::ImageFormat::Jpeg).expect("a JPEG");
    let whole = jpeg.get_ref();
    assert_eq!(texels(whole, "image/jpeg", None).map(|t| t.len()), Ok(1600));
    // What follows its end does not matter, nor do bytes that fill it up.
    let longer = [whole, &b"padding"[..]].concat();
    assert_eq!(texels(&longer, "image/jpeg", None).map(|t| t.len()), Ok(1600));
    for length in 3..whole.len() {
        let sentence = texels(&whole[..length], "image/jpeg", None).expect_err("cut off");
        assert!(sentence.contains("image 0"), "{sentence}");
    }
}

/// Faces of colours of their own, darker to the right; from the front of each.
#[test]
fn image_based_lights_are_around_the_scene() {
    let mut file = square(json!({}));
    let colors: [[u8; 3]; 6] =
        [[255, 0, 0], [0, 255, 255], [0, 255, 0], [255, 0, 255], [0, 0, 255], [255, 255, 0]];
    let images: Vec<usize> = colors
        .iter()
        .map(|c| {
            let shade = |x: u32, c: u8| if x < 2 { c } else { c / 4 * 3 };
            // Twice as bright as white is, by alpha.
            let texture = file.texture(4, 4, |x, _| [shade(x, c[0]), shade(x, c[1]), shade(x, c[2]), 128]);
            file.json["textures"][texture]["source"].as_u64().expect("an image") as usize
        })
        .collect();
    file.json["extensions"] = json!({"EXT_lights_image_based": {"lights": [{
        "intensity": 3.0, "specularImageSize": 4, "irradianceCoefficients": [], "specularImages": [images],
    }]}});
    file.json["scenes"] = json!([{"nodes": [0], "extensions": {"EXT_lights_image_based": {"light": 0}}}]);
    file.json["scene"] = json!(0);
    let of =
        |file: &File, direction: Vec3| load(file).environment.expect("light").radiance(direction.normalize());
    let twice = 3.0 * 255.0 / 128.0;
    // Seen from inside, what is to the right is darker.
    for (direction, right, color) in [
        (Vec3::X, Vec3::Z, Vec3::X),
        (Vec3::NEG_X, Vec3::NEG_Z, Vec3::new(0.0, 1.0, 1.0)),
        (Vec3::Y, Vec3::NEG_X, Vec3::Y),
        (Vec3::NEG_Y, Vec3::NEG_X, Vec3::new(1.0, 0.0, 1.0)),
        (Vec3::Z, Vec3::NEG_X, Vec3::Z),
        (Vec3::NEG_Z, Vec3::X, Vec3::new(1.0, 1.0, 0.0)),
    ] {
        let [left, right] = [-0.5, 0.5].map(|shift| of(&file, direction + right * shift));
        assert!(left.abs_diff_eq(color * twice, 0.2), "{direction}: {left}");
        assert!(right.length() < 0.7 * left.length() && right.length() > 0.0, "{direction}: {right}");
    }
    // A quarter turn about +Y takes what is at +Z to +X.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    file.json["extensions"]["EXT_lights_image_based"]["lights"][0]["rotation"] =
        json!([0.0, half, 0.0, half]);
    let turned = of(&file, Vec3::new(1.0, 0.0, 0.2));
    assert!(turned.z > 1.0 && turned.x < 0.1, "{turned}");
    // What is broken is left out.
    file.json["extensions"]["EXT_lights_image_based"]["lights"][0]["specularImages"] =
        json!([[0, 1, 2, 3, 4, 99]]);
    let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
    assert!(scene.environment.is_none());
    assert!(scene.warnings.iter().any(|w| w.contains("EXT_lights_image_based")), "{:?}", scene.warnings);
}

#[test]
fn alpha_blending_is_coverage_or_a_mask() {
    let of = |alpha: f32, texture: Option<fn(u32) -> u8>| {
        let base = json!({"baseColorFactor": [0.5, 0.5, 0.5, alpha], "metallicFactor": 0.0});
        let mut file = square(
            json!({"alphaMode": "BLEND", "pbrMetallicRoughness": base, "emissiveFactor": [1.0, 0.0, 0.0]}),
        );
        if let Some(alpha) = texture {
            let texture = file.texture(16, 16, |x, y| [255, 255, 255, alpha(16 * y + x)]);
            file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": texture});
        }
        let scene = load(&file);
        let surface = Geometry::new(&scene).surface(&scene, 0, Vec2::splat(0.3), Vec3::Z);
        (scene.materials[0].clone(), surface)
    };
    let (pane, surface) = of(0.25, None);
    assert!(pane.blended && pane.alpha_cutoff.is_none() && pane.is_transparent());
    assert_eq!(pane.emission, Vec3::X * 0.25);
    assert!(surface.transmittance.abs_diff_eq(Vec3::splat(0.75), 1e-6));
    let (opaque, whole) = of(1.0, None);
    assert!(!opaque.is_transparent() && opaque.alpha_cutoff.is_none());
    assert!(surface.albedo.abs_diff_eq(whole.albedo * 0.25, 1e-6) && is_near(surface.f90, 0.25));
    assert_eq!(whole.transmittance, Vec3::ZERO);
    // Leaves: half of the texels are there, the others are not.
    let (leaf, _) = of(1.0, Some(|i| if i % 2 == 0 { 255 } else { 0 }));
    assert_eq!((leaf.blended, leaf.alpha_cutoff), (false, Some(0.5)));
    let (smoke, surface) = of(0.5, Some(|_| 128));
    assert!(smoke.blended && surface.transmittance.abs_diff_eq(Vec3::splat(1.0 - 0.25), 2e-3));
}

#[test]
fn transmission_tints_what_passes() {
    let of = |metallic: f32, texel: u8| {
        let mut file = square(json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.8, 1.0], "metallicFactor": metallic},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}},
        }));
        let texture = file.texture(1, 1, |_, _| [texel, 0, 0, 255]);
        file.json["materials"][0]["extensions"]["KHR_materials_transmission"]["transmissionTexture"] =
            json!({"index": texture});
        let scene = load(&file);
        assert!(scene.materials[0].is_transparent());
        Geometry::new(&scene).surface(&scene, 0, Vec2::splat(0.3), Vec3::Z)
    };
    let glass = of(0.0, 255);
    assert!(glass.transmittance.abs_diff_eq(Vec3::new(0.1, 0.2, 0.4) * 0.96, 1e-5), "{glass:?}");
    assert!(glass.f0.abs_diff_eq(Vec3::splat(0.04), 1e-6));
    // What passes is not reflected.
    assert!(glass.albedo.abs_diff_eq(of(0.0, 0).albedo * 0.5, 1e-6));
    assert_eq!((of(0.0, 0).transmittance, of(1.0, 255).transmittance), (Vec3::ZERO, Vec3::ZERO));
    let file = square(json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": "all"}}}));
    let warnings = load_gltf_slice(&file.glb(), None).expect("a scene").warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("KHR_materials_transmission"), "{warnings:?}");
}
