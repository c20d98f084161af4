//! A storage buffer of words with its copy on this side: what is set to something else is written to the device.

use crate::Result;
use crate::device::buffers::storage;
use std::ops::Range;

pub(crate) struct Mirror {
    words: Vec<u32>,
    pub buffer: wgpu::Buffer,
    /// What differs on the device.
    stale: Option<Range<usize>>,
}

impl Mirror {
    /// With these contents, and zeros up to `room` words.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limit.
    pub fn new(device: &wgpu::Device, label: &str, mut words: Vec<u32>, room: usize) -> Result<Self> {
        words.resize(words.len().max(room), 0);
        Ok(Self { buffer: storage(device, label, &words)?, words, stale: None })
    }

    pub fn room(&self) -> usize {
        self.words.len()
    }

    /// Changes words from `at` on.
    pub fn set(&mut self, at: usize, words: &[u32]) {
        let before = &mut self.words[at..at + words.len()];
        let differ = |(a, b): (&u32, &u32)| a != b;
        if let Some(first) = before.iter().zip(words).position(differ) {
            let last = before.iter().zip(words).rposition(differ).unwrap_or(first);
            before[first..=last].copy_from_slice(&words[first..=last]);
            let (start, end) = (at + first, at + last + 1);
            self.stale = Some(match &self.stale {
                Some(stale) => stale.start.min(start)..stale.end.max(end),
                None => start..end,
            });
        }
    }

    /// Writes what was changed.
    pub fn flush(&mut self, queue: &wgpu::Queue) {
        if let Some(stale) = self.stale.take() {
            let words = bytemuck::cast_slice(&self.words[stale.clone()]);
            queue.write_buffer(&self.buffer, stale.start as u64 * 4, words);
        }
    }
}
