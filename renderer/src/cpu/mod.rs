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
use crate::{RenderError, Renderer, Split};
use bregma_volume::{Sample, Volume, with_samples};
use cells::Cells;
use glam::Vec3;
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

/// Side of the square tiles that cores take in turn: rays of one tile touch the same bricks, and 256 tiles of a 512² picture
/// keep all cores busy to the end.
const TILE: u32 = 32;

/// Draws on the CPU. Keeps what stays valid between frames: the distance maps of the surfaces drawn last.
#[derive(Debug, Default)]
pub struct CpuRenderer {
    maps: crate::frame::MapCache,
}

impl Renderer for CpuRenderer {
    fn name(&self) -> String {
        format!("cpu, {} threads", rayon::current_num_threads())
    }

    fn render(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        draw(&frame, scene, width, height)
    }

    fn split(&mut self, volumes: &[Arc<Volume>], scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
        let frame = Frame::new(&mut self.maps, volumes, scene, width, height)?;
        split::split(&frame, scene, width, height)
    }
}

/// The pixel of one ray: colour, depth, layer.
type Pixel = ([u8; 4], f32, u8);

fn draw(frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Picture, RenderError> {
    let tiles: Vec<(u32, u32)> =
        (0..height).step_by(TILE as usize).flat_map(|y| (0..width).step_by(TILE as usize).map(move |x| (x, y))).collect();
    let draw_tile = |&(x, y): &(u32, u32)| draw_tile(frame, scene, x..(x + TILE).min(width), y..(y + TILE).min(height));
    let drawn: Vec<Vec<Pixel>> = tiles.par_iter().map(draw_tile).collect::<Result<_, _>>()?;
    let count = width as usize * height as usize;
    let mut picture = Picture { width, height, rgba: vec![[0; 4]; count], depth_mm: vec![f32::NAN; count], volume_id: vec![0; count] };
    for (&(x0, y0), pixels) in tiles.iter().zip(&drawn) {
        let tile_width = TILE.min(width - x0);
        for (n, &(rgba, depth_mm, id)) in pixels.iter().enumerate() {
            let (x, y) = (x0 + n as u32 % tile_width, y0 + n as u32 / tile_width);
            let at = y as usize * width as usize + x as usize;
            (picture.rgba[at], picture.depth_mm[at], picture.volume_id[at]) = (rgba, depth_mm, id);
        }
    }
    Ok(picture)
}

/// One pass for each volume, then one over all hits: the typed inner loops stay small.
fn draw_tile(frame: &Frame, scene: &Scene, xs: std::ops::Range<u32>, ys: std::ops::Range<u32>) -> Result<Vec<Pixel>, RenderError> {
    let pixels: Vec<(u32, u32)> = ys.flat_map(|y| xs.clone().map(move |x| (x, y))).collect();
    let mut hits: Vec<Vec<Shaded>> = vec![Vec::new(); pixels.len()];
    for layer in &frame.layers {
        with_samples!(layer.surface.volume.samples(), samples => {
            let dims = layer.surface.grid.dims();
            let (level, sign) = (layer.level, layer.surface.sign);
            let field = Field { samples: samples.as_slice(), dims, map: &layer.map, level, sign };
            with_walk!(scene.solver, W => trace::<_, W>(&field, frame, scene, layer, &pixels, &mut hits));
        });
    }
    let finish = |(&(x, y), hits): (&(u32, u32), &Vec<Shaded>)| {
        let (color, first) = combine(scene.mode, hits);
        let depth_mm = first.map_or(f32::NAN, |h| frame.depth_mm(x, y, h.s));
        (encode(color, frame.background), depth_mm, first.map_or(0, |h| h.layer as u8 + 1))
    };
    Ok(pixels.iter().zip(&hits).map(finish).collect())
}

fn trace<T: Sample, W: WalkBrick>(
    field: &Field<'_, T>,
    frame: &Frame,
    scene: &Scene,
    layer: &FrameLayer,
    pixels: &[(u32, u32)],
    hits: &mut [Vec<Shaded>],
) {
    for (&(x, y), hits) in pixels.iter().zip(hits) {
        let line = Line { origin: layer.rays.origin.at(x, y), direction: layer.rays.direction.at(x, y) };
        // What lies behind an opaque hit is not asked for.
        let s_max = if frame.only_nearest { hits.first().map_or(frame.s_max, |h| h.s) } else { frame.s_max };
        // Of two hits at one depth the first layer's is drawn.
        let hit = field.first_hit::<W>(&line, s_max).filter(|hit| !frame.only_nearest || hits.first().is_none_or(|h| hit.s < h.s));
        if let Some(hit) = hit {
            let view = frame.world_rays.direction.at(x, y).normalize().as_vec3();
            let normal = normal(field, layer, &hit, view);
            let color = phong(&scene.light, layer.color, normal, view, frame.toward_light);
            if frame.only_nearest {
                hits.clear();
            }
            hits.push(Shaded { s: hit.s, layer: layer.index, color, opacity: layer.opacity });
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
