//! Cases with a known state.

use super::database::each_alone;
use super::*;
use crate::scene::builtin::shapes;
use crate::visibility::LeafKind;
use crate::visibility::blockers::BlockerTree;
use crate::visibility::node_visibility::SceneContext;
use crate::visibility::surfaces::Surfaces;

/// The state of the whole front of object 0, a square of ±1 at the origin that faces +Y, under a light.
fn of_floor(mut others: Vec<Mesh>, light: LightSample) -> State {
    let mut scene = empty_scene();
    add(&mut scene, square(vec3(0.0, 0.0, 0.0), 1.0, MaterialId(0)));
    // Something far away, so that the scene is as large in every case.
    others.push(square(vec3(0.0, -3.0, 0.0), 4.0, MaterialId(0)));
    for mesh in others {
        add(&mut scene, mesh);
    }
    let mut geometry = Geometry::new(&scene);
    let shift = geometry.origin.as_vec3();
    let mut light = light;
    light.position -= shift;
    geometry.dropped = 0;
    let database = VisibilityDatabase::build(
        &scene,
        &geometry,
        &set(&geometry, vec![light]),
        &VisibilitySettings::flat(),
    )
    .expect("a database");
    let leaf = database.receivers().leaf_at(0, -shift, true).expect("the floor is shaded");
    assert_eq!(
        database.receivers().nodes[database.receivers().leaves[leaf as usize].node as usize].parent,
        NONE
    );
    database.leaf_states(leaf)[0]
}

/// A horizontal square that faces up.
fn square(center: Vec3, half: f32, material: MaterialId) -> Mesh {
    let at = |x: f32, z: f32| center + vec3(x * half, 0.0, z * half);
    polygon(&[at(-1., -1.), at(-1., 1.), at(1., 1.), at(1., -1.)], material)
}

fn above(y: f32) -> LightSample {
    light(vec3(0.0, y, 0.0), Vec3::NEG_Y, Profile::Cosine)
}

#[test]
fn states_of_a_square() {
    use State::{Full, Partial, Unoccluded};
    let at = |y: f32, half: f32, material: MaterialId| vec![square(vec3(0.0, y, 0.0), half, material)];
    assert_eq!(of_floor(vec![], above(2.0)), Unoccluded);
    // Half way to the light the pyramid is ±0.5 wide.
    assert_eq!(of_floor(at(1.0, 0.51, MaterialId(0)), above(2.0)), Full);
    assert_eq!(of_floor(at(1.0, 0.49, MaterialId(0)), above(2.0)), Partial);
    assert_eq!(of_floor(at(1.0, 0.51, MaterialId(2)), above(2.0)), Partial);
    let beside = |x: f32| vec![square(vec3(x, 1.0, 0.0), 0.2, MaterialId(0))];
    assert_eq!(of_floor(beside(0.71), above(2.0)), Unoccluded);
    assert_eq!(of_floor(beside(0.69), above(2.0)), Partial);
    // Behind the light, below the floor, in its plane.
    assert_eq!(of_floor(at(2.1, 9.0, MaterialId(0)), above(2.0)), Unoccluded);
    assert_eq!(of_floor(at(-0.1, 9.0, MaterialId(0)), above(2.0)), Unoccluded);
    assert_eq!(of_floor(vec![square(vec3(2.0, 0.0, 0.0), 1.0, MaterialId(0))], above(2.0)), Unoccluded);
    // The light behind the floor, and the floor behind the light, for every profile that has a plane.
    let spot = Profile::Spot { scale: 2.0, offset: -1.0 };
    for profile in [Profile::Cosine, Profile::Hemisphere, spot] {
        assert_eq!(of_floor(vec![], light(vec3(0.0, -1.0, 0.0), Vec3::Y, profile)), Full);
        assert_eq!(of_floor(vec![], light(vec3(0.0, 2.0, 0.0), Vec3::Y, profile)), Full);
        assert_eq!(of_floor(vec![], light(vec3(0.0, 2.0, 0.0), Vec3::X, profile)), Unoccluded);
    }
    // A large triangle that is no patch serves as one, and covers it or does not.
    let mut triangle =
        polygon(&[vec3(-1.1, 1.0, -1.1), vec3(-1.1, 1.0, 2.2), vec3(2.2, 1.0, -1.1)], MaterialId(0));
    triangle.patches.clear();
    assert_eq!(of_floor(vec![triangle.clone()], above(2.0)), Full);
    triangle.positions.iter_mut().for_each(|p| p.x += 0.7);
    assert_eq!(of_floor(vec![triangle], above(2.0)), Partial);
    // No single polygon covers it, though two do.
    let halves = [-1.0, 1.0].map(|s| square(vec3(s * 0.6, 1.0, 0.0), 0.6, MaterialId(0)));
    assert_eq!(of_floor(halves.to_vec(), above(2.0)), Partial);
}

