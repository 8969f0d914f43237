//! Solvers on the GPU by themselves: the first entries of many segments, for the stability table.

use super::layout::padded;
use super::pipelines::{compile, entry, filled_buffer, storage};
use super::{GpuRenderer, solver_source};
use crate::RenderError;
use crate::roots::Solver;
use crate::stability::{Segment, SolveSegments};
use bytemuck::{Pod, Zeroable};
use wgpu::{BindGroupEntry, BufferUsages};

/// `Segment` of `shaders/segments.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct SegmentRecord {
    lower: [f32; 4],
    upper: [f32; 4],
    start: [f32; 4],
    end: [f32; 4],
}

impl SolveSegments for GpuRenderer {
    fn first_entries(&mut self, solver: Solver, segments: &[Segment]) -> Result<Vec<Option<f32>>, RenderError> {
        // Fixed steps know no cells, and so no segments of them.
        let Some(solver) = solver_source(solver) else { return Ok(vec![None; segments.len()]) };
        let gpu = &self.gpu;
        let source = [&solver, include_str!("../../../shaders/segments.wgsl")].join("\n");
        let (layout, pipeline) = compile(gpu, "solve", &source, &[entry(0, storage(true)), entry(1, storage(false))]);
        let record = |s: &Segment| {
            let [a, b, c, d, e, f, g, h] = s.corners;
            SegmentRecord { lower: [a, b, c, d], upper: [e, f, g, h], start: padded(s.from), end: padded(s.to) }
        };
        let records: Vec<SegmentRecord> = segments.iter().map(record).collect();
        let input = filled_buffer(gpu, bytemuck::cast_slice(&records), BufferUsages::STORAGE);
        let size = segments.len() as u64 * 4;
        let buffer =
            |usage| gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("entries"), size, usage, mapped_at_creation: false });
        let (output, readback) =
            (buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC), buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST));
        let entries = [
            BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
        ];
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("solve"), layout: &layout, entries: &entries });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((segments.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, size);
        gpu.queue.submit([encoder.finish()]);
        let bytes = gpu.read_buffer(&readback, |bytes| bytes.to_vec())?;
        let answer = |b: &[u8; 4]| Some(f32::from_le_bytes(*b)).filter(|u| *u >= 0.0);
        Ok(bytes.as_chunks().0.iter().map(answer).collect())
    }
}
