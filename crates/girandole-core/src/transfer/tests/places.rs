//! Where objects are, what they are made of, and which cannot have transfer.

use super::*;
use crate::scene::{ColorSpace, Filter, MaterialId, MeshTriangle, MorphTarget, Texture, TextureRef, Wrap};
use glam::{Affine2, DAffine3, DQuat, DVec3, Quat, Vec2};

fn place(scale: DVec3) -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
    DAffine3::from_scale_rotation_translation(scale, turn, DVec3::new(3.0, -1.0, 70.0))
}

fn at(place: DAffine3) -> Scene {
    torus(Vec3::splat(0.7), Transform::Affine(place))
}

/// Some light of five bands.
fn environment() -> Vec<Vec3> {
    sh::project(5, 2000, |d| Vec3::new(1.0 + d.x, d.y.max(0.0), (d.z * 3.0).powi(2) + d.x * d.y))
}

/// What vertices receive of light that is given in the world.
fn received(transfer: &ObjectTransfer, scene: &Scene, world: &[Vec3]) -> Vec<Vec3> {
    let frame = transfer.frame(scene, ObjectId(0)).expect("a frame");
    let mut here = vec![Vec3::ZERO; world.len()];
    sh::Rotation::new(frame.transfer_from_world_direction, 5).apply(world, &mut here);
    (0..transfer.vertex_count()).map(|v| transfer.irradiance(v, &here)).collect()
}

fn apart(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
}

#[test]
fn turning_scaling_and_mirroring_everything_changes_nothing() {
    let here = at(DAffine3::IDENTITY);
    let transfer = simulate(&here, &few(2));
    let light = environment();
    let expected = received(&transfer, &here, &light);
    for scale in [DVec3::ONE, DVec3::splat(0.01), DVec3::splat(-3.0), DVec3::new(2.0, -2.0, 2.0)] {
        let there = at(place(scale));
        // Simulated there, it is the same to the bit; moved there, it has the same frame.
        assert!(simulate(&there, &few(2)) == transfer, "{scale}");
        let frame = transfer.frame(&there, ObjectId(0)).expect("a frame");
        let world_from_transfer = frame.transfer_from_world_direction.transpose();
        assert!(frame.world_from_transfer.abs_diff_eq(place(scale), 1e-9));
        assert!((frame.transfer_from_world_direction.determinant().abs() - 1.0).abs() < 1e-5);
        let mut turned = vec![Vec3::ZERO; light.len()];
        sh::Rotation::new(world_from_transfer, 5).apply(&light, &mut turned);
        assert!(apart(&received(&transfer, &there, &turned), &expected) < 1e-4);
        // Negative control: only the object turns.
        assert!(apart(&received(&transfer, &there, &light), &expected) > 0.1);
    }
}

#[test]
fn what_is_stretched_is_simulated_as_it_is() {
    let flat = DVec3::new(1.0, 0.3, 1.0);
    let stretched = at(place(flat));
    let transfer = simulate(&stretched, &few(1));
    // The same mesh without the transform.
    let mut baked = at(DAffine3::IDENTITY);
    let mesh = &mut baked.meshes[0];
    mesh.positions.iter_mut().for_each(|p| *p *= flat.as_vec3());
    mesh.normals.iter_mut().for_each(|n| *n = (*n / flat.as_vec3()).normalize());
    let expected = simulate(&baked, &few(1));
    let one = constant(Vec3::ONE);
    let all = |t: &ObjectTransfer| (0..t.vertex_count()).map(|v| t.irradiance(v, &one)).collect::<Vec<_>>();
    let mean = |all: &[Vec3]| all.iter().map(|e| e.x).sum::<f32>() / all.len() as f32;
    assert!(apart(&all(&transfer), &all(&expected)) < 0.1);
    assert!((mean(&all(&transfer)) - mean(&all(&expected))).abs() < 0.01);
    let round = simulate(&at(DAffine3::IDENTITY), &few(1));
    assert!((mean(&all(&round)) - mean(&all(&expected))).abs() > 0.02, "negative control");
    // Moved and scaled it stays so; stretched otherwise, it is another one.
    let mut scaled = place(flat);
    scaled.matrix3 = DMat3::from_rotation_y(0.4) * scaled.matrix3 * 2.5;
    let frame = transfer.frame(&at(scaled), ObjectId(0)).expect("a frame");
    let turn = frame.world_from_transfer.matrix3 * 0.4;
    assert!((turn * turn.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-9));
    for other in
        [DVec3::ONE, DVec3::new(0.3, 1.0, 1.0), DVec3::new(1.0, 0.31, 1.0), DVec3::new(1.0, 0.0, 1.0)]
    {
        let error = transfer.frame(&at(place(other)), ObjectId(0)).expect_err("another shape");
        assert!(error.to_string().contains("stretched"), "{error}");
    }
    let smaller =
        alone(shapes::torus(0.36, 0.14, 12, 12, MaterialId(0)), Material::default(), Transform::IDENTITY);
    let error = transfer.frame(&smaller, ObjectId(0)).expect_err("another mesh");
    assert!(error.to_string().contains("vertices"), "{error}");
    // Its sphere is about its own shape.
    let (low, high) = round.bounds();
    assert!(low.abs_diff_eq(Vec3::new(-0.5, -0.14, -0.5), 1e-6) && high.abs_diff_eq(-low, 1e-6));
    assert!(round.center().length() < 1e-6 && (round.radius() - 0.5).abs() < 0.01);
}

