//! Conservative tests of bounds.

use super::*;
use crate::scene::builtin::shapes;
use crate::visibility::boxes::SweptBox;
use crate::visibility::cones::{ConeBase, ShadowCone, Sphere};
use crate::visibility::primitives::Tolerance;
use crate::visibility::pyramid::Containment;
use crate::visibility::shapes::{Apex, PatchPlane, Shape};
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
            polygon(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(1.3, 1.0), corner(0.0, 1.0)], MaterialId(0)),
        );
    }
    let geometry = Geometry::new(&scene);
    let surfaces = Surfaces::new(&scene, &geometry, &VisibilitySettings::default());
    let (mut on_rays, mut beside, mut missed) = (0, 0, 0);
    for patch in &surfaces.patches {
        let shape = Shape::Patch { corners: &patch.corners, plane: patch.plane };
        let (center, radius) = shape.sphere(&surfaces.tolerance);
        for profile in [Profile::Cosine, Profile::Directional] {
            for _ in 0..20 {
                let apex = Apex::new(&light(numbers.vector() * 3.0, numbers.vector().normalize(), profile));
                let base = ConeBase::new(&shape, &surfaces.tolerance);
                let cone = ShadowCone::new(&apex, &base);
                let touches = |center: DVec3, radius: f64| cone.may_touch(&Sphere { center, radius });
                for corner in &patch.corners {
                    // From the corner itself to the light, or on for as long as one likes.
                    let start = *corner + patch.plane.normal * surfaces.tolerance.ray_offset;
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

/// A light somewhere above the middle of a random polygon, both within a few metres.
fn random_pair(numbers: &mut Numbers) -> (Vec<DVec3>, DVec3, Apex) {
    let [a, b] = [numbers.vector(), numbers.vector()].map(Vec3::as_dvec3);
    let normal = a.cross(b).normalize();
    let corners = vec![-a - b, a - b, (a + b) * 1.2, b - a * 0.5];
    let profile = if numbers.unit() < 0.2 { Profile::Directional } else { Profile::Cosine };
    let way = normal * 2.0 + numbers.vector().as_dvec3();
    let at = way * (f64::from(numbers.unit()) * 3.0 + 0.3);
    (corners, normal, Apex::new(&light(at.as_vec3(), -way.normalize().as_vec3(), profile)))
}

#[test]
fn what_is_inside_a_cone_is_on_rays_of_the_receiver() {
    let mut numbers = Numbers(9);
    let tolerance = Tolerance { ray_offset: 1e-4, coordinate: 1e-5, seam: 2e-6, side: 2e-4, less: 0.0 };
    let mut found = [0; 3];
    for _ in 0..20_000 {
        let (corners, normal, apex) = random_pair(&mut numbers);
        let plane = PatchPlane { normal, offset: 0.0, tilt: 0.0 };
        let shape = Shape::Patch { corners: &corners, plane };
        let base = ConeBase::new(&shape, &tolerance);
        let cone = ShadowCone::new(&apex, &base);
        let center = numbers.vector().as_dvec3() + normal * f64::from(numbers.unit());
        let sphere = Sphere { center, radius: f64::from(numbers.unit()) * 0.2 };
        let containment = cone.classify(&sphere);
        found[containment as usize] += 1;
        for _ in 0..8 {
            let point = center + numbers.vector().normalize().as_dvec3() * sphere.radius;
            // Where the ray from the light through the point meets the receiver's plane.
            let way = -apex.towards(point);
            let at = point - way * (normal.dot(point) / normal.dot(way));
            let is_before = normal.dot(point) >= 0.0 && normal.dot(way) < 0.0;
            let inner =
                (0..4).all(|i| normal.cross(corners[(i + 1) % 4] - corners[i]).dot(at - corners[i]) >= 0.0);
            let is_on_ray =
                is_before && inner && (!apex.finite || apex.normal.dot(-apex.towards(point)) >= 0.0);
            match containment {
                Containment::Inside => assert!(is_on_ray, "{apex:?} {sphere:?} {point}"),
                Containment::Outside => assert!(!is_on_ray, "{apex:?} {sphere:?} {point}"),
                Containment::Crossing => {}
            }
        }
    }
    assert!(found.iter().all(|n| *n > 500), "{found:?}");
}

#[test]
fn cones_and_swept_boxes_shrink_to_the_light() {
    let mut numbers = Numbers(11);
    let tolerance = Tolerance { ray_offset: 1e-4, coordinate: 1e-5, seam: 2e-6, side: 2e-4, less: 0.0 };
    let (mut beside, mut finite) = (0, 0);
    for _ in 0..2000 {
        let (corners, normal, apex) = random_pair(&mut numbers);
        let plane = PatchPlane { normal, offset: 0.0, tilt: 0.0 };
        let shape = Shape::Patch { corners: &corners, plane };
        let (low, high) = corners
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), c| (low.min(*c), high.max(*c)));
        let swept = SweptBox::new(&apex, [low, high], tolerance.side);
        for corner in &corners {
            for t in [0.0, 0.3, 0.99, 1.0] {
                let point = *corner + apex.towards(*corner) * t;
                assert!(swept.may_intersect(point, point), "{apex:?} {corner} {t}");
                let room = numbers.vector().abs().as_dvec3();
                assert!(swept.may_intersect(point - room, point + room * 2.0));
            }
        }
        let base = ConeBase::new(&shape, &tolerance);
        let (center, radius) = shape.sphere(&tolerance);
        let towards = apex.towards(center);
        if apex.finite && towards.length() > 2.0 * radius {
            // Half way to the light, where half as much is in it.
            let across = towards.normalize().any_orthonormal_vector() * radius;
            let point = center + towards * 0.5 + across * 0.75;
            finite += 1;
            beside +=
                usize::from(!ShadowCone::new(&apex, &base).may_touch(&Sphere { center: point, radius: 0.0 }));
            // Behind the receiver.
            let behind = center - towards.normalize() * (high - low).length();
            assert!(!swept.may_intersect(behind, behind));
        }
    }
    assert!(finite > 300 && beside == finite, "{beside} of {finite}");
}

#[test]
fn convexity_is_found_by_few_visits() {
    let surfaces = |mesh: Mesh| {
        let mut scene = empty_scene();
        add(&mut scene, mesh);
        Surfaces::new(&scene, &Geometry::new(&scene), &VisibilitySettings::default())
    };
    let ball = surfaces(shapes::sphere(1.0, 80, 40, MaterialId(0)));
    assert!(ball.meshes[0].convex);
    assert!(!surfaces(shapes::torus(1.0, 0.4, 40, 20, MaterialId(0))).meshes[0].convex);
    let tree = &ball.meshes[0].tree;
    let up = glam::DVec3::Y;
    let mut visits = 1000;
    assert_eq!(tree.extends_beyond(up, 1.001, &mut visits), Some(false));
    assert_eq!(tree.extends_beyond(up, 0.9, &mut visits), Some(true));
    assert!(visits > 700 && visits < 1000, "of 2047 clusters: {visits}");
    let mut few = 3;
    assert_eq!(tree.extends_beyond(up, 0.999, &mut few), None);
}
