//! The CPU renderer: the same algorithm as the GPU's, on all cores and for sixteen rays at once.

pub(crate) mod brick;
mod cells;
pub(crate) mod cuts;
pub(crate) mod dvr;
pub(crate) mod dvr_exact;
pub(crate) mod dvr_steps;
pub(crate) mod faces;
pub(crate) mod gauss;
pub(crate) mod gradient;
mod integral;
mod intervals;
pub(crate) mod let_through;
pub(crate) mod light;
pub(crate) mod line;
mod march;
mod nearest;
pub(crate) mod packets;
pub(crate) mod project;
mod ray;
pub(crate) mod rim;
pub(crate) mod samples;
pub(crate) mod segments;
mod shade;
mod shadows;
mod sides;
pub(crate) mod slice;
mod split;
mod steps;
mod to_light;
mod trace;
pub(crate) mod transparent;
mod traveller;
pub(crate) mod volume;
mod walk;
pub(crate) mod within;

use crate::frame::Frame;
use crate::lanes::{Doubles, Floats, axes, numbers};
use crate::modes::Gather;
use crate::picture::Picture;
use crate::roots::{Method, Solver};
use crate::scene::{Integrator, Scene};
use crate::skip::{BLOCK, MapCache};
use crate::studio::{Tracer, TracerCache};
use crate::tone::colored;
use crate::{Backend, InstructionSet, RenderError, Renderer, Split};
use bregma_field::Volume;
use brick::FAR;
use cuts::kept;
use dvr_steps::Steps;
pub(crate) use faces::face_color;
use faces::faces;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use glam::{Vec3, Vec4};
use integral::integrals;
pub(crate) use light::encode;
use line::{Line, Part};
use march::{march, set_out};
use nearest::nearest;
use packets::{Packet, Pixels, packets};
use project::{Sought, Way, project};
use ray::{Gathered, View};
use rayon::prelude::*;
use shade::{color_by_depth, draw_agreed, light, paint_faces};
use std::mem::discriminant;
use std::sync::Arc;
use trace::trace;
use volume::{Field, line_of, world_line_of};

/// Draws on the CPU. Keeps what stays valid between frames: the maps of the surfaces drawn last.
#[derive(Debug)]
pub struct CpuRenderer {
    maps: MapCache,
    studio: TracerCache,
    spare: Option<Picture>,
    level: Level,
}

impl Default for CpuRenderer {
    fn default() -> Self {
        Self::with_instructions(Level::new())
    }
}

impl CpuRenderer {
    /// A renderer that uses a set of vector instructions, one of [`CpuRenderer::instruction_sets`].
    pub fn with_instructions(level: InstructionSet) -> Self {
        Self { maps: MapCache::new(level), studio: TracerCache::with_instructions(level), spare: None, level }
    }

    /// The sets of vector instructions that this machine has, the best one first.
    pub fn instruction_sets() -> Vec<InstructionSet> {
        let best = Level::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        let lesser = [best.as_avx2().map(Level::Avx2), best.as_sse4_2().map(Level::Sse4_2), best.as_sse2().map(Level::Sse2)];
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        let lesser: [Option<Level>; 0] = [];
        let mut sets = vec![best];
        sets.extend(lesser.into_iter().flatten().filter(|set| discriminant(set) != discriminant(&best)));
        sets
    }
}

/// The name of a set of vector instructions, without what its token says beside it.
fn name_of(level: Level) -> String {
    format!("{level:?}").chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>().to_lowercase()
}

impl Renderer for CpuRenderer {
    fn name(&self) -> String {
        format!("cpu, {} threads, {}", rayon::current_num_threads(), name_of(self.level))
    }

    fn backend(&self) -> Backend {
        Backend::Cpu
    }

    fn has(&self, solver: Solver) -> bool {
        solver.on_cpu()
    }

    fn sample(&mut self, volumes: &[Arc<Volume>], scene: &Scene, [width, height]: [u32; 2], sample: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, [width, height], sample)?;
        draw(self.level, &frame, scene, [width, height], self.spare.take())
    }

    fn tracer(&mut self, volumes: &[Arc<Volume>], scene: &Scene, size: [u32; 2], seed: u32) -> Result<Tracer, RenderError> {
        Tracer::reusing(&mut self.studio, volumes, scene, size, seed)
    }

    fn reuse(&mut self, picture: Picture) {
        self.spare = Some(picture);
    }

    fn bytes(&self) -> usize {
        self.maps.bytes() + self.studio.bytes()
    }

    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, [width, height], 0)?;
        split::split(self.level, &frame, scene, width, height)
    }
}

