//! Energy: what surfaces receive where radiance is the same from everywhere.

use super::*;

fn received(transfer: &ObjectTransfer, environment: &[Vec3]) -> Vec<Vec3> {
    (0..transfer.vertex_count()).map(|v| transfer.irradiance(v, environment)).collect()
}

#[test]
fn what_is_convex_receives_all_of_the_light() {
    let radiance = Vec3::new(1.0, 2.0, 0.5);
    let sphere = alone(shapes::sphere(1.0, 16, 8, MaterialId(0)), Material::default(), Transform::IDENTITY);
    let mut block = Mesh::default();
    block.add_box(Vec3::splat(-1.0), Vec3::new(1.0, 2.0, 3.0), MaterialId(0));
    let block = alone(block, Material::default(), Transform::IDENTITY);
    let is_whole = |scene: &Scene| {
        let all = received(&simulate(scene, &few(2)), &constant(radiance));
        all.iter().all(|e| e.abs_diff_eq(radiance * PI, 1e-5 * PI))
    };
    assert!(is_whole(&sphere) && is_whole(&block));
    assert!(!is_whole(&torus(Vec3::ONE, Transform::IDENTITY)), "negative control");
    // And each band of the light is that of the clamped cosine.
    let transfer = simulate(&sphere, &few(2));
    let mut cosine = [0.0; 25];
    for (vertex, normal) in sphere.meshes[0].normals.iter().enumerate() {
        sh::clamped_cosine(*normal, 5, &mut cosine);
        let vector = &transfer.coefficients()[vertex * 25..(vertex + 1) * 25];
        assert!(vector.iter().zip(cosine).all(|(t, c)| (t - c).abs() < 1e-5), "{vertex}");
    }
}

#[test]
fn no_energy_is_created() {
    let one = constant(Vec3::ONE);
    let scene = torus(Vec3::ONE, Transform::IDENTITY);
    let mut before = vec![Vec3::ZERO; scene.meshes[0].positions.len()];
    for bounces in [0, 1, 3, 20] {
        let now = received(&simulate(&scene, &few(bounces)), &one);
        assert!(now.iter().all(|e| e.max_element() <= PI * (1.0 + 1e-5)), "{bounces} bounces");
        assert!(now.iter().zip(&before).all(|(now, before)| now.cmpge(before * (1.0 - 1e-5)).all()));
        before = now;
    }
    // White, it is a furnace after many bounces, where its triangles are small (what is between a triangle and the horizon of its bent
    // normals is lost); black, it is not.
    let mean = |all: &[Vec3]| all.iter().map(|e| e.x).sum::<f32>() / all.len() as f32 / PI;
    let finer = alone(
        shapes::torus(0.36, 0.14, 100, 48, MaterialId(0)),
        Material::diffuse("", Vec3::ONE),
        Transform::IDENTITY,
    );
    let finer = received(&simulate(&finer, &few(6)), &one);
    assert!(mean(&finer) > 0.9999, "{}", mean(&finer));
    let black = received(&simulate(&torus(Vec3::ZERO, Transform::IDENTITY), &few(20)), &one);
    assert!(mean(&black) < 0.95, "{}", mean(&black));
}
