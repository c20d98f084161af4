//! Lengths are metres; files are not always right about that.

#[cfg(feature = "import")]
use super::Geometry;
use super::motion::Keyframes;
use super::{ClipPlanes, Projection, Scene, Transform};
use crate::{Error, Result};
use glam::{DAffine3, DVec3};

/// How a warning ends that lengths of a file are likely in other units: those of another [scale](Scene::scale).
pub const HARDLY_METRES: &str = "its lengths are hardly metres";

impl Scene {
    /// Multiplies all lengths, as of a file in other units than metres: 0.01 for centimetres. Radiance stays, and so do intensities
    /// of punctual lights. For building, before the scene is opened.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `factor` is positive and finite.
    pub fn scale(&mut self, factor: f64) -> Result<()> {
        if !(factor.is_normal() && factor > 0.0 && (factor as f32).is_normal()) {
            return Err(Error::Invalid(format!(
                "lengths cannot be multiplied by {factor}; give a number above 0"
            )));
        }
        let single = factor as f32;
        let is_root: Vec<bool> = self.nodes.iter().map(|node| node.parent.is_none()).collect();
        for node in self.nodes.iter_mut().filter(|node| node.parent.is_none()) {
            match &mut node.local {
                Transform::Parts { translation, scale, .. } => {
                    *translation *= single;
                    *scale *= single;
                }
                Transform::Affine(affine) => *affine = DAffine3::from_scale(DVec3::splat(factor)) * *affine,
            }
        }
        let channels = self.animations.iter_mut().flat_map(|animation| &mut animation.channels);
        for channel in channels.filter(|channel| is_root[channel.node.index()]) {
            if let Keyframes::Translation(values) | Keyframes::Scale(values) = &mut channel.keyframes {
                values.iter_mut().for_each(|value| *value *= single);
            }
        }
        for camera in &mut self.cameras {
            if let Projection::Orthographic { ymag } = &mut camera.projection {
                *ymag *= single;
            }
            camera.clip = ClipPlanes { near: camera.clip.near * single, far: camera.clip.far * single };
        }
        self.touch();
        Ok(())
    }

    /// Warns where lengths are hardly metres.
    #[cfg(feature = "import")]
    pub(super) fn doubt_units(&mut self, geometry: &Geometry) {
        // Rooms of this height, metres, and other scenes of this size are hardly meant to be so, nor smaller ones than that.
        const HIGHEST_ROOM: f32 = 60.0;
        const LARGEST: f32 = 1e4;
        const SMALLEST: f32 = 0.005;
        let (low, high) = geometry.main_bounds();
        let (size, height) = ((high - low).length(), high.y - low.y);
        let tracer = || crate::trace::SceneTracer::of_all_surfaces(self, geometry);
        let is_room = || super::defaults::inside(&tracer()).is_some();
        let what = if height > HIGHEST_ROOM && is_room() {
            format!("`{}` is a room {height:.0} m high", self.name)
        } else if size > LARGEST {
            format!("`{}` is {size:.0} m across", self.name)
        } else if size < SMALLEST && size > 0.0 {
            match size * 1e3 {
                millimetres @ 1e-3.. => format!("`{}` is {millimetres:.3} mm across", self.name),
                millimetres => format!("`{}` is {millimetres:.0e} mm across", self.name),
            }
        } else {
            return;
        };
        self.warn(format!("{what}; {HARDLY_METRES}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::{self, MovingObject};
    use crate::scene::{Geometry, View};

    #[test]
    fn all_lengths_are_multiplied() {
        let scene = builtin::build("table", MovingObject::Torus).expect("a room");
        let mut large = scene.clone();
        large.scale(100.0).expect("a factor");
        for seconds in [0.0, 1.3] {
            let [small, large] = [&scene, &large].map(|scene| {
                let mut scene = scene.clone();
                scene.set_time(seconds).expect("a time");
                let geometry = Geometry::new(&scene);
                let world: Vec<DVec3> =
                    geometry.positions.iter().map(|p| geometry.origin + p.as_dvec3()).collect();
                (world, View::new(&scene, &scene.cameras[0], 1.0))
            });
            let is_same = |(a, b): (&DVec3, &DVec3)| (*a * 100.0).abs_diff_eq(*b, 1e-3);
            assert!(small.0.iter().zip(&large.0).all(is_same));
            assert!((small.1.eye * 100.0).abs_diff_eq(large.1.eye, 1e-3));
            assert!(small.1.forward.abs_diff_eq(large.1.forward, 1e-5));
        }
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-60] {
            assert!(large.scale(wrong).is_err(), "{wrong}");
        }
    }

    #[cfg(feature = "import")]
    #[test]
    fn rooms_in_centimetres_are_noticed() {
        for (factor, is_said) in [(1.0, false), (100.0, true), (1e-5, true), (0.1, false)] {
            let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
            scene.scale(factor).expect("a factor");
            scene.doubt_units(&Geometry::new(&scene));
            assert_eq!(
                scene.warnings.iter().any(|w| w.ends_with(HARDLY_METRES)),
                is_said,
                "{factor}: {:?}",
                scene.warnings
            );
        }
    }
}
