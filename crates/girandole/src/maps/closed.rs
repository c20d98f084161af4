//! Closed surfaces. A ray from outside of one meets its outside first: what faces away from a light there is behind that, and the depth
//! of a map is the same without it. (Where a surface crosses itself so that a part of it is turned inside out, that part's far side
//! counts as the nearest; it faces the light, and nothing is seen of it but from inside.)

use super::map_view::Bounds;
use crate::layout::Light;
use girandole_core::glam::Vec3;
use girandole_core::scene::Geometry;
use std::collections::{HashMap, HashSet};

/// The least cosine between a cluster's triangles and their mean direction for a cone to be of use.
const NARROWEST: f32 = 0.1;

/// The corners of a triangle.
pub(super) type Corners = [Vec3; 3];

/// The cone of triangles' normals (Shirman and Abi-Ezzi 1993): its axis, as long as 1 + the sine of the largest angle between it and
/// a normal; zero where they point too many ways.
pub(super) fn cone<'a>(triangles: impl Iterator<Item = &'a Corners> + Clone) -> Vec3 {
    let normals = triangles.map(|corners| normal(*corners)).filter(|normal| *normal != Vec3::ZERO);
    let axis = normals.clone().sum::<Vec3>().normalize_or_zero();
    let cosine = normals.map(|normal| normal.dot(axis)).fold(1.0, f32::min);
    if cosine < NARROWEST { Vec3::ZERO } else { axis * (1.0 + (1.0 - cosine * cosine).max(0.0).sqrt()) }
}

/// Whether a light is certainly outside of what is in a box.
pub(crate) fn is_outside(light: &Light, bounds: &Bounds) -> bool {
    let d = bounds.center - light.position;
    if light.is_parallel() {
        return light.normal.dot(d) > light.normal.abs().dot(bounds.half_extent);
    }
    d.abs().cmpgt(bounds.half_extent).any()
}

/// Whether the corners of a closed surface's triangles turn left as seen from outside.
pub(super) fn outward(mut triangles: impl Iterator<Item = Corners>) -> bool {
    let Some(first) = triangles.next() else { return true };
    triangles.map(|corners| volume(&corners, first[0])).sum::<f64>() >= 0.0
}

/// The unit normal of a triangle; zero where it has no area.
pub(crate) fn normal([a, b, c]: Corners) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// Six times the volume of the tetrahedron between a triangle and a point, negative in front of it.
fn volume(corners: &Corners, point: Vec3) -> f64 {
    let [a, b, c] = corners.map(|p| (p - point).as_dvec3());
    a.dot(b.cross(c))
}

/// Whether triangles make up closed surfaces, all of them with their fronts outside or all with their backs: each directed edge
/// has its opposite exactly once. Corners are one where they are in the same place.
pub(crate) fn is_closed(geometry: &Geometry, triangles: &[u32]) -> bool {
    let mut corners = HashMap::new();
    let mut corner = |p: Vec3| {
        let next = corners.len();
        // The sum makes both zeros one.
        *corners.entry((p + 0.0).to_array().map(f32::to_bits)).or_insert(next)
    };
    let welded: Vec<[usize; 3]> = triangles.iter().map(|&t| geometry.corners(t).map(&mut corner)).collect();
    let edges = |[a, b, c]: [usize; 3]| [(a, b), (b, c), (c, a)];
    let mut directed = HashSet::new();
    if !welded.iter().flat_map(|&t| edges(t)).all(|edge| directed.insert(edge))
        || !directed.iter().all(|&(a, b)| directed.contains(&(b, a)))
    {
        return false;
    }
    // The surfaces' volumes, by the first of each one's corners.
    let mut first: Vec<usize> = (0..corners.len()).collect();
    for &(a, b) in &directed {
        let [a, b] = [a, b].map(|corner| root(&mut first, corner));
        first[a.max(b)] = a.min(b);
    }
    let mut volumes = vec![0.0; corners.len()];
    let origin = triangles.first().map_or(Vec3::ZERO, |&t| geometry.corners(t)[0]);
    for (&triangle, corners) in triangles.iter().zip(&welded) {
        volumes[root(&mut first, corners[0])] += volume(&geometry.corners(triangle), origin);
    }
    let surfaces = || (0..volumes.len()).filter(|&i| first[i] == i).map(|i| volumes[i]);
    surfaces().all(|v| v > 0.0) || surfaces().all(|v| v < 0.0)
}

