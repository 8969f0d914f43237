//! Paths of light: what `shaders/path.wgsl` is given, and what is read back of it.
//!
//! A dispatch takes the paths of a batch of blocks so many vertices on that no operating system kills it and a cancelled picture stops soon; as
//! many follow as the samples of that batch need.

use super::blocks::{BLOCK_PIXELS, pixel_in_block};
use super::buffers::{bound, bound_textures, compile, entry, filled_buffer, storage, storage_buffer, texture_entries};
use super::device::{Gpu, GpuError};
use super::layout::NO_SOLID;
use super::plan::{Extras, VolumeOnGpu};
use super::shader::{Reads, link};
use super::stage::{StageParams, numbers, of_piece};
use super::{GpuRenderer, bindings};
use crate::RenderError;
use crate::studio::NotDrawn;
use crate::studio::accumulate::{BlockSums, GUIDES_OF_BLOCK, SUMS_OF_BLOCK};
use crate::studio::path::Stage;
use bregma_field::Progress;
use wgpu::{BindGroupEntry, BindingType, BufferUsages, SamplerBindingType};

/// Blocks whose paths are under way at once.
const BATCH: usize = 1024;

/// Bytes of `Path` of `shaders/path.wgsl`.
pub(super) const PATH_BYTES: usize = 96;

/// `BlockSums` of `shaders/path.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(super) struct SumsRecord {
    pub sums: [f32; SUMS_OF_BLOCK],
    pub pixel: [u32; 2],
    pub first: u32,
    pub count: u32,
}

/// Words before the numbers of `UnderWay` of `shaders/path.wgsl`: how many they are, and whether a driver has ended a loop.
const BEFORE_NUMBERS: usize = 2;

