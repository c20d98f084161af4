//! Conservative tests of bounds.

use super::*;
use crate::scene::builtin::shapes;
use crate::visibility::cones::{ConeBase, ShadowCone, Sphere};
use crate::visibility::shapes::{Apex, Shape};
use crate::visibility::surfaces::Surfaces;
use glam::DVec3;

#[test]
fn cones_contain_the_rays() {
    let mut numbers = Numbers(5);
    let mut scene = empty_scene();
    add(&mut scene, room(vec3(-2.0, 0.0, -3.0), vec3(2.0, 2.5, 3.0)));
    for _ in 0..8 {
        let [a, b] = [numbers.vector(), numbers.vector()];
        let corner = |u: f32, v: f32| vec3(0.0, 1.0, 0.0) + a * u + b * v;
        add(
            &mut scene,
            polygon(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.3, 1.0), corner(0.0, 1.0)], 0),
        );
    }
    let geometry = Geometry::new(&scene);
    let surfaces = Surfaces::new(&scene, &geometry, &VisibilitySettings::default());
    let (mut on_rays, mut beside, mut missed) = (0, 0, 0);
    for patch in &surfaces.patches {
        let shape = Shape::Patch {
            corners: &patch.corners,
            normal: patch.normal,
            offset: patch.offset,
            tilt: patch.tilt,
        };
        let (center, radius) = shape.sphere(&surfaces.tolerance);
        for profile in [Profile::Cosine, Profile::Directional] {
            for _ in 0..20 {
                let apex = Apex::new(&light(numbers.vector() * 3.0, numbers.vector().normalize(), profile));
                let base = ConeBase::new(&shape, &surfaces.tolerance);
                let cone = ShadowCone::new(&apex, &base);
                let touches = |center: DVec3, radius: f64| cone.may_touch(&Sphere { center, radius });
                for corner in &patch.corners {
                    // From the corner itself to the light, or on for as long as one likes.
                    let start = *corner + patch.normal * surfaces.tolerance.ray_offset;
                    for t in [0.0, 0.001, 0.3, 0.9, 1.0] {
                        let point = start + apex.towards(start) * if apex.finite { t } else { t * 50.0 };
                        on_rays += 1;
                        assert!(touches(point, 0.0), "{shape:?} {apex:?} {t}");
                    }
                }
                // It is no wider than a third more, and does not go on behind.
                let along = apex.towards(center).normalize();
                let behind = center - along * radius * 1.3;
                let across = center + along.any_orthonormal_vector() * radius * 1.3;
                for point in [behind, across] {
                    beside += 1;
                    missed += usize::from(!touches(point, 0.0));
                }
                assert!(touches(behind, radius), "spheres have an extent");
            }
        }
    }
    assert!(on_rays > 1000 && missed == beside, "{on_rays} {missed} of {beside}");
}

#[test]
fn convexity_is_found_by_few_visits() {
    let surfaces = |mesh: Mesh| {
        let mut scene = empty_scene();
        add(&mut scene, mesh);
        Surfaces::new(&scene, &Geometry::new(&scene), &VisibilitySettings::default())
    };
    let ball = surfaces(shapes::sphere(1.0, 80, 40, 0));
    assert!(ball.meshes[0].convex);
    assert!(!surfaces(shapes::torus(1.0, 0.4, 40, 20, 0)).meshes[0].convex);
    let tree = &ball.meshes[0].tree;
    let up = glam::DVec3::Y;
    let mut visits = 1000;
    assert_eq!(tree.extends_beyond(up, 1.001, &mut visits), Some(false));
    assert_eq!(tree.extends_beyond(up, 0.9, &mut visits), Some(true));
    assert!(visits > 700 && visits < 1000, "of 2047 clusters: {visits}");
    let mut few = 3;
    assert_eq!(tree.extends_beyond(up, 0.999, &mut few), None);
}
