//! Receivers that views need, against rays from their eyes.

use super::random::{random_lights, random_room};
use super::seen::{add_walls, looking};
use super::*;
use crate::scene::{LocalView, View};
use crate::visibility::{LeafId, LeafKind};
use std::collections::HashMap;

/// A view in the world.
fn view_of(geometry: &Geometry, local: &LocalView) -> View {
    let &LocalView { right, up, forward, half_extent, center, orthographic, depth, clip, .. } = local;
    let eye = geometry.origin + local.eye.as_dvec3();
    View { eye, right, up, forward, half_extent, center, orthographic, depth, clip }
}

fn random_view(geometry: &Geometry, numbers: &mut Numbers) -> View {
    let (low, high) = geometry.bounds;
    let eye = (low + high) * 0.5 + (high - low) * 0.45 * numbers.vector();
    view_of(geometry, &looking(eye, numbers.vector().normalize()))
}

/// By leaf, the states.
fn states(database: &VisibilityDatabase) -> HashMap<LeafId, Vec<State>> {
    let leaves = 0..database.receivers().leaves.len() as u32;
    let determined = leaves.filter(|&leaf| database.receivers().leaves[leaf as usize].node != NONE);
    determined.map(|leaf| (database.leaf_id(leaf), database.leaf_states(leaf).to_vec())).collect()
}

/// What rays from an eye, in any direction and by flat mirrors, hit: how often, and how often that is not determined.
#[derive(Default)]
struct Hits {
    all: usize,
    mirrored: usize,
    /// Of those, more than twice.
    deep: usize,
    undetermined: usize,
}

impl Hits {
    fn count(
        &mut self,
        database: &VisibilityDatabase,
        tracer: &SceneTracer,
        view: &View,
        numbers: &mut Numbers,
    ) {
        let geometry = tracer.geometry();
        for _ in 0..200 {
            let mut origin = view.relative_to(geometry.origin).eye;
            let mut direction = numbers.vector().normalize();
            for mirrors in 0..9 {
                let Some(hit) = tracer.closest_visible(origin, direction) else { break };
                let (at, normal) = (origin + direction * hit.t, geometry.normal(hit.triangle));
                let is_front = normal.dot(direction) < 0.0;
                let normal = if is_front { normal } else { -normal };
                let leaf = database.receivers().leaf_at(hit.triangle, at, is_front);
                let Some(leaf) = leaf else { break };
                self.all += 1;
                self.mirrored += usize::from(mirrors > 0);
                self.deep += usize::from(mirrors > 2);
                self.undetermined +=
                    usize::from(database.receivers().leaves[leaf as usize].kind == LeafKind::Undetermined);
                if !database.is_mirror(leaf) {
                    break;
                }
                origin = tracer.offset_ray_origin(at, normal);
                direction -= normal * (2.0 * normal.dot(direction));
            }
        }
    }
}

#[test]
fn what_a_view_needs_is_determined_and_nothing_is_another_one_for_it() {
    let mut numbers = Numbers(47);
    let [mut needed, mut elsewhere] = [Hits::default(), Hits::default()];
    let (mut leaves, mut left_out, mut beside_double_sided) = (0, 0, 0);
    for room in 0..120 {
        let mut scene = random_room(&mut numbers);
        add_walls(&mut scene, &mut numbers);
        add_walls(&mut scene, &mut numbers);
        if room % 2 == 0 {
            let double_sided = room % 4 == 0;
            let mirror = Material { specular: 1.0, roughness: 0.1, double_sided, ..Material::default() };
            let mirror = scene.add_material(mirror);
            // Two that face each other, more or less.
            let turn = numbers.rotation();
            for turn in [turn, turn * Quat::from_rotation_x(std::f32::consts::PI)] {
                let at = turn * vec3(0.0, 0.0, -0.7) + 0.3 * numbers.vector();
                let corners = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
                add(&mut scene, polygon(&corners.map(|(x, y)| at + turn * vec3(x, y, 0.0)), mirror));
            }
        }
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let lights = set(&geometry, random_lights(&scene, &geometry, &mut numbers, 12));
        let [view, other] = [(); 2].map(|()| random_view(&geometry, &mut numbers));
        let settings = VisibilitySettings::default();
        let build = |views: &[View]| {
            VisibilityDatabase::build_for(&scene, &geometry, &lights, &settings, views).expect("a database")
        };
        let (all, both) = (build(&[]), build(&[view, other]));
        let mut database = build(&[view]);
        needed.count(&database, &tracer, &view, &mut numbers);
        elsewhere.count(&database, &tracer, &other, &mut numbers);
        // What is determined is what it is where all is, and where the other view came later.
        let of_all = states(&all);
        assert!(states(&database).iter().all(|(leaf, states)| of_all[leaf] == *states));
        leaves += all.counts().leaves;
        left_out += all.counts().leaves - database.counts().leaves;
        if room % 4 == 0 {
            beside_double_sided += all.counts().leaves - database.counts().leaves;
        }
        database.determine_for(&geometry, &[other]);
        assert!(states(&database) == states(&both) && !database.lacks(&geometry, &[view, other]));
        needed.count(&database, &tracer, &other, &mut numbers);
        // It follows lights as any other.
        let moved = set(&geometry, random_lights(&scene, &geometry, &mut numbers, 12));
        let changes = changes(&database, &moved);
        assert!(database.follow(&scene, &geometry, (&moved, &changes), |_| false));
        let again = database.redetermined(&scene, &geometry, &moved).expect("it belongs to them");
        assert!(states(&database) == states(&again));
    }
    assert_eq!(needed.undetermined, 0, "of {}", needed.all);
    // The control: enough is left out, and missed where another view looks.
    assert!(8 * left_out > leaves, "{left_out} of {leaves}");
    assert!(beside_double_sided > 100, "{beside_double_sided}");
    assert!(needed.mirrored > 200 && needed.deep > 40, "{} {}", needed.mirrored, needed.deep);
    assert!(elsewhere.undetermined > 100, "{} of {}", elsewhere.undetermined, elsewhere.all);
}