/// The pass that draws paths among volumes that are read so.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    reads: Vec<Reads>,
    numbers: Vec<(&'static str, f64)>,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// The WGSL of that pass.
pub(super) fn shader(volumes: &[Reads]) -> String {
    link("path", &[], volumes)
}

impl Pass {
    fn new(gpu: &Gpu, reads: Vec<Reads>, numbers: Vec<(&'static str, f64)>) -> Self {
        use bindings::{EXTRAS, PATHS, SAMPLER, SOLIDS, STAGE_PARAMS, STILL_UNDER_WAY, SUMS, TRACE_PARAMS, UNDER_WAY};
        let mut entries = [TRACE_PARAMS, EXTRAS, STAGE_PARAMS, UNDER_WAY].map(|binding| entry(binding, storage(true))).to_vec();
        entries.extend([PATHS, SUMS, STILL_UNDER_WAY].map(|binding| entry(binding, storage(false))));
        entries.extend(reads.iter().enumerate().flat_map(|(n, reads)| texture_entries(n, *reads, false)));
        if reads.iter().any(|reads| reads.is_cut) {
            entries.push(entry(SOLIDS, storage(true)));
        }
        if reads.iter().any(|reads| reads.in_layers) {
            entries.push(entry(SAMPLER, BindingType::Sampler(SamplerBindingType::NonFiltering)));
        }
        let (layout, pipeline) = compile(gpu, "draw", &shader(&reads), &numbers, &entries);
        Self { reads, numbers, layout, pipeline }
    }
}

impl GpuRenderer {
    /// Compiles the pass of a stage among volumes that are read so, if it is not yet.
    fn paths_pass(&mut self, reads: Vec<Reads>, stage: &Stage) -> Result<Pass, GpuError> {
        self.check_volumes(reads.len())?;
        let numbers = numbers(stage);
        if let Some(known) = self.pipelines.paths.iter().find(|pass| pass.reads == reads && pass.numbers == numbers) {
            return Ok(known.clone());
        }
        let pass = Pass::new(&self.gpu, reads, numbers);
        self.pipelines.paths.push(pass.clone());
        Ok(pass)
    }
}

/// A stage on the GPU.
#[derive(Debug)]
pub(crate) struct PathsOnGpu {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    /// By the parity of the dispatch: what one leaves to be gone on with, the next finds.
    groups: [wgpu::BindGroup; 2],
    paths: wgpu::Buffer,
    sums: wgpu::Buffer,
    sums_back: wgpu::Buffer,
    under_way: [wgpu::Buffer; 2],
    count_back: wgpu::Buffer,
}

impl PathsOnGpu {
    /// Brings what paths need to the GPU; nothing where no volume has a cell that they could meet.
    pub fn new(renderer: &mut GpuRenderer, stage: &Stage) -> Result<Option<Self>, GpuError> {
        let pieces: Vec<_> = stage.bone.pieces.iter().filter(|piece| !piece.surface.grid.is_flat()).collect();
        if pieces.is_empty() {
            return Ok(None);
        }
        let solids = renderer.solids(pieces.iter().map(|piece| piece.surface.solid.clone()).collect())?;
        let (places, solids) = (solids.map(|solids| solids.places.clone()), solids.map(|solids| solids.buffer.clone()));
        let (mut extras, mut params, mut volumes) = (Extras::default(), vec![], vec![]);
        for (number, piece) in pieces.iter().enumerate() {
            let solid = places.as_ref().map_or([NO_SOLID, 0, 0], |places| places[number]);
            params.push(of_piece(piece, stage.bone.normals, number, solid, &mut extras));
            let (samples, reads) = renderer.samples_of(&piece.surface)?;
            let (map, masks) = (renderer.map_texture(&piece.map, &piece.masks)?, renderer.mask_texture(&piece.masks)?);
            volumes.push(VolumeOnGpu { samples, reads, map, masks, light_spans: None });
        }
        // A buffer has at least one.
        extras.0.push([0.0; 4]);
        let Pass { layout, pipeline, .. } = renderer.paths_pass(volumes.iter().map(|volume| volume.reads).collect(), stage)?;
        let gpu = renderer.gpu.clone();
        let buffer = |bytes: usize| storage_buffer(&gpu, bytes as u64);
        let paths = buffer(BATCH * BLOCK_PIXELS * PATH_BYTES);
        let sums = buffer(BATCH * size_of::<SumsRecord>());
        let under_way = [(); 2].map(|()| buffer((BEFORE_NUMBERS + BATCH * BLOCK_PIXELS) * size_of::<u32>()));
        let read = |bytes: &[u8]| filled_buffer(&gpu, bytes, BufferUsages::STORAGE);
        let (params, extras) = (read(bytemuck::cast_slice(&params)), read(bytemuck::cast_slice(&extras.0)));
        let stage_params = read(bytemuck::bytes_of(&StageParams::new(stage)));
        let views: Vec<_> = volumes.iter().map(VolumeOnGpu::views).collect();
        let mut entries: Vec<BindGroupEntry<'_>> = views.iter().enumerate().flat_map(|(n, views)| bound_textures(n, views)).collect();
        entries.extend([
            bound(bindings::TRACE_PARAMS, params.as_entire_binding()),
            bound(bindings::EXTRAS, extras.as_entire_binding()),
            bound(bindings::STAGE_PARAMS, stage_params.as_entire_binding()),
            bound(bindings::PATHS, paths.as_entire_binding()),
            bound(bindings::SUMS, sums.as_entire_binding()),
        ]);
        if let Some(solids) = &solids {
            entries.push(bound(bindings::SOLIDS, solids.as_entire_binding()));
        }
        if volumes.iter().any(|volume| volume.reads.in_layers) {
            entries.push(bound(bindings::SAMPLER, wgpu::BindingResource::Sampler(&renderer.pipelines.nearest)));
        }
        let groups = [[0, 1], [1, 0]].map(|[found, left]: [usize; 2]| {
            let lists = [
                bound(bindings::UNDER_WAY, under_way[found].as_entire_binding()),
                bound(bindings::STILL_UNDER_WAY, under_way[left].as_entire_binding()),
            ];
            let entries = &[entries.as_slice(), &lists].concat();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("paths"), layout: &layout, entries })
        });
        let sums_back = readback_buffer(&gpu, sums.size());
        let count_back = readback_buffer(&gpu, (BEFORE_NUMBERS * size_of::<u32>()) as u64);
        drop(entries);
        Ok(Some(Self { pipeline, groups, paths, sums, sums_back, under_way, count_back, gpu }))
    }

    /// Draws samples up to number `until` of each pixel of blocks, which begin at these pixels, in a picture of a size. Stopped by request, blocks have
    /// all of these or none.
    pub fn draw(&self, size: [u32; 2], blocks: &mut [([u32; 2], &mut BlockSums)], until: u32, progress: &Progress) -> Result<(), NotDrawn> {
        for batch in blocks.chunks_mut(BATCH) {
            let mut words: Vec<u32> = vec![];
            for ([x, y], block) in batch.iter() {
                let sums = block.halves.as_flattened().as_flattened().iter().chain(block.guides.as_flattened());
                words.extend(sums.map(|v| v.to_bits()));
                words.extend([*x, *y, block.samples, until - block.samples]);
            }
            // Pixels beyond the picture have no path.
            let is_pixel = |n: usize| {
                let ([x, y], [dx, dy]) = (batch[n / BLOCK_PIXELS].0, pixel_in_block((n % BLOCK_PIXELS) as u32));
                x + dx < size[0] && y + dy < size[1]
            };
            let numbers: Vec<u32> = (0..batch.len() * BLOCK_PIXELS).filter(|n| is_pixel(*n)).map(|n| n as u32).collect();
            let count = numbers.len() as u32;
            let queue = &self.gpu.queue;
            queue.write_buffer(&self.sums, 0, bytemuck::cast_slice(&words));
            queue.write_buffer(&self.under_way[0], 0, bytemuck::cast_slice(&[&[count, 0], numbers.as_slice()].concat()));
            self.go_on(count, progress)?;
            self.read(batch, until)?;
        }
        Ok(())
    }

    /// Dispatches until none of so many pixels of a batch is under way.
    fn go_on(&self, mut count: u32, progress: &Progress) -> Result<(), NotDrawn> {
        for number in 0.. {
            progress.advance(0)?;
            let (group, left) = (&self.groups[number % 2], &self.under_way[(number + 1) % 2]);
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            if number == 0 {
                encoder.clear_buffer(&self.paths, 0, None);
            }
            encoder.clear_buffer(left, 0, Some(self.count_back.size()));
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(count.div_ceil(BLOCK_PIXELS as u32), 1, 1);
            drop(pass);
            encoder.copy_buffer_to_buffer(left, 0, &self.count_back, 0, self.count_back.size());
            self.gpu.queue.submit([encoder.finish()]);
            let read = |bytes: &[u8]| bytemuck::pod_read_unaligned::<[u32; BEFORE_NUMBERS]>(bytes);
            let [still, unfinished] = self.gpu.read_buffer(&self.count_back, read).map_err(RenderError::from)?;
            if unfinished > 0 {
                return Err(RenderError::from(GpuError::Unfinished { adapter: self.gpu.info.name.clone() }).into());
            }
            if still == 0 {
                break;
            }
            count = still;
        }
        Ok(())
    }

    /// Reads the sums of a batch back, which then has `until` samples.
    fn read(&self, batch: &mut [([u32; 2], &mut BlockSums)], until: u32) -> Result<(), RenderError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let used = (batch.len() * size_of::<SumsRecord>()) as u64;
        encoder.copy_buffer_to_buffer(&self.sums, 0, &self.sums_back, 0, used);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.read_buffer(&self.sums_back, |bytes| {
            let numbers: &[f32] = bytemuck::cast_slice(&bytes[..used as usize]);
            for ((_, block), numbers) in batch.iter_mut().zip(numbers.chunks_exact(size_of::<SumsRecord>() / size_of::<f32>())) {
                let (halves, guides) = numbers[..SUMS_OF_BLOCK].split_at(GUIDES_OF_BLOCK);
                block.halves.as_flattened_mut().as_flattened_mut().copy_from_slice(halves);
                block.guides.as_flattened_mut().copy_from_slice(guides);
                block.samples = until;
            }
        })?;
        Ok(())
    }
}

