//! The database as a whole: order of work, dynamic objects, blockers.

use super::growth::{Growth, grown, lights_on_shell};
use super::*;
use crate::scene::builtin::{self, MovingObject};
use crate::visibility::blockers::BlockerTree;
use crate::visibility::database::{determine, entries_of, of_light};
use crate::visibility::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace};
use crate::visibility::shapes::{Apex, Shape};
use crate::visibility::surfaces::Surfaces;
use crate::visibility::{Blocker, Receivers};

/// The visibility of all nodes with each blocker by itself.
fn each_alone(context: &SceneContext, receivers: &Receivers) -> Vec<NodeVisibility> {
    // Which nodes and lights face each other.
    let nothing = BlockerTree::new(context.surfaces, |_| false);
    let empty = SceneContext { blockers: &nothing, ..*context };
    let (facing, _) = determine(&empty, receivers, |_, shape, at, parent, workspace| {
        empty.visibility_by_groups(shape, at, parent, workspace)
    });
    let each = |node: usize,
                shape: Shape,
                at: NodeContext,
                parent: Option<&NodeVisibility>,
                workspace: &mut Workspace| {
        context.visibility_by_blockers(shape, at.own_mesh, (parent, &facing[node]), workspace)
    };
    determine(context, receivers, each).0
}

