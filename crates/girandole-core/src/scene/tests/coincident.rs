//! Triangles in the same place count once.

use super::*;

const CORNERS: [Vec3; 3] = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, -1.0)];

/// Orders of the corners: the first three with the same front, the last with the other.
const ORDERS: [[usize; 3]; 4] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1]];

fn triangle(order: [usize; 3], material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_polygon(&order.map(|corner| CORNERS[corner]), material);
    mesh
}

/// A scene of these materials: single-sided, double-sided, another of each, with holes, seen through.
fn materials() -> Scene {
    let mut scene = Scene::default();
    let double_sided = Material { double_sided: true, ..Material::default() };
    let holes = Material { alpha_cutoff: Some(0.5), ..double_sided.clone() };
    let glass = Material { blended: true, ..double_sided.clone() };
    for material in
        [Material::default(), double_sided.clone(), Material::default(), double_sided, holes, glass]
    {
        scene.add_material(material);
    }
    scene
}

const ONE: MaterialId = MaterialId(0);
const BOTH: MaterialId = MaterialId(1);
const ONE_ELSE: MaterialId = MaterialId(2);
const BOTH_ELSE: MaterialId = MaterialId(3);
const HOLES: MaterialId = MaterialId(4);
const GLASS: MaterialId = MaterialId(5);

/// Which of some triangles, by order and material, stay; each is an object of its own, or all are one.
fn staying(triangles: &[(usize, MaterialId)], apart: bool) -> Vec<usize> {
    let mut scene = materials();
    // Which is which is told by its texture coordinates.
    let tagged = triangles.iter().enumerate().map(|(tag, &(order, material))| {
        let mut mesh = triangle(ORDERS[order], material);
        mesh.uvs.fill([glam::Vec2::splat(tag as f32); 2]);
        mesh
    });
    if apart {
        for mesh in tagged {
            scene.add_object("", mesh, Transform::IDENTITY);
        }
    } else {
        let mut all = Mesh::default();
        for mesh in tagged {
            let first = all.positions.len() as u32;
            all.positions.extend(mesh.positions);
            all.normals.extend(mesh.normals);
            all.uvs.extend(mesh.uvs);
            let moved = |t: MeshTriangle| MeshTriangle { vertices: t.vertices.map(|v| v + first), ..t };
            all.triangles.extend(mesh.triangles.into_iter().map(moved));
        }
        scene.add_object("", all, Transform::IDENTITY);
    }
    let geometry = Geometry::new(&scene);
    assert_eq!(geometry.triangles.len() + geometry.coincident, triangles.len());
    geometry.triangles.iter().map(|t| geometry.uvs[t.vertices[0] as usize][0].x as usize).collect()
}

/// Triangles by order of corners and material, and which of them stay.
type Case<'a> = (&'a [(usize, MaterialId)], &'a [usize]);

#[test]
fn a_side_counts_once() {
    let cases: [Case; 17] = [
        (&[(0, ONE)], &[0]),
        (&[(0, ONE), (0, ONE)], &[0]),
        (&[(0, ONE), (1, ONE), (2, ONE)], &[0]),
        // Back to back.
        (&[(0, ONE), (3, ONE)], &[0, 1]),
        (&[(0, ONE), (3, ONE), (1, ONE), (3, ONE)], &[0, 1]),
        (&[(0, BOTH), (0, BOTH)], &[0]),
        (&[(0, BOTH), (3, BOTH)], &[0]),
        (&[(3, BOTH), (2, ONE), (3, ONE)], &[0]),
        // What covers more takes the place of what covers less.
        (&[(0, ONE), (2, BOTH)], &[1]),
        (&[(0, ONE), (3, ONE), (1, BOTH)], &[0, 1]),
        // The first of different materials.
        (&[(0, ONE), (1, ONE_ELSE)], &[0]),
        (&[(0, BOTH), (3, BOTH_ELSE)], &[0]),
        // What shows what is behind it leaves that.
        (&[(0, BOTH), (0, HOLES)], &[0, 1]),
        (&[(0, GLASS), (0, BOTH)], &[0, 1]),
        (&[(0, HOLES), (0, GLASS), (3, HOLES), (1, GLASS)], &[0, 1]),
        (&[(0, HOLES), (3, HOLES)], &[0]),
        (&[(0, BOTH), (0, GLASS), (0, BOTH), (0, GLASS), (0, ONE)], &[0, 1]),
    ];
    for (triangles, expected) in cases {
        for apart in [false, true] {
            assert_eq!(staying(triangles, apart), expected, "{triangles:?}, apart: {apart}");
        }
    }
}

/// How many triangles coincide in a scene of two of the same, after a change of it.
fn coincident(change: impl Fn(&mut Scene)) -> usize {
    let mut scene = materials();
    for _ in 0..2 {
        scene.add_object("", triangle(ORDERS[0], BOTH), Transform::translation(Vec3::Y));
    }
    change(&mut scene);
    Geometry::new(&scene).coincident
}