#[test]
fn parallel_light() {
    use State::{Full, Partial, Unoccluded};
    let sun = |normal: Vec3| light(vec3(0.0, 90.0, 0.0), normal.normalize(), Profile::Directional);
    let board = |x: f32, half: f32| vec![square(vec3(x, 1.0, 0.0), half, MaterialId(0))];
    assert_eq!(of_floor(board(0.0, 1.01), sun(Vec3::NEG_Y)), Full);
    assert_eq!(of_floor(board(0.0, 0.99), sun(Vec3::NEG_Y)), Partial);
    assert_eq!(of_floor(board(2.01, 1.0), sun(Vec3::NEG_Y)), Unoccluded);
    assert_eq!(of_floor(board(1.0, 1.01), sun(vec3(-1.0, -1.0, 0.0))), Full);
    assert_eq!(of_floor(board(0.0, 1.01), sun(vec3(-1.0, -1.0, 0.0))), Partial);
    assert_eq!(of_floor(board(-2.01, 1.0), sun(vec3(-1.0, -1.0, 0.0))), Unoccluded);
    assert_eq!(of_floor(vec![], sun(Vec3::Y)), Full);
}

#[test]
fn meshes_as_blockers_and_receivers() {
    let ball = |x: f32, y: f32, rings: u32| {
        let mut mesh = shapes::sphere(0.3, 2 * rings, rings, MaterialId(0));
        mesh.positions.iter_mut().for_each(|p| *p += vec3(x, y, 0.0));
        mesh
    };
    assert_eq!(of_floor(vec![ball(0.0, 1.0, 12)], above(2.0)), State::Partial);
    assert_eq!(of_floor(vec![ball(0.95, 1.0, 12)], above(2.0)), State::Unoccluded);
    // A ball under a board and one beside it; their undersides face away from the light.
    let mut scene = empty_scene();
    add(&mut scene, square(vec3(0.0, 1.0, 0.0), 0.5, MaterialId(0)));
    let hidden = add(&mut scene, ball(0.0, 0.0, 12));
    let lit = add(&mut scene, ball(3.0, 0.0, 40));
    let geometry = Geometry::new(&scene);
    let database = build(
        &scene,
        &geometry,
        vec![light(vec3(0.0, 2.0, 0.0) - geometry.origin.as_vec3(), Vec3::NEG_Y, Profile::Cosine)],
    );
    let states = |object: usize| -> Vec<State> {
        let leaves = database.receivers().leaves.iter().enumerate();
        leaves
            .filter(|(_, l)| l.kind == LeafKind::Cluster { object: object as u32 })
            .map(|(i, _)| database.leaf_states(i as u32)[0])
            .collect()
    };
    assert!(states(hidden.index()).len() > 3 && states(hidden.index()).iter().all(|&s| s == State::Full));
    // It is convex, so that it does not shade itself.
    let count = |state| states(lit.index()).iter().filter(|&&s| s == state).count();
    assert!(count(State::Unoccluded) > 0 && count(State::Full) > 0, "{:?}", states(lit.index()));
    assert_eq!(count(State::Partial), 0);
    // The board covers one as a whole: not piece by piece.
    let receivers = database.receivers();
    let whole = |object: ObjectId| {
        let of_object = |node: &usize| {
            let is_root = receivers.nodes[*node].parent == NONE;
            is_root && receivers.object(&database.surfaces, *node as u32) == object.0
        };
        (0..receivers.nodes.len()).find(of_object).map(|node| database.state(node as u32, 0))
    };
    assert_eq!([hidden, lit].map(whole), [Some(State::Full), Some(State::Unoccluded)]);
}

