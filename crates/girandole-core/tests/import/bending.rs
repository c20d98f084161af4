//! Files with meshes that bend, and what becomes of these meshes by plain arithmetic.

use crate::builder::File;
use girandole_core::glam::{DMat3, DMat4, DQuat, DVec3, Vec3};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Seconds after which everything is as it was.
pub const DURATION: f64 = 2.0;
const SEGMENTS: u16 = 8;
const RINGS: u16 = 8;
/// Of the joint at the elbow, which no inverse bind matrix undoes.
const ELBOW_SCALE: DVec3 = DVec3::new(1.0, 1.2, 0.6);

/// Vertices and triangles.
#[derive(Clone)]
pub struct Surface {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub indices: Vec<u16>,
}

impl Surface {
    /// Rows of vertices, joined by two triangles a cell.
    fn grid(rows: u16, columns: u16, vertex: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Self {
        let at = |i: u16| (f64::from(i / (columns + 1)), f64::from(i % (columns + 1)));
        let vertices = (0..(rows + 1) * (columns + 1)).map(at);
        let (positions, normals) =
            vertices.map(|(row, column)| vertex(row / f64::from(rows), column / f64::from(columns))).unzip();
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| row * (columns + 1) + column));
        let indices = cells.flat_map(|a| {
            let (b, d) = (a + 1, a + columns + 1);
            [a, d, d + 1, a, d + 1, b]
        });
        Self { positions, normals, indices: indices.collect() }
    }

    /// A tube of 2 m along y.
    pub fn tube() -> Self {
        Self::grid(RINGS, SEGMENTS, |up, around| {
            let (sine, cosine) = (TAU * around).sin_cos();
            (DVec3::new(0.2 * cosine, 2.0 * up, 0.2 * sine), DVec3::new(cosine, 0.0, sine))
        })
    }

    /// A cloth of 1 m² that faces up.
    pub fn cloth() -> Self {
        Self::grid(4, 4, |z, x| (DVec3::new(x - 0.5, 0.4, z - 0.5), DVec3::Y))
    }
}

/// A mesh, and what bends it.
#[derive(Clone)]
pub struct Bending {
    pub rest: Surface,
    pub is_skinned: bool,
    pub is_morphed: bool,
    /// Whether the file leaves normals out.
    pub is_flat: bool,
}

/// How far along the tube the elbow holds it.
fn elbow_share(rest: DVec3) -> f64 {
    f64::from((rest.y as f32 - 0.5).clamp(0.0, 1.0))
}

fn shifts(rest: DVec3) -> [DVec3; 2] {
    [DVec3::new(0.0, 0.4 * rest.x * rest.x + 0.3 * rest.z, 0.0), DVec3::new(0.3 * rest.z, 0.0, 0.1 * rest.y)]
}

/// What only the first target does to normals.
fn turn(rest: DVec3) -> DVec3 {
    DVec3::new(-0.8 * rest.x, 0.0, -0.3)
}

pub fn morph_weights(t: f64) -> [f64; 2] {
    [t * t * t - 2.0 * t * t + 0.25, 0.25 * t * t]
}

fn morph_slopes(t: f64) -> [f64; 2] {
    [3.0 * t * t - 4.0 * t, 0.5 * t]
}

fn armature(t: f64) -> DMat4 {
    let turned = DQuat::from_rotation_y(0.5);
    DMat4::from_rotation_translation(turned, DVec3::new(0.1, 0.0, 0.0) + DVec3::new(0.6, 0.1, 0.2) * t * 0.5)
}

/// World from joint, times the inverse bind matrix.
fn joints(t: f64) -> [DMat4; 2] {
    let root = armature(t) * DMat4::from_translation(DVec3::Y * 0.1);
    let angle = FRAC_PI_2 * if t < 1.0 { t } else { 2.0 - t };
    let turned = DQuat::from_rotation_z(-angle);
    let elbow = root * DMat4::from_scale_rotation_translation(ELBOW_SCALE, turned, DVec3::new(0.0, 0.9, 0.0));
    [root * DMat4::from_translation(DVec3::Y * -0.1), elbow * DMat4::from_translation(DVec3::Y * -1.0)]
}

impl Bending {
    pub fn skinned() -> Self {
        Self { rest: Surface::tube(), is_skinned: true, is_morphed: false, is_flat: false }
    }

