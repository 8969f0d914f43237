//! Where the time of a frame goes: the same rays to the same hits again, with parts of the work left out.
//!
//! The twin of `gpu/split.rs`.

use super::draw;
use super::line::Part;
use super::packets::packets;
use super::samples::Source;
use super::volume::{Field, line_of};
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Floats, LANES, numbers};
use crate::roots::Method;
use crate::scene::Scene;
use crate::skip::BLOCK;
use crate::{RenderError, SPLIT_ROUNDS, Split};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

/// The rays of a layer and how deep each looks: to its hit, once that is known.
struct Rays<'a> {
    level: Level,
    layer: &'a FrameLayer,
    width: u32,
    limits: &'a [f32],
}

impl Rays<'_> {
    /// The fastest of some walks in ms, and the depth of each ray's hit, or its limit where it has none.
    fn time(&self, method: Option<Method>, source: Source<'_>) -> (f64, Vec<f32>) {
        let mut fastest = f64::INFINITY;
        let mut depths = self.limits.to_vec();
        let band = (BLOCK * self.width) as usize;
        for _ in 0..SPLIT_ROUNDS {
            let begun = Instant::now();
            depths.par_chunks_mut(band).zip(self.limits.par_chunks(band)).enumerate().for_each(|(row, (depths, limits))| {
                dispatch!(self.level, simd => self.walk(simd, method, source, row as u32 * BLOCK, limits, depths));
            });
            fastest = fastest.min(begun.elapsed().as_secs_f64() * 1e3);
        }
        (fastest, depths)
    }

    #[inline(always)]
    fn walk<S: Simd>(&self, simd: S, method: Option<Method>, source: Source<'_>, y0: u32, limits: &[f32], depths: &mut [f32]) {
        let mut field = Field { source, ..Field::of(self.layer) };
        if let Source::Nothing = source {
            // Where nothing is fetched nothing is inside, which the compiler cannot know.
            (field.level, field.sign) = (black_box(1.0), black_box(1.0));
        }
        for packet in packets(self.width, limits.len() as u32 / self.width) {
            let [s_min, s_max] = self.layer.skip.spans.at(packet.x0, y0);
            if s_min > s_max {
                continue;
            }
            let pixels = packet.pixels(simd, y0);
            let mut limit = [0.0; LANES];
            numbers(pixels.inside).for_each(|lane| limit[lane] = limits[packet.index(lane, self.width)]);
            let limit = Floats::load_array(simd, limit);
            let lines = line_of(simd, self.layer, &pixels);
            let part = Part { begin: Floats::splat(simd, 0.0), s_min: Floats::splat(simd, s_min), s_max: limit.min(s_max) };
            let hits = field.first_hits(simd, method, &lines, &part, pixels.inside);
            let depth = hits.found.select(hits.s, limit);
            numbers(pixels.inside).for_each(|lane| depths[packet.index(lane, self.width)] = depth[lane]);
        }
    }
}

/// Times the parts of a frame.
pub fn split(level: Level, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Split, RenderError> {
    let mut whole_ms = f64::INFINITY;
    for _ in 0..SPLIT_ROUNDS {
        let begun = Instant::now();
        black_box(draw(level, frame, scene, [width, height], None)?);
        whole_ms = whole_ms.min(begun.elapsed().as_secs_f64() * 1e3);
    }
    let (mut walking_ms, mut fetched_ms, mut solved_ms) = (0.0, 0.0, 0.0);
    let mut limits = vec![f32::MAX; width as usize * height as usize];
    for layer in &frame.layers {
        let samples = Source::of(&layer.placement.surface);
        let (solved, depths) = Rays { level, layer, width, limits: &limits }.time(Some(frame.method), samples);
        let known = Rays { level, layer, width, limits: &depths };
        // Fixed steps have no solver apart from what they fetch and interpolate.
        let (walked, fetched) = if frame.method.is_stepping() {
            (known.time(Some(frame.method), Source::Nothing).0, solved)
        } else {
            (known.time(None, Source::Nothing).0, known.time(None, samples).0)
        };
        walking_ms += walked;
        fetched_ms += fetched;
        solved_ms += solved;
        if frame.only_nearest {
            limits = depths;
        }
    }
    Ok(Split::between(walking_ms, fetched_ms, solved_ms, whole_ms))
}
