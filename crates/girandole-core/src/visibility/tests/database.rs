//! The database as a whole: order of work, dynamic objects, blockers.

use super::growth::{Growth, grown, lights_on_shell};
use super::motion::contents;
use super::*;
use crate::scene::builtin::{self, MovingObject};
use crate::visibility::Receivers;
use crate::visibility::blockers::BlockerTree;
use crate::visibility::light_points::LightPoint;
use crate::visibility::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace};
use crate::visibility::pyramid::{Facing, Occlusion, Pyramid, Scratch, Tests};
use crate::visibility::shapes::Shape;
use crate::visibility::surfaces::Surfaces;

/// The visibility of all nodes of a given hierarchy, each computed by `test` from its parent's, and the number of tests.
fn determine(
    context: &SceneContext,
    receivers: &Receivers,
    mut test: impl FnMut(usize, Shape, NodeContext, Option<&NodeVisibility>, &mut Workspace) -> NodeVisibility,
) -> (Vec<NodeVisibility>, Tests) {
    let mut workspace = Workspace::new();
    let mut nodes: Vec<NodeVisibility> = Vec::new();
    for index in 0..receivers.nodes.len() {
        let node = &receivers.nodes[index];
        let shape = receivers.shape(context.surfaces, index as u32);
        let own_mesh = receivers.mesh(index as u32);
        let at = NodeContext { own_mesh, is_leaf: node.leaf != NONE, ..NodeContext::default() };
        let visibility = test(index, shape, at, nodes.get(node.parent as usize), &mut workspace);
        nodes.push(visibility);
    }
    (nodes, workspace.scratch.tests)
}

/// A node's state for each light, and its blockers by light, full or partial.
#[derive(Clone)]
pub struct Alone {
    pub states: Vec<State>,
    blockers: Vec<Vec<(u32, bool)>>,
}

/// Tests a node against each of all blockers, or each that its parent found partial. `facing` are the states without any.
fn test_each(
    context: &SceneContext,
    node: (Shape, Option<u32>),
    parent: Option<&Alone>,
    facing: &[State],
) -> Alone {
    let (shape, own_mesh) = node;
    let surfaces = context.surfaces;
    let tolerance = shape.tolerance(&surfaces.tolerance);
    let (mut pyramid, mut scratch) = (Pyramid::new(), Scratch::default());
    let mut result = Alone { states: facing.to_vec(), blockers: vec![Vec::new(); facing.len()] };
    for (light, state) in result.states.iter_mut().enumerate() {
        if *state == State::Full
            || pyramid.set(&context.lights[light].apex, shape, &tolerance) == Facing::None
        {
            *state = State::Full;
            continue;
        }
        let open = match parent {
            None => context.blockers.items.clone(),
            Some(parent) => parent.blockers[light].iter().filter(|b| !b.1).map(|b| b.0).collect(),
        };
        for blocker in open {
            let occlusion = surfaces.test(blocker, &mut pyramid, own_mesh, &mut scratch);
            if occlusion != Occlusion::None {
                let full = occlusion == Occlusion::Full && context.lights[light].own != blocker;
                *state = (*state).max(if full { State::Full } else { State::Partial });
                result.blockers[light].push((blocker, full));
            }
        }
        if parent.is_some_and(|p| p.states[light] == State::Full) {
            *state = State::Full;
        }
    }
    result
}

