//! The pass that goes on behind the first surface, through all volumes at once. WGSL has neither modules nor arrays of textures, so each volume
//! has its own copy of what walks through it, by names of its own.

use super::blocks::{BLOCK_PIXELS, pixel_in_block};
use super::device::{Gpu, GpuError};
use super::layout::Block;
use super::pipelines::{
    HIT_BYTES, bound, compile, entry, filled_buffer, hit_buffer, numbers, part, samples_binding, samples_view, storage,
};
use super::plan::Plan;
use super::{GpuRenderer, Parts, Projection, Reads, wgsl};
use crate::frame::Frame;
use crate::roots::{Method, Solver};
use crate::scene::{Integrator, Mode, Picture, Scene};
use crate::tone::Gathered;
use std::collections::HashSet;
use wgpu::{BindGroupEntry, BindingType, BufferUsages, SamplerBindingType, TextureFormat, TextureViewDimension};

/// What is done along the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gather {
    Shells { shadows: bool },
    Steps,
    Exact,
}

impl Gather {
    /// What a scene asks for.
    pub fn of(scene: &Scene) -> Self {
        match scene.integrator {
            _ if scene.is_transparent() => Self::Shells { shadows: scene.shadows },
            Integrator::Steps { .. } => Self::Steps,
            Integrator::Exact => Self::Exact,
        }
    }
}

/// Bindings of a volume; those of the next begin so much later.
const BINDINGS: u32 = 16;

/// The WGSL of a pass over volumes that are read so.
pub(super) fn source(volumes: &[Reads], gather: Gather) -> String {
    let each = volumes.iter().enumerate().map(|(n, reads)| own(&layer_source(*reads), n));
    let (integrate, begin, enough, shared) = match gather {
        Gather::Shells { shadows: true } => (wgsl!("shells"), "", "0.95", "const SHADOWS = true;"),
        Gather::Shells { shadows: false } => (wgsl!("shells"), "", "0.95", "const SHADOWS = false;"),
        Gather::Steps => (wgsl!("dvr_steps"), STEPS, "0.99", wgsl!("dvr")),
        Gather::Exact => (wgsl!("dvr_exact"), "", "0.9999", wgsl!("dvr")),
    };
    let march = wgsl!("march").replace("//BEGIN", begin).replace("//INTEGRATE", integrate).replace("ENOUGH", enough);
    let march = for_each(&march, volumes.len());
    each.chain([wgsl!("light").to_owned(), march, shared.to_owned()]).collect::<Vec<_>>().join("\n")
}

/// Where the first step lies.
const STEPS: &str = "let step_depth = params.step_mm / mm_per_depth;
    let first_step = select(0.5, noise_at(pixel), params.jitter == 1u) * step_depth;
    var step_number = 0.0;";

/// What walks through a volume.
fn layer_source(reads: Reads) -> String {
    let samples = if reads.in_layers { wgsl!("samples") } else { wgsl!("samples_3d") };
    let parts = [
        wgsl!("line"),
        &samples.replace("SAMPLE", reads.component),
        wgsl!("interpolant"),
        wgsl!("bernstein"),
        wgsl!("cubic"),
        wgsl!("exact"),
        wgsl!("gradient"),
        wgsl!("corner_cells"),
        wgsl!("cells"),
        wgsl!("walk"),
        wgsl!("cuts"),
        wgsl!("blocks"),
        wgsl!("nearest"),
        wgsl!("trace"),
        wgsl!("shadows"),
        wgsl!("pieces"),
        wgsl!("traveller"),
    ];
    let all = parts.join("\n");
    // The passes of trace.wgsl are others.
    all.replace("@compute @workgroup_size(64)\n", "")
        .replace("@builtin(workgroup_id) ", "")
        .replace("@builtin(local_invocation_index) ", "")
}

/// Gives everything that `source` declares, and its bindings, names and numbers of layer `n`'s own.
fn own(source: &str, n: usize) -> String {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let declared = |line: &str| -> Option<String> {
        let line = line.split_once(") var<").map_or(line, |(_, var)| var);
        let line = line.strip_prefix("var<").unwrap_or(line);
        let start = ["fn ", "struct ", "const ", "private> ", "storage, read> ", "storage, read_write> "];
        let name = start.iter().find_map(|s| line.strip_prefix(s)).or_else(|| line.split_once(") var ").map(|(_, name)| name))?;
        let name: String = name.chars().take_while(|c| word(*c)).collect();
        (!name.is_empty()).then_some(name)
    };
    let names: HashSet<String> = source.lines().filter_map(declared).collect();
    let mut result = String::with_capacity(source.len() * 5 / 4);
    for line in source.lines() {
        let code = line.split("//").next().unwrap_or_default();
        let mut rest = code;
        while let Some(start) = rest.find(word) {
            let (before, from) = rest.split_at(start);
            let end = from.find(|c| !word(c)).unwrap_or(from.len());
            let (name, after) = from.split_at(end);
            result.push_str(before);
            result.push_str(name);
            if names.contains(name) {
                result.push_str(&format!("_{n}"));
            }
            rest = after;
            // A binding's number stands between parentheses.
            let number = after.strip_prefix('(').filter(|_| name == "binding").and_then(|after| after.split_once(')'));
            if let Some((number, behind)) = number.and_then(|(number, behind)| Some((number.parse::<u32>().ok()?, behind))) {
                result.push_str(&format!("({})", number + BINDINGS * (n as u32 + 1)));
                rest = behind;
            }
        }
        result.push_str(rest);
        result.push('\n');
    }
    result
}