/// All states and blockers.
#[cfg(feature = "parallel")]
fn contents(database: &VisibilityDatabase) -> (Vec<State>, Vec<Vec<(Blocker, bool)>>) {
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
        Ok(pool.install(|| {
            VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database")
        }))
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
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database");
        // All of them from the start, on the same hierarchy.
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let apexes: Vec<Apex> = lights.samples().iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.samples().iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let alone = |accept: &dyn Fn(u32) -> bool| {
            let blockers = BlockerTree::new(&surfaces, accept);
            let context =
                SceneContext { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &blockers };
            each_alone(&context, database.receivers())
        };
        let (all, fixed) = (alone(&|_| true), alone(&|object| !scene.objects[object as usize].dynamic));
        let (mut without, mut pairs, mut looser, mut blocked, mut untested, mut spared) = (0, 0, 0, 0, 0, 0);
        for node in 0..database.receivers().nodes.len() as u32 {
            for index in 0..apexes.len() as u32 {
                // Groups of static blockers may leave a pair partial that each of them by itself does not.
                let (found, each) = (database.state(node, index), all[node as usize].states[index as usize]);
                pairs += 1;
                looser += usize::from(found != each && found == State::Partial);
                assert!(
                    found == each || found == State::Partial || each == State::Partial,
                    "{name} {node} {index} {found:?} {each:?}"
                );
                without += usize::from(fixed[node as usize].states[index as usize] != each);
                // Dynamic blockers are stored one by one, unless they cannot change the state.
                let moves = |b: u32| scene.objects[surfaces.blocker_object(b) as usize].dynamic;
                let entries = entries_of(&database.moving, node, index);
                let mut found: Vec<_> = entries.map(|e| (e.blocker(), e.full())).collect();
                let entries = entries_of(&all, node, index);
                let mut expected: Vec<_> =
                    entries.map(|e| (e.blocker(), e.full())).filter(|e| moves(e.0)).collect();
                found.sort_unstable();
                expected.sort_unstable();
                match fixed[node as usize].states[index as usize] {
                    State::Unoccluded => {
                        blocked += expected.len();
                        assert_eq!(found, expected);
                    }
                    State::Partial => {
                        assert!(expected.iter().all(|e| found.contains(e)), "{found:?} {expected:?}");
                        untested += found.len() - expected.len();
                        let is_untested_mesh =
                            |e: &&(u32, bool)| surfaces.mesh_of(e.0).is_some() && !expected.contains(e);
                        assert_eq!(
                            found.len() - expected.len(),
                            found.iter().filter(is_untested_mesh).count()
                        );
                    }
                    State::Full => {
                        assert!(found.is_empty());
                        spared += expected.len();
                    }
                }
            }
        }
        println!("{name}: {looser} of {pairs} pairs are looser in groups");
        assert!(looser * 1000 <= pairs && blocked > 100, "{name}: {looser} of {pairs}, {blocked}");
        assert!(untested > 100 && spared > 100, "{name}: {untested} untested, {spared} spared");
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
    for name in builtin::NAMES {
        let scene = builtin::build(name, MovingObject::None).expect("it is built in");
        let geometry = Geometry::new(&scene);
        let lights = sampled(&scene, &geometry, 40);
        let settings = VisibilitySettings::default();
        let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("a database");
        let surfaces = Surfaces::new(&scene, &geometry, &settings);
        let apexes: Vec<Apex> = lights.samples().iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.samples().iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let blockers = BlockerTree::new(&surfaces, |_| true);
        let context = SceneContext { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &blockers };
        let receivers = database.receivers();
        let nothing = BlockerTree::new(&surfaces, |_| false);
        let empty = SceneContext { blockers: &nothing, ..context };
        let (mut pairs, mut tighter, mut looser, mut split, mut blocked) = (0, 0, 0, 0, 0);
        for (index, leaf) in receivers.leaves.iter().enumerate() {
            let shape = receivers.shape(&surfaces, leaf.node);
            let at =
                NodeContext { own_mesh: receivers.mesh(leaf.node), is_leaf: true, ..NodeContext::default() };
            let mut workspace = Workspace::new();
            let facing = empty.visibility_by_groups(shape, at, None, &mut workspace);
            let alone = context.visibility_by_blockers(shape, at.own_mesh, (None, &facing), &mut workspace);
            split += usize::from(receivers.nodes[leaf.node as usize].parent != NONE);
            for (light, (&found, &brute)) in
                database.leaf_states(index as u32).iter().zip(&alone.states).enumerate()
            {
                pairs += 1;
                // The parent's bounds may be tighter; groups may be looser.
                tighter += usize::from(found != brute && found != State::Partial);
                looser += usize::from(found != brute && found == State::Partial);
                assert!(found == brute || found == State::Partial || brute == State::Partial);
                // One of the blockers that are named does block a part.
                let partial: Vec<Blocker> = of_light(&alone.entries, light as u32)
                    .iter()
                    .map(|e| surfaces.blocker(e.blocker()))
                    .collect();
                blocked += partial.len();
                if found == State::Partial && brute == State::Partial {
                    let mut named = database.blockers(leaf.node, light as u32).flat_map(|(b, _)| match b {
                        Blocker::Group(group) => database.members(group).collect(),
                        one => vec![one],
                    });
                    assert!(named.any(|b| partial.contains(&b)), "{name} leaf {index} {light}");
                }
            }
        }
        println!(
            "{name}: {pairs} pairs, {blocked} blockers; the hierarchy is tighter {tighter} times, looser {looser}"
        );
        assert!(split > 50 && blocked > 1000, "{name}: {split} {blocked}");
        assert!(tighter * 100 < pairs && looser * 1000 < pairs, "{name}: {tighter} {looser} of {pairs}");
        for node in 0..receivers.nodes.len() as u32 {
            let named = (0..apexes.len() as u32).flat_map(|light| database.blockers(node, light));
            groups += named.filter(|(b, full)| matches!(b, Blocker::Group(_)) && !full).count();
        }
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
        let apexes: Vec<Apex> = lights.iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let blockers = BlockerTree::with_clusters(&surfaces, &apexes, |_| true);
        let context = SceneContext { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &blockers };
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
                swapped += usize::from(state != visibility.states[(index + 1) % apexes.len()]);
                // What covers a group is named at each of its members.
                let full = of_light(&visibility.entries, light).iter().any(|e| e.full());
                if receivers.nodes[node as usize].parent == NONE && state == State::Full && full {
                    covered += 1;
                    assert!(database.blockers(node, light).any(|(_, full)| full), "{node} {light}");
                }
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
