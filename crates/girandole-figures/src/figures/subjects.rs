//! Scenes whose true picture is known.

use crate::bench::{Bench, first_view, shared_file};
use anyhow::{Context, Result, ensure};
use girandole_core::image::Image;
use girandole_core::scene::{Environment, Geometry, LoadOptions, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::image_file::{read, read_environment};
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{PathSettings, path_trace};
use std::path::Path;
use std::process::Command;

/// Bounces of light: the pictures that an independent renderer made have at most two segments more.
pub const BOUNCES: u32 = 4;
/// Of the worst pixels, as in `cargo xtask truth`.
const TRIM: f32 = 0.001;

/// A scene with its truth.
pub struct Subject {
    /// What it is called.
    pub name: String,
    /// It.
    pub scene: Scene,
    /// From where it is seen.
    pub view: View,
    /// In so many pixels.
    pub size: [u32; 2],
    /// The true picture.
    pub truth: Image,
    /// Which pixels are compared.
    options: CompareOptions,
    /// What the truth is.
    pub made: String,
    /// Whether it is a room that people made, with textures and all.
    pub is_real: bool,
}

impl Subject {
    /// Those of the shared folder; without it a room that is built in.
    pub fn all(bench: &Bench) -> Result<Vec<Self>> {
        let ours = bench.of([&[][..], &["table"], &["table", "cornell"]]);
        let real = bench.of([&[][..], &[], &["staircase", "classroom"]]);
        let mut subjects = Vec::new();
        for name in ours {
            let scene = shared_file(bench.shared.as_deref(), &format!("truth/{name}/scene.glb"));
            let scene = scene.map(|file| Scene::load(&file)).transpose()?;
            subjects.extend(Self::shared(bench, (name, &format!("truth/{name}/256x192")), scene, false)?);
        }
        for name in real {
            let folder = format!("real/{name}");
            let packed = shared_file(bench.shared.as_deref(), &format!("{folder}/{name}.glb.xz"));
            let sky = shared_file(bench.shared.as_deref(), &format!("{folder}/sky.exr"));
            let scene = packed.map(|file| unpacked(&file, sky.as_deref())).transpose()?;
            subjects.extend(Self::shared(bench, (name, &folder), scene, true)?);
        }
        if subjects.is_empty() {
            subjects.push(Self::built_in(bench)?);
        }
        Ok(subjects)
    }

    /// A scene, where it is there, with the pictures in a folder below the shared one.
    fn shared(
        bench: &Bench,
        (name, folder): (&str, &str),
        scene: Option<Scene>,
        is_real: bool,
    ) -> Result<Option<Self>> {
        let file = |file: &str| shared_file(bench.shared.as_deref(), &format!("{folder}/{file}"));
        let files = (scene, file(&format!("d{}.exr", BOUNCES + 2)), file("mask.exr"));
        let (Some(scene), Some(picture), Some(mask)) = files else { return Ok(None) };
        let (truth, mask) = (read(&picture)?, read(&mask)?);
        let size = [truth.width, truth.height];
        let view = first_view(&scene, size)?;
        let options = CompareOptions { mask: Some(mask), keep_edges: false, trim: TRIM };
        let made = "Mitsuba 3.9.1, without emitters and edges".into();
        Ok(Some(Self { name: name.into(), scene, view, size, truth, options, made, is_real }))
    }

    /// A room that is built in, by our own path tracer with another seed.
    fn built_in(bench: &Bench) -> Result<Self> {
        let scene = bench.room("pillars")?;
        let (size, paths) = (bench.of([[48, 36], [160, 120], [256, 192]]), bench.of([8, 512, 1024]));
        let view = first_view(&scene, size)?;
        let geometry = Geometry::new(&scene);
        let settings = PathSettings { paths, bounces: Some(BOUNCES), seed: 1 };
        let truth = path_trace(&SceneTracer::new(&scene, &geometry), &view, size, &settings, &|_| ()).mean;
        let options = CompareOptions { trim: TRIM, ..CompareOptions::default() };
        let made = format!("our path tracer, {paths} paths a pixel");
        Ok(Self { name: "pillars".into(), scene, view, size, truth, options, made, is_real: false })
    }

    /// How far a picture is off.
    pub fn error(&self, image: &Image) -> Result<Comparison> {
        Ok(compare(&self.truth, image, &self.options)?)
    }
}

/// A packed scene, in the light of a sky where there is one.
fn unpacked(packed: &Path, sky: Option<&Path>) -> Result<Scene> {
    let output = Command::new("xz").arg("-dkc").arg(packed).output().context("cannot run xz")?;
    ensure!(output.status.success(), "xz cannot unpack {}", packed.display());
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("scene.glb");
    std::fs::write(&file, output.stdout)?;
    let environment = sky.map(|sky| -> Result<Environment> {
        let (image, _) = read_environment(sky, &|_| ())?;
        Ok(Environment::new(image)?)
    });
    let environment = environment.transpose()?;
    Ok(Scene::load_with(&file, LoadOptions { environment, ..LoadOptions::default() })?)
}