#[test]
fn what_bends_lets_light_through_or_is_not_there_is_refused() {
    let refused = |scene: &Scene, settings: &TransferSettings, fragment: &str| {
        let error = ObjectTransfer::simulate(scene, ObjectId(0), settings, &|_| {}).expect_err(fragment);
        assert!(error.to_string().contains(fragment), "{error}");
    };
    let good = at(DAffine3::IDENTITY);
    let usual = few(0);
    refused(&Scene::default(), &usual, "no object 0");
    let mut removed = good.clone();
    removed.remove_object(ObjectId(0)).expect("removed");
    refused(&removed, &usual, "removed");
    let mut bent = good.clone();
    bent.meshes[0].morph_targets.push(MorphTarget::default());
    refused(&bent, &usual, "bends");
    let mut glass = good.clone();
    glass.materials[0].transmission = 0.5;
    refused(&glass, &usual, "lets light through");
    let mut broken = good.clone();
    broken.meshes[0].triangles.push(MeshTriangle { vertices: [0, 1, 9999], material: MaterialId(0) });
    refused(&broken, &usual, "vertex that does not exist");
    refused(&at(place(DVec3::new(1.0, 0.0, 1.0))), &usual, "flattened");
    let compressed = |clusters, bases| Some(Compression { clusters, bases });
    for settings in [
        TransferSettings { bands: 0, ..usual.clone() },
        TransferSettings { bands: 9, ..usual.clone() },
        TransferSettings { directions: 63, ..usual.clone() },
        TransferSettings { bounces: 65, ..usual.clone() },
        TransferSettings { compression: compressed(0, 4), ..usual.clone() },
        TransferSettings { compression: compressed(1, 193), ..usual.clone() },
    ] {
        refused(&good, &settings, "choose");
    }
    assert!(TransferSettings::default().validate().is_ok());
}

/// Two squares, one metre apart, that look at each other, of so many vertices along each side.
fn plates(side: u32, upper_faces_down: bool) -> Mesh {
    let mut mesh = Mesh::default();
    for (y, up) in [(0.0, true), (1.0, !upper_faces_down)] {
        let first = mesh.positions.len() as u32;
        for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
            let at = Vec2::new(i as f32, j as f32) / (side - 1) as f32 * 2.0;
            mesh.positions.push(Vec3::new(at.x - 1.0, y, at.y - 1.0));
            mesh.normals.push(if up { Vec3::Y } else { Vec3::NEG_Y });
            mesh.uvs.push([at * 0.5; 2]);
            if i + 1 < side && j + 1 < side {
                let [a, b, c, d] = [0, 1, side + 1, side].map(|k| first + i * side + j + k);
                let fan = if up { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                mesh.triangles.extend(fan.map(|vertices| MeshTriangle { vertices, material: MaterialId(0) }));
            }
        }
    }
    mesh
}

#[test]
fn backs_reflect_where_they_are_double_sided() {
    let one = constant(Vec3::ONE);
    let lower = |faces_down, double_sided| {
        let material = Material { double_sided, ..Material::default() };
        let scene = alone(plates(9, faces_down), material, Transform::IDENTITY);
        let transfer = simulate(&scene, &few(2));
        assert_eq!(transfer.sides(), if double_sided { 2 } else { 1 });
        (0..81).map(|v| transfer.irradiance(v, &one).x).sum::<f32>() / 81.0
    };
    let [front, back, double] = [lower(true, false), lower(false, false), lower(false, true)];
    assert!((double / front - 1.0).abs() < 0.01, "{double} for {front}");
    assert!(back < 0.9 * front, "negative control: {back}");
    // Seen from below, the lower one has nothing before it.
    let material = Material { double_sided: true, ..Material::default() };
    let transfer = simulate(&alone(plates(9, true), material, Transform::IDENTITY), &few(2));
    assert!((0..81).all(|v| (transfer.irradiance_of_side(1, v, &one).x / PI - 1.0).abs() < 1e-5));
    assert!(transfer.irradiance(40, &one).x < 0.95 * PI, "negative control");
}

