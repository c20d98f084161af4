//! What the vertices of objects receive that are lit by transfer, on the CPU.

use super::{Gathering, IncidentLight, ObjectTransfer, TransferFrame};
use crate::Result;
use crate::lights::{Clamp, LightSet};
use crate::scene::{Geometry, ObjectId};
use crate::trace::SceneTracer;
use crate::visibility::VisibilityDatabase;
use glam::{DVec3, UVec3, Vec2, Vec3};
use std::ops::Range;

/// What the vertices of some objects receive, W/m².
#[derive(Clone, Debug, Default)]
pub struct TransferredLight {
    /// Their vertices, and by side what these receive.
    objects: Vec<(Range<u32>, Vec<Vec<Vec3>>)>,
}

impl TransferredLight {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an object, lit by these lights.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where the transfer is that of another mesh, or the object was stretched since.
    pub fn add(
        &mut self,
        tracer: &SceneTracer,
        (lights, database): (&LightSet, Option<&VisibilityDatabase>),
        (object, transfer): (ObjectId, &ObjectTransfer),
        gathering: Gathering,
        clamp: Clamp,
    ) -> Result<()> {
        let frame = transfer.frame(tracer.scene(), object)?;
        let light = IncidentLight::new(tracer, lights, database, object, clamp);
        let grid = Grid::new(tracer.geometry(), transfer, &frame, gathering);
        let at = |position| light.at(position, &frame, transfer.bands());
        let incident: Vec<Vec<Vec3>> = grid.positions().map(at).collect();
        let vertices = tracer.geometry().objects[object.index()].vertices.clone();
        let received = |(vertex, index): (u32, usize), side: usize| {
            let cell = grid.cell(tracer.geometry().positions[vertex as usize]);
            let mut here = vec![Vec3::ZERO; incident[0].len()];
            for (point, weight) in cell {
                here.iter_mut().zip(&incident[point]).for_each(|(sum, c)| *sum += *c * weight);
            }
            transfer.irradiance_of_side(side, index, &here).max(Vec3::ZERO)
        };
        let of_side = |side| vertices.clone().zip(0..).map(move |vertex| received(vertex, side)).collect();
        let sides = (0..transfer.sides()).map(of_side).collect();
        self.objects.push((vertices.clone(), sides));
        Ok(())
    }

    /// What a point of a triangle receives on its front, or on its back, where its object is one of these.
    pub fn irradiance(
        &self,
        geometry: &Geometry,
        (triangle, front): (u32, bool),
        barycentric: Vec2,
    ) -> Option<Vec3> {
        let [a, b, c] = geometry.triangles[triangle as usize].vertices;
        let (range, sides) = self.objects.iter().find(|(range, _)| range.contains(&a))?;
        let irradiance = sides.get(usize::from(!front)).or(sides.first())?;
        let of = |vertex: u32| irradiance[(vertex - range.start) as usize];
        let Vec2 { x: u, y: v } = barycentric;
        Some(of(a) * (1.0 - u - v) + of(b) * u + of(c) * v)
    }
}

/// The points about an object at which light is gathered. Mirrored in `shaders/lib/transfer_object.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// World from the unit cube, which is the object's box, relative to the geometry's origin. The only point of
    /// [`Gathering::Center`] is the centre of a box about the bounding sphere.
    pub world_from_box: glam::DAffine3,
    points: u32,
}

impl Grid {
    /// About an object where it is.
    pub fn new(
        geometry: &Geometry,
        transfer: &ObjectTransfer,
        frame: &TransferFrame,
        gathering: Gathering,
    ) -> Self {
        let (low, high) = match gathering {
            Gathering::Center => {
                let radius = Vec3::splat(transfer.radius());
                (transfer.center() - radius, transfer.center() + radius)
            }
            Gathering::Grid { .. } => transfer.bounds(),
        };
        // A box without thickness gets some.
        let size = (high - low).as_dvec3();
        let size = size.max(DVec3::splat(1e-3 * size.max_element().max(1e-30)));
        let mut world_from_transfer = frame.world_from_transfer;
        world_from_transfer.translation -= geometry.origin;
        let transfer_from_box =
            glam::DAffine3::from_scale_rotation_translation(size, glam::DQuat::IDENTITY, low.as_dvec3());
        Self { world_from_box: world_from_transfer * transfer_from_box, points: gathering.points() }
    }

    /// The length of the box along each of its axes, metres.
    pub fn size(&self) -> DVec3 {
        let m = self.world_from_box.matrix3;
        DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
    }

    /// The points, in order of x, y and z: centres of equal cells.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        let n = self.points;
        (0..n.pow(3)).map(move |index| {
            let cell = UVec3::new(index % n, index / n % n, index / (n * n));
            let place = (cell.as_dvec3() + 0.5) / f64::from(n);
            self.world_from_box.transform_point3(place).as_vec3()
        })
    }

    /// The indices of the points about a position, and how much each counts.
    fn cell(&self, position: Vec3) -> [(usize, f32); 8] {
        let n = self.points;
        let place = self.world_from_box.inverse().transform_point3(position.as_dvec3());
        let at = (place * f64::from(n) - 0.5).clamp(DVec3::ZERO, DVec3::splat(f64::from(n - 1)));
        let low = at.floor().as_uvec3().min(UVec3::splat(n.max(2) - 2));
        let share = (at - low.as_dvec3()).as_vec3();
        std::array::from_fn(|i| {
            let far = UVec3::new(i as u32 & 1, i as u32 >> 1 & 1, i as u32 >> 2);
            let place = (low + far).min(UVec3::splat(n - 1));
            let weight = |axis: usize| if far[axis] == 1 { share[axis] } else { 1.0 - share[axis] };
            (((place.z * n + place.y) * n + place.x) as usize, weight(0) * weight(1) * weight(2))
        })
    }
}