#[test]
fn the_walls_of_an_empty_room_block_nothing() {
    for turn in [Quat::IDENTITY, Numbers(3).rotation(), Numbers(4).rotation()] {
        let mut scene = empty_scene();
        let shell = room(vec3(-2.0, 0.0, -3.0), vec3(2.0, 2.5, 3.0));
        let object = scene.add_object("", shell, Transform::rigid(turn, vec3(10.0, 20.0, 30.0)));
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let mut numbers = Numbers(1);
        let mut lights: Vec<LightSample> = (0..200)
            .map(|i| bounce(&tracer, i % geometry.triangles.len() as u32, barycentric(&mut numbers)))
            .collect();
        lights.push(light(Vec3::ZERO, turn * Vec3::NEG_Y, Profile::Hemisphere));
        let counts = build(&scene, &geometry, lights.clone()).counts();
        assert_eq!(counts.by_state[State::Partial as usize], 0, "{counts:?}");
        assert!(counts.by_state[State::Unoccluded as usize] > 900 && counts.leaves == 6);
        // Negative control: with a box in it they still do not, but the box does.
        let mut furniture = Mesh::default();
        furniture.add_box(vec3(-0.5, 0.0, -0.5), vec3(0.5, 0.5, 0.5), MaterialId(0));
        let node = scene.objects[object].node;
        scene.meshes.push(furniture);
        let mesh = scene.meshes.len() - 1;
        scene.objects.push(crate::scene::Object {
            name: String::new(),
            node,
            mesh,
            dynamic: false,
            removed: false,
            skin: None,
        });
        let geometry = Geometry::new(&scene);
        let database = build(&scene, &geometry, lights);
        assert!(database.counts().by_state[State::Partial as usize] > 100);
        assert_eq!(geometry.objects[object.index()].patches.len(), 6);
        let surfaces = Surfaces::new(&scene, &geometry, &VisibilitySettings::default());
        let box_alone = BlockerTree::new(&surfaces, |of| of != object.0);
        let context = SceneContext { surfaces: &surfaces, lights: &database.lights, blockers: &box_alone };
        let (mut pairs, mut blocked) = (0, 0);
        for (node, alone) in (0..).zip(each_alone(&context, database.receivers())) {
            for (light, &state) in alone.states.iter().enumerate() {
                pairs += 1;
                blocked += usize::from(state < database.state(node, light as u32));
            }
        }
        assert!(blocked * 1000 <= pairs, "without the walls {blocked} of {pairs} are less occluded");
    }
}

#[test]
fn odd_input() {
    // Nothing at all, no lights, and lights without anything to see.
    let scene = empty_scene();
    let geometry = Geometry::new(&scene);
    for lights in [vec![], vec![above(1.0)]] {
        let database = build(&scene, &geometry, lights);
        assert_eq!(database.counts().leaves, 0);
        assert_eq!(database.receivers().leaf_at(0, Vec3::ZERO, true), None);
    }
    let mut scene = empty_scene();
    add(&mut scene, square(Vec3::ZERO, 1.0, MaterialId(0)));
    let geometry = Geometry::new(&scene);
    assert_eq!(build(&scene, &geometry, vec![]).counts().leaves, 1);
    // The back of what has none.
    let database = build(&scene, &geometry, vec![above(1.0)]);
    assert_eq!(database.receivers().leaf_at(0, Vec3::ZERO, false), None);
    assert_eq!(database.receivers().leaf_at(0, Vec3::NAN, true), Some(0));
    // Lights in the plane of a receiver, on its edge and corner, at the very point of a cluster's centre.
    let odd = [vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 1.0), vec3(1.0, 1e-6, 0.0), vec3(9.0, 0.0, 0.0)];
    let odd = odd.map(|p| light(p, Vec3::NEG_Y, Profile::Hemisphere)).to_vec();
    let mut scene = empty_scene();
    add(&mut scene, square(Vec3::ZERO, 1.0, MaterialId(1)));
    add(&mut scene, shapes::sphere(0.3, 12, 6, MaterialId(1)));
    let geometry = Geometry::new(&scene);
    let database = build(&scene, &geometry, odd.clone());
    let verdict = verify(&scene, &geometry, &odd, &database, 2000, &mut Numbers(5));
    assert_eq!(verdict.wrong, 0, "{verdict:?}");
    // Tiny and huge.
    for scale in [1e-12, 1e-5, 1e6, 1e12] {
        let mut scene = empty_scene();
        let mut mesh = room(-Vec3::ONE, Vec3::ONE);
        mesh.add_box(vec3(-0.3, -1.0, -0.3), vec3(0.3, 0.0, 0.3), MaterialId(0));
        mesh.positions.iter_mut().for_each(|p| *p *= scale);
        add(&mut scene, mesh);
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let mut numbers = Numbers(6);
        let lights: Vec<_> = (0..24)
            .filter(|_| !geometry.triangles.is_empty())
            .map(|i| bounce(&tracer, i % geometry.triangles.len() as u32, barycentric(&mut numbers)))
            .collect();
        let database = build(&scene, &geometry, lights.clone());
        let verdict = verify(&scene, &geometry, &lights, &database, 500, &mut numbers);
        assert_eq!(verdict.wrong, 0, "{scale} {verdict:?}");
        assert!(verdict.wrong_if_swapped > 100, "{scale} {verdict:?}");
    }
}
