//! Solvers on the GPU by themselves: what they make of many segments, for the stability table.

use super::buffers::{bound, compile, entry, filled_buffer, storage, volume_texture};
use super::layout::padded;
use super::shader::link;
use super::{GpuRenderer, bindings, solver_module, upload};
use crate::RenderError;
use crate::roots::Solver;
use crate::stability::{Segment, SolveSegments, Solved};
use bytemuck::{Pod, Zeroable};
use wgpu::{BindingType, BufferUsages, SamplerBindingType, TextureSampleType, TextureViewDimension};

/// `Segment` of `shaders/segments.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct SegmentRecord {
    lower: [f32; 4],
    upper: [f32; 4],
    start: [f32; 4],
    end: [f32; 4],
}

/// `Solved` of `shaders/segments.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct SolvedRecord {
    entry: f32,
    entries: u32,
}

impl SolveSegments for GpuRenderer {
    fn solve(&mut self, solver: Solver, segments: &[Segment]) -> Result<Vec<Solved>, RenderError> {
        let gpu = &self.gpu;
        let is_filter = solver == Solver::Filter;
        let mut entries = vec![entry(bindings::SEGMENTS, storage(true)), entry(bindings::SOLVED, storage(false))];
        if is_filter {
            let cells = volume_texture(TextureSampleType::Float { filterable: true }, TextureViewDimension::D3);
            entries.push(entry(bindings::SEGMENT_CELLS, cells));
            entries.push(entry(bindings::SAMPLER, BindingType::Sampler(SamplerBindingType::Filtering)));
        }
        let (file, numbers) = solver_module(solver);
        let entry_of = if is_filter { "filter_segments" } else { "corner_segments" };
        let source = link("segments", &[("segment_entry", entry_of), ("solver", file)], &[]);
        let (layout, pipeline) = compile(gpu, "solve", &source, &numbers, &entries);
        let record = |s: &Segment| {
            let [a, b, c, d, e, f, g, h] = s.corners;
            SegmentRecord { lower: [a, b, c, d], upper: [e, f, g, h], start: padded(s.from), end: padded(s.to) }
        };
        let records: Vec<SegmentRecord> = segments.iter().map(record).collect();
        let input = filled_buffer(gpu, bytemuck::cast_slice(&records), BufferUsages::STORAGE);
        let size = (segments.len() * size_of::<SolvedRecord>()) as u64;
        let buffer =
            |usage| gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("solved"), size, usage, mapped_at_creation: false });
        let (output, readback) =
            (buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC), buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST));
        let mut entries = vec![bound(bindings::SEGMENTS, input.as_entire_binding()), bound(bindings::SOLVED, output.as_entire_binding())];
        let blocks = if is_filter { Some(self.blocks(segments)?) } else { None };
        if let Some(blocks) = &blocks {
            entries.push(bound(bindings::SEGMENT_CELLS, wgpu::BindingResource::TextureView(blocks)));
            entries.push(bound(bindings::SAMPLER, wgpu::BindingResource::Sampler(&self.pipelines.filter)));
        }
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("solve"), layout: &layout, entries: &entries });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((segments.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, size);
        gpu.queue.submit([encoder.finish()]);
        let answer = |r: &SolvedRecord| Solved { entry: Some(r.entry).filter(|u| *u >= 0.0), entries: r.entries };
        Ok(gpu.read_buffer(&readback, |bytes| bytemuck::cast_slice(bytes).iter().map(answer).collect())?)
    }
}

impl GpuRenderer {
    /// The corners of all cells as blocks of 2×2×2 samples of a texture that the hardware filters, i fastest.
    fn blocks(&self, segments: &[Segment]) -> Result<wgpu::TextureView, RenderError> {
        let count = (1..).find(|n: &usize| n.pow(3) >= segments.len()).unwrap_or(1);
        let side = 2 * count;
        let mut samples = vec![0.0_f32; side.pow(3)];
        for (n, s) in segments.iter().enumerate() {
            let [x, y, z] = [n % count, n / count % count, n / (count * count)].map(|b| 2 * b);
            for (c, value) in s.corners.iter().enumerate() {
                samples[((z + (c >> 2)) * side + y + (c >> 1 & 1)) * side + x + (c & 1)] = *value;
            }
        }
        let texture = upload::upload(&self.gpu, &upload::Shape::of_f32([side; 3]), bytemuck::cast_slice(&samples))?;
        Ok(texture.create_view(&Default::default()))
    }
}