/// The visibility of all nodes with each blocker by itself.
pub fn each_alone(context: &SceneContext, receivers: &Receivers) -> Vec<Alone> {
    // Which nodes and lights face each other.
    let nothing = BlockerTree::empty();
    let empty = SceneContext { blockers: &nothing, ..*context };
    let (facing, _) = determine(&empty, receivers, |_, shape, at, parent, workspace| {
        empty.visibility_by_groups(shape, at, parent, workspace)
    });
    let mut nodes: Vec<Alone> = Vec::new();
    for (index, facing) in facing.iter().enumerate() {
        let node = (receivers.shape(context.surfaces, index as u32), receivers.mesh(index as u32));
        let parent = nodes.get(receivers.nodes[index].parent as usize);
        nodes.push(test_each(context, node, parent, &facing.states));
    }
    nodes
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
        Ok(pool.install(|| {
            VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database")
        }))
    };
    let (one, five) = (with(1)?, with(5)?);
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
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database");
        // All of them from the start, on the same hierarchy.
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let alone = |accept: &dyn Fn(u32) -> bool| {
            let blockers = BlockerTree::new(&surfaces, accept);
            let points = LightPoint::of(lights.samples(), &surfaces, &blockers);
            let context = SceneContext { surfaces: &surfaces, lights: &points, blockers: &blockers };
            each_alone(&context, database.receivers())
        };
        let (all, fixed) = (alone(&|_| true), alone(&|object| !scene.objects[object as usize].dynamic));
        let (mut without, mut pairs, mut looser, mut blocked, mut covered, mut idle) = (0, 0, 0, 0, 0, 0);
        let moves = |b: &u32| scene.objects[surfaces.blocker_object(*b) as usize].dynamic;
        for node in 0..database.receivers().nodes.len() as u32 {
            for light in 0..lights.len() as u32 {
                // Groups may leave a pair partial that each of their members by itself does not.
                let each = &all[node as usize];
                let (found, of_each) = (database.state(node, light), each.states[light as usize]);
                let static_state = fixed[node as usize].states[light as usize];
                pairs += 1;
                looser += usize::from(found != of_each && found == State::Partial);
                assert!(
                    found == of_each || found == State::Partial || of_each == State::Partial,
                    "{name} {node} {light} {found:?} {of_each:?}"
                );
                without += usize::from(static_state != of_each);
                // Where dynamic blockers decide, one of them does block.
                let mut movers = each.blockers[light as usize].iter().filter(|(b, _)| moves(b));
                if static_state == State::Unoccluded && found == State::Partial {
                    blocked += 1;
                    assert!(movers.next().is_some(), "{node} {light}");
                } else if static_state != State::Full && found == State::Full {
                    let parent = database.receivers().nodes[node as usize].parent;
                    let above = parent != NONE && database.state(parent, light) == State::Full;
                    covered += usize::from(!above);
                    assert!(above || movers.any(|(_, is_full)| *is_full), "{node} {light}");
                } else {
                    idle += movers.count();
                }
            }
        }
        println!("{name}: {looser} of {pairs} pairs are looser in groups");
        assert!(looser * 1000 <= pairs && blocked > 100, "{name}: {looser} of {pairs}, {blocked}");
        assert!(covered > 10 && idle > 100, "{name}: {covered} covered, {idle} that decide nothing");
        assert!(without > 100, "{name}: they change states: {without}");
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
        let other = VisibilityDatabase::build(&moved, &geometry, &lights, &settings).expect("a database");
        let dynamic_patch = |r: &Receivers, i: usize| scene.objects[r.grids[i].object as usize].dynamic;
        let sizes = |r: &Receivers| -> Vec<[u32; 2]> {
            (0..r.grids.len())
                .filter(|&i| !dynamic_patch(r, i))
                .map(|i| [r.grids[i].columns, r.grids[i].rows])
                .collect()
        };
        assert_eq!(sizes(&receivers), sizes(other.receivers()));
        assert!(sizes(&receivers).len() > 5 && sizes(&receivers).iter().any(|s| *s != [1, 1]));
    }
}

#[test]
fn the_hierarchy_finds_what_all_blockers_against_each_leaf_do() {
    let mut groups = 0;
    for name in builtin::EXPERIMENTS {
        let scene = builtin::build(name, MovingObject::None).expect("it is built in");
        let geometry = Geometry::new(&scene);
        let lights = sampled(&scene, &geometry, 40);
        let settings = VisibilitySettings::default();
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database");
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let blockers = BlockerTree::new(&surfaces, |_| true);
        let points = LightPoint::of(lights.samples(), &surfaces, &blockers);
        let context = SceneContext { surfaces: &surfaces, lights: &points, blockers: &blockers };
        let receivers = database.receivers();
        let nothing = BlockerTree::empty();
        let empty = SceneContext { blockers: &nothing, ..context };
        let (mut pairs, mut tighter, mut looser, mut split, mut blocked) = (0, 0, 0, 0, 0);
        for (index, leaf) in receivers.leaves.iter().enumerate() {
            let shape = receivers.shape(&surfaces, leaf.node);
            let at =
                NodeContext { own_mesh: receivers.mesh(leaf.node), is_leaf: true, ..NodeContext::default() };
            let mut workspace = Workspace::new();
            let facing = empty.visibility_by_groups(shape, at, None, &mut workspace);
            let alone = test_each(&context, (shape, at.own_mesh), None, &facing.states);
            split += usize::from(receivers.nodes[leaf.node as usize].parent != NONE);
            blocked += alone.blockers.iter().map(Vec::len).sum::<usize>();
            for (&found, &brute) in database.leaf_states(index as u32).iter().zip(&alone.states) {
                pairs += 1;
                // The parent's bounds may be tighter; groups may be looser.
                tighter += usize::from(found != brute && found != State::Partial);
                looser += usize::from(found != brute && found == State::Partial);
                assert!(found == brute || found == State::Partial || brute == State::Partial);
            }
        }
        println!(
            "{name}: {pairs} pairs, {blocked} blockers; the hierarchy is tighter {tighter} times, looser {looser}"
        );
        assert!(split > 50 && blocked > 1000, "{name}: {split} {blocked}");
        assert!(tighter * 100 < pairs && looser * 1000 < pairs, "{name}: {tighter} {looser} of {pairs}");
        let (nodes, _) = determine(&context, receivers, |_, shape, at, parent, workspace| {
            context.visibility_by_groups(shape, at, parent, workspace)
        });
        let entries = nodes.iter().flat_map(|node| &node.entries).filter(|entry| !entry.is_partly_facing());
        groups += entries.filter(|entry| blockers.nodes[entry.blocker() as usize].count == 0).count();
    }
    assert!(groups > 100, "groups stand for their members: {groups}");
}