    pub fn morphed() -> Self {
        Self { rest: Surface::cloth(), is_skinned: false, is_morphed: true, is_flat: false }
    }

    pub fn both() -> Self {
        Self { is_morphed: true, ..Self::skinned() }
    }

    pub fn all() -> [Self; 5] {
        let flat = |bending| Self { is_flat: true, ..bending };
        [Self::skinned(), Self::morphed(), Self::both(), flat(Self::both()), flat(Self::morphed())]
    }

    /// The mesh at a moment, in the world.
    pub fn baked(&self, t: f64) -> Surface {
        let weights = if self.is_morphed { morph_weights(t) } else { [0.0; 2] };
        let joints = if self.is_skinned { joints(t) } else { [DMat4::IDENTITY; 2] };
        let mut result = self.rest.clone();
        let vertices = result.positions.iter_mut().zip(&mut result.normals);
        for (position, normal) in vertices {
            let rest = *position;
            let share = elbow_share(rest);
            let [a, b] = shifts(rest);
            let morphed = rest + a * weights[0] + b * weights[1];
            let [at_root, at_elbow] = joints.map(|joint| joint.transform_point3(morphed));
            *position = at_root * (1.0 - share) + at_elbow * share;
            let [root, elbow] = joints.map(DMat3::from_mat4);
            let blended = root * (1.0 - share) + elbow * share;
            let turned = *normal + turn(rest) * weights[0];
            *normal = (blended.inverse().transpose() * turned).normalize();
        }
        result
    }

    /// A room of floor and lamp with the mesh in it, animated.
    pub fn file(&self) -> File {
        let mut file = room();
        let mut primitive = primitive(&mut file, &self.rest, self.is_flat);
        let mut node = json!({"name": "bent"});
        if self.is_morphed {
            let list = |index: usize| self.rest.positions.iter().map(|p| shifts(*p)[index]).collect();
            let targets: [Vec<DVec3>; 2] = [list(0), list(1)];
            let turns: Vec<DVec3> = self.rest.positions.iter().map(|p| turn(*p)).collect();
            let [a, b, turns] = [&targets[0], &targets[1], &turns].map(|list| vectors(&mut file, list));
            primitive["targets"] = json!([{"POSITION": a, "NORMAL": turns}, {"POSITION": b}]);
        }
        if self.is_skinned {
            // The elbow first, in bytes and floats.
            let weights: Vec<f32> = self
                .rest
                .positions
                .iter()
                .flat_map(|p| [elbow_share(*p) as f32, 1.0 - elbow_share(*p) as f32, 0.0, 0.0])
                .collect();
            let bytes = [1, 0, 9, 0].repeat(self.rest.positions.len());
            let view = file.view(&bytes);
            let joints = json!({"bufferView": view, "componentType": 5121, "type": "VEC4",
                "count": self.rest.positions.len()});
            let joints = file.push("accessors", joints);
            let weights = file.floats(&weights, "VEC4");
            primitive["attributes"]["JOINTS_0"] = json!(joints);
            primitive["attributes"]["WEIGHTS_0"] = json!(weights);
            // Their own nodes do not move skinned meshes.
            node["translation"] = json!([7.0, 8.0, 9.0]);
            node["scale"] = json!([-1.0, 2.0, 1.0]);
        }
        let mesh = file.mesh(primitive);
        node["mesh"] = json!(mesh);
        let node = file.node(node);
        let mut channels: Vec<(usize, &str, usize)> = Vec::new();
        if self.is_morphed {
            file.json["meshes"][mesh]["weights"] = json!([9.0, 9.0]);
            file.json["nodes"][node]["weights"] = json!(morph_weights(0.0));
            let keys = [0.0, 0.5, 2.0].map(|t| [morph_slopes(t), morph_weights(t), morph_slopes(t)]);
            let keys: Vec<f32> = keys.as_flattened().as_flattened().iter().map(|x| *x as f32).collect();
            let (times, keys) = (file.floats(&[0.0, 0.5, 2.0], "SCALAR"), file.floats(&keys, "SCALAR"));
            channels.push((node, "weights", sampler(&mut file, times, keys, "CUBICSPLINE")));
        }
        if self.is_skinned {
            let elbow = file.push(
                "nodes",
                json!({"name": "elbow", "translation": [0.0, 0.9, 0.0], "scale": ELBOW_SCALE.to_array()}),
            );
            let root = file.push("nodes", json!({"translation": [0.0, 0.1, 0.0], "children": [elbow]}));
            let turned = DQuat::from_rotation_y(0.5).to_array();
            let armature = file.node(json!({"name": "armature", "translation": [0.1, 0.0, 0.0],
                "rotation": turned, "children": [root]}));
            let bind = |y: f32| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., y, 0., 1.];
            let matrices = file.floats(&[bind(-0.1), bind(-1.0)].concat(), "MAT4");
            let skin = json!({"joints": [root, elbow], "inverseBindMatrices": matrices, "name": "arm"});
            let skin = file.push("skins", skin);
            file.json["nodes"][node]["skin"] = json!(skin);
            let quarter = DQuat::from_rotation_z(-FRAC_PI_2).to_array().map(|x| x as f32);
            let turns = [[0., 0., 0., 1.], quarter, [0., 0., 0., 1.]].concat();
            let (times, turns) = (file.floats(&[0.0, 1.0, 2.0], "SCALAR"), file.floats(&turns, "VEC4"));
            channels.push((elbow, "rotation", sampler(&mut file, times, turns, "LINEAR")));
            let (times, steps) =
                (file.floats(&[0.0, 2.0], "SCALAR"), file.floats(&[0.1, 0.0, 0.0, 0.7, 0.1, 0.2], "VEC3"));
            channels.push((armature, "translation", sampler(&mut file, times, steps, "LINEAR")));
        }
        let list: Vec<Value> = channels
            .iter()
            .map(|(node, path, sampler)| json!({"sampler": sampler, "target": {"node": node, "path": path}}))
            .collect();
        file.json["animations"][0]["channels"] = json!(list);
        file
    }

    /// The room with the mesh as it is at a moment, as one that does not bend.
    pub fn baked_file(&self, t: f64) -> File {
        let mut file = room();
        let primitive = primitive(&mut file, &self.baked(t), self.is_flat);
        let mesh = file.mesh(primitive);
        file.node(json!({"name": "bent", "mesh": mesh}));
        file
    }
}

