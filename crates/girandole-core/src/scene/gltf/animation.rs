//! Animations of nodes and morph weights.

use super::accessor::Accessor;
use super::document::{lookup, shortened};
use super::{Importer, Parsed, budget};
use crate::scene::{Animation, Channel, Interpolation, Keyframes};
use glam::{Quat, Vec3};
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::Property;
use gltf::json::validation::Checked;

/// Keys of all channels together; no animation needs more.
const MAX_KEYS: usize = 1 << 24;

/// Names in a warning.
const MOST_NAMES: usize = 5;
/// What a warning of animations that do not play ends with.
pub const RESTING: &str = "; choose one to play alone";

impl Importer<'_> {
    /// Reads the channels that drive nodes of the scene. Objects that they move, and those that are deformed,
    /// are dynamic.
    pub(super) fn read_animations(&mut self) -> Parsed<()> {
        let mut keys = 0;
        for (index, json) in self.document.root.animations.iter().enumerate() {
            let mut animation =
                Animation { name: json.name.clone().unwrap_or_default(), channels: Vec::new() };
            for channel in &json.channels {
                let read = self.channel(json, channel, &mut keys);
                let name = || match &json.name {
                    Some(name) => format!("of `{name}`"),
                    None => format!("of animation {index}"),
                };
                animation.channels.extend(self.or_without("animation channel", name, read)?.flatten());
            }
            if !animation.channels.is_empty() {
                self.scene.animations.push(animation);
            }
        }
        for (object, is_animated) in self.scene.animated_objects().into_iter().enumerate() {
            let moves = is_animated || self.scene.is_deformed(&self.scene.objects[object]);
            self.scene.objects[object].dynamic |= moves;
        }
        Ok(())
    }

    /// Says which animations do not play, as others drive the same things.
    pub(super) fn name_resting_clips(&mut self) {
        let playing = self.scene.playing_clips();
        let named = |clip: usize| {
            let name = &self.scene.animations[clip].name;
            if name.is_empty() { clip.to_string() } else { format!("`{}`", shortened(name, 40)) }
        };
        let resting = (0..self.scene.animations.len()).filter(|clip| playing.binary_search(clip).is_err());
        let resting: Vec<usize> = resting.collect();
        if resting.is_empty() {
            return;
        }
        let names: Vec<String> = resting.iter().take(MOST_NAMES).map(|&clip| named(clip)).collect();
        let more = if resting.len() > MOST_NAMES { ", …" } else { "" };
        self.scene.warn(format!(
            "of {} animations these do not play, as they drive what {} drives: {}{more}{RESTING}",
            self.scene.animations.len(),
            named(playing[0]),
            names.join(", "),
        ));
    }

    fn channel(
        &mut self,
        animation: &json::Animation,
        json: &json::animation::Channel,
        keys: &mut usize,
    ) -> Parsed<Option<Channel>> {
        lookup(&self.document.root.nodes, json.target.node.value(), "node")?;
        let Some(node) = self.nodes.get(json.target.node.value()).copied().flatten() else { return Ok(None) };
        let Checked::Valid(property) = json.target.path else {
            self.scene.warn("animations of anything but nodes are left out".into());
            return Ok(None);
        };
        let mut each = 1;
        if property == Property::MorphTargetWeights {
            // What cannot be drawn is left out, and so is its animation.
            let Some(object) = self.scene.objects.iter().find(|o| o.node == node) else { return Ok(None) };
            each = self.scene.meshes[object.mesh].morph_targets.len();
        }
        let sampler = lookup(&animation.samplers, json.sampler.value(), "animation sampler")?;
        let interpolation = match sampler.interpolation {
            Checked::Valid(json::animation::Interpolation::Linear) => Interpolation::Linear,
            Checked::Valid(json::animation::Interpolation::Step) => Interpolation::Step,
            Checked::Valid(json::animation::Interpolation::CubicSpline) => Interpolation::CubicSpline,
            Checked::Invalid => {
                return Err("it has a key interpolation that does not exist; export it again".into());
            }
        };
        let input = Accessor::new(self.document, sampler.input.value())?.of(Type::Scalar, "key times")?;
        if input.component != ComponentType::F32 {
            return Err("its key times are not floats; export it again".into());
        }
        *keys = keys.saturating_add(input.count);
        let too_many = || {
            let what = format!("its animations have more than {MAX_KEYS} keys; resample them");
            self.document.budget.refuse(what)
        };
        if *keys > MAX_KEYS {
            return Err(too_many());
        }
        let kind = match property {
            Property::Rotation => Type::Vec4,
            Property::MorphTargetWeights => Type::Scalar,
            Property::Translation | Property::Scale => Type::Vec3,
        };
        let output = Accessor::new(self.document, sampler.output.value())?.of(kind, "key values")?;
        *keys = keys.saturating_add(if kind == Type::Scalar { output.count } else { 0 });
        if *keys > MAX_KEYS {
            return Err(too_many());
        }
        self.document.budget.take(input.count.saturating_add(output.count), budget::KEY)?;
        let values = each * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if input.count == 0 || values == 0 || output.count != input.count.saturating_mul(values) {
            return Err(format!(
                "it has {} keys with {} values instead of {values} each; export it again",
                input.count, output.count
            ));
        }
        let times: Vec<f32> = (0..input.count).map(|i| input.get::<1>(i)[0]).collect();
        if !(times.iter().all(|t| t.is_finite()) && times.windows(2).all(|w| w[0] < w[1])) {
            return Err("its key times do not ascend; export it again".into());
        }
        let vectors = || -> Parsed<Vec<Vec3>> {
            (0..output.count).map(|i| finite(Vec3::from(output.get::<3>(i)), Vec3::is_finite)).collect()
        };
        let keyframes = match property {
            Property::Translation => Keyframes::Translation(vectors()?),
            Property::Scale => Keyframes::Scale(vectors()?),
            Property::MorphTargetWeights => Keyframes::MorphWeights(
                (0..output.count)
                    .map(|i| finite(output.get::<1>(i)[0], f32::is_finite))
                    .collect::<Parsed<_>>()?,
            ),
            Property::Rotation => Keyframes::Rotation(
                (0..output.count)
                    .map(|i| finite(Quat::from_array(output.get::<4>(i)), Quat::is_finite))
                    .collect::<Parsed<_>>()?,
            ),
        };
        Ok(Some(Channel { node, times, keyframes, interpolation }))
    }
}

fn finite<T: Copy>(value: T, is_finite: impl Fn(T) -> bool) -> Parsed<T> {
    if is_finite(value) {
        Ok(value)
    } else {
        Err("it has a key without a finite value; export it again".into())
    }
}