/// The first corner of a surface, from any (with path halving; Tarjan and van Leeuwen 1984).
fn root(first: &mut [usize], mut corner: usize) -> usize {
    while first[corner] != corner {
        first[corner] = first[first[corner]];
        corner = first[corner];
    }
    corner
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::COSINE;
    use girandole_core::glam::Quat;
    use girandole_core::scene::builtin::shapes;
    use girandole_core::scene::{Material, Mesh, Scene, Transform};

    fn torus() -> Mesh {
        shapes::thesis_torus(0)
    }

    fn inside_out(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|t| t.vertices.swap(0, 1));
        mesh
    }

    /// Corners of a mesh in place, and whether it is closed.
    fn placed(mesh: Mesh, place: Transform) -> (Vec<Corners>, bool) {
        let mut scene = Scene::default();
        scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
        scene.add_object("mesh", mesh, place);
        let geometry = Geometry::new(&scene);
        let all: Vec<u32> = (0..geometry.triangles.len() as u32).collect();
        (all.iter().map(|&t| geometry.corners(t)).collect(), is_closed(&geometry, &all))
    }

    fn scaled(x: f32) -> Transform {
        let (rotation, scale) = (Quat::from_rotation_x(0.7), Vec3::new(x, 1.3, 0.8));
        Transform::Parts { translation: Vec3::ZERO, rotation, scale }
    }

    #[test]
    fn surfaces_are_closed_where_no_edge_is_open_and_all_face_one_way() {
        let is_closed = |mesh: Mesh| placed(mesh, scaled(1.0)).1;
        assert!(is_closed(torus()) && is_closed(inside_out(torus())));
        let mut open = torus();
        open.triangles.pop();
        assert!(!is_closed(open));
        // A surface more, closed too, and the other way round.
        let with = |second: Mesh| {
            let mut both = torus();
            let first = both.positions.len() as u32;
            both.positions.extend(second.positions.iter().map(|p| *p + Vec3::Y));
            both.normals.extend(&second.normals);
            both.triangles.extend(second.triangles.iter().map(|t| {
                let mut t = *t;
                t.vertices = t.vertices.map(|v| v + first);
                t
            }));
            both
        };
        assert!(is_closed(with(torus())) && !is_closed(with(inside_out(torus()))));
    }

    #[test]
    fn corners_turn_left_as_seen_from_outside_unless_the_mesh_is_inside_out() {
        // Mirrored ones are turned by the geometry.
        for (mesh, x, is_outward) in [
            (torus(), 1.0, true),
            (inside_out(torus()), 1.0, false),
            (torus(), -1.0, true),
            (inside_out(torus()), -1.0, false),
        ] {
            let (corners, _) = placed(mesh, scaled(x));
            assert_eq!(outward(corners.into_iter()), is_outward, "{x}");
        }
    }

    #[test]
    fn cones_hold_all_normals_and_are_no_wider_than_that() {
        let (corners, _) = placed(torus(), scaled(1.0));
        let mut cones = 0;
        for cluster in corners.chunks(4) {
            let cone = cone(cluster.iter());
            if cone == Vec3::ZERO {
                continue;
            }
            cones += 1;
            let (axis, sine) = (cone.normalize(), cone.length() - 1.0);
            let sines = cluster.iter().map(|c| normal(*c).cross(axis).length());
            assert!((sines.fold(0.0, f32::max) - sine).abs() < 1e-3);
        }
        // The controls: most neighbours make a cone, all together none.
        assert!(cones * 5 > corners.chunks(4).len() * 4 && cone(corners.iter()) == Vec3::ZERO);
    }

    #[test]
    fn lights_in_the_box_about_a_surface_are_not_outside_of_it() {
        let bounds = Bounds { center: Vec3::X, half_extent: Vec3::new(1.0, 0.5, 1.0) };
        let light = |position, normal, profile| Light { position, normal, profile, ..Light::default() };
        for (position, outside) in [(Vec3::X, false), (Vec3::new(1.9, 0.4, 0.9), false), (Vec3::Y, true)] {
            assert_eq!(is_outside(&light(position, Vec3::Z, COSINE), &bounds), outside, "{position}");
        }
        let sun = |position| light(position, Vec3::X, crate::shader_constants::DIRECTIONAL);
        assert!(is_outside(&sun(Vec3::X * -1.0), &bounds) && !is_outside(&sun(Vec3::X * 0.5), &bounds));
    }
}
