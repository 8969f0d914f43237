//! The CPU renderer: the same algorithm as the GPU's, on all cores.

mod cells;
mod shade;
mod steps;
mod walk;

use crate::frame::{Frame, FrameLayer};
use crate::roots::{Analytic, Exact, Linear, Marmitt, Neubauer, PerVoxel, Solver, Steps};
use crate::scene::{Picture, Scene};
use crate::{RenderError, Renderer};
use bregma_volume::{Sample, Volume, with_samples};
use cells::Cells;
use glam::Vec3;
use rayon::prelude::*;
use shade::{Shaded, combine, encode, phong};
use std::sync::Arc;
use walk::{Field, Hit, Line, Met, WalkBrick};

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
        Ok(draw(&frame, scene, width, height))
    }
}

/// The pixel of one ray: colour, depth, layer.
type Pixel = ([u8; 4], f32, u8);

fn draw(frame: &Frame, scene: &Scene, width: u32, height: u32) -> Picture {
    let tiles: Vec<(u32, u32)> =
        (0..height).step_by(TILE as usize).flat_map(|y| (0..width).step_by(TILE as usize).map(move |x| (x, y))).collect();
    let drawn: Vec<Vec<Pixel>> =
        tiles.par_iter().map(|&(x, y)| draw_tile(frame, scene, x..(x + TILE).min(width), y..(y + TILE).min(height))).collect();
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
    picture
}

/// One pass for each volume, then one over all hits: the typed inner loops stay small.
fn draw_tile(frame: &Frame, scene: &Scene, xs: std::ops::Range<u32>, ys: std::ops::Range<u32>) -> Vec<Pixel> {
    let pixels: Vec<(u32, u32)> = ys.flat_map(|y| xs.clone().map(move |x| (x, y))).collect();
    let mut hits: Vec<Vec<Shaded>> = vec![Vec::new(); pixels.len()];
    for layer in &frame.layers {
        with_samples!(layer.surface.volume.samples(), samples => {
            let dims = layer.surface.grid.dims();
            let (level, sign) = (layer.level, layer.surface.sign);
            let field = Field { samples: samples.as_slice(), dims, map: &layer.map, level, sign };
            trace_with(scene.solver)(&field, frame, scene, layer, &pixels, &mut hits);
        });
    }
    let finish = |(&(x, y), hits): (&(u32, u32), &Vec<Shaded>)| {
        let (color, first) = combine(scene.mode, hits);
        let depth_mm = first.map_or(f32::NAN, |h| frame.depth_mm(x, y, h.s));
        (encode(color, frame.background), depth_mm, first.map_or(0, |h| h.layer as u8 + 1))
    };
    pixels.iter().zip(&hits).map(finish).collect()
}

/// One pass of one volume over the pixels of a tile.
type Trace<T> = fn(&Field<'_, T>, &Frame, &Scene, &FrameLayer, &[(u32, u32)], &mut [Vec<Shaded>]);

/// The pass that is compiled for `solver`.
fn trace_with<T: Sample>(solver: Solver) -> Trace<T> {
    match solver {
        Solver::Exact => trace::<T, Cells<Exact>>,
        Solver::Linear => trace::<T, Cells<Linear>>,
        Solver::Neubauer(Steps::Two) => trace::<T, Cells<Neubauer<2>>>,
        Solver::Neubauer(Steps::Three) => trace::<T, Cells<Neubauer<3>>>,
        Solver::Neubauer(Steps::Four) => trace::<T, Cells<Neubauer<4>>>,
        Solver::Marmitt(Steps::Two) => trace::<T, Cells<Marmitt<2>>>,
        Solver::Marmitt(Steps::Three) => trace::<T, Cells<Marmitt<3>>>,
        Solver::Marmitt(Steps::Four) => trace::<T, Cells<Marmitt<4>>>,
        Solver::Analytic => trace::<T, Cells<Analytic>>,
        Solver::Step(PerVoxel::One) => trace::<T, steps::Steps<1>>,
        Solver::Step(PerVoxel::Two) => trace::<T, steps::Steps<2>>,
        Solver::Step(PerVoxel::Four) => trace::<T, steps::Steps<4>>,
        Solver::Step(PerVoxel::Eight) => trace::<T, steps::Steps<8>>,
    }
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
