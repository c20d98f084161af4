//! GPU timestamps of passes, where the device has them.

use std::cell::RefCell;
use std::collections::BTreeMap;

/// Passes that one frame can time; later ones go untimed.
const CAPACITY: u32 = 1024;

/// Collects the duration of each pass under a name; passes of one name add up.
pub(crate) struct Timers {
    /// Whether passes are timed from now on.
    pub on: bool,
    set: Option<wgpu::QuerySet>,
    names: RefCell<Vec<&'static str>>,
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
        Self { on: false, set, names: RefCell::new(Vec::new()), period_ns: queue.get_timestamp_period() }
    }

    fn next(&self, name: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        let mut names = self.names.borrow_mut();
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
        self.names.borrow_mut().clear();
    }

    /// Records the read-back of all timestamps: a buffer to map, if there are any.
    pub fn resolve(&self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) -> Option<wgpu::Buffer> {
        let count = 2 * self.names.borrow().len() as u32;
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
        Some(readable)
    }

    /// Milliseconds by name.
    pub fn sums(&self, ticks: &[u64]) -> BTreeMap<&'static str, f64> {
        let mut sums = BTreeMap::new();
        for (&name, pair) in self.names.borrow().iter().zip(ticks.chunks_exact(2)) {
            let elapsed = pair[1].saturating_sub(pair[0]) as f64;
            *sums.entry(name).or_insert(0.0) += elapsed * f64::from(self.period_ns) * 1e-6;
        }
        sums
    }
}
