//! Precomputed radiance transfer: the light about an object, what it makes of that at its vertices, and from there at pixels (Barczak
//! §4.4).

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, MapsView, batches};
use crate::device::kernel::{Groups, Kernel, buffer, texture};
use crate::device::recorder::Recorder;
use crate::gpu_scene::lights::GpuLights;
use crate::gpu_scene::previous_transforms::GpuPreviousTransforms;
use crate::gpu_scene::transfer::GpuTransfer;
use crate::shader_constants::{BATCH, GROUPS_PER_ROW, WORKGROUP};
use crate::shaders;

pub(crate) struct Transfer {
    arrive: Kernel,
    project: Kernel,
    light_vertices: Kernel,
    /// For vectors that are compressed: clusters first, then vertices.
    compressed: [Kernel; 2],
    interpolate: Kernel,
    /// The same, where kernels store the radiance of samples.
    interpolate_radiance: Kernel,
}

/// What vertices receive that are lit by transfer.
#[derive(Clone, Copy)]
pub(crate) struct LitVertices<'a> {
    irradiance: &'a wgpu::Buffer,
    range: &'a wgpu::Buffer,
}

impl Transfer {
    pub fn new(compiler: &Compiler) -> Self {
        Self {
            arrive: compiler.kernel(&shaders::INCIDENT_LIGHT, "arrive"),
            project: compiler.kernel(&shaders::INCIDENT_LIGHT, "project_arrivals"),
            light_vertices: compiler.kernel(&shaders::TRANSFER_VERTICES, "light_vertices"),
            compressed: ["light_clusters", "light_compressed_vertices"]
                .map(|entry| compiler.kernel(&shaders::TRANSFER_VERTICES, entry)),
            interpolate: compiler.kernel(&shaders::TRANSFER, "interpolate_transfer"),
            interpolate_radiance: Compiler { writes_radiance: true, ..*compiler }
                .kernel(&shaders::TRANSFER, "interpolate_transfer"),
        }
    }

    /// Lights the vertices of all objects. Shadow maps that are stale have the objects in their `old` places.
    pub fn record<'a>(
        &self,
        recorder: &mut Recorder,
        whole: &BandSample,
        maps: MapsView,
        (lights, old): (&GpuLights, &GpuPreviousTransforms),
        transfer: &'a GpuTransfer,
    ) -> LitVertices<'a> {
        let lit = LitVertices { irradiance: &transfer.vertex_irradiance, range: &transfer.range };
        for object in &transfer.objects {
            for batch in batches(lights.count(), BATCH).filter(|_| object.points > 0) {
                let (band, old) = (whole.with_batch(batch), old.batch(batch.first));
                let resources = [
                    texture("atlas", maps.atlas),
                    buffer("maps", maps.maps),
                    ("lights", wgpu::BindingResource::Buffer(lights.batch(batch.first))),
                    buffer("object", &object.uniform),
                    buffer("light_objects", &transfer.light_objects),
                    buffer("incident", &object.incident),
                    buffer("arrivals", &object.arrivals),
                    buffer("previous_transforms", old.places),
                    ("previous_rows", wgpu::BindingResource::Buffer(old.rows)),
                ];
                let groups = Groups::Count([(batch.end - batch.first).div_ceil(WORKGROUP), object.points]);
                self.arrive.record(recorder, band.groups(), "incident_light_gpu_ms", &resources, groups);
                let groups = Groups::Count([1, object.points]);
                self.project.record(recorder, band.groups(), "incident_light_gpu_ms", &resources, groups);
            }
            let resources = [
                buffer("object", &object.uniform),
                buffer("transfer", &object.data),
                buffer("incident", &object.incident),
                buffer("vertex_irradiance", lit.irradiance),
                buffer("range", lit.range),
                buffer("projected", &object.projected),
            ];
            let [light_clusters, light_compressed] = &self.compressed;
            let time = "transfer_vertices_gpu_ms";
            if object.vectors > 0 {
                let groups = Groups::Count([object.vectors.div_ceil(WORKGROUP), object.grid_points]);
                light_clusters.record(recorder, whole.groups(), time, &resources, groups);
            }
            let kernel = if object.vectors > 0 { light_compressed } else { &self.light_vertices };
            let groups = object.vertices.div_ceil(WORKGROUP);
            let groups = Groups::Count([groups.min(GROUPS_PER_ROW), groups.div_ceil(GROUPS_PER_ROW)]);
            kernel.record(recorder, whole.groups(), time, &resources, groups);
        }
        lit
    }

    /// Puts what pixels receive that show these objects into a grid of all pixels, where other passes left them out; or their radiance
    /// into the picture.
    pub fn put(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        (lit, as_radiance): (LitVertices, bool),
        grid: GridView,
    ) {
        let resources = [
            texture("triangle_ids", seen.triangle_ids),
            texture("mirror_hits", seen.ends()),
            buffer("vertex_irradiance", lit.irradiance),
            buffer("range", lit.range),
            texture("fine_irradiance", grid.irradiance),
            texture("fine_directional", grid.directional),
            buffer("partial_sums", &band.targets.partial_sums),
            texture("picture", &band.targets.picture_view),
        ];
        let groups = Groups::tiles(band.grid_size(1));
        let kernel = if as_radiance { &self.interpolate_radiance } else { &self.interpolate };
        kernel.record(recorder, band.groups(), "transfer_gpu_ms", &resources, groups);
    }
}
