//! What all kernels of a sub-pixel sample are told: view, size, depth, sun.

use crate::layout::{self, Frame};
use crate::points::targets::Targets;
use crate::resident::Resident;
use crate::settings::RenderSettings;
use girandole_core::brdf;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::lights::Clamp;
use girandole_core::scene::{ClipDepth, ClipPlanes, LocalView};
use girandole_core::trace::RAY_OFFSET;

/// The uniform of a sub-pixel sample of a band of rows.
pub(super) fn frame_uniform(
    view: &LocalView,
    (scene, targets): (&Resident, &Targets),
    settings: &RenderSettings,
    band: [u32; 2],
    sample: u32,
) -> Frame {
    let (n, size) = (settings.samples_per_axis, targets.size);
    let center = |i: u32| (i as f32 + 0.5) / n as f32;
    // The first sample is the one next to the pixel's centre.
    let central = (n - 1) / 2 * (n + 1);
    let place = match sample {
        0 => central,
        s if s == central => 0,
        s => s,
    };
    // Far enough to see the whole scene from any eye that sees it at all.
    let far = (view.eye.length() + scene.extent) * 2.0;
    // Depth of parallel rays is as exact as what they cross is deep.
    let deep = match view.orthographic {
        true => farthest(view, scene.bounds) + scene.detail,
        false => far,
    };
    let (depth_bias, depth_scale, is_forward) = depth_mapping(view, scene.detail * 1e-5, deep);
    let sun = scene.geometry.environment.as_ref().and_then(|environment| environment.sun);
    let mirror_solid_angle = match scene.mirrors(settings) {
        0 => 0.0,
        _ => brdf::mirror_solid_angle(scene.lights.count() as usize),
    };
    // What no ray meets, and what further sets weigh against rays.
    let has_other_gloss = scene.lights.has_punctual || targets.light_set > 0;
    Frame {
        eye: view.eye,
        orthographic: u32::from(view.orthographic),
        right: view.right,
        half_width: view.half_extent.x,
        up: view.up,
        half_height: view.half_extent.y,
        forward: view.forward,
        depth_bias,
        size,
        band,
        offset: Vec2::new(center(place % n), center(place / n)),
        end_light: scene.lights.count(),
        clamp: layout::clamp(settings.clamp),
        far,
        sample,
        samples: n * n,
        last_row: band[1].min(size[1] - 1),
        step: 1,
        last_batch: 1,
        tolerance: settings.tolerance,
        debug: u32::from(settings.debug.is_some()),
        center: view.center,
        depth_scale,
        forward_depth: u32::from(is_forward),
        environment: scene.geometry.environment.as_ref().map_or(Vec2::ZERO, |e| e.uniform),
        sun_direction: sun.map_or(Vec3::ZERO, |disc| disc.direction),
        sun_chord2: sun.map_or(0.0, |disc| disc.chord * disc.chord),
        sun_radiance: sun.map_or(Vec3::ZERO, |disc| disc.radiance),
        sample_solid_angle: if settings.clamp == Clamp::Own { scene.lights.mean_solid_angle } else { 0.0 },
        mirror_solid_angle,
        ray_offset: scene.detail * RAY_OFFSET,
        columns: targets.drawn.columns(),
        light_set: targets.light_set,
        sample_area: scene.lights.mean_area,
        polished_alpha: if has_other_gloss { 0.0 } else { brdf::polished_alpha(mirror_solid_angle) },
        ..Frame::default()
    }
}

/// How far the farthest corner of a box is along a view's axis, metres; 0 if that is behind the eye.
fn farthest(view: &LocalView, (low, high): (Vec3, Vec3)) -> f32 {
    let corner = Vec3::select(view.forward.cmpge(Vec3::ZERO), high, low);
    (corner - view.eye).dot(view.forward).max(0.0) * 1.001
}

/// [`Frame::depth_bias`], [`Frame::depth_scale`], and whether the caller's depth is greater for what is farther. `near`
/// and `far` serve views that say nothing of depth.
fn depth_mapping(view: &LocalView, near: f32, far: f32) -> (f32, f32, bool) {
    let Some(ClipDepth { offset, factor }) = view.depth else {
        let (bias, scale) = own_mapping(view, near, far);
        return (bias, scale, false);
    };
    let is_forward = (factor > 0.0) == view.orthographic;
    let (offset, factor) = if is_forward { (1.0 - offset, -factor) } else { (offset, factor) };
    if view.orthographic { (offset, -1.0 / factor, is_forward) } else { (factor, -offset, is_forward) }
}

/// The mapping of views that say nothing of depth: reversed, and cut off where the view is.
fn own_mapping(view: &LocalView, near: f32, far: f32) -> (f32, f32) {
    let ClipPlanes { near: from, far: to } = view.clip;
    if view.orthographic {
        let to = if to.is_finite() { to } else { from + far };
        return (1.0 + from / (to - from), to - from);
    }
    let near = if from > 0.0 { from } else { near };
    // Depth is 1 at the near plane and 0 at the far one.
    if to.is_finite() { (near * (to / (to - near)), near / (to - near)) } else { (near, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::glam::camera::rh::proj::directx as proj;
    use girandole_core::glam::{DAffine3, DVec3, Mat4};
    use girandole_core::scene::View;

    /// What the visibility buffer makes of a distance, as the caller's depth.
    fn depth_at(view: &LocalView, z: f32) -> f32 {
        let (bias, scale, is_forward) = depth_mapping(view, 1e-4, 50.0);
        let reversed = if view.orthographic { bias - z / scale } else { (bias - z * scale) / z };
        if is_forward { 1.0 - reversed } else { reversed }
    }

    #[test]
    fn depth_is_the_callers() {
        let swap = Mat4::from_cols_array_2d(&[
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0, 1.0],
        ]);
        let (near, far) = (0.25, 40.0);
        for (clip_from_view, planes) in [
            (proj::perspective(1.0, 1.5, near, far), [0.0, 1.0]),
            (swap * proj::perspective(1.0, 1.5, near, far), [1.0, 0.0]),
            (proj::perspective_infinite(1.0, 1.5, near), [0.0, 1.0 - near / far]),
            (proj::perspective_infinite_reverse(1.0, 1.5, near), [1.0, near / far]),
            (proj::orthographic(-3.0, 3.0, -2.0, 2.0, near, far), [0.0, 1.0]),
            (swap * proj::orthographic(-3.0, 3.0, -2.0, 2.0, near, far), [1.0, 0.0]),
        ] {
            let view = View::from_matrices(DAffine3::IDENTITY, clip_from_view).expect("a view");
            let local = view.relative_to(DVec3::ZERO);
            for (z, depth) in [(near, planes[0]), (far, planes[1])] {
                assert!((depth_at(&local, z) - depth).abs() < 1e-6, "{clip_from_view}: {z}");
            }
            for z in [0.3, 1.0, 7.0, 39.0] {
                let expected = view.clip_depth(z).expect("it has depth");
                assert!((depth_at(&local, z) - expected).abs() < 1e-6, "{clip_from_view}: {z}");
            }
            assert_eq!(depth_mapping(&local, 1e-4, 50.0).2, !view.is_reversed());
            // Without the caller's depth, that of the renderer.
            let own = LocalView { depth: None, clip: ClipPlanes::NONE, ..local };
            let expected = if local.orthographic { (1.0, 50.0, false) } else { (1e-4, 0.0, false) };
            assert_eq!(depth_mapping(&own, 1e-4, 50.0), expected);
        }
    }
}