/// Draws band by band, of one row of blocks each, and in a band block by block: rays of one block touch the same bricks.
fn draw(level: Level, frame: &Frame, scene: &Scene, [width, height]: [u32; 2], spare: Option<Picture>) -> Result<Picture, RenderError> {
    let goes_on = match scene.mode.gather() {
        Gather::Number(of) => {
            let sought = Sought { of, by_gradient: scene.of_gradient, in_range: scene.value_range.is_some() };
            return Ok(draw_projection(level, frame, scene, sought, [width, height]));
        }
        Gather::Plane => return Ok(slice::draw(level, frame, scene, [width, height], spare)),
        Gather::Crossings | Gather::Density => true,
        Gather::Nearest | Gather::FirstOfEach => false,
    };
    if !goes_on && frame.method == Method::Solver(Solver::Filter) {
        return Err(RenderError::NeedsGpu(scene.solver));
    }
    let background = encode(Vec4::ZERO, frame.background);
    let mut picture = Picture::blank(spare, [width, height], false);
    let band = BLOCK as usize * width as usize;
    let pixels = (picture.rgba.par_chunks_mut(band), picture.depth_mm.par_chunks_mut(band), picture.volume_id.par_chunks_mut(band));
    pixels.into_par_iter().enumerate().for_each(|(row, (rgba, depth_mm, volume_id))| {
        rgba.fill(background);
        depth_mm.fill(f32::NAN);
        volume_id.fill(0);
        let band = Band { width, y0: row as u32 * BLOCK, rgba, depth_mm, volume_id };
        if goes_on {
            dispatch!(level, simd => draw_through(simd, frame, scene, band));
        } else {
            dispatch!(level, simd => draw_band(simd, frame, scene, band));
        }
    });
    Ok(picture)
}

/// Draws the maximum, mean or integral along each ray.
fn draw_projection(level: Level, frame: &Frame, scene: &Scene, sought: Sought, [width, height]: [u32; 2]) -> Picture {
    let count = frame.layers.len();
    let mut gathered = vec![[f32::NAN; 2]; width as usize * height as usize * count];
    let band = BLOCK as usize * width as usize * count;
    gathered.par_chunks_mut(band.max(1)).enumerate().for_each(|(row, gathered)| {
        let y0 = row as u32 * BLOCK;
        dispatch!(level, simd => project_band(simd, frame, sought, [width, y0], gathered));
    });
    colored(frame, scene, sought.of, [width, height], &gathered)
}

#[inline(always)]
fn project_band<S: Simd>(simd: S, frame: &Frame, sought: Sought, [width, y0]: [u32; 2], gathered: &mut [[f32; 2]]) {
    let count = frame.layers.len();
    let height = (gathered.len() / count) as u32 / width;
    let all: Vec<Packet> = packets(width, height).collect();
    for block in all.chunk_by(|a, b| a.x0 / BLOCK == b.x0 / BLOCK) {
        for (n, layer) in frame.layers.iter().enumerate() {
            let [s_min, s_max] = layer.skip.spans.at(block[0].x0, y0);
            if s_min > s_max {
                continue;
            }
            let field = Field::of(layer);
            // No iterators: what these call is not compiled for the machine's vector instructions.
            let mut ways = Vec::with_capacity(block.len());
            for packet in block {
                let pixels = packet.pixels(simd, y0);
                let kept = kept(simd, &layer.placement.surface.region, &world_line_of(simd, frame, &pixels));
                let part = Part { begin: kept.begin, s_min: Floats::splat(simd, s_min), s_max: Floats::splat(simd, s_max).min(kept.end) };
                ways.push(Way { lines: line_of(simd, layer, &pixels), part, asked: pixels.inside });
            }
            let found = simd.vectorize(
                #[inline(always)]
                || {
                    if sought.is_sum() && field.has_numbers() && field.solid.is_none() {
                        integrals(simd, &field, &ways)
                    } else {
                        project(simd, sought, layer, &field, &ways)
                    }
                },
            );
            for (packet, of) in block.iter().zip(found) {
                for lane in numbers(of.found) {
                    gathered[packet.index(lane, width) * count + n] = [of.value[lane], of.depth[lane]];
                }
            }
        }
    }
}

/// A row of blocks of the picture.
struct Band<'a> {
    width: u32,
    y0: u32,
    rgba: &'a mut [[u8; 4]],
    depth_mm: &'a mut [f32],
    volume_id: &'a mut [u8],
}

