//! Where the time of a frame goes: the same rays to the same hits again, with parts of the work left out.
//!
//! The twin of `cpu/split.rs`.

use super::buffers::hit_buffer;
use super::layout::TraceParams;
use super::{GpuError, GpuRenderer, Parts};
use crate::frame::Frame;
use crate::scene::Scene;
use crate::{SPLIT_ROUNDS, Split};
use std::time::Instant;

fn fastest_ms(mut seconds: impl FnMut() -> Result<f64, GpuError>) -> Result<f64, GpuError> {
    (0..SPLIT_ROUNDS).try_fold(f64::INFINITY, |fastest, _| Ok(fastest.min(seconds()? * 1e3)))
}

impl GpuRenderer {
    /// Times the parts of a frame.
    pub(super) fn split_frame(&mut self, frame: &Frame, scene: &Scene, width: u32, height: u32) -> Result<Split, GpuError> {
        let whole_ms = fastest_ms(|| {
            let begun = Instant::now();
            self.draw(frame, scene, width, height)?;
            Ok(begun.elapsed().as_secs_f64())
        })?;
        // One slot more than passes: a pass that only looks as far as the hits before it, and has none itself.
        let slots = frame.layers.len() + 1;
        let plan = self.plan(frame, scene, width, height, slots)?;
        let hits = hit_buffer(&self.gpu, plan.pixels() * slots);
        let (mut walking_ms, mut fetched_ms, mut solved_ms) = (0.0, 0.0, 0.0);
        for blocks in plan.batches() {
            for (pass, params) in plan.trace.iter().enumerate() {
                let mut time = |parts, params: &TraceParams| {
                    fastest_ms(|| self.pipelines.time(&self.gpu, &plan, (pass, params), parts, &blocks, &hits))
                };
                let solved = time(Parts::Solve, params)?;
                let limited = TraceParams { pass_number: params.pass_number + 1, only_nearest: 1, ..*params };
                walking_ms += time(Parts::Walk, &limited)?;
                // Fixed steps have no solver apart from what they fetch and interpolate.
                fetched_ms += if plan.method.is_stepping() { solved } else { time(Parts::Fetch, &limited)? };
                solved_ms += solved;
            }
        }
        Ok(Split::between(walking_ms, fetched_ms, solved_ms, whole_ms))
    }
}
