//! GPU timestamps of passes, where the device has them.

use super::readback;
use crate::Result;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Passes that one frame can time; later ones go untimed.
const CAPACITY: u32 = 1024;

/// Collects the duration of each pass under a name; passes of one name add up.
pub(crate) struct Timers {
    /// Whether passes are timed from now on.
    pub on: bool,
    set: Option<wgpu::QuerySet>,
    names: Mutex<Vec<&'static str>>,
    period_ns: f32,
}

impl Timers {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let set = device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| {
            device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timers"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * CAPACITY,
            })
        });
        Self { on: false, set, names: Mutex::new(Vec::new()), period_ns: queue.get_timestamp_period() }
    }

    /// Those of passes that nobody times.
    pub fn none() -> Self {
        Self { on: false, set: None, names: Mutex::default(), period_ns: 0.0 }
    }

    fn names(&self) -> MutexGuard<'_, Vec<&'static str>> {
        self.names.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn next(&self, name: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        let mut names = self.names();
        let set = self.set.as_ref().filter(|_| self.on && (names.len() as u32) < CAPACITY)?;
        names.push(name);
        Some((set, names.len() as u32 - 1))
    }

    pub fn compute(&self, name: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.next(name).map(|(query_set, i)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(2 * i),
            end_of_pass_write_index: Some(2 * i + 1),
        })
    }

    pub fn render(&self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.next(name).map(|(query_set, i)| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(2 * i),
            end_of_pass_write_index: Some(2 * i + 1),
        })
    }

    /// Forgets what was timed so far.
    pub fn reset(&self) {
        self.names().clear();
    }

    /// Records the read-back of all timestamps, if there are any.
    pub fn resolve(&self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) -> Option<Timestamps> {
        let names = self.names().clone();
        let count = 2 * names.len() as u32;
        let set = self.set.as_ref().filter(|_| count > 0)?;
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: u64::from(count) * 8,
                usage,
                mapped_at_creation: false,
            })
        };
        let resolved = buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC);
        let readable = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        encoder.resolve_query_set(set, 0..count, &resolved, 0);
        encoder.copy_buffer_to_buffer(&resolved, 0, &readable, 0, u64::from(count) * 8);
        Some(Timestamps { buffer: readable, names, period_ns: self.period_ns })
    }
}

/// Timestamps on their way back.
pub(crate) struct Timestamps {
    buffer: wgpu::Buffer,
    names: Vec<&'static str>,
    period_ns: f32,
}

impl Timestamps {
    /// Milliseconds by name.
    pub async fn sums(self) -> Result<BTreeMap<&'static str, f64>> {
        let bytes = readback::bytes(&self.buffer).await?;
        let ticks = bytemuck::pod_collect_to_vec::<u8, u64>(&bytes);
        let mut sums = BTreeMap::new();
        for (&name, pair) in self.names.iter().zip(ticks.chunks_exact(2)) {
            let elapsed = pair[1].saturating_sub(pair[0]) as f64;
            *sums.entry(name).or_insert(0.0) += elapsed * f64::from(self.period_ns) * 1e-6;
        }
        Ok(sums)
    }
}
