//! What is listed twice shines once, and reflects once: by light samples and by the path tracer.

use crate::common::{Stage, look, trace};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Geometry, Material, Mesh};
use girandole_core::trace::SceneTracer;
use girandole_reference::{OracleSettings, PathSettings, oracle};

/// Copies of the panel: whether each faces up instead of down.
type Copies<'a> = &'a [bool];

/// A room with a panel below its ceiling, of one object, or of one for each copy.
fn pictures(copies: Copies, double_sided: bool, apart: bool, emission: f32) -> [Image; 2] {
    let mut stage = Stage::default();
    let walls = stage.material(Material::default());
    let panel = Material { double_sided, ..Material::emitter("", Vec3::splat(emission)) };
    let panel = stage.material(Material { base_color: Vec3::splat(0.5), ..panel });
    stage.room(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), walls);
    let mut meshes = vec![Mesh::default()];
    for (i, &faces_up) in copies.iter().enumerate() {
        if apart && i > 0 {
            meshes.push(Mesh::default());
        }
        let [x, z] = [Vec3::X, Vec3::Z].map(|axis| axis * 0.3);
        let mut corners = [-x - z, x - z, x + z, z - x].map(|p| p + Vec3::Y * 1.5);
        if faces_up {
            // Fanned from the same corner, so that the triangles are the same.
            corners[1..].reverse();
        }
        meshes.last_mut().expect("one").add_polygon(&corners, panel);
    }
    meshes.into_iter().for_each(|mesh| stage.mesh(mesh));
    let geometry = Geometry::new(&stage.scene);
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let view = look(Vec3::new(0.2, 1.0, 0.9), Vec3::new(0.0, 0.9, -0.5), 1.0);
    let settings = LightSettings { count: 64, ..LightSettings::default() };
    let lights = LightSet::sample(&stage.scene, &geometry, &settings).expect("light");
    let samples = oracle(&tracer, &lights, &view, [24, 24], &OracleSettings::default(), &|_| ());
    let paths = PathSettings { paths: 8, bounces: None, seed: 1 };
    [samples, trace(&stage.scene, &geometry, &view, 24, paths).mean]
}

#[test]
fn coincident_panels_count_once() {
    for (once, doubles, double_sided) in [
        (&[false][..], &[&[false, false][..], &[false, false, false]][..], false),
        (&[false], &[&[false, false], &[false, true], &[false, true, true]], true),
        // Single-sided ones back to back are two.
        (&[false, true], &[&[false, true, false, true]], false),
    ] {
        for apart in [false, true] {
            let expected = pictures(once, double_sided, apart, 5.0);
            assert!(expected.iter().all(|picture| picture.mean().min_element() > 0.1));
            for double in doubles {
                let found = pictures(double, double_sided, apart, 5.0);
                assert!(found == expected, "{double:?}, double-sided: {double_sided}, apart: {apart}");
            }
            assert!(pictures(once, double_sided, apart, 5.1) != expected);
        }
    }
    // What back to back means: the light of both, but for what the panel itself reflects of that.
    let sides = [&[false][..], &[true], &[false, true]];
    let [down, up, both] =
        sides.map(|copies| pictures(copies, false, false, 5.0).map(|picture| picture.mean().element_sum()));
    for i in 0..2 {
        let sum = down[i] + up[i];
        assert!((both[i] / sum - 1.0).abs() < 0.1, "{} and {} are not {}", down[i], up[i], both[i]);
        assert!(down[i] < 0.9 * sum && up[i] < 0.9 * sum, "each of them matters");
    }
}