/// Draws what goes on behind the first surface: direct volume rendering, and transparent surfaces.
#[inline(always)]
fn draw_through<S: Simd>(simd: S, frame: &Frame, scene: &Scene, band: Band<'_>) {
    let Band { width, y0, rgba, depth_mm, volume_id } = band;
    let height = rgba.len() as u32 / width;
    for packet in packets(width, height) {
        if frame.layers.iter().all(|layer| is_empty(layer.skip.spans.at(packet.x0, y0))) {
            continue;
        }
        let pixels = packet.pixels(simd, y0);
        let view = View::of(simd, frame, scene, &pixels);
        let gathered = simd.vectorize(
            #[inline(always)]
            || gather(simd, &packet, &pixels, &view, y0),
        );
        let depth = ((Doubles::splat(simd, frame.base_mm) + Doubles::of(gathered.s)) * view.length).to_floats();
        for lane in numbers(pixels.inside & gathered.color[3].simd_gt(0.0)) {
            let at = packet.index(lane, width);
            let color = Vec4::from_array(gathered.color.map(|part| part[lane]));
            rgba[at] = encode(color, frame.background);
            if gathered.id[lane] > 0.0 {
                depth_mm[at] = depth[lane];
                volume_id[at] = gathered.id[lane] as u8;
            }
        }
    }
}

fn is_empty([s_min, s_max]: [f32; 2]) -> bool {
    s_min > s_max
}

/// What a packet's rays gather on their whole way.
#[inline(always)]
fn gather<S: Simd>(simd: S, packet: &Packet, pixels: &Pixels<S>, view: &View<'_, S>, y0: u32) -> Gathered<S> {
    let View { frame, scene, .. } = *view;
    let lines: Vec<Line<S>> = frame.layers.iter().map(|layer| line_of(simd, layer, pixels)).collect();
    let faces = faces(simd, view, &lines);
    let face = nearest(simd, &faces, Floats::splat(simd, 0.0));
    let until = face.found.select(face.s, Floats::splat(simd, FAR));
    let block = [packet.x0, y0];
    let mut all = Gathered::nothing(simd);
    let mut travellers = set_out(simd, frame, pixels, block, &lines, until);
    let enough = if scene.mode.gather() == Gather::Crossings {
        transparent::gather(simd, view, &mut travellers, &mut all);
        transparent::ENOUGH
    } else if let Integrator::Steps { .. } = scene.integrator {
        let mut steps = Steps::begin(simd, view);
        march(
            simd,
            &mut travellers,
            #[inline(always)]
            |travellers, stretch| dvr_steps::gather(simd, view, travellers, stretch, &mut steps, &mut all),
        );
        dvr_steps::ENOUGH
    } else {
        march(
            simd,
            &mut travellers,
            #[inline(always)]
            |travellers, stretch| dvr_exact::gather(simd, view, travellers, stretch, &mut all),
        );
        dvr_exact::ENOUGH
    };
    let mut all = all.filled(enough);
    if face.found.any_true() {
        let mut color = [Floats::splat(simd, 0.0); 3];
        paint_faces(simd, frame, scene, &faces, &face, &mut color);
        all.put_face(simd, &color, &face);
    }
    all
}

#[inline(always)]
fn draw_band<S: Simd>(simd: S, frame: &Frame, scene: &Scene, band: Band<'_>) {
    let Band { width, y0, rgba, depth_mm, volume_id } = band;
    let height = rgba.len() as u32 / width;
    let mut hits = vec![];
    for packet in packets(width, height) {
        let pixels = packet.pixels(simd, y0);
        hits.clear();
        for layer in &frame.layers {
            hits.extend(trace(simd, frame, scene, layer, layer.skip.spans.at(packet.x0, y0), &pixels, &hits));
        }
        let mut first = nearest(simd, &hits, Floats::splat(simd, 0.0));
        if !first.found.any_true() {
            continue;
        }
        let view = View::of(simd, frame, scene, &pixels);
        let mut second = if frame.overlays { Some(nearest(simd, &hits, first.id)) } else { None };
        if frame.depth_range_mm > 0.0
            && let Some(behind) = second.take()
        {
            color_by_depth(simd, &view, &mut first, &behind);
        }
        let normal = match &second {
            Some(second) => draw_agreed(simd, &view, &mut first, second),
            None => first.normal,
        };
        let mut color = light(simd, &view, &first, &normal);
        paint_faces(simd, frame, scene, &hits, &first, &mut color);
        if let Some(second) = second {
            let mut behind = light(simd, &view, &second, &second.normal);
            paint_faces(simd, frame, scene, &hits, &second, &mut behind);
            let opacity = second.found.select(first.opacity, Floats::splat(simd, 1.0));
            color = axes!(a => color[a] * opacity + behind[a] * (1.0 - opacity));
        }
        let depth = ((Doubles::splat(simd, frame.base_mm) + Doubles::of(first.s)) * view.length).to_floats();
        for lane in numbers(first.found) {
            let at = packet.index(lane, width);
            let color = Vec3::from_array(axes!(a => color[a][lane]));
            rgba[at] = encode(color.extend(1.0), frame.background);
            depth_mm[at] = depth[lane];
            volume_id[at] = first.id[lane] as u8;
        }
    }
}
