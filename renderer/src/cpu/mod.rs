//! The CPU renderer: the same algorithm as the GPU's, on all cores.

mod cells;
mod segments;
mod shade;
mod split;
mod steps;
mod walk;

use crate::frame::{Frame, FrameLayer};
use crate::roots::{Analytic, Exact, Linear, Marmitt, Neubauer, PerVoxel, Solver, Steps};
use crate::scene::{Picture, Scene};
use crate::spans::BLOCK;
use crate::{RenderError, Renderer, Split};
use bregma_volume::{Sample, Volume, with_samples};
use cells::Cells;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use shade::{Shaded, combine, encode, phong};
use std::sync::Arc;
use steps::FixedSteps;
use walk::{Field, Hit, Line, Met, WalkBrick};

/// Runs `$body` with `$w` bound to the walk that is compiled for a solver.
macro_rules! with_walk {
    ($solver:expr, $w:ident => $body:expr) => {
        with_walk!(@match $solver, $w, $body,
            (Solver::Exact, Cells<Exact>),
            (Solver::Linear, Cells<Linear>),
            (Solver::Neubauer(Steps::Two), Cells<Neubauer<2>>),
            (Solver::Neubauer(Steps::Three), Cells<Neubauer<3>>),
            (Solver::Neubauer(Steps::Four), Cells<Neubauer<4>>),
            (Solver::Marmitt(Steps::Two), Cells<Marmitt<2>>),
            (Solver::Marmitt(Steps::Three), Cells<Marmitt<3>>),
            (Solver::Marmitt(Steps::Four), Cells<Marmitt<4>>),
            (Solver::Analytic, Cells<Analytic>),
            (Solver::Step(PerVoxel::One), FixedSteps<1>),
            (Solver::Step(PerVoxel::Two), FixedSteps<2>),
            (Solver::Step(PerVoxel::Four), FixedSteps<4>),
            (Solver::Step(PerVoxel::Eight), FixedSteps<8>)
        )
    };
    (@match $solver:expr, $w:ident, $body:expr, $(($pattern:pat, $walk:ty)),*) => {
        match $solver {
            $($pattern => { type $w = $walk; $body })*
            Solver::Filter => return Err(RenderError::NeedsGpu(Solver::Filter)),
        }
    };
}
use with_walk;

/// Draws on the CPU. Keeps what stays valid between frames: the distance maps of the surfaces drawn last.
#[derive(Debug, Default)]
pub struct CpuRenderer {
    maps: crate::frame::MapCache,
}

impl Renderer for CpuRenderer {
    fn name(&self) -> String {
        format!("cpu, {} threads", rayon::current_num_threads())
    }

    fn backend(&self) -> &'static str {
        "cpu"
    }

    fn has(&self, solver: Solver) -> bool {
        solver.on_cpu()
    }

    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        draw(&frame, scene, width, height)
    }

    fn bytes(&self) -> usize {
        self.maps.bytes()
    }

    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        split::split(&frame, scene, width, height)
    }
}

/// Draws band by band, of one row of blocks each, and in a band block by block: rays of one block touch the same bricks.
fn draw(frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
    let count = width as usize * height as usize;
    let background = encode(Vec4::ZERO, frame.background);
    let mut picture = Picture { width, height, rgba: vec![background; count], depth_mm: vec![f32::NAN; count], volume_id: vec![0; count] };
    let band = BLOCK as usize * width as usize;
    let pixels = (picture.rgba.par_chunks_mut(band), picture.depth_mm.par_chunks_mut(band), picture.volume_id.par_chunks_mut(band));
    pixels.into_par_iter().enumerate().try_for_each(|(row, (rgba, depth_mm, volume_id))| {
        // One slot for the nearest hit, or one for each layer.
        let slots = if frame.only_nearest { 1 } else { frame.layers.len() };
        let mut hits = vec![None; slots * BLOCK_PIXELS];
        let rows = (rgba.len() / width as usize) as u32;
        for x0 in (0..width).step_by(BLOCK as usize) {
            let block = Block { x0, y0: row as u32 * BLOCK, width: BLOCK.min(width - x0), height: rows };
            if !trace_block(frame, scene, &block, &mut hits)? {
                continue;
            }
            for (n, x, y) in block.pixels() {
                let (color, first) = combine(scene.mode, hits[n..].iter().step_by(BLOCK_PIXELS).flatten());
                if let Some(first) = first {
                    let at = (y - block.y0) as usize * width as usize + x as usize;
                    rgba[at] = encode(color, frame.background);
                    depth_mm[at] = frame.depth_mm(x, y, first.s);
                    volume_id[at] = first.layer as u8 + 1;
                }
            }
        }
        Ok::<(), RenderError>(())
    })?;
    Ok(picture)
}

