//! The database as a whole: order of work, dynamic objects, blockers, growth.

use super::*;
use crate::lights::LightSettings;
use crate::scene::builtin::{self, MovingObject, shapes};
use crate::visibility::blockers::BlockerTree;
use crate::visibility::database::determine;
use crate::visibility::hierarchy::{Context, Memory};
use crate::visibility::pyramid::Apex;
use crate::visibility::surfaces::Surfaces;

fn sampled(scene: &Scene, geometry: &Geometry, count: u32) -> LightSet {
    let settings = LightSettings { count, ..LightSettings::default() };
    LightSet::sample(scene, geometry, &settings).expect("there is light")
}

/// All states and blockers.
fn contents(database: &VisibilityDatabase) -> (Vec<State>, Vec<Vec<(super::super::Blocker, bool)>>) {
    let nodes = 0..database.receivers().nodes.len() as u32;
    let pairs: Vec<(u32, u32)> =
        nodes.flat_map(|n| (0..database.lights() as u32).map(move |l| (n, l))).collect();
    let states = pairs.iter().map(|&(n, l)| database.state(n, l)).collect();
    (states, pairs.iter().map(|&(n, l)| database.blockers(n, l).collect()).collect())
}

#[cfg(feature = "parallel")]
#[test]
fn the_number_of_threads_does_not_matter() -> std::result::Result<(), rayon::ThreadPoolBuildError> {
    let scene = builtin::build("table", MovingObject::Torus).expect("it is built in");
    let geometry = Geometry::new(&scene);
    let lights = sampled(&scene, &geometry, 60);
    let settings = VisibilitySettings::default();
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build()?;
        Ok(pool.install(|| VisibilityDatabase::build(&scene, &geometry, &lights, &settings)))
    };
    let (one, five) = (with(1)?, with(5)?);
    assert_eq!(one.receivers(), five.receivers());
    assert_eq!(one.counts(), five.counts());
    assert!(contents(&one) == contents(&five));
    Ok(())
}

#[test]
fn dynamic_objects_are_blockers_like_others() {
    for name in ["table", "pillars"] {
        let mut scene = builtin::build(name, MovingObject::Torus).expect("it is built in");
        // Some patches move too.
        let last = scene.objects.len() - 2;
        scene.objects[last].dynamic = true;
        let geometry = Geometry::new(&scene);
        let lights = sampled(&scene, &geometry, 80);
        let settings = VisibilitySettings::default();
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings);
        // All of them from the start, on the same hierarchy.
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let apexes: Vec<Apex> = lights.samples.iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.samples.iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let rows = |accept: &dyn Fn(u32) -> bool| {
            let blockers = BlockerTree::new(&surfaces, accept);
            let context = Context {
                surfaces: &surfaces,
                lights: &apexes,
                own: &own,
                blockers: &blockers,
                grouped: false,
            };
            determine(&context, database.receivers()).0
        };
        let (all, fixed) = (rows(&|_| true), rows(&|object| !scene.objects[object as usize].dynamic));
        let mut without = 0;
        for node in 0..database.receivers().nodes.len() as u32 {
            for index in 0..apexes.len() as u32 {
                let state = all[node as usize].states[index as usize];
                assert_eq!(database.state(node, index), state, "{name} {node} {index}");
                without += usize::from(fixed[node as usize].states[index as usize] != state);
                let mut found: Vec<_> = database.blockers(node, index).collect();
                let mut expected: Vec<_> =
                    super::super::database::of_light(&all[node as usize].entries, index)
                        .iter()
                        .map(|e| (surfaces.blocker(e.blocker()), e.full()))
                        .collect();
                let key = |(blocker, full): &(super::super::Blocker, bool)| (format!("{blocker:?}"), *full);
                found.sort_by_key(key);
                expected.sort_by_key(key);
                assert_eq!(found, expected);
            }
        }
        assert!(without > 100, "{name}: they matter: {without}");
        // The hierarchy is that of the scene without them, as far as receivers go.
        let receivers = database.receivers().clone();
        let mut moved = scene.clone();
        for index in 0..moved.objects.len() {
            if moved.objects[index].dynamic {
                let node = moved.objects[index].node;
                let local = moved.nodes[node].local.affine();
                let shifted = glam::DAffine3::from_translation(glam::DVec3::new(0.05, 0.1, 0.02)) * local;
                moved.nodes[node].local = Transform::Affine(shifted);
            }
        }
        let geometry = Geometry::new(&moved);
        let other = VisibilityDatabase::build(&moved, &geometry, &lights, &settings);
        let cells = |r: &super::super::Receivers| r.cells.clone();
        let dynamic_patch =
            |r: &super::super::Receivers, i: usize| scene.objects[r.grids[i].object as usize].dynamic;
        let sizes = |r: &super::super::Receivers| -> Vec<[u32; 2]> {
            (0..r.grids.len())
                .filter(|&i| !dynamic_patch(r, i))
                .map(|i| [r.grids[i].columns, r.grids[i].rows])
                .collect()
        };
        assert_eq!(sizes(&receivers), sizes(other.receivers()));
        assert!(!cells(&receivers).is_empty());
    }
}

