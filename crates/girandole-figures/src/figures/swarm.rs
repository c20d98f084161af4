//! A room in which many small things move.

use girandole_core::glam::{Vec3, vec3};
use girandole_core::math::sequence;
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{
    Animation, Channel, Geometry, Interpolation, Keyframes, MaterialId, Mesh, Scene, Transform,
};

const ROOM: &str = "block";
/// Metres from the middle of a mover's way, a square on edge, to its corners; it goes round in [`PERIOD`] seconds.
const REACH: f32 = 0.25;
const PERIOD: f32 = 2.0;
/// What has to be clear about a way's middle, in metres.
const CLEAR: f32 = REACH + 0.15;

/// The block's room with so many small tori, of which each goes round in a square of its own.
///
/// # Errors
/// Those of [`builtin::build`].
pub fn swarm(count: usize) -> girandole_core::Result<Scene> {
    let mut scene = builtin::build(ROOM, MovingObject::None)?;
    let mut channels = Vec::new();
    for (index, center) in places(&scene, count).into_iter().enumerate() {
        let way = way(center, index as u32);
        let object = scene.add_object("torus", torus(), Transform::translation(way[0]));
        scene.objects[object].dynamic = true;
        let times = (0..way.len()).map(|i| i as f32 * PERIOD / 4.0).collect();
        let keyframes = Keyframes::Translation(way);
        let node = scene.objects[object].node;
        channels.push(Channel { node, times, keyframes, interpolation: Interpolation::Linear });
    }
    scene.animations.push(Animation { name: "ways".into(), channels });
    Ok(scene)
}

fn torus() -> Mesh {
    shapes::torus(0.05, 0.02, 12, 8, MaterialId(0))
}

/// Places that are clear of what stands in the room.
fn places(scene: &Scene, count: usize) -> Vec<Vec3> {
    let geometry = Geometry::new(scene);
    let positions = || geometry.positions.iter().copied();
    let low = positions().fold(Vec3::INFINITY, Vec3::min);
    let high = positions().fold(Vec3::NEG_INFINITY, Vec3::max);
    let is_clear = |at: &Vec3| {
        (0..geometry.triangles.len() as u32).all(|triangle| {
            let [a, b, c] = geometry.corners(triangle);
            at.distance(at.clamp(a.min(b).min(c), a.max(b).max(c))) > CLEAR
        })
    };
    let at = |i: u32| low + (high - low) * Vec3::from([0, 1, 2].map(|axis| sequence::sample(i, axis, 7)));
    (0..).map(at).filter(is_clear).take(count).collect()
}

/// Corners of a square about a place, the first again at the end, in a plane that depends on the mover.
fn way(center: Vec3, index: u32) -> Vec<Vec3> {
    let tilt = |axis| sequence::sample(index, axis, 1) - 0.5;
    let (x, y) = vec3(tilt(0), 1.0, tilt(1)).normalize().any_orthonormal_pair();
    [x, y, -x, -y, x].map(|side| center + side * REACH).into()
}
