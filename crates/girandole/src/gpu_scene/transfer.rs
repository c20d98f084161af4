//! Objects that are lit by precomputed radiance transfer.

use super::light_source::LightSource;
use crate::device::buffers::{check_bytes, storage, uniform};
use crate::device::context::Context;
use crate::gpu_scene::previous_transforms::mover_of;
use crate::layout::{TransferObject, VertexRange};
use crate::shader_constants::{BATCH, NONE};
use crate::stats::TransferCounts;
use crate::{Error, Result};
use girandole_core::glam::{DAffine3, Vec3, Vec4};
use girandole_core::lights::{Clamp, LightSample};
use girandole_core::math::sh;
use girandole_core::scene::ObjectId;
use girandole_core::trace::SceneTracer;
use girandole_core::transfer::{
    CompressedTransfer, Gathering, Grid, IncidentLight, ObjectTransfer, TransferFrame,
};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use web_time::Instant;

/// By how much the box that stands for an object in shadow maps is larger than it: texels are not infinitely small.
const MARGIN: f32 = 0.02;

/// Bytes of `Arrival` in `incident_light.wgsl`.
const ARRIVAL_BYTES: u64 = 32;

/// Which objects are lit by transfer, and how.
pub(crate) type Transfers = BTreeMap<ObjectId, Transferred>;

/// How an object is lit.
pub(crate) struct Transferred {
    pub transfer: Arc<ObjectTransfer>,
    pub gathering: Gathering,
    /// The transfer vectors on the device.
    data: Arc<wgpu::Buffer>,
}

impl Transferred {
    /// # Errors
    /// [`Error::Scene`] for a grid of too many points or none, [`Error::TooLarge`] beyond the device's limit.
    pub fn new(context: &Context, transfer: Arc<ObjectTransfer>, gathering: Gathering) -> Result<Self> {
        if !(1..=Gathering::MOST_POINTS).contains(&gathering.points()) {
            return Err(Error::invalid(format!(
                "a grid of {} points along each axis for the light about an object: give 1 to {}",
                gathering.points(),
                Gathering::MOST_POINTS
            )));
        }
        let compressed = transfer.compressed().map(packed);
        let data = compressed.as_deref().unwrap_or(transfer.coefficients());
        let data = Arc::new(storage(&context.device, "transfer vectors", data)?);
        Ok(Self { transfer, gathering, data })
    }
}

/// Compressed vectors as `transfer_vertices.wgsl` reads them.
fn packed(compressed: &CompressedTransfer) -> Vec<f32> {
    let CompressedTransfer { length, bases_each, clusters, weights, means, bases, .. } = compressed;
    let mut words = Vec::new();
    for (cluster, mean) in means.chunks_exact(*length).enumerate() {
        words.extend(mean);
        words.extend(&bases[cluster * bases_each * length..][..bases_each * length]);
    }
    for (vector, &cluster) in clusters.iter().enumerate() {
        words.push(cluster as f32);
        words.extend(&weights[vector * bases_each..][..*bases_each]);
    }
    words
}

/// What lies on the GPU of objects that are lit by transfer.
pub(crate) struct GpuTransfer {
    pub objects: Vec<GpuTransferObject>,
    /// What vertices receive.
    pub vertex_irradiance: wgpu::Buffer,
    /// The vertices that this is of.
    pub range: wgpu::Buffer,
    /// The object that each light lies on.
    pub light_objects: wgpu::Buffer,
    /// What gathering light on the CPU took.
    gathered: Gathered,
}