#[test]
fn groups_of_receivers_find_what_each_of_them_does() {
    for growth in [Growth::Boxes, Growth::Hall] {
        let scene = grown(growth, 10);
        let geometry = Geometry::new(&scene);
        let lights = lights_on_shell(&scene, &geometry);
        let settings = VisibilitySettings::flat();
        let database =
            VisibilityDatabase::build(&scene, &geometry, &set(&geometry, lights.clone()), &settings)
                .expect("a database");
        let receivers = database.receivers();
        // Each patch from all blockers.
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let blockers = BlockerTree::with_clusters(&surfaces, |_| true);
        let points = LightPoint::of(&lights, &surfaces, &blockers);
        let context = SceneContext { surfaces: &surfaces, lights: &points, blockers: &blockers };
        let (nodes, tests) = determine(&context, receivers, |_, shape, at, parent, workspace| {
            context.visibility_by_groups(shape, at, parent, workspace)
        });
        let (mut pairs, mut other, mut swapped, mut covered) = (0, 0, 0, 0);
        for (node, visibility) in nodes.iter().enumerate() {
            for (index, &alone) in visibility.states.iter().enumerate() {
                let (node, light) = (node as u32, index as u32);
                let state = database.state(node, light);
                pairs += 1;
                assert!(state == alone || state == State::Partial || alone == State::Partial);
                other += usize::from(state != alone);
                swapped += usize::from(state != visibility.states[(index + 1) % points.len()]);
                // What covers a group covers each of its members.
                let is_full = visibility.entries.iter().any(|e| e.light == light && e.full());
                covered += usize::from(state == State::Full && is_full);
            }
        }
        let spared = 1.0 - database.counts().tests.total() as f64 / tests.total() as f64;
        println!(
            "{growth:?}: {other} of {pairs} pairs differ, {covered} covered, {spared:.2} of tests spared"
        );
        assert!(other * 1000 < pairs && covered > 100, "{other} of {pairs}, {covered}");
        assert!(swapped * 10 > pairs, "with other lights they differ: {swapped} of {pairs}");
        assert!(spared > 0.2, "{spared}");
    }
}

#[test]
fn many_lights_on_all_cores_are_what_they_are_one_after_the_other() {
    let scene = builtin::build("table", MovingObject::None).expect("it is built in");
    let geometry = Geometry::new(&scene);
    let lights = sampled(&scene, &geometry, 700);
    let settings = VisibilitySettings::default();
    let few = sampled(&scene, &geometry, 100);
    let database = VisibilityDatabase::build(&scene, &geometry, &few, &settings).expect("a database");
    let surfaces = Surfaces::new(&scene, &geometry, &settings);
    let blockers = BlockerTree::new(&surfaces, |_| true);
    let points = LightPoint::of(lights.samples(), &surfaces, &blockers);
    let context = SceneContext { surfaces: &surfaces, lights: &points, blockers: &blockers };
    let all = 0..points.len();
    let (one_after_the_other, tests) =
        determine(&context, database.receivers(), |_, shape, at, parent, workspace| {
            context.visibility_of_lights(all.clone(), (shape, at), parent, workspace)
        });
    let (on_all_cores, tests_on_all) =
        determine(&context, database.receivers(), |_, shape, at, parent, workspace| {
            context.visibility_by_groups(shape, at, parent, workspace)
        });
    assert_eq!(tests_on_all, tests);
    let entries = |node: &NodeVisibility| -> Vec<(u32, u32, bool)> {
        node.entries.iter().map(|e| (e.light, e.blocker(), e.full())).collect()
    };
    let mut differ = [0; 3];
    for (all, each) in on_all_cores.iter().zip(&one_after_the_other) {
        assert!(all.states == each.states && entries(all) == entries(each));
        each.states.iter().for_each(|state| differ[*state as usize] += 1);
    }
    assert!(differ.into_iter().all(|pairs| pairs > 10_000), "{differ:?}");
}
