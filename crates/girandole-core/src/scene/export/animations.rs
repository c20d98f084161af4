//! Animations of nodes and morph weights.

use super::{Exporter, named};
use crate::scene::{Channel, Interpolation, Keyframes};
use gltf::json::accessor::Type;
use gltf::json::animation::{self, Property, Sampler, Target};
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Accessor, Index};

impl Exporter<'_> {
    pub(super) fn write_animations(&mut self) {
        for animation in &self.scene.animations {
            let mut samplers = Vec::new();
            let mut channels = Vec::new();
            for channel in animation.channels.iter().filter(|channel| !channel.times.is_empty()) {
                let (sampler, path) = self.sampler(channel);
                let target = Target {
                    node: Index::new(channel.node.0),
                    path: Valid(path),
                    extensions: None,
                    extras: None,
                };
                let sampler = Index::push(&mut samplers, sampler);
                channels.push(animation::Channel { sampler, target, extensions: None, extras: None });
            }
            if !channels.is_empty() {
                let name = named(&animation.name);
                self.root.push(json::Animation { channels, samplers, name, extensions: None, extras: None });
            }
        }
    }

    fn sampler(&mut self, channel: &Channel) -> (Sampler, Property) {
        let times: Vec<[f32; 1]> = channel.times.iter().map(|&time| [time]).collect();
        let input = self.buffers.floats(&mut self.root, &times, Type::Scalar, true);
        let (output, path) = self.values(&channel.keyframes);
        let interpolation = match channel.interpolation {
            Interpolation::Linear => animation::Interpolation::Linear,
            Interpolation::Step => animation::Interpolation::Step,
            Interpolation::CubicSpline => animation::Interpolation::CubicSpline,
        };
        (Sampler { input, interpolation: Valid(interpolation), output, extensions: None, extras: None }, path)
    }

    fn values(&mut self, keyframes: &Keyframes) -> (Index<Accessor>, Property) {
        let Self { root, buffers, .. } = self;
        let of3 = |values: &[glam::Vec3]| values.iter().map(glam::Vec3::to_array).collect::<Vec<_>>();
        match keyframes {
            Keyframes::Translation(values) => {
                (buffers.floats(root, &of3(values), Type::Vec3, false), Property::Translation)
            }
            Keyframes::Scale(values) => {
                (buffers.floats(root, &of3(values), Type::Vec3, false), Property::Scale)
            }
            Keyframes::Rotation(values) => {
                let values: Vec<[f32; 4]> = values.iter().map(|q| q.to_array()).collect();
                (buffers.floats(root, &values, Type::Vec4, false), Property::Rotation)
            }
            Keyframes::MorphWeights(values) => {
                let values: Vec<[f32; 1]> = values.iter().map(|&weight| [weight]).collect();
                (buffers.floats(root, &values, Type::Scalar, false), Property::MorphTargetWeights)
            }
        }
    }
}