/// One of them.
pub(crate) struct GpuTransferObject {
    pub uniform: wgpu::Buffer,
    pub data: Arc<wgpu::Buffer>,
    /// Coefficients of the light that arrives, for each point of the grid.
    pub incident: wgpu::Buffer,
    /// What arrives at each point from the lights of a batch, on its way there.
    pub arrivals: wgpu::Buffer,
    /// What vectors of clusters receive at each point, where there are any.
    pub projected: wgpu::Buffer,
    /// Vectors of clusters: means and bases.
    pub vectors: u32,
    /// Points of the grid.
    pub grid_points: u32,
    /// The same, where the device gathers the light; 0 where it was gathered already.
    pub points: u32,
    /// Vertices, times the sides that have vectors.
    pub vertices: u32,
    /// Its triangles, which other passes leave out.
    pub triangles: Range<u32>,
}

/// What gathering light at the centres of objects took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Gathered {
    /// Wall-clock time, ms.
    ms: f64,
    rays: u64,
}

impl GpuTransfer {
    /// For a scene and its light as they are; nothing where no object is lit by transfer. Objects that were stretched since
    /// their transfer was simulated are lit by shadow maps.
    ///
    /// # Errors
    /// [`Error::TooLarge`] beyond the device's limits.
    pub fn new(context: &Context, source: LightSource) -> Result<Option<Self>> {
        let LightSource { scene, geometry, lights, transfers, .. } = source;
        let mut lit = Vec::new();
        for (&object, transferred) in transfers {
            match transferred.transfer.frame(scene, object) {
                Ok(frame) => lit.push((object, transferred, frame)),
                Err(why) => tracing::warn!("{why}; shadow maps light it"),
            }
        }
        let ranges = || lit.iter().map(|(object, ..)| &geometry.objects[object.index()].vertices);
        let (Some(first), Some(end)) = (ranges().map(|r| r.start).min(), ranges().map(|r| r.end).max())
        else {
            return Ok(None);
        };
        let mut gathered = Gathered::default();
        let mut objects = Vec::with_capacity(lit.len());
        for (object, transferred, frame) in &lit {
            let incident = (transferred.gathering == Gathering::Center)
                .then(|| at_center(source, *object, transferred, frame, &mut gathered));
            objects.push(GpuTransferObject::new(context, source, (*object, transferred, frame), incident)?);
        }
        let count = end - first;
        let range = VertexRange { first, count, ..VertexRange::default() };
        let on = |light: &LightSample| match light.triangle() {
            NONE => NONE,
            triangle => geometry.triangles[triangle as usize].object,
        };
        let light_objects: Vec<u32> = lights.samples().iter().map(on).collect();
        let device = &context.device;
        Ok(Some(Self {
            objects,
            vertex_irradiance: storage(
                device,
                "irradiance of vertices",
                &vec![Vec4::ZERO; 2 * count as usize],
            )?,
            range: uniform(device, "range of vertices", bytemuck::bytes_of(&range)),
            light_objects: storage(device, "objects of lights", &light_objects)?,
            gathered,
        }))
    }

    /// How much there is.
    pub fn counts(&self) -> TransferCounts {
        let Gathered { ms: gather_ms, rays } = self.gathered;
        TransferCounts {
            objects: self.objects.len() as u32,
            vertices: self.objects.iter().map(|object| object.vertices).sum(),
            points: self.objects.iter().map(|object| object.points).sum(),
            rays,
            gather_ms,
        }
    }

    /// Triangles that it lights.
    pub fn triangles(&self) -> impl Iterator<Item = Range<u32>> + '_ {
        self.objects.iter().map(|object| object.triangles.clone())
    }
}

/// The light at the centre of an object.
fn at_center(
    source: LightSource,
    object: ObjectId,
    transferred: &Transferred,
    frame: &TransferFrame,
    gathered: &mut Gathered,
) -> Vec<Vec4> {
    let start = Instant::now();
    let tracer = SceneTracer::without(source.scene, source.geometry, object);
    let light = IncidentLight::new(
        &tracer,
        source.lights,
        source.visibility.map(|known| &**known),
        object,
        Clamp::Own,
    );
    let grid = Grid::new(source.geometry, &transferred.transfer, frame, Gathering::Center);
    let position = grid.positions().next().unwrap_or_default();
    let coefficients = light.at(position, frame, transferred.transfer.bands());
    gathered.rays += light.traced() as u64;
    gathered.ms += start.elapsed().as_secs_f64() * 1e3;
    coefficients.into_iter().map(|c| c.extend(0.0)).collect()
}

