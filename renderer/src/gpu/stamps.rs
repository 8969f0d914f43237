//! How long a pass takes by the card's own clock, where the adapter has one that can be read.

use super::GpuError;
use super::device::Gpu;
use wgpu::{BufferUsages, CommandEncoder, ComputePassTimestampWrites, Features, QuerySet, QueryType};

/// The times at which a pass begins and ends.
pub(super) struct Stamps {
    set: QuerySet,
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
}

/// Two times of 64 bits.
const BYTES: u64 = 16;

impl Stamps {
    /// `None` where the adapter has no such clock.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device.features().contains(Features::TIMESTAMP_QUERY) {
            return None;
        }
        let set = gpu.device.create_query_set(&wgpu::QuerySetDescriptor { label: Some("stamps"), ty: QueryType::Timestamp, count: 2 });
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("stamps"), size: BYTES, usage, mapped_at_creation: false })
        };
        let resolved = buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC);
        Some(Self { set, resolved, readback: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST) })
    }

    /// What a pass is begun with.
    pub fn writes(&self) -> ComputePassTimestampWrites<'_> {
        ComputePassTimestampWrites { query_set: &self.set, beginning_of_pass_write_index: Some(0), end_of_pass_write_index: Some(1) }
    }

    /// Asks for the times of the pass that ended.
    pub fn resolve(&self, encoder: &mut CommandEncoder) {
        encoder.resolve_query_set(&self.set, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readback, 0, BYTES);
    }

    /// Waits for the pass; seconds.
    pub fn seconds(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        let ticks = gpu.read_buffer(&self.readback, |bytes| {
            let at = |n: usize| bytes.chunks_exact(8).nth(n).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes);
            at(1).saturating_sub(at(0))
        })?;
        Ok(ticks as f64 * f64::from(gpu.queue.get_timestamp_period()) * 1e-9)
    }
}
