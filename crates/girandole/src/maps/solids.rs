//! Which clusters of a solid are hidden from a light by the solid itself: those that face away from it as a whole.
//!
//! A ray from outside of a closed surface meets its outside first. What faces away from the light is behind that, and the depth
//! of the map is the same without it. (Where a surface crosses itself so that a part of it is turned inside out, that part's
//! far side counts as the nearest; it faces the light, and nothing is seen of it but from inside.)

use super::footprint::{Bounds, MapView};
use girandole_core::glam::Vec3;
use girandole_core::scene::Geometry;
use std::collections::{HashMap, HashSet};

/// By how much triangles face away from the light before they are left out, as the sine of an angle: at the outline, where
/// front and back meet, rasterisation rounds either.
const MARGIN: f32 = 0.02;
/// The least cosine between a cluster's triangles and their mean direction for a cone to be of use.
const NARROWEST: f32 = 0.1;

/// The corners of a triangle.
pub(super) type Corners = [Vec3; 3];

/// A closed surface.
#[derive(Default)]
pub(crate) struct Solid {
    bounds: Option<Bounds>,
    /// One a cluster; none where triangles face too many ways.
    cones: Vec<Option<Cone>>,
}

/// A cone of normals (Shirman and Abi-Ezzi 1993), with its apex behind the planes of all of a cluster's triangles.
struct Cone {
    /// A point behind the planes of all triangles.
    apex: Vec3,
    /// Mean direction of their normals, unit.
    axis: Vec3,
    /// Sine of the largest angle between it and a normal.
    sine: f32,
}

impl Solid {
    /// The solid that clusters of triangles make up, given by their corners; their union is closed.
    pub fn new(clusters: &[&[Corners]]) -> Self {
        let all = || clusters.iter().copied().flatten();
        let origin = all().next().map_or(Vec3::ZERO, |corners| corners[0]);
        let outward = if all().map(|c| volume(c, origin)).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        Self {
            bounds: Some(Bounds::around(all().flatten().copied())),
            cones: clusters.iter().map(|cluster| Cone::new(cluster, outward)).collect(),
        }
    }

    /// Tells of each cluster whether it is hidden from a light; none, if nothing is known to be.
    pub fn hidden_from<'a>(&'a self, map: &MapView) -> Option<impl Fn(usize) -> bool + 'a> {
        let light = map.light;
        let (position, direction) = (light.position, light.normal);
        let is_parallel = light.is_parallel();
        let Bounds { center, half_extent } = self.bounds?;
        let d = center - position;
        let is_outside = if is_parallel {
            direction.dot(d) > direction.abs().dot(half_extent)
        } else {
            d.abs().cmpgt(half_extent).any()
        };
        // Curved maps show a straight surface elsewhere than it is.
        let is_straight = is_parallel || map.faces() > 1;
        let hidden = move |cluster: usize| {
            self.cones[cluster].as_ref().is_some_and(|cone: &Cone| {
                let ray = if is_parallel { direction } else { cone.apex - position };
                ray.dot(cone.axis) > (cone.sine + MARGIN) * ray.length()
            })
        };
        (is_outside && is_straight).then_some(hidden)
    }
}

impl Cone {
    fn new(triangles: &[Corners], outward: f32) -> Option<Self> {
        let normal = |corners: &Corners| normal(*corners) * outward;
        let axis = triangles.iter().map(normal).sum::<Vec3>().normalize_or_zero();
        let cosine = triangles.iter().map(|c| normal(c).dot(axis)).fold(1.0, f32::min);
        if cosine < NARROWEST {
            return None;
        }
        let from = triangles[0][0];
        let above = |c: &Corners| (from - c[0]).dot(normal(c)) / normal(c).dot(axis);
        let back = triangles.iter().map(above).fold(f32::NEG_INFINITY, f32::max);
        Some(Self { apex: from - axis * back, axis, sine: (1.0 - cosine * cosine).sqrt() })
    }
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
    use super::super::culling::{Items, Wanted};
    use super::super::footprint::TexelRect;
    use super::super::occluders::{Clusters, Occluders};
    use super::*;
    use crate::layout::Light;
    use crate::shader_constants::{COSINE, NONE};
    use girandole_core::glam::Quat;
    use girandole_core::scene::builtin::shapes;
    use girandole_core::scene::{Material, Mesh, Scene, Transform};
    use girandole_core::trace::SceneTracer;

