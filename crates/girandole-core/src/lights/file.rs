//! Light samples in files, so that processes that share work sample a scene's light once for all.

use super::emission::Shares;
use super::{LightSample, LightSet, LightSettings};
use crate::scene::{Geometry, Scene, View};
use crate::{Result, files};
use serde::{Deserialize, Serialize};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_128;

/// Of the format, and of what sampling finds.
const VERSION: u32 = 8;

/// What a file holds.
#[derive(Serialize, Deserialize)]
struct Kept {
    /// Of all that samples depend on.
    key: String,
    samples: Vec<LightSample>,
    shares: Vec<Shares>,
    paths: u32,
    warnings: Vec<String>,
}

impl LightSet {
    /// As [`LightSet::sample_for`]: read from a folder where the same was sampled before, else sampled and kept there, as far as that
    /// can be written. What is damaged is sampled again. Files are named by a hash of what samples depend on: the scene's content and
    /// where everything is, the settings, the views, the version.
    ///
    /// # Errors
    /// As [`LightSet::sample_for`].
    pub fn sample_once(
        scene: &Scene,
        geometry: &Geometry,
        settings: &LightSettings,
        views: &[View],
        folder: &Path,
    ) -> Result<Self> {
        geometry.belongs_to(scene)?;
        let version = env!("CARGO_PKG_VERSION");
        let moves: Vec<bool> = scene.objects.iter().map(|object| object.dynamic).collect();
        let (content, placement) = (scene.content(), scene.placement(None));
        let text = format!("{version} {VERSION} {content} {placement} {moves:?} {settings:?} {views:?}");
        let key = format!("{:032x}", xxh3_128(text.as_bytes()));
        let path = folder.join(format!("{key}.lights"));
        if let Some(found) = Self::read(geometry, &path, &key) {
            return Ok(found);
        }
        let set = Self::sample_for(scene, geometry, settings, views)?;
        let Self { samples, shares, paths, warnings, .. } = set.clone();
        if let Ok(bytes) = serde_json::to_vec(&Kept { key, samples, shares, paths, warnings })
            && std::fs::create_dir_all(folder).is_ok()
            && let Err(error) = files::write(&path, &bytes)
        {
            tracing::warn!("light samples are not kept: {error}");
        }
        Ok(set)
    }

    fn read(geometry: &Geometry, path: &Path, key: &str) -> Option<Self> {
        if !path.is_file() {
            return None;
        }
        let kept: Kept = serde_json::from_slice(&files::read(path).ok()?).ok()?;
        let Kept { key: of_file, samples, shares, paths, warnings } = kept;
        let is_whole = of_file == key && shares.len() == samples.len() && !samples.is_empty();
        let triangles = geometry.triangles.len() as u32;
        let lies_on_it = |s: &LightSample| s.triangle() == crate::scene::NONE || s.triangle() < triangles;
        if !(is_whole && samples.iter().all(lies_on_it)) {
            return None;
        }
        Some(Self { shares, paths, warnings, ..Self::from_samples(geometry, samples) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin;
    use glam::Vec3;
    use proptest::prelude::*;

    #[test]
    fn samples_are_read_as_they_were() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["pillars", "living-room", "blinds"] {
            let scene = builtin::build(name, builtin::default_object(name)).expect("a room");
            let geometry = Geometry::new(&scene);
            let view = [View::new(&scene, &scene.cameras[0], 1.5)];
            let settings = LightSettings { count: 40, ..LightSettings::default() };
            let once = |settings: &LightSettings, views: &[View]| {
                LightSet::sample_once(&scene, &geometry, settings, views, folder.path()).expect("samples")
            };
            let files = || std::fs::read_dir(folder.path()).expect("a folder").count();
            let before = files();
            let sampled = LightSet::sample_for(&scene, &geometry, &settings, &view).expect("samples");
            let first = once(&settings, &view);
            assert_eq!(files(), before + 1);
            // Another one there is read, not sampled.
            let read = once(&settings, &view);
            for set in [&first, &read] {
                assert!(*set == sampled && set.shares == sampled.shares, "{name}");
            }
            assert_eq!(files(), before + 1);
            // The controls: other settings, another view and another place are others.
            once(&LightSettings { seed: 1, ..settings }, &view);
            once(&settings, &[]);
            assert_eq!(files(), before + 3);
            let mut moved = scene.clone();
            moved.set_time(0.5).expect("a moment");
            let moved_geometry = Geometry::new(&moved);
            let other = LightSet::sample_once(&moved, &moved_geometry, &settings, &view, folder.path());
            let expected = LightSet::sample_for(&moved, &moved_geometry, &settings, &view).expect("samples");
            assert!(other.expect("samples") == expected, "{name}");
        }
    }

    #[test]
    fn what_is_damaged_is_sampled_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = builtin::build("gap", builtin::MovingObject::None).expect("a room");
        let geometry = Geometry::new(&scene);
        let settings = LightSettings { count: 8, ..LightSettings::default() };
        let once =
            || LightSet::sample_once(&scene, &geometry, &settings, &[], folder.path()).expect("samples");
        let first = once();
        let path =
            std::fs::read_dir(folder.path()).expect("a folder").next().expect("a file").expect("it").path();
        let bytes = std::fs::read(&path).expect("bytes");
        let text = String::from_utf8(bytes.clone()).expect("text");
        for damaged in [
            String::new(),
            text[..text.len() / 2].to_owned(),
            text.replacen("\"key\":\"", "\"key\":\"0", 1),
            text.replacen("\"triangle\":", "\"triangle\":4000000", 1),
        ] {
            assert_ne!(damaged, text);
            std::fs::write(&path, damaged).expect("it is written");
            assert!(once() == first);
            assert_eq!(std::fs::read(&path).expect("bytes"), bytes);
        }
        // The control: it is what the file says.
        assert!(first.warnings.is_empty());
        let told = text.replacen("\"warnings\":[]", "\"warnings\":[\"read\"]", 1);
        std::fs::write(&path, told).expect("it is written");
        assert_eq!(once().warnings, ["read"]);
        // No folder at all: nothing is kept.
        let file = folder.path().join("no folder");
        std::fs::write(&file, "").expect("it is written");
        assert!(LightSet::sample_once(&scene, &geometry, &settings, &[], &file).expect("samples") == first);
    }

    proptest! {
        #[test]
        fn numbers_come_back_to_the_bit(bits in prop::array::uniform3(any::<u32>())) {
            let number = Vec3::from_array(bits.map(f32::from_bits));
            prop_assume!(number.is_finite());
            let text = serde_json::to_string(&number).expect("text");
            let back: Vec3 = serde_json::from_str(&text).expect("numbers");
            prop_assert_eq!(back.to_array().map(f32::to_bits), number.to_array().map(f32::to_bits));
        }
    }
}
