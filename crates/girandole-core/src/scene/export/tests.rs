use crate::scene::builtin::{self, MovingObject, shapes};
use crate::scene::*;
use glam::{Affine2, DAffine3, DMat3, DQuat, DVec3, Mat2, Quat, Vec2, Vec3};

/// What the import makes of a scene that was written, and what was left out.
fn again(scene: &Scene) -> (Scene, Vec<String>) {
    let Exported { bytes, left_out } = scene.export_glb().expect("it can be written");
    (load_gltf_slice(&bytes, None).expect("it can be read"), left_out)
}

/// The triangles of a scene in the world, each with its material, in an order that depends on these alone.
fn triangles(scene: &Scene) -> Vec<(u32, [[u32; 3]; 3])> {
    let geometry = Geometry::new(scene);
    let corner = |&v: &u32| (geometry.positions[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let triangle = |triangle: &Triangle| {
        let mut corners: Vec<[u32; 3]> = triangle.vertices.iter().map(corner).collect();
        let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or_default();
        corners.rotate_left(least);
        (triangle.material.0, [corners[0], corners[1], corners[2]])
    };
    let mut all: Vec<_> = geometry.triangles.iter().map(triangle).collect();
    all.sort_unstable();
    all
}

/// A texture as far as it is seen.
type Used = (Vec<[u8; 4]>, [Wrap; 2], Filter);

/// Materials with the texels that they use in place of indices.
fn materials(scene: &Scene) -> Vec<(Material, Vec<Used>)> {
    let plain = |material: &Material| {
        let used = material.textures().map(|used| {
            let Texture { texels, wrap, filter, .. } = &scene.textures[used.texture as usize];
            (texels.clone(), *wrap, *filter)
        });
        let used = used.collect();
        let mut plain = material.clone();
        let Material {
            base_color_texture,
            metallic_roughness_texture,
            specular_texture,
            specular_color_texture,
            emission_texture,
            transmission_texture,
            normal_texture,
            ..
        } = &mut plain;
        let uses = [
            base_color_texture,
            metallic_roughness_texture,
            specular_texture,
            specular_color_texture,
            emission_texture,
            transmission_texture,
        ];
        uses.into_iter()
            .flatten()
            .chain(normal_texture.iter_mut().map(|n| &mut n.texture))
            .for_each(|t| t.texture = 0);
        (plain, used)
    };
    scene.materials.iter().map(plain).collect()
}

fn assert_same(scene: &Scene, read: &Scene) {
    assert!(triangles(read) == triangles(scene), "{}: other triangles", scene.name);
    for (read, written) in materials(read).iter().zip(materials(scene)) {
        assert_eq!(*read, written);
    }
    assert_eq!(read.materials.len(), scene.materials.len());
    let views = |scene: &Scene| scene.cameras.iter().map(|c| View::new(scene, c, 1.5)).collect::<Vec<_>>();
    assert_eq!(views(read), views(scene));
    assert_eq!(read.animations, scene.animations);
    let light = |l: &PunctualLight| (l.name.clone(), l.kind, l.intensity, l.node);
    assert_eq!(
        read.lights.iter().map(light).collect::<Vec<_>>(),
        scene.lights.iter().map(light).collect::<Vec<_>>()
    );
    let movers = |scene: &Scene| scene.placed_objects().filter(|(_, o)| o.dynamic).count();
    assert_eq!(movers(read), movers(scene));
    for (read, written) in read.nodes.iter().zip(&scene.nodes) {
        assert_eq!((&read.name, read.parent), (&written.name, written.parent));
    }
    assert_eq!(read.warnings, [""; 0]);
}

#[test]
fn rooms_come_back_as_they_are() {
    for name in builtin::NAMES {
        let mut scene = builtin::build(name, MovingObject::Torus).expect("a room");
        scene.set_time(1.25).expect("a time");
        let around = scene.environment.take();
        let (mut read, left_out) = again(&scene);
        assert_eq!(left_out, [""; 0]);
        // What is there twice is said.
        assert_eq!(std::mem::take(&mut read.warnings).len(), usize::from(name == "moulding"));
        scene.environment = around;
        assert_eq!(again(&scene).1.len(), usize::from(scene.environment.is_some()), "{name}");
        assert_same(&scene, &read);
        let (third, left_out) = again(&read);
        assert_eq!(left_out, [""; 0], "{name}");
        assert!(triangles(&third) == triangles(&scene), "{name}");
    }
    // The control: another scene is another file.
    let [a, b] = ["table", "block"].map(|name| builtin::build(name, MovingObject::None).expect("a room"));
    assert!(triangles(&a) != triangles(&b));
}

fn texture(name: &str, color_space: ColorSpace) -> Texture {
    let texels = (0..32_u8).map(|i| [i * 8, 255 - i, i, if i % 2 == 0 { 128 + i } else { 255 }]).collect();
    let wrap = [Wrap::Mirror, Wrap::Clamp];
    Texture { name: name.into(), width: 8, height: 4, texels, color_space, wrap, filter: Filter::Nearest }
}

/// A scene with everything that glTF has a place for.
fn everything() -> Scene {
    let mut scene = Scene::default();
    scene.textures.extend([
        texture("colour", ColorSpace::Srgb),
        texture("levels", ColorSpace::Linear),
        texture("bumps", ColorSpace::Linear),
    ]);
    let turned = Affine2::from_mat2_translation(
        Mat2::from_cols(Vec2::new(0.6, -0.8), Vec2::new(0.8, 0.6)) * Mat2::from_diagonal(Vec2::new(2.0, 3.0)),
        Vec2::new(0.25, -0.5),
    );
    let scaled = Affine2::from_scale(Vec2::new(4.0, 0.5));
    let used = |texture, uv_set, transform| Some(TextureRef { texture, uv_set, transform });
    let base = Material { specular: 1.0, roughness: 0.4, ..Material::default() };
    for material in [
        Material { name: "matt".into(), specular: 0.0, vertex_colors: true, ..base.clone() },
        Material {
            name: "all".into(),
            base_color: Vec3::new(0.2, 0.4, 0.6),
            base_color_texture: used(0, 0, scaled),
            metallic: 0.7,
            metallic_roughness_texture: used(1, 1, Affine2::IDENTITY),
            specular: 0.5,
            specular_color: Vec3::new(0.5, 2.0, 1.0),
            specular_texture: used(1, 0, Affine2::IDENTITY),
            specular_color_texture: used(0, 0, Affine2::IDENTITY),
            emission: Vec3::new(31.4, 0.1, 7.0),
            emission_texture: used(0, 1, Affine2::IDENTITY),
            double_sided: true,
            ..base.clone()
        },
        Material {
            name: "cut".into(),
            base_color_texture: used(0, 0, Affine2::IDENTITY),
            alpha_cutoff: Some(0.7),
            ..base.clone()
        },
        Material { name: "veil".into(), alpha: 0.5, blended: true, emission: Vec3::ONE, ..base.clone() },
        Material {
            name: "glass".into(),
            transmission: 0.75,
            transmission_texture: used(1, 0, Affine2::IDENTITY),
            ..base.clone()
        },
        Material { name: "sign".into(), unlit: true, specular: 0.0, ..base.clone() },
        Material { name: "unused".into(), emission: Vec3::splat(3.0), ..base },
    ] {
        scene.materials.push(material);
    }
    let parent = scene.add_node("parent", Transform::translation(Vec3::new(1.0, 2.0, 3.0)));
    for material in 0..6 {
        let mut mesh = shapes::thesis_torus(MaterialId(material));
        mesh.name = format!("mesh {material}");
        mesh.uvs = mesh.positions.iter().map(|p| [p.truncate(), Vec2::new(p.z, p.x)]).collect();
        if material == 0 {
            mesh.colors = mesh.positions.iter().map(|p| p.abs().min(Vec3::ONE)).collect();
        }
        // Every other triangle is of a further material.
        if material == 3 {
            mesh.triangles.iter_mut().step_by(2).for_each(|triangle| triangle.material = MaterialId(5));
        }
        let place = DAffine3::from_translation(DVec3::X * f64::from(material));
        let object = scene.add_object(&format!("object {material}"), mesh, Transform::Affine(place));
        let node = scene.objects[object].node;
        scene.nodes[node].parent = Some(parent);
        scene.objects[object].dynamic = material == 4;
    }
    // A second object, and a camera and lights, on nodes that have some already.
    let (node, mesh) = (scene.objects[1].node, scene.objects[2].mesh);
    scene.objects.push(Object { name: "second".into(), node, mesh, ..scene.objects[1].clone() });
    for (i, kind) in
        [PunctualKind::Point, PunctualKind::Directional, PunctualKind::Spot { inner: 0.2, outer: 0.5 }]
            .into_iter()
            .enumerate()
    {
        let intensity = Vec3::new(12.7, 0.3, 1e-3) * (i as f32 + 1.0);
        scene.lights.push(PunctualLight { name: format!("light {i}"), node: parent, kind, intensity });
    }
    let eye = scene.add_node("eye", Transform::looking_at(Vec3::new(0.0, 2.0, 9.0), Vec3::ZERO));
    let (a, b) = (Projection::Perspective { yfov: 0.9 }, Projection::Orthographic { ymag: 2.5 });
    let cut = ClipPlanes { near: 0.3, far: 40.0 };
    for (name, projection, clip) in
        [("eye", a, ClipPlanes::NONE), ("plan", b, ClipPlanes::NONE), ("cut", a, cut)]
    {
        scene.cameras.push(Camera { name: name.into(), node: eye, projection, clip });
    }
    let (times, interpolation) = (vec![0.0, 0.5, 2.0], Interpolation::Linear);
    let rotations = [0.0, 1.0, 2.0].map(Quat::from_rotation_y).to_vec();
    let shifts = vec![Vec3::X; 9];
    scene.animations.push(Animation {
        name: "turn".into(),
        channels: vec![
            Channel {
                node: eye,
                times: times.clone(),
                keyframes: Keyframes::Rotation(rotations),
                interpolation,
            },
            Channel {
                node: parent,
                times,
                keyframes: Keyframes::Translation(shifts),
                interpolation: Interpolation::CubicSpline,
            },
        ],
    });
    let turned_use = TextureRef { texture: 2, uv_set: 0, transform: turned };
    scene.materials[1].normal_texture = Some(NormalTexture { texture: turned_use, scale: 0.5 });
    scene
}

#[test]
fn everything_comes_back() {
    let scene = everything();
    let (read, left_out) = again(&scene);
    assert_eq!(left_out, [""; 0]);
    assert!(triangles(&read) == triangles(&scene));
    let sent: Vec<&str> = read.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(sent, ["matt", "all", "cut", "veil", "glass", "sign", "unused"]);
    for ((read, used), (written, was_used)) in materials(&read).iter().zip(&materials(&scene)) {
        let mut read = read.clone();
        if let (Some(normal), Some(was)) = (&mut read.normal_texture, &written.normal_texture) {
            let [is, was] = [normal.texture.transform, was.texture.transform];
            assert!(is.abs_diff_eq(was, 1e-6) && is != Affine2::IDENTITY, "{is} {was}");
            normal.texture.transform = was;
        }
        assert_eq!((&read, used), (written, was_used));
    }
    assert_eq!(read.animations.len(), 1);
    let kinds = |scene: &Scene| {
        scene.lights.iter().map(|l| (l.name.clone(), l.kind, l.intensity)).collect::<Vec<_>>()
    };
    assert_eq!(kinds(&read), kinds(&scene));
    let views = |scene: &Scene| {
        scene.cameras.iter().map(|c| (c.name.clone(), View::new(scene, c, 1.0))).collect::<Vec<_>>()
    };
    assert_eq!(views(&read), views(&scene));
    let names = |scene: &Scene| {
        let mut names: Vec<String> = scene.placed_objects().map(|(_, o)| o.name.clone()).collect();
        names.sort();
        names
    };
    assert_eq!(names(&read), names(&scene));
    let dynamic =
        |scene: &Scene, name: &str| scene.placed_objects().any(|(_, o)| o.name == name && o.dynamic);
    assert!(dynamic(&read, "object 4") && dynamic(&scene, "object 4"));
}

#[test]
fn bent_meshes_come_back() {
    let mut scene = Scene::default();
    scene.add_material(Material { specular: 1.0, ..Material::default() });
    let mut mesh = shapes::thesis_torus(MaterialId(0));
    let count = mesh.positions.len();
    let bent = mesh.positions.iter().map(|p| *p * 0.5).collect();
    mesh.morph_targets =
        vec![MorphTarget { positions: bent, normals: vec![Vec3::X * 0.1; count] }, MorphTarget::default()];
    mesh.joint_weights = (0..count)
        .flat_map(|i| {
            [0, 1].map(|joint| JointWeight { joint, weight: if joint == 0 { 0.25 } else { (i % 3) as f32 } })
        })
        .collect();
    let object = scene.add_object("bent", mesh, Transform::IDENTITY);
    let joints = [0.0, 1.0].map(|x| {
        let node = scene.add_node(&format!("joint {x}"), Transform::translation(Vec3::new(x, 0.5, 0.0)));
        Joint { node, inverse_bind: DAffine3::from_translation(DVec3::new(-f64::from(x), 0.0, 0.0)) }
    });
    scene.skins.push(Skin { name: "skin".into(), joints: joints.to_vec() });
    scene.objects[object].skin = Some(0);
    let node = scene.objects[object].node;
    scene.nodes[node].morph_weights = vec![0.75, 0.0];
    let weights = Keyframes::MorphWeights(vec![0.0, 1.0, 0.5, 0.0]);
    let channel =
        Channel { node, times: vec![0.0, 1.0], keyframes: weights, interpolation: Interpolation::Step };
    scene.animations.push(Animation { name: "bend".into(), channels: vec![channel] });
    let (mut read, left_out) = again(&scene);
    assert_eq!(left_out, [""; 0]);
    assert_eq!((&read.skins, &read.animations), (&scene.skins, &scene.animations));
    assert_eq!(triangles(&read), triangles(&scene));
    let at_rest = triangles(&scene);
    for scene in [&mut scene, &mut read] {
        scene.set_time(1.5).expect("a time");
    }
    assert_eq!(triangles(&read), triangles(&scene));
    assert_ne!(triangles(&read), at_rest);
}

#[test]
fn what_has_no_place_is_named() {
    let mut scene = everything();
    scene.environment = Some(Environment::constant(Vec3::ONE).expect("an environment"));
    scene.materials[0].base_color = Vec3::splat(1.5);
    scene.textures[0].color_space = ColorSpace::Linear;
    let shear = Affine2::from_mat2(Mat2::from_cols(Vec2::new(0.6, -0.8), Vec2::new(1.0, 0.0)));
    scene.materials[2].base_color_texture = Some(TextureRef { texture: 0, uv_set: 0, transform: shear });
    let node = scene.animations[0].channels[0].node;
    let turned =
        DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), DQuat::from_rotation_x(0.5), DVec3::X);
    scene.nodes[node].local = Transform::Affine(turned);
    let left_out = again(&scene).1.join("\n");
    for expected in ["all around", "`matt`", "texture `colour`", "shear of texture"] {
        assert!(left_out.contains(expected), "{expected}: {left_out}");
    }
    // What is animated has parts: a matrix is taken apart, as far as that can be.
    assert!(!left_out.contains("shear of node"), "{left_out}");
    scene.nodes[node].local = Transform::Affine(
        turned
            * DAffine3::from_mat3(DMat3::from_cols_array_2d(&[
                [1.0, 0.5, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
            ])),
    );
    assert!(again(&scene).1.join("\n").contains("shear of node `eye`"));
    // What is gone is no longer there; without anything there is no file.
    let objects = scene.objects.len();
    scene.remove_object(ObjectId::from(0)).expect("removed");
    assert_eq!(again(&scene).0.objects.len(), objects - 1);
    for index in 1..objects {
        scene.remove_object(index.into()).expect("removed");
    }
    assert!(scene.export_glb().is_err() && Scene::default().export_glb().is_err());
}
