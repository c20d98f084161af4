//! glTF files made in code.

use serde_json::{Value, json};

/// A glTF file under construction: JSON, and the binary chunk.
pub struct File {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl File {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "materials": [], "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
        });
        Self { json, bin: Vec::new() }
    }

    /// Adds an element to a list of the root and returns its index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = &mut self.json[list];
        if list.is_null() {
            *list = json!([]);
        }
        let list = list.as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, size: usize, kind: &str) -> usize {
        let components = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "MAT4" => 16,
            _ => 4,
        };
        let view = self.view(bytes);
        let count = bytes.len() / size / components;
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    pub fn floats(&mut self, data: &[f32], kind: &str) -> usize {
        let bytes: Vec<u8> = data.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, 4, kind)
    }

    pub fn shorts(&mut self, data: &[u16], kind: &str) -> usize {
        let bytes: Vec<u8> = data.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, 2, kind)
    }

    /// The unit square in the XY plane that faces +Z, with texture coordinates whose v points down.
    pub fn square(&mut self) -> Value {
        let positions = self.floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.], "VEC3");
        let normals = self.floats(&[0., 0., 1.].repeat(4), "VEC3");
        let uvs = self.floats(&[0., 1., 1., 1., 1., 0., 0., 0.], "VEC2");
        let indices = self.shorts(&[0, 1, 2, 0, 2, 3], "SCALAR");
        json!({
            "attributes": {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs}, "indices": indices,
        })
    }

    /// Adds a mesh of one primitive, and returns the mesh.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// Adds a root node.
    pub fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().expect("roots").push(json!(index));
        index
    }

    /// A file with one square.
    pub fn with_square() -> Self {
        let mut file = Self::new();
        let primitive = file.square();
        let mesh = file.mesh(primitive);
        file.node(json!({"mesh": mesh}));
        file
    }

    /// Adds a PNG in the binary chunk, and a texture of it.
    pub fn texture(&mut self, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> usize {
        let image = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(texel(x, y)));
        let mut png = std::io::Cursor::new(Vec::new());
        image.write_to(&mut png, image::ImageFormat::Png).expect("a PNG");
        let view = self.view(png.get_ref());
        let source = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        self.push("textures", json!({"source": source}))
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        if json["buffers"][0]["byteLength"] == json!(0) {
            json["buffers"][0]["byteLength"] = json!(bin.len());
        }
        container(json.to_string().into_bytes(), &bin)
    }
}

/// A GLB of these chunks.
pub fn container(mut text: Vec<u8>, bin: &[u8]) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    let word = |n: usize| (n as u32).to_le_bytes();
    glb.extend(word(12 + 8 + text.len() + 8 + bin.len()));
    glb.extend(word(text.len()));
    glb.extend(b"JSON");
    glb.extend(&text);
    glb.extend(word(bin.len()));
    glb.extend(b"BIN\0");
    glb.extend(bin);
    glb
}

/// A small file with some of everything.
pub fn some_of_everything() -> File {
    let mut file = File::new();
    let texture =
        file.texture(2, 2, |x, y| [255, (x * 200) as u8, (y * 100) as u8, if x == y { 255 } else { 0 }]);
    let sampler =
        file.push("samplers", json!({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9987}));
    file.json["textures"][texture]["sampler"] = json!(sampler);
    let material = file.push(
        "materials",
        json!({
            "name": "all",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 1.0, 0.75], "metallicFactor": 0.25, "roughnessFactor": 0.5,
                "baseColorTexture": {"index": texture, "extensions": {"KHR_texture_transform": {
                    "offset": [0.25, 0.5], "rotation": std::f32::consts::FRAC_PI_2, "scale": [2.0, 3.0], "texCoord": 1,
                }}},
                "metallicRoughnessTexture": {"index": texture, "texCoord": 1},
            },
            "normalTexture": {"index": texture, "scale": 0.5},
            "emissiveFactor": [0.5, 1.0, 0.0], "emissiveTexture": {"index": texture},
            "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
            "extensions": {
                "KHR_materials_emissive_strength": {"emissiveStrength": 8.0},
                "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 0.5, 0.25]},
            },
        }),
    );
    let mut primitive = file.square();
    let uvs = file.floats(&[0.5; 8], "VEC2");
    primitive["attributes"]["TEXCOORD_1"] = json!(uvs);
    primitive["material"] = json!(material);
    let mesh = file.mesh(primitive);
    let times = file.floats(&[0.0, 1.0, 2.5], "SCALAR");
    let turns = file.floats(&[0., 0., 0., 1., 0., 0., 1., 0., 0., 0., 0., 1.], "VEC4");
    let shifts = file.floats(&[0.5; 27], "VEC3");
    let sizes = file.floats(&[1.0; 9], "VEC3");
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1.0, 0.5, 0.25], "intensity": 4.0, "name": "bulb"},
        {"type": "spot", "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 2.0},
    ]}});
    file.json["extensionsUsed"] =
        json!(["KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_specular"]);
    let perspective =
        json!({"type": "perspective", "perspective": {"yfov": 0.75, "znear": 0.1}, "name": "eye"});
    file.push("cameras", perspective);
    let orthographic = json!({"xmag": 2.0, "ymag": 1.5, "znear": 0.1, "zfar": 10.0});
    file.push("cameras", json!({"type": "orthographic", "orthographic": orthographic}));
    let light = |i: usize| json!({"KHR_lights_punctual": {"light": i}});
    let child = file.push("nodes", json!({"mesh": mesh, "name": "child", "scale": [2.0, 2.0, -2.0]}));
    let root = file.node(json!({
        "name": "root", "mesh": mesh, "children": [child], "translation": [0.0, 1.0, 0.0],
        "rotation": [0.0, 0.0, 0.0, 2.0], "extras": {"dynamic": true, "transfer": true},
    }));
    for (i, extra) in
        [json!({"camera": 0}), json!({"camera": 1}), json!({"name": "lamp"})].into_iter().enumerate()
    {
        let mut node = extra;
        node["extensions"] = light(i);
        file.node(node);
    }
    let matrix = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 5., 6., 7., 1.];
    file.node(json!({"mesh": mesh, "matrix": matrix}));
    file.push(
        "animations",
        json!({"name": "turn", "samplers": [
            {"input": times, "output": turns, "interpolation": "STEP"},
            {"input": times, "output": shifts, "interpolation": "CUBICSPLINE"},
            {"input": times, "output": sizes},
        ], "channels": [
            {"sampler": 0, "target": {"node": root, "path": "rotation"}},
            {"sampler": 1, "target": {"node": child, "path": "translation"}},
            {"sampler": 2, "target": {"node": root, "path": "scale"}},
        ]}),
    );
    file
}
