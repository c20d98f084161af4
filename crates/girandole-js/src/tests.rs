use crate::{Camera, Lit, Settings};
use girandole::wgpu;
use girandole_core::scene::builtin::{self, MovingObject};

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Bgra8Unorm;
const SIZE: [u32; 2] = [32, 24];

/// A device that computes nothing.
fn device() -> (wgpu::Device, wgpu::Queue) {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor.backend_options.noop.enable = true;
    let instance = wgpu::Instance::new(descriptor);
    pollster::block_on(async {
        let adapter = instance.request_adapter(&Default::default()).await.expect("a no-op adapter");
        adapter.request_device(&Default::default()).await.expect("a no-op device")
    })
}

fn settings(json: &str) -> Result<Settings, String> {
    serde_json::from_str(json).map_err(|error| error.to_string())
}

/// Renders until nothing is to come. How many samples shone in each picture.
fn pictures(lit: &mut Lit, device: &wgpu::Device) -> Vec<usize> {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let mut pictures = Vec::new();
    loop {
        let mut is_drawn = false;
        let is_more = lit.render(
            (SIZE, FORMAT),
            || false,
            || {
                is_drawn = true;
                Some(texture.create_view(&Default::default()))
            },
        );
        let is_more = is_more.expect("a frame");
        if is_drawn {
            pictures.push(lit.stats().lit);
        }
        if !is_more {
            return pictures;
        }
    }
}

#[test]
fn pictures_grow_until_all_samples_shine_and_then_rest() {
    let (device, queue) = device();
    let mut lit = Lit::new(&device, &queue);
    assert!(pictures(&mut lit, &device).is_empty(), "there is no scene");
    assert!(lit.camera().is_none());
    lit.set(&settings(r#"{"lights": 100, "bounces": 1}"#).expect("settings"));
    lit.show(builtin::build("block", MovingObject::None).expect("a room"));
    assert_eq!(pictures(&mut lit, &device), [16, 16, 32, 64, 100], "naive first, then as asked for");
    let stats = lit.stats();
    assert_eq!((stats.lights, stats.lit, stats.progress, stats.scene.as_str()), (100, 100, 1.0, "block"));
    assert!(stats.triangles > 10);
    assert!(pictures(&mut lit, &device).is_empty(), "nothing changed");
    lit.set(&settings(r#"{"exposure": 1}"#).expect("settings"));
    assert_eq!(pictures(&mut lit, &device), [100], "the light is the same");
    let camera = lit.camera().expect("a camera");
    let [x, y, z] = camera.position;
    lit.look_from(&Camera { position: [x + 0.1, y, z], ..camera }).expect("a view");
    assert_eq!(pictures(&mut lit, &device), [100], "and so it is from elsewhere");
    lit.place();
    assert_eq!(pictures(&mut lit, &device), [16, 16, 32, 64, 100], "until it is placed anew");
    lit.set(&settings(r#"{"lights": 16, "mode": "naive"}"#).expect("settings"));
    assert_eq!(pictures(&mut lit, &device), [16]);
}

#[test]
fn what_no_setting_is_is_refused() {
    for (json, word) in [
        (r#"{"colour": 1}"#, "colour"),
        (r#"{"lights": -1}"#, "-1"),
        (r#"{"mode": "fast"}"#, "fast"),
        (r#"{"exposure": "bright"}"#, "variant"),
    ] {
        let refused = settings(json).expect_err(json);
        assert!(refused.contains(word), "{refused}");
    }
    let (device, queue) = device();
    let mut lit = Lit::new(&device, &queue);
    let nowhere = Camera { position: [0.0; 3], target: [0.0; 3], up: [0.0, 1.0, 0.0], fov: 60.0 };
    assert!(lit.look_from(&nowhere).expect_err("no view").to_string().contains("same point"));
    lit.show(builtin::build("block", MovingObject::None).expect("a room"));
    lit.set(&settings(r#"{"lights": 0}"#).expect("settings"));
    let mut refused = || lit.render((SIZE, FORMAT), || false, || None).expect_err("no light").to_string();
    let sentences = [(); 3].map(|()| refused());
    assert!(sentences[0].contains("light"), "{sentences:?}");
    assert!(sentences.iter().all(|sentence| *sentence == sentences[0]), "{sentences:?}");
}