fn readback_buffer(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
    gpu.device.create_buffer(&wgpu::BufferDescriptor { label: Some("read back"), size, usage, mapped_at_creation: false })
}

#[cfg(test)]
mod tests {
    use super::super::buffers::hit_buffer;
    use super::*;
    use crate::lanes::LANES;
    use crate::studio::sampling::{Words, key, pair};
    use fearless_simd::prelude::*;
    use fearless_simd::{Level, dispatch};

    /// A pass that writes the numbers of some keys as they are, and what the second half of their pixel's would be.
    const NUMBERS: &str = "
        @group(0) @binding(0) var<storage, read> asked: array<vec4<u32>>;
        @group(0) @binding(1) var<storage, read_write> told: array<vec4<u32>>;
        @compute @workgroup_size(BLOCK_PIXELS)
        fn numbers(@builtin(global_invocation_id) id: vec3<u32>) {
            let it = asked[id.x];
            let of_path = key(it.x, it.y, it.z & 1u);
            let found = pair(of_path, it.z >> 1u, it.w);
            told[id.x] = vec4<u32>(of_path, bitcast<vec2<u32>>(found), 0u);
        }";

    #[test]
    fn random_numbers_are_the_processors_to_the_bit() {
        // Fails if a constant, a shift or an order is another: both would draw other noise, and could not be told from one that is wrong.
        let renderer = GpuRenderer::new(true).unwrap();
        let gpu = &renderer.gpu;
        let mut r = bregma_synthetic::Random(3);
        let mut word = |most: f64| (r.unit() * most) as u32;
        let asked: Vec<[u32; 4]> = (0..1 << 14).map(|_| [word(4e9), word(4e9), word(1e6), word(4000.0)]).collect();
        let source = link("sampling", &[], &[]) + NUMBERS;
        let (layout, pipeline) = compile(gpu, "numbers", &source, &[], &[entry(0, storage(true)), entry(1, storage(false))]);
        let input = filled_buffer(gpu, bytemuck::cast_slice(&asked), BufferUsages::STORAGE);
        let output = hit_buffer(gpu, asked.len());
        let entries = [bound(0, input.as_entire_binding()), bound(1, output.as_entire_binding())];
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("numbers"), layout: &layout, entries: &entries });
        let back = readback_buffer(gpu, output.size());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((asked.len() / BLOCK_PIXELS) as u32, 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&output, 0, &back, 0, output.size());
        gpu.queue.submit([encoder.finish()]);
        let told = gpu.read_buffer(&back, |bytes| bytemuck::cast_slice::<u8, [u32; 4]>(bytes).to_vec()).unwrap();
        for (n, ([pixel, seed, number, dimension], told)) in asked.iter().zip(told).enumerate() {
            let of_path = key(*pixel, *seed, number & 1);
            let numbers = dispatch!(Level::new(), simd => {
                let [x, y] = pair(Words::splat(simd, of_path), Words::from_slice(simd, &[number >> 1; LANES]), *dimension);
                [x[0].to_bits(), y[0].to_bits()]
            });
            assert_eq!([of_path, numbers[0], numbers[1]], told[..3], "number {n}: {:?}", asked[n]);
        }
    }
}
