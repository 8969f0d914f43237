//! Where the time of a frame goes: the same rays to the same hits again, with parts of the work left out.
//!
//! The twin of `gpu/split.rs`.

use super::cells::Cells;
use super::steps::FixedSteps;
use super::walk::{Field, Line, WalkBrick};
use super::{Block, draw, with_walk};
use crate::frame::{Frame, FrameLayer};
use crate::roots::{Analytic, Exact, FirstEntry, Linear, Marmitt, Neubauer, PerVoxel, Solver, Steps};
use crate::scene::Scene;
use crate::spans::BLOCK;
use crate::{RenderError, SPLIT_ROUNDS, Split};
use bregma_volume::{Sample, with_samples};
use glam::Vec3;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

/// A sample that is nowhere in memory, to time a walk that fetches nothing.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Unread;

impl Sample for Unread {
    const NAME: &'static str = "nothing";
    fn to_f32(self) -> f32 {
        0.0
    }
}

/// Instead of a solver, to time a walk that fetches but does not solve.
struct Unsolved;

impl FirstEntry for Unsolved {
    fn first_entry(f: &[f32; 8], _: Vec3, _: Vec3) -> Option<f32> {
        black_box(f);
        None
    }
}

/// The rays of a layer and how deep each looks: to its hit, once that is known.
struct Rays<'a> {
    layer: &'a FrameLayer,
    width: u32,
    limits: &'a [f32],
}

impl Rays<'_> {
    /// The fastest of some walks in ms, and the depth of each ray's hit, or its limit where it has none.
    fn time<T: Sample, W: WalkBrick>(&self, field: &Field<'_, T>) -> (f64, Vec<f32>) {
        let mut fastest = f64::INFINITY;
        let mut depths = self.limits.to_vec();
        let band = (BLOCK * self.width) as usize;
        for _ in 0..SPLIT_ROUNDS {
            let begun = Instant::now();
            depths.par_chunks_mut(band).zip(self.limits.par_chunks(band)).enumerate().for_each(|(row, (depths, limits))| {
                let height = (limits.len() / self.width as usize) as u32;
                for x0 in (0..self.width).step_by(BLOCK as usize) {
                    let block = Block { x0, y0: row as u32 * BLOCK, width: BLOCK.min(self.width - x0), height };
                    let [s_min, s_max] = self.layer.spans.at(block.x0, block.y0);
                    if s_min > s_max {
                        continue;
                    }
                    for (_, x, y) in block.pixels() {
                        let at = (y - block.y0) as usize * self.width as usize + x as usize;
                        let line = Line { origin: self.layer.rays.origin.at(x, y), direction: self.layer.rays.direction.at(x, y) };
                        depths[at] = field.first_hit::<W>(&line, [s_min, s_max.min(limits[at])]).map_or(limits[at], |hit| hit.s);
                    }
                }
            });
            fastest = fastest.min(begun.elapsed().as_secs_f64() * 1e3);
        }
        (fastest, depths)
    }
}

/// Times the parts of a frame.
pub fn split(frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
    let mut whole_ms = f64::INFINITY;
    for _ in 0..SPLIT_ROUNDS {
        let begun = Instant::now();
        black_box(draw(frame, scene, width, height)?);
        whole_ms = whole_ms.min(begun.elapsed().as_secs_f64() * 1e3);
    }
    let (mut walking_ms, mut fetched_ms, mut solved_ms) = (0.0, 0.0, 0.0);
    let mut limits = vec![frame.s_max; width as usize * height as usize];
    for layer in &frame.layers {
        let dims = layer.surface.grid.dims();
        let nothing = vec![Unread; dims.iter().product()];
        // Levels that the compiler cannot see, or it would know that nothing is ever met and walk nowhere.
        let unread =
            Field { samples: &nothing[..], dims, map: &layer.map, masks: &layer.masks, level: black_box(1.0), sign: black_box(1.0) };
        with_samples!(layer.surface.volume.samples(), samples => {
            let field = Field { samples: samples.as_slice(), dims, map: &layer.map, masks: &layer.masks, level: layer.level, sign: layer.surface.sign };
            with_walk!(scene.solver, W => {
                let (solved, depths) = Rays { layer, width, limits: &limits }.time::<_, W>(&field);
                let known = Rays { layer, width, limits: &depths };
                // Fixed steps have no solver apart from what they fetch and interpolate.
                let (walked, fetched) = match scene.solver {
                    Solver::Step(_) => (known.time::<_, W>(&unread).0, solved),
                    _ => (known.time::<_, Cells<Unsolved>>(&unread).0, known.time::<_, Cells<Unsolved>>(&field).0),
                };
                walking_ms += walked;
                fetched_ms += fetched;
                solved_ms += solved;
                if frame.only_nearest {
                    limits = depths;
                }
            });
        });
    }
    Ok(Split::between(walking_ms, fetched_ms, solved_ms, whole_ms))
}
