//! One volume on the way of rays: its samples, what need not be walked of it, and where its pixels' rays are.
//!
//! The twin of `shaders/volume.wgsl`.

use super::line::Line;
use super::packets::Pixels;
use super::samples::Source;
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Floats, Ints, Mask, Vecs, axes, dot};
use crate::skip::{CellMasks, DistanceMap};
use bregma_field::Solid;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// One volume, ready to be walked.
#[derive(Clone, Copy)]
pub(crate) struct Field<'a> {
    pub source: Source<'a>,
    pub dims: [i32; 3],
    pub map: &'a DistanceMap,
    pub masks: &'a CellMasks,
    pub level: f32,
    pub sign: f32,
    /// Only what lies within it is there.
    pub solid: Option<&'a Solid>,
}

impl<'a> Field<'a> {
    /// Of a layer of a picture.
    pub fn of(layer: &'a FrameLayer) -> Self {
        let source = Source::of(&layer.placement.surface);
        let dims = layer.placement.surface.grid.dims().map(|n| n as i32);
        Self {
            source,
            dims,
            map: &layer.skip.map,
            masks: &layer.skip.masks,
            level: layer.placement.level,
            sign: layer.placement.surface.sign,
            solid: layer.placement.surface.solid.as_deref(),
        }
    }

    /// Whether its samples are so few that each has a number in 31 bits.
    pub fn has_numbers(&self) -> bool {
        self.dims.iter().map(|n| i64::from(*n)).product::<i64>() <= i64::from(i32::MAX)
    }

    /// Corner values of cells relative to the level, positive inside; corner x + 2y + 4z is at (x, y, z).
    #[inline(always)]
    pub fn corners<S: Simd>(&self, simd: S, cell: &[Ints<S>; 3], of: Mask<S>) -> [Floats<S>; 8] {
        let f = self.source.corners(simd, cell, of);
        let at = |c: usize| self.sign * (f[c] - self.level);
        [at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)]
    }
}

/// The lines of a packet through a layer.
#[inline(always)]
pub(super) fn line_of<S: Simd>(simd: S, layer: &FrameLayer, pixels: &Pixels<S>) -> Line<S> {
    Line { origin: pixels.at(simd, &layer.placement.rays.origin), direction: pixels.at(simd, &layer.placement.rays.direction) }
}

/// The lines of a packet in the world.
#[inline(always)]
pub(super) fn world_line_of<S: Simd>(simd: S, frame: &Frame, pixels: &Pixels<S>) -> Line<S> {
    Line { origin: pixels.at(simd, &frame.based_rays.origin), direction: pixels.at(simd, &frame.based_rays.direction) }
}

/// Normals of index space in the world, turned toward the viewer, who looks along `direction` of index space; unit, or zero as they are.
#[inline(always)]
pub(super) fn toward_viewer<S: Simd>(simd: S, layer: &FrameLayer, index: &Vecs<S>, direction: &Vecs<S>) -> Vecs<S> {
    let zero = Floats::splat(simd, 0.0);
    // Both sides of a surface are lit: the smooth normal may turn away where the surface does not.
    let away = dot(index, direction).simd_gt(zero);
    let index = axes!(a => away.select(-index[a], index[a]));
    let m = &layer.placement.normal_to_world;
    let world = axes!(a => m.x_axis[a] * index[0] + m.y_axis[a] * index[1] + m.z_axis[a] * index[2]);
    let length = dot(&world, &world).sqrt();
    let known = length.simd_gt(zero);
    axes!(a => known.select(world[a] / length, zero))
}