impl GpuTransferObject {
    /// `incident` is the light at its centre, where that was gathered already.
    fn new(
        context: &Context,
        source: LightSource,
        (object, transferred, frame): (ObjectId, &Transferred, &TransferFrame),
        incident: Option<Vec<Vec4>>,
    ) -> Result<Self> {
        let device = &context.device;
        let range = &source.geometry.objects[object.index()];
        let transfer = &transferred.transfer;
        let record = record(source, object, transferred, frame);
        let points = record.points.iter().product::<u32>();
        let coefficients = sh::coefficient_count(transfer.bands());
        let vectors = record.clusters * (record.bases + 1);
        let scratch = |label, size| -> Result<wgpu::Buffer> {
            check_bytes(device, label, size)?;
            let usage = wgpu::BufferUsages::STORAGE;
            let descriptor =
                wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            Ok(device.create_buffer(&descriptor))
        };
        let is_gathered = incident.is_some();
        let arrivals = if is_gathered { 1 } else { u64::from(points) * u64::from(BATCH) };
        let incident = incident.unwrap_or_else(|| vec![Vec4::ZERO; points as usize * coefficients]);
        Ok(Self {
            uniform: uniform(device, "object with transfer", bytemuck::bytes_of(&record)),
            data: transferred.data.clone(),
            incident: storage(device, "light about an object", &incident)?,
            arrivals: scratch("arriving light", arrivals * ARRIVAL_BYTES)?,
            projected: scratch("light of clusters", u64::from(points) * u64::from(vectors.max(1)) * 16)?,
            vectors,
            grid_points: points,
            points: if is_gathered { 0 } else { points },
            vertices: record.vertices * record.sides,
            triangles: range.triangles.clone(),
        })
    }
}

fn record(
    source: LightSource,
    object: ObjectId,
    transferred: &Transferred,
    frame: &TransferFrame,
) -> TransferObject {
    let LightSource { scene, geometry, .. } = source;
    let transfer = &transferred.transfer;
    let grid = Grid::new(geometry, transfer, frame, transferred.gathering);
    let world_from_box = grid.world_from_box;
    let [box_from_world_x, box_from_world_y, box_from_world_z] = rows(&world_from_box.inverse());
    let [world_from_box_x, world_from_box_y, world_from_box_z] = rows(&world_from_box);
    let direction = |axis| frame.transfer_from_world_direction.row(axis);
    let vertices = &geometry.objects[object.index()].vertices;
    TransferObject {
        box_from_world_x,
        box_from_world_y,
        box_from_world_z,
        world_from_box_x,
        world_from_box_y,
        world_from_box_z,
        transfer_from_world_x: direction(0),
        bands: transfer.bands(),
        transfer_from_world_y: direction(1),
        channels: transfer.channels() as u32,
        transfer_from_world_z: direction(2),
        index: object.0,
        points: [transferred.gathering.points(); 3],
        first_vertex: vertices.start,
        margin: margin(grid.size().as_vec3()),
        vertices: vertices.end - vertices.start,
        mover: mover_of(scene, object.index()),
        sides: transfer.sides() as u32,
        clusters: transfer.compressed().map_or(0, |c| (c.means.len() / c.length) as u32),
        bases: transfer.compressed().map_or(0, |c| c.bases_each as u32),
    }
}

/// The margin in units of a box of this size: the same length on all sides.
fn margin(size: Vec3) -> Vec3 {
    Vec3::splat(MARGIN * size.max_element()) / size
}

fn rows(affine: &DAffine3) -> [Vec4; 3] {
    [0, 1, 2].map(|axis| affine.matrix3.row(axis).extend(affine.translation[axis]).as_vec4())
}