#[test]
fn the_hierarchy_finds_what_all_blockers_against_each_leaf_do() {
    for name in builtin::NAMES {
        let scene = builtin::build(name, MovingObject::None).expect("it is built in");
        let geometry = Geometry::new(&scene);
        let lights = sampled(&scene, &geometry, 40);
        let settings = VisibilitySettings::default();
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings);
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let apexes: Vec<Apex> = lights.samples.iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.samples.iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let blockers = BlockerTree::new(&surfaces, |_| true);
        let context =
            Context { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &blockers, grouped: false };
        let receivers = database.receivers();
        let (mut pairs, mut tighter, mut split, mut blocked) = (0, 0, 0, 0);
        for (index, leaf) in receivers.leaves.iter().enumerate() {
            let shape = receivers.shape(&surfaces, leaf.node);
            let row = context.row(shape, receivers.mesh(leaf.node), None, &mut Memory::new());
            split += usize::from(receivers.nodes[leaf.node as usize].parent != NONE);
            // What was decided at the leaf and at its ancestors.
            let mut decided = Vec::new();
            let mut up = leaf.node;
            while up != NONE {
                let entries = &database.fixed[up as usize].entries;
                let is_leaf = up == leaf.node;
                decided
                    .extend(entries.iter().filter(|e| is_leaf || e.full()).map(|e| (e.light, e.blocker())));
                up = receivers.nodes[up as usize].parent;
            }
            decided.sort_unstable();
            for entry in &row.entries {
                blocked += 1;
                let found = decided.binary_search(&(entry.light, entry.blocker())).is_ok();
                // Unless an ancestor faces away as a whole, which a single leaf's wider bounds may not show.
                let state = database.state(leaf.node, entry.light);
                assert!(found || !entry.full() || state == State::Full);
                tighter += usize::from(!found && state != State::Full);
            }
            for (found, brute) in database.leaf_states(index as u32).iter().zip(&row.states) {
                pairs += 1;
                if found != brute {
                    assert_eq!(*brute, State::Partial, "{name} leaf {index}: {found:?}");
                    tighter += 1;
                }
            }
        }
        println!("{name}: {pairs} pairs, {blocked} blockers, {tighter} times the hierarchy knows more");
        assert!(split > 50 && blocked > 1000, "{name}: {split} {blocked}");
        assert!(tighter * 100 < pairs + blocked, "{name}: {tighter} of {pairs} and {blocked}");
    }
}

/// What grows fourfold when `count` doubles.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Growth {
    /// The number of boxes in a room.
    Boxes,
    /// The triangles of a mesh.
    Mesh,
    /// A room's area with the number of boxes in it.
    Hall,
}

/// Tests a pair of node and light.
fn tests_of(growth: Growth, count: u32) -> f64 {
    let mut scene = empty_scene();
    let half = if growth == Growth::Hall { count as f32 } else { 4.0 };
    add(&mut scene, room(vec3(-half, 0.0, -half), vec3(half, 3.0, half)));
    if growth == Growth::Mesh {
        let mut torus = shapes::torus(1.0, 0.4, 10 * count, 5 * count, 0);
        torus.positions.iter_mut().for_each(|p| p.y += 1.4);
        add(&mut scene, torus);
    } else {
        for i in 0..count * count {
            let step = half * 1.5 / count as f32;
            let at = vec3((i % count) as f32, 0.0, (i / count) as f32) * step - vec3(half, 0.0, half) * 0.75;
            let mut furniture = Mesh::default();
            let size = step * 0.5;
            furniture.add_box(at, at + vec3(size, size, size), 0);
            add(&mut scene, furniture);
        }
    }
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let mut numbers = Numbers(9);
    // Lights on the shell only.
    let lights: Vec<_> = (0..60).map(|i| bounce(&tracer, i % 12, barycentric(&mut numbers))).collect();
    let counts = build(&scene, &geometry, lights.clone()).counts();
    println!("{growth:?} {count}: {counts:?}");
    counts.tests as f64 / (counts.nodes * lights.len()) as f64
}

#[test]
fn tests_a_pair_fall_when_the_scene_grows() {
    for growth in [Growth::Boxes, Growth::Mesh, Growth::Hall] {
        let found = [4, 8, 16].map(|count| tests_of(growth, count));
        println!("{growth:?}: {found:.2?} tests a pair with 1, 4 and 16 times the geometry");
    }
}
