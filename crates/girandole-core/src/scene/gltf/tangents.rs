//! Tangents where a file has none: the MikkTSpace algorithm, as glTF asks for.

use glam::{Affine2, Vec2, Vec3, Vec4};

struct Corners<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    uvs: &'a [[Vec2; 2]],
    set: usize,
    transform: Affine2,
    triangles: &'a [[u32; 3]],
    tangents: Vec<[Vec4; 3]>,
}

/// The same on every machine.
struct Portable;

impl bevy_mikktspace::Ops for Portable {
    fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }

    fn acos(x: f32) -> f32 {
        libm::acosf(x)
    }
}

impl bevy_mikktspace::Geometry<Portable> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.triangles[face][corner] as usize].into()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.triangles[face][corner] as usize].into()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.uvs[self.triangles[face][corner] as usize][self.set];
        self.transform.transform_point2(uv).into()
    }

    fn set_tangent(&mut self, space: Option<bevy_mikktspace::TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            // MikkTSpace counts v upwards, glTF downwards.
            let [x, y, z, w] = space.tangent_encoded();
            let tangent = Vec4::new(x, y, z, -w);
            if tangent.is_finite() {
                self.tangents[face][corner] = tangent;
            }
        }
    }
}

/// A tangent for each corner of each triangle, by texture coordinates of `set` after `transform`. Zero where the
/// coordinates are degenerate.
pub(in crate::scene) fn generate(
    positions: &[Vec3],
    normals: &[Vec3],
    uvs: &[[Vec2; 2]],
    set: usize,
    transform: Affine2,
    triangles: &[[u32; 3]],
) -> Vec<[Vec4; 3]> {
    let tangents = vec![[Vec4::ZERO; 3]; triangles.len()];
    let mut corners = Corners { positions, normals, uvs, set, transform, triangles, tangents };
    // Its error type has no values.
    let _ = bevy_mikktspace::generate_tangents(&mut corners);
    corners.tangents
}