/// Repeats what stands between `//EACH` and `//END` for each of `count` volumes.
fn for_each(source: &str, count: usize) -> String {
    let mut result = String::new();
    let mut each: Option<String> = None;
    for line in source.lines() {
        match (line.trim(), &mut each) {
            ("//EACH", _) => each = Some(String::new()),
            ("//END", Some(text)) => {
                (0..count).for_each(|n| result.push_str(&text.replace("LAYER", &n.to_string())));
                each = None;
            }
            (_, Some(text)) => {
                text.push_str(line);
                text.push('\n');
            }
            _ => {
                result.push_str(line);
                result.push('\n');
            }
        }
    }
    result
}

/// A pass through volumes that are read so.
#[derive(Debug)]
pub(super) struct March {
    reads: Vec<Reads>,
    gather: Gather,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl March {
    fn new(gpu: &Gpu, reads: Vec<Reads>, gather: Gather) -> Self {
        let mut entries = vec![entry(0, storage(true)), entry(4, storage(false))];
        for (n, reads) in reads.iter().enumerate() {
            let first = BINDINGS * (n as u32 + 1);
            entries.extend([0, 6, 9].map(|binding| entry(first + binding, storage(true))));
            entries.push(entry(first + 1, samples_binding(*reads, false)));
            entries.push(entry(first + 2, numbers(TextureFormat::Rg32Uint, TextureViewDimension::D3)));
            entries.push(entry(first + 5, numbers(TextureFormat::R32Uint, TextureViewDimension::D2)));
            if reads.in_layers {
                entries.push(entry(first + 4, BindingType::Sampler(SamplerBindingType::NonFiltering)));
            }
        }
        let (layout, pipeline) = compile(gpu, "march", &source(&reads, gather), &entries);
        Self { reads, gather, layout, pipeline }
    }
}

/// What a ray says that a driver has ended: `UNFINISHED` of `shaders/march.wgsl`.
const UNFINISHED: u32 = 2;

/// What a pixel is read as: of a march its colour, depth, volume and whether there is anything; of a projection what is gathered.
type Record = [u32; 4];
const _: () = assert!(size_of::<Record>() as u64 == HIT_BYTES);

/// Where a pixel of a picture is.
struct Place {
    x: u32,
    y: u32,
    at: usize,
}

/// Calls `put` for each pixel of some blocks that lies in a picture.
fn for_pixels(blocks: &[[u32; 2]], records: &[Record], width: u32, height: u32, mut put: impl FnMut(Place, &Record)) {
    for ([x0, y0], records) in blocks.iter().zip(records.chunks_exact(BLOCK_PIXELS)) {
        for (n, record) in (0..).zip(records) {
            let [dx, dy] = pixel_in_block(n);
            let (x, y) = (x0 + dx, y0 + dy);
            if x < width && y < height {
                put(Place { x, y, at: (y * width + x) as usize }, record);
            }
        }
    }
}

impl GpuRenderer {
    /// What each layer gives for each pixel of a projection, pixel by pixel.
    pub(super) fn project(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Vec<Gathered>, GpuError> {
        let count = frame.layers.len();
        let mut gathered = vec![[f32::NAN; 2]; width as usize * height as usize * count];
        let passes: Vec<usize> = (0..count).filter(|&n| !frame.layers[n].surface.grid.is_flat()).collect();
        let plan = self.plan(frame, scene, width, height, count)?;
        let parts = Parts::Project(Projection { is_max: scene.mode == Mode::Max, of_gradient: scene.of_gradient });
        let (hits, back) = (hit_buffer(&self.gpu, &plan, count), readback(&self.gpu, &plan));
        for blocks in plan.batches() {
            for (own, &layer) in plan.trace.iter().enumerate().zip(&passes) {
                let number = self.pipelines.trace(&self.gpu, plan.volumes[own.0].reads, Method::Solver(Solver::Exact), parts);
                let group = self.pipelines.trace_group(&self.gpu, number, &plan, own, &blocks, (&hits, None));
                let pipeline = &self.pipelines.trace[number].pipeline;
                let first = u64::from(plan.shade.stride) * own.0 as u64 * HIT_BYTES;
                read_records(&self.gpu, pipeline, &group, blocks.len(), (&hits, first), &back, |records| {
                    for_pixels(&plan.blocks[blocks.clone()], records, width, height, |place, &[value, depth, _, found]| {
                        if f32::from_bits(found) > 0.0 {
                            gathered[place.at * count + layer] = [value, depth].map(f32::from_bits);
                        }
                    });
                })?;
            }
        }
        Ok(gathered)
    }

    /// The picture of a mode that goes on behind the first surface.
    pub(super) fn march(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Picture, GpuError> {
        let mut picture = Picture::of(scene.background_bytes(), width, height);
        let plan = self.plan(frame, scene, width, height, 1)?;
        if plan.volumes.is_empty() {
            return Ok(picture);
        }
        let reads: Vec<Reads> = plan.volumes.iter().map(|v| v.reads).collect();
        // Of a pass through so many volumes.
        let limits = self.gpu.device.limits();
        let most = (limits.max_storage_buffers_per_shader_stage as usize - 2) / 3;
        let most = most.min(limits.max_storage_textures_per_shader_stage as usize / 2);
        if reads.len() > most {
            return Err(GpuError::TooManyVolumes { count: reads.len(), most });
        }
        let gather = Gather::of(scene);
        let known = self.pipelines.march.iter().position(|m| m.reads == reads && m.gather == gather);
        let number = known.unwrap_or_else(|| {
            self.pipelines.march.push(March::new(&self.gpu, reads, gather));
            self.pipelines.march.len() - 1
        });
        let (gpu, march) = (&self.gpu, &self.pipelines.march[number]);
        let shade = filled_buffer(gpu, bytemuck::bytes_of(&plan.shade), BufferUsages::STORAGE);
        let params: Vec<wgpu::Buffer> =
            plan.trace.iter().map(|p| filled_buffer(gpu, bytemuck::bytes_of(p), BufferUsages::STORAGE)).collect();
        let (records, back) = (hit_buffer(gpu, &plan, 1), readback(gpu, &plan));
        let views: Vec<_> =
            plan.volumes.iter().map(|v| (samples_view(v), [&v.map, &v.masks].map(|t| t.create_view(&Default::default())))).collect();
        for blocks in plan.batches() {
            let mut entries: Vec<BindGroupEntry<'_>> = vec![bound(0, shade.as_entire_binding()), bound(4, records.as_entire_binding())];
            for (n, (volume, (samples, [map, masks]))) in plan.volumes.iter().zip(&views).enumerate() {
                let first = BINDINGS * (n as u32 + 1);
                let texture = wgpu::BindingResource::TextureView;
                entries.extend([
                    bound(first, params[n].as_entire_binding()),
                    bound(first + 1, texture(samples)),
                    bound(first + 2, texture(map)),
                    bound(first + 5, texture(masks)),
                    bound(first + 6, part(&volume.blocks, &blocks, size_of::<Block>())),
                    bound(first + 9, volume.extras.as_entire_binding()),
                ]);
                if volume.reads.in_layers {
                    entries.push(bound(first + 4, wgpu::BindingResource::Sampler(&self.pipelines.nearest)));
                }
            }
            let group =
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("march"), layout: &march.layout, entries: &entries });
            let mut is_done = true;
            read_records(gpu, &march.pipeline, &group, blocks.len(), (&records, 0), &back, |records| {
                for_pixels(&plan.blocks[blocks.clone()], records, width, height, |place, &[color, s, id, is_there]| {
                    is_done &= is_there != UNFINISHED;
                    if is_there == 0 {
                        return;
                    }
                    picture.rgba[place.at] = color.to_le_bytes();
                    if id != 0 {
                        picture.depth_mm[place.at] = frame.depth_mm(place.x, place.y, f32::from_bits(s));
                        picture.volume_id[place.at] = id as u8;
                    }
                });
            })?;
            if !is_done {
                return Err(GpuError::Unfinished { adapter: gpu.info.name.clone() });
            }
        }
        Ok(picture)
    }
}

/// Room in memory for what a batch of blocks of `plan` gives.
fn readback(gpu: &Gpu, plan: &Plan) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: (plan.batch * BLOCK_PIXELS) as u64 * HIT_BYTES,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Runs a pass over `count` blocks, and reads what it has left from `first` on.
fn read_records(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    count: usize,
    (records, first): (&wgpu::Buffer, u64),
    back: &wgpu::Buffer,
    read: impl FnOnce(&[Record]),
) -> Result<(), GpuError> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(count as u32, 1, 1);
    drop(pass);
    let bytes = (count * BLOCK_PIXELS) as u64 * HIT_BYTES;
    encoder.copy_buffer_to_buffer(records, first, back, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    gpu.read_buffer(back, |all| read(bytemuck::cast_slice(&all[..bytes as usize])))
}