#[test]
fn textures_color_what_is_reflected() {
    let one = constant(Vec3::ONE);
    let texture = |texel: [u8; 3]| Texture {
        name: String::new(),
        width: 1,
        height: 1,
        texels: vec![[texel[0], texel[1], texel[2], 255]],
        color_space: ColorSpace::Linear,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    };
    let lit = |texel: Option<[u8; 3]>, base_color: Vec3| {
        let mut scene = alone(plates(5, true), Material::diffuse("", base_color), Transform::IDENTITY);
        if let Some(texel) = texel {
            scene.textures.push(texture(texel));
            let reference = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };
            scene.materials[0].base_color_texture = Some(reference);
        }
        let transfer = simulate(&scene, &few(2));
        (transfer.channels(), (0..50).map(|v| transfer.irradiance(v, &one)).collect::<Vec<_>>())
    };
    let (channels, textured) = lit(Some([255, 102, 0]), Vec3::ONE);
    let (_, plain) = lit(None, Vec3::new(1.0, 0.4, 0.0));
    assert!(channels == 3 && apart(&textured, &plain) < 1e-5);
    let (channels, grey) = lit(Some([102, 102, 102]), Vec3::ONE);
    assert!(channels == 1 && apart(&grey, &plain) > 0.05, "negative control");
    assert!(grey.iter().zip(&plain).all(|(a, b)| (a.y - b.y).abs() < 1e-5));
}

#[test]
fn feet_of_walls_are_beside_them() {
    // A floor with a long wall as high at its edge, whose plane holds the corners there: half of what is above them is hidden.
    let mut mesh = Mesh::default();
    mesh.add_polygon(&[Vec3::ZERO, Vec3::Z * 4.0, Vec3::new(4.0, 0.0, 4.0), Vec3::X * 4.0], MaterialId(0));
    let (start, end) = (Vec3::Z * -50.0, Vec3::Z * 54.0);
    let wall = [start, start + Vec3::Y * 4.0, end + Vec3::Y * 4.0, end];
    mesh.add_polygon(&wall, MaterialId(0));
    let scene = alone(mesh, Material::default(), Transform::rigid(Quat::IDENTITY, Vec3::ONE));
    let transfer = simulate(&scene, &TransferSettings { directions: 1024, ..few(0) });
    let received = |v| transfer.irradiance(v, &constant(Vec3::ONE)).x / PI;
    let feet = [received(0), received(1)];
    assert!(feet.iter().all(|e| (e - 0.5).abs() < 0.01), "{feet:?}");
    // As far from it as it is high, 0.5 (1 − cos 45°) is.
    assert!((received(2) - 0.854).abs() < 0.01, "{}", received(2));
}

#[test]
fn error_estimates_are_what_errors_are() {
    let scene = torus(Vec3::splat(0.7), Transform::IDENTITY);
    let truth = simulate(&scene, &TransferSettings { directions: 8192, ..few(1) });
    let mut unoccluded = [0.0; 25];
    sh::clamped_cosine(Vec3::Z, 5, &mut unoccluded);
    let whole: f32 = unoccluded.iter().map(|t| t * t).sum();
    for directions in [64, 256, 1024] {
        let transfer = simulate(&scene, &TransferSettings { directions, ..few(1) });
        let pairs = transfer.coefficients().iter().zip(truth.coefficients());
        let square: f32 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
        let found = (square / transfer.vertex_count() as f32 / whole).sqrt();
        let said = transfer.error().vector;
        assert!((0.7..1.4).contains(&(found / said)), "{directions}: {found}, and {said} is said");
        assert!(transfer.error().vector_worst > said);
        assert_eq!(transfer.error().has_enough_rays(), directions == 1024, "{:?}", transfer.error());
    }
}

#[test]
fn directions_are_seen_where_they_are() {
    // A point below a small roof receives less from above than from the side.
    let mut mesh = plates(3, true);
    mesh.positions[9..].iter_mut().for_each(|p| *p = Vec3::new(p.x * 0.6, 0.4, p.z * 0.6));
    let transfer = simulate(&alone(mesh, Material::default(), Transform::IDENTITY), &few(0));
    let from = |direction: Vec3| {
        let mut light = vec![0.0; 25];
        sh::basis(direction.normalize(), 5, &mut light);
        let light: Vec<Vec3> = light.into_iter().map(Vec3::splat).collect();
        transfer.irradiance(4, &light).x / direction.normalize().y
    };
    let around = (0..8).map(|i| Quat::from_rotation_y(i as f32) * Vec3::new(1.0, 0.4, 0.0));
    let around: Vec<f32> = around.map(from).collect();
    assert!(around.iter().all(|&side| from(Vec3::Y) < 0.5 * side), "{} {around:?}", from(Vec3::Y));
}