fn sampler(file: &mut File, input: usize, output: usize, interpolation: &str) -> usize {
    if file.json["animations"].is_null() {
        file.push("animations", json!({"samplers": [], "channels": []}));
    }
    let samplers = file.json["animations"][0]["samplers"].as_array_mut().expect("samplers");
    samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    samplers.len() - 1
}

fn vectors(file: &mut File, list: &[DVec3]) -> usize {
    let list: Vec<f32> = list.iter().flat_map(|p| p.as_vec3().to_array()).collect();
    file.floats(&list, "VEC3")
}

fn primitive(file: &mut File, surface: &Surface, is_flat: bool) -> Value {
    let positions = vectors(file, &surface.positions);
    let indices = file.shorts(&surface.indices, "SCALAR");
    let mut primitive = json!({"attributes": {"POSITION": positions}, "indices": indices, "material": 0});
    if !is_flat {
        let normals = vectors(file, &surface.normals);
        primitive["attributes"]["NORMAL"] = json!(normals);
    }
    primitive
}

/// A floor of 2 × 2 m, and a lamp of 0.6 × 0.6 m 3 m above it.
fn room() -> File {
    let mut file = File::new();
    file.push(
        "materials",
        json!({"name": "white", "doubleSided": true,
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorFactor": [0.8, 0.7, 0.6, 1.0]}}),
    );
    file.push(
        "materials",
        json!({"name": "lamp", "emissiveFactor": [1.0, 1.0, 1.0], "extensions":
        {"KHR_materials_emissive_strength": {"emissiveStrength": 20.0}}}),
    );
    for (half, y, up, material) in [(1.0, 0.0, Vec3::Y, 0), (0.3, 3.0, Vec3::NEG_Y, 1)] {
        let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
        let surface = Surface {
            positions: corners.map(|(x, z)| DVec3::new(half * x, y, half * z)).to_vec(),
            normals: vec![up.as_dvec3(); 4],
            indices: if up.y > 0.0 { vec![0, 1, 2, 0, 2, 3] } else { vec![0, 2, 1, 0, 3, 2] },
        };
        let mut primitive = primitive(&mut file, &surface, false);
        primitive["material"] = json!(material);
        let mesh = file.mesh(primitive);
        file.node(json!({"mesh": mesh}));
    }
    file
}