    /// The clusters of a dynamic mesh in place, and those of them that a light's map leaves out.
    fn hidden(
        mesh: &Mesh,
        place: Transform,
        light: &Light,
        faces: u32,
    ) -> (Scene, Geometry, Clusters, Vec<usize>) {
        let mut scene = Scene::default();
        scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
        // Something static, so that clusters of movers are not the first.
        scene.add_object("stone", shapes::sphere(0.01, 8, 4, 0), Transform::translation(Vec3::splat(9.0)));
        scene.add_object("mover", mesh.clone(), place);
        scene.objects[1].dynamic = true;
        let geometry = Geometry::new(&scene);
        let clusters = Occluders::new(&scene, &geometry, &Default::default(), false).opaque;
        let mut light = *light;
        light.position -= geometry.origin.as_vec3();
        let map = MapView::new(&light, 1 << 20, faces);
        let mut items = Items::default();
        let wanted = Wanted { still: true, moving: true, by_kernel: false };
        clusters.cull((0, map), TexelRect::whole(1 << 20), |_| false, wanted, &mut items);
        assert!(items.pieces.is_empty());
        let drawn: HashSet<usize> =
            items.clusters.iter().map(|item| (item.face_cluster >> 3) as usize).collect();
        let of_mover = clusters.of_object(girandole_core::scene::ObjectId(1)).expect("clusters");
        let hidden = of_mover.filter(|cluster| !drawn.contains(cluster)).collect();
        (scene, geometry, clusters, hidden)
    }

    fn light(position: Vec3) -> Light {
        let normal = -position.normalize_or(Vec3::Y);
        let tangent = normal.any_orthonormal_vector();
        Light { position, normal, tangent, profile: COSINE, ..Default::default() }
    }

    fn torus() -> Mesh {
        shapes::thesis_torus(0)
    }

    fn turned() -> Transform {
        Transform::Parts {
            translation: Vec3::ZERO,
            rotation: Quat::from_rotation_x(0.7),
            scale: Vec3::new(1.0, 1.3, 0.8),
        }
    }

    fn inside_out(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|t| t.vertices.swap(0, 1));
        mesh
    }

    const POSITIONS: [Vec3; 4] = [
        Vec3::new(2.0, 0.5, 0.3),
        Vec3::new(0.1, -2.5, 0.2),
        Vec3::new(-0.9, 0.9, 0.9),
        Vec3::new(0.0, 0.3, 20.0),
    ];

    #[test]
    fn what_is_left_out_is_hidden_by_the_rest() {
        let mirrored = Transform::Parts {
            translation: Vec3::ZERO,
            rotation: Quat::from_rotation_z(0.3),
            scale: Vec3::new(-1.0, 1.0, 1.0),
        };
        for (mesh, place) in [(torus(), turned()), (inside_out(torus()), turned()), (torus(), mirrored)] {
            for position in POSITIONS {
                let light = light(position);
                let (scene, geometry, clusters, hidden) = hidden(&mesh, place, &light, 4);
                let share = hidden.len() as f32 / clusters.bounds.len() as f32;
                assert!((0.05..0.5).contains(&share), "{position}: {share}");
                let is_hidden: HashSet<u32> =
                    hidden.iter().flat_map(|&c| clusters.of_cluster(c).iter().copied()).collect();
                let tracer = SceneTracer::new(&scene, &geometry);
                let from = position - geometry.origin.as_vec3();
                let mut nearest_hidden = 0;
                for &triangle in clusters.triangles.iter().filter(|t| **t != NONE) {
                    let [a, b, c] = geometry.corners(triangle);
                    let direction = (a * 0.3 + b * 0.3 + c * 0.4 - from).normalize();
                    let hit = tracer.closest_hit(from, direction, f32::INFINITY, NONE).expect("something");
                    nearest_hidden += u32::from(is_hidden.contains(&hit.triangle));
                }
                assert_eq!(nearest_hidden, 0, "{position}");
            }
        }
    }

    #[test]
    fn nothing_is_left_out_of_what_is_open_or_seen_from_within_or_shown_curved() {
        let count = |mesh: &Mesh, position, faces| hidden(mesh, turned(), &light(position), faces).3.len();
        let outside = POSITIONS[0];
        assert!(count(&torus(), outside, 4) > 0 && count(&torus(), outside, 5) > 0);
        assert_eq!(count(&torus(), outside, 1), 0);
        let mut open = torus();
        open.triangles.pop();
        assert_eq!(count(&open, outside, 4), 0);
        // A surface more, closed too, but the other way round.
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
        assert!(count(&with(torus()), outside, 4) > 0);
        assert_eq!(count(&with(inside_out(torus())), outside, 4), 0);
        // In the torus's hole the light is within the box.
        let within = Vec3::new(0.05, 0.02, 0.0);
        let mut scene = Scene::default();
        scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
        scene.add_object("torus", torus(), turned());
        let geometry = Geometry::new(&scene);
        let all: Vec<u32> = (0..geometry.triangles.len() as u32).collect();
        let corners: Vec<Corners> = all.iter().map(|&t| geometry.corners(t)).collect();
        let clusters: Vec<&[Corners]> = corners.chunks(8).collect();
        let solid = Solid::new(&clusters);
        let sees = |position: Vec3| {
            let light = light(position - geometry.origin.as_vec3());
            solid.hidden_from(&MapView::new(&light, 64, 4)).is_some()
        };
        assert!(!sees(within) && sees(outside));
    }
}
