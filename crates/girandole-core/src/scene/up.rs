//! +Y is up; files are not always right about that.

use super::{Mesh, Node, Scene, Transform};
#[cfg(feature = "import")]
use glam::DVec3;
use glam::{DAffine3, DMat3, Vec3};

/// How a warning ends that a file likely has another [axis](UpAxis) up.
pub const LIKELY_Z_UP: &str = "its z axis likely points up";

/// The axis of a file that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +X.
    X,
    /// +Y, as everywhere here.
    #[default]
    Y,
    /// +Z.
    Z,
}

impl UpAxis {
    /// A vector with +Y up from one of the file: a quarter turn, exactly.
    pub fn turned(self, v: Vec3) -> Vec3 {
        match self {
            Self::X => Vec3::new(-v.y, v.x, v.z),
            Self::Y => v,
            Self::Z => Vec3::new(v.x, v.z, -v.y),
        }
    }

    /// The same as a matrix.
    pub fn rotation(self) -> DMat3 {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| self.turned(axis).as_dvec3());
        DMat3::from_cols(x, y, z)
    }
}

impl Mesh {
    /// Turns it so that what pointed up in its file does: its positions, normals, tangents and morph targets.
    pub fn turn_up(&mut self, up: UpAxis) {
        let targets =
            self.morph_targets.iter_mut().flat_map(|target| [&mut target.positions, &mut target.normals]);
        for list in [&mut self.positions, &mut self.normals].into_iter().chain(targets) {
            list.iter_mut().for_each(|v| *v = up.turned(*v));
        }
        for tangent in &mut self.tangents {
            *tangent = up.turned(tangent.truncate()).extend(tangent.w);
        }
    }
}

impl Scene {
    /// Turns everything so that what pointed up in its file does, about the origin: all roots hang on a new node. For
    /// building, before the scene is opened.
    pub fn turn_up(&mut self, up: UpAxis) {
        if up == UpAxis::Y {
            return;
        }
        let all = self.nodes.len().into();
        let turn = Transform::Affine(DAffine3::from_mat3(up.rotation()));
        for root in self.nodes.iter_mut().filter(|node| node.parent.is_none()) {
            root.parent = Some(all);
        }
        self.nodes.push(Node { name: "up".into(), local: turn, ..Node::default() });
        self.touch();
    }

    /// Warns where a model of one mesh likely has +Z up.
    #[cfg(feature = "import")]
    pub(super) fn doubt_up(&mut self) {
        if self.meshes.iter().any(lies_on_its_side) {
            self.warn(format!("`{}` lies on its side as it stands; {LIKELY_Z_UP}", self.name));
        }
    }
}

/// Whether a mesh has a floor all over the side of its box towards −Z, none towards +Z, −Y and +Y: what has +Y up has
/// its floor elsewhere, but for a relief.
#[cfg(feature = "import")]
fn lies_on_its_side(mesh: &Mesh) -> bool {
    const FLOOR: f64 = 0.9;
    const ROOF: f64 = 0.5;
    const WALL: f64 = 0.8;
    /// Flatter models are sheets, of which nobody knows.
    const LEAST_EXTENT: f64 = 0.02;
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = mesh
        .triangles
        .iter()
        .flat_map(|t| t.vertices)
        .map(|v| mesh.positions[v as usize])
        .fold(start, |(low, high), p| (low.min(p), high.max(p)));
    let (low, size) = (low.as_dvec3(), high.as_dvec3() - low.as_dvec3());
    if !(size.is_finite() && size.min_element() > LEAST_EXTENT * size.length()) {
        return false;
    }
    // Shares of the box's sides that triangles in them cover: towards −x, −y, −z, then +x, +y, +z.
    let mut covered = [DVec3::ZERO; 2];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.vertices.map(|v| (mesh.positions[v as usize].as_dvec3() - low) / size);
        let area = (b - a).cross(c - a).abs() * 0.5;
        for axis in 0..3 {
            for (side, covered) in covered.iter_mut().enumerate() {
                let is_in = |p: DVec3| (p[axis] - side as f64).abs() < 1e-3;
                if is_in(a) && is_in(b) && is_in(c) {
                    covered[axis] += area[axis];
                }
            }
        }
    }
    let [at_low, at_high] = covered;
    at_low.z >= FLOOR && at_high.z <= ROOF && at_low.y <= WALL && at_high.y <= WALL
}
