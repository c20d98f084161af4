//! Clear coats and sheen that textures say the extent of, and the alpha of vertices' colours, beside twins without.

use crate::builder::File;
use girandole_core::brdf::Surface;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{Geometry, NONE, Scene, load_gltf_slice};
use girandole_core::trace::SceneTracer;
use serde_json::{Value, json};

/// A square with a material, and a texture of two texels beside each other.
fn square(material: Value, texels: [[u8; 4]; 2]) -> File {
    let mut file = File::new();
    file.push("materials", material);
    let mut primitive = file.square();
    primitive["material"] = json!(0);
    let mesh = file.mesh(primitive);
    file.node(json!({"mesh": mesh}));
    file.texture(2, 1, |x, _| texels[x as usize]);
    file
}

fn load(file: &File) -> Scene {
    let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    scene
}

/// What a square looks like at the middle of its left or right half, of height 0.25.
fn surface(file: &File, right: bool) -> Surface {
    let scene = load(file);
    let at = Vec2::new(if right { 0.75 } else { 0.25 }, 0.25);
    Geometry::new(&scene).surface(&scene, 0, Vec2::new(at.x - at.y, at.y), Vec3::Z)
}

/// Whether surfaces are equal as far as bytes of textures tell.
fn alike(a: &Surface, b: &Surface) -> bool {
    let near = |a: Vec3, b: Vec3| a.abs_diff_eq(b, 0.006);
    near(a.albedo, b.albedo)
        && near(a.f0, b.f0)
        && (a.f90 - b.f90).abs() < 0.006
        && (a.alpha - b.alpha).abs() < 0.006
        && near(a.transmittance, b.transmittance)
        && near(a.emission, b.emission)
}

const BASE: [f32; 4] = [0.7, 0.3, 0.1, 1.0];

fn coated(factor: f32, roughness: f32, textures: Value) -> Value {
    let mut coat = json!({"clearcoatFactor": factor, "clearcoatRoughnessFactor": roughness});
    for (name, texture) in textures.as_object().expect("textures") {
        coat[name] = texture.clone();
    }
    json!({
        "pbrMetallicRoughness": {"baseColorFactor": BASE, "metallicFactor": 0.0, "roughnessFactor": 0.8},
        "extensions": {"KHR_materials_clearcoat": coat},
    })
}

#[test]
fn coats_are_where_their_textures_say() {
    let texels = [[51, 204, 0, 255], [255, 51, 0, 255]];
    let both = json!({"clearcoatTexture": {"index": 0}, "clearcoatRoughnessTexture": {"index": 0}});
    let textured = square(coated(0.9, 0.5, both.clone()), texels);
    let twin = |factor: f32, roughness: f32| square(coated(factor, roughness, json!({})), texels);
    let [left, right] = [(0.2, 0.8), (1.0, 0.2)].map(|(r, g)| surface(&twin(0.9 * r, 0.5 * g), false));
    assert!(alike(&surface(&textured, false), &left), "{left:?}");
    assert!(alike(&surface(&textured, true), &right), "{right:?}");
    assert!(!alike(&left, &right), "the control: both sides are the same");
    // Beside a texture of the surface's own.
    let mut rough = square(coated(0.9, 0.5, both), texels);
    rough.json["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({"index": 0});
    let mut twin = twin(0.9 * 0.2, 0.5 * 0.8);
    twin.json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.8 * 0.8);
    assert!(alike(&surface(&rough, false), &surface(&twin, false)));
    // What lies otherwise is averaged, and said so.
    rough.json["materials"][0]["extensions"]["KHR_materials_clearcoat"]["clearcoatTexture"] =
        json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.0]}}});
    let scene = load_gltf_slice(&rough.glb(), None).expect("a scene");
    assert!(scene.warnings.iter().any(|w| w.contains("averaged")), "{:?}", scene.warnings);
}

#[test]
fn sheen_has_the_colour_of_its_texture() {
    let texels = [[255, 0, 0, 255], [0, 188, 255, 255]];
    let sheen = |color: [f32; 3], textured: bool| {
        let mut sheen = json!({"sheenColorFactor": color, "sheenRoughnessFactor": 0.7});
        if textured {
            sheen["sheenColorTexture"] = json!({"index": 0});
        }
        json!({
            "pbrMetallicRoughness": {"baseColorFactor": BASE, "metallicFactor": 0.0},
            "extensions": {"KHR_materials_sheen": sheen},
        })
    };
    let textured = square(sheen([1.0, 0.8, 0.6], true), texels);
    // 188 is a half in sRGB.
    let [left, right] = [[1.0, 0.0, 0.0], [0.0, 0.8 * 0.503, 0.6]]
        .map(|color| surface(&square(sheen(color, false), texels), false));
    assert!(alike(&surface(&textured, false), &left), "{left:?}");
    assert!(alike(&surface(&textured, true), &right), "{right:?}");
    assert!(!alike(&left, &right), "the control: both sides are the same");
}

/// A square whose corners have these alphas, from the left to the right.
fn faded(mode: &str, [left, right]: [f32; 2]) -> File {
    let mut file = square(
        json!({
            "alphaMode": mode, "emissiveFactor": [0.5, 0.5, 0.5],
            "pbrMetallicRoughness": {"baseColorFactor": BASE, "metallicFactor": 0.0},
        }),
        [[255; 4]; 2],
    );
    let colors = [left, right, right, left].map(|alpha| [1.0, 1.0, 1.0, alpha]).concat();
    let colors = file.floats(&colors, "VEC4");
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    file
}

#[test]
fn alpha_of_vertices_multiplies_the_material_s() {
    let twin = |mode: &str, alpha: f32| {
        let mut file = faded(mode, [1.0, 1.0]);
        file.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = json!(alpha);
        file
    };
    // The same all over.
    assert!(alike(&surface(&faded("BLEND", [0.4, 0.4]), false), &surface(&twin("BLEND", 0.4), false)));
    // From side to side; emission is that of the mean.
    let (left, right) = (faded("BLEND", [0.0, 0.8]), faded("BLEND", [0.0, 0.8]));
    let dark = |file: &File| Surface { emission: Vec3::ZERO, ..surface(file, false) };
    let there = |file: &File, right: bool| Surface { emission: Vec3::ZERO, ..surface(file, right) };
    assert!(alike(&there(&left, false), &dark(&twin("BLEND", 0.2))), "{:?}", surface(&left, false));
    assert!(alike(&there(&right, true), &dark(&twin("BLEND", 0.6))));
    assert!(!alike(&there(&left, false), &dark(&twin("BLEND", 0.6))), "the control");
    // Masks cut off what is below a half, and nothing is cut off where alpha does not count.
    let passes = |file: &File, right: bool| {
        let scene = load(file);
        let geometry = Geometry::new(&scene);
        let at = geometry.corners(0)[0] + Vec3::new(if right { 0.75 } else { 0.25 }, 0.25, 1.0);
        SceneTracer::new(&scene, &geometry).closest_hit(at, Vec3::NEG_Z, 2.0, NONE).is_none()
    };
    let mask = faded("MASK", [0.0, 1.0]);
    assert!(passes(&mask, false) && !passes(&mask, true));
    let opaque = faded("OPAQUE", [0.0, 1.0]);
    assert!(!passes(&opaque, false) && !load(&opaque).materials[0].is_transparent());
    assert_eq!(load(&opaque).materials.len(), 1);
}