const BLOCK_PIXELS: usize = (BLOCK * BLOCK) as usize;

/// Some pixels that lie together.
struct Block {
    x0: u32,
    y0: u32,
    width: u32,
    height: u32,
}

impl Block {
    /// Number of each pixel in the block, and its place in the picture.
    fn pixels(&self) -> impl Iterator<Item = (usize, u32, u32)> + use<'_> {
        let place = |n| (n as usize, self.x0 + n % self.width, self.y0 + n / self.width);
        (0..self.width * self.height).map(place)
    }
}

/// One pass for each volume over a block. False when there is nothing to see.
fn trace_block(frame: &Frame, scene: &Scene, block: &Block, hits: &mut [Option<Shaded>]) -> Result<bool, RenderError> {
    let mut seen = false;
    for (number, layer) in frame.layers.iter().enumerate() {
        let span = layer.spans.at(block.x0, block.y0);
        if span[0] > span[1] {
            continue;
        }
        if !seen {
            hits.fill(None);
            seen = true;
        }
        let slot = if frame.only_nearest { 0 } else { number };
        let hits = &mut hits[slot * BLOCK_PIXELS..][..BLOCK_PIXELS];
        with_samples!(layer.surface.volume.samples(), samples => {
            let dims = layer.surface.grid.dims();
            let (level, sign) = (layer.level, layer.surface.sign);
            let field = Field { samples: samples.as_slice(), dims, map: &layer.map, masks: &layer.masks, level, sign };
            with_walk!(scene.solver, W => trace::<_, W>(&field, frame, scene, layer, span, block, hits));
        });
    }
    Ok(seen)
}

fn trace<T: Sample, W: WalkBrick>(
    field: &Field<'_, T>,
    frame: &Frame,
    scene: &Scene,
    layer: &FrameLayer,
    [s_min, s_max]: [f32; 2],
    block: &Block,
    hits: &mut [Option<Shaded>],
) {
    for (n, x, y) in block.pixels() {
        let line = Line { origin: layer.rays.origin.at(x, y), direction: layer.rays.direction.at(x, y) };
        // What lies behind an opaque hit is not asked for.
        let s_max = hits[n].map_or(s_max, |hit: Shaded| s_max.min(hit.s));
        // Of two hits at one depth the first layer's is drawn.
        let hit = field.first_hit::<W>(&line, [s_min, s_max]).filter(|hit| hits[n].is_none_or(|h| hit.s < h.s));
        if let Some(hit) = hit {
            let view = frame.world_rays.direction.at(x, y).normalize().as_vec3();
            let normal = normal(field, layer, &hit, view);
            let color = phong(&scene.light, layer.color, normal, view, frame.toward_light);
            hits[n] = Some(Shaded { s: hit.s, layer: layer.index, color, opacity: layer.opacity });
        }
    }
}

/// Outward normal in the world, unit.
fn normal<T: Sample>(field: &Field<'_, T>, layer: &FrameLayer, hit: &Hit, view: Vec3) -> Vec3 {
    let index = match hit.met {
        Met::Isosurface => -field.smooth_gradient(hit.cell, hit.local),
        Met::Face(normal) => normal,
        Met::Eye => return -view,
    };
    (layer.normal_to_world * index).try_normalize().unwrap_or(-view)
}