#[test]
fn places_are_compared_to_the_bit_and_in_the_world() {
    assert_eq!(coincident(|_| ()), 1);
    let moved =
        |by: Vec3| move |scene: &mut Scene| scene.nodes[1].local = Transform::translation(Vec3::Y + by);
    assert_eq!(coincident(moved(Vec3::Y * 1e-6)), 0);
    assert_eq!(coincident(moved(Vec3::X)), 0);
    // Minus nothing is nothing, and a mirror image of a mirror image is the same.
    assert_eq!(coincident(|scene| scene.meshes[1].positions[0] = vec3(-0.0, -0.0, -0.0)), 1);
    assert_eq!(coincident(|scene| scene.objects[1].mesh = 0), 1);
    let mirrored = |scene: &mut Scene| {
        let flip = glam::DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        scene.nodes[1].local = Transform::Affine(glam::DAffine3::from_translation(DVec3::Y) * flip);
        scene.meshes[1].positions.iter_mut().for_each(|p| p.x = -p.x);
    };
    assert_eq!(coincident(mirrored), 1);
    assert_eq!(coincident(|scene| scene.objects[1].removed = true), 0);
}

#[test]
fn what_moves_on_its_own_counts_on_its_own() {
    assert_eq!(coincident(|scene| scene.objects[1].dynamic = true), 0);
    assert_eq!(coincident(|scene| scene.objects.iter_mut().for_each(|o| o.dynamic = true)), 0);
    // Unless one node carries both.
    let carried = |scene: &mut Scene| {
        let node = scene.add_node("", Transform::IDENTITY);
        for object in 0..2 {
            scene.objects[object].dynamic = true;
            let carried = scene.objects[object].node;
            scene.nodes[carried].parent = Some(node);
        }
        scene.animations.push(Animation {
            name: String::new(),
            channels: vec![Channel {
                node,
                times: vec![0.0, 1.0],
                keyframes: Keyframes::Translation(vec![Vec3::ZERO, Vec3::X]),
                interpolation: Interpolation::Linear,
            }],
        });
    };
    assert_eq!(coincident(carried), 1);
    let bent = |scene: &mut Scene| scene.meshes[1].morph_targets.push(MorphTarget::default());
    assert_eq!(coincident(bent), 0);
    // What is moved shows that there are two; then both have all their triangles.
    let mut scene = materials();
    let objects = [0, 1].map(|_| scene.add_object("", triangle(ORDERS[0], BOTH), Transform::IDENTITY));
    assert_eq!(Geometry::new(&scene).triangles.len(), 1);
    scene.set_transform(scene.objects[objects[0]].node, Transform::translation(Vec3::Y)).unwrap();
    assert_eq!(Geometry::new(&scene).triangles.len(), 2);
}

#[test]
fn indices_stay_consistent() {
    // Boxes, of which every third is there twice, single-sided, and a sheet that covers a side of one.
    let boxes = |copies: &[usize]| {
        let mut scene = materials();
        for i in 0..12 {
            let mut mesh = Mesh::default();
            let low = vec3(i as f32, 0.0, 0.0);
            for _ in 0..copies[i % copies.len()] {
                mesh.add_box(low, low + vec3(0.5, 0.7, 0.9), (i % 4).into());
            }
            scene.add_object("", mesh, Transform::IDENTITY);
        }
        let mut sheet = Mesh::default();
        let corners = [vec3(4.5, 0.0, 0.9), vec3(4.5, 0.0, 0.0), vec3(4.5, 0.7, 0.0), vec3(4.5, 0.7, 0.9)];
        sheet.add_polygon(&corners, ONE);
        scene.add_object("", sheet, Transform::IDENTITY);
        Geometry::new(&scene)
    };
    let [once, twice] = [boxes(&[1]), boxes(&[2, 1, 3])];
    assert_eq!((once.coincident, twice.coincident), (2, 2 + 12 * (4 + 8)));
    let shown = |geometry: &Geometry| {
        let triangles = geometry.triangles.iter().zip(0..);
        let all = triangles
            .map(|(t, i)| (geometry.corners(i).map(|p| p.to_array()), t.object, t.material, t.patch));
        all.collect::<Vec<_>>()
    };
    assert_eq!(shown(&once), shown(&twice));
    assert_eq!(once.patches, twice.patches);
    for geometry in [once, twice] {
        let mut next = [0, 0];
        for (index, object) in (0..).zip(&geometry.objects) {
            assert_eq!([object.triangles.start, object.patches.start], next);
            next = [object.triangles.end, object.patches.end];
            let triangles = object.triangles.start as usize..object.triangles.end as usize;
            assert!(geometry.triangles[triangles].iter().all(|t| t.object == index));
        }
        assert_eq!(next.map(|n| n as usize), [geometry.triangles.len(), geometry.patches.len()]);
        for (index, patch) in (0..).zip(&geometry.patches) {
            assert!(patch.triangles.clone().all(|t| geometry.triangles[t as usize].patch == index));
        }
    }
}

#[test]
fn rooms_have_none_but_where_it_is_meant() {
    for name in builtin::NAMES {
        let scene = builtin::build(name, builtin::MovingObject::Torus).unwrap();
        // Three boxes of the moulding are there twice.
        let expected = if name == "moulding" { 3 * 12 } else { 0 };
        assert_eq!(Geometry::new(&scene).coincident, expected, "{name}");
    }
}
