//! Gradients of the interpolant: its own, which changes abruptly from cell to cell, and a smooth one.
//!
//! The twin of `shaders/gradient.wgsl`.

use super::cells::CellPass;
use super::samples::{Source, around};
use crate::frame::FrameLayer;
use crate::lanes::{Floats, Ints, LANES, Mask, Vecs, axes, lerp, mix, numbers};
use bregma_field::{Block, Sample, with_block};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// The gradient of the trilinear interpolant of corner values, in index space.
#[inline(always)]
pub(super) fn gradient<S: Simd>(f: &[Floats<S>; 8], p: &Vecs<S>) -> Vecs<S> {
    let [x, y, z] = *p;
    [
        mix(mix(f[1] - f[0], f[3] - f[2], y), mix(f[5] - f[4], f[7] - f[6], y), z),
        mix(mix(f[2] - f[0], f[3] - f[1], x), mix(f[6] - f[4], f[7] - f[5], x), z),
        mix(mix(f[4] - f[0], f[5] - f[1], x), mix(f[6] - f[2], f[7] - f[3], x), y),
    ]
}

/// The interpolant's gradient at u of the way through cells, in the world, in sample units per mm.
#[inline(always)]
pub(super) fn world_gradient<S: Simd>(layer: &FrameLayer, pass: &CellPass<S>, u: Floats<S>) -> Vecs<S> {
    let g = gradient(&pass.f, &lerp(&pass.start, &pass.end, u));
    let m = layer.placement.gradient_to_world.to_cols_array_2d();
    axes!(a => g[0] * m[0][a] + g[1] * m[1][a] + g[2] * m[2][a])
}

impl Source<'_> {
    /// Gradient at a point of a cell, in index space: central differences at the corners, interpolated. It is
    /// continuous from cell to cell, which the interpolant's own gradient is not; at the grid's faces it is one-sided.
    #[inline(always)]
    pub fn smooth_gradient<S: Simd>(
        self,
        simd: S,
        dims: [i32; 3],
        cell: &[Ints<S>; 3],
        local: &Vecs<S>,
        of: Mask<S>,
        around: &mut Around<S>,
    ) -> Vecs<S> {
        // Compiled by itself and called, from each mode.
        simd.vectorize(
            #[inline(always)]
            || self.differences(simd, dims, cell, local, of, around),
        )
    }

    #[inline(always)]
    fn differences<S: Simd>(
        self,
        simd: S,
        dims: [i32; 3],
        cell: &[Ints<S>; 3],
        local: &Vecs<S>,
        of: Mask<S>,
        around: &mut Around<S>,
    ) -> Vecs<S> {
        let zero = Floats::splat(simd, 0.0);
        let Self::Samples(samples) = self else { return [zero; 3] };
        let new = of & !around.known;
        let v = &mut around.samples;
        if new.any_true() {
            let cells = cell.map(Ints::to_array);
            with_block!(samples, block => {
                for lane in numbers(new) {
                    let at = [cells[0][lane], cells[1][lane], cells[2][lane]];
                    surroundings(&block, dims, at, |[x, y, z], value| v[z][y][x][lane] = value);
                }
            });
            around.known |= new;
        }
        let [x, y, z] = *local;
        let (one, half) = (Floats::splat(simd, 1.0), Floats::splat(simd, 0.5));
        // What each difference of samples along an axis is at the point's other two coordinates.
        let differences = [
            [across(simd, v, 0, 0, y, z), across(simd, v, 0, 1, y, z)],
            [across(simd, v, 1, 0, x, z), across(simd, v, 1, 1, x, z)],
            [across(simd, v, 2, 0, x, y), across(simd, v, 2, 1, x, y)],
        ];
        axes!(a => {
            // One-sided where the column was cut short.
            let (first, last) = (cell[a].simd_eq(0), cell[a].simd_eq(dims[a] - 2));
            mix(differences[a][0] * first.select(one, half), differences[a][1] * last.select(one, half), local[a])
        })
    }
}

/// By z, y and x.
type Surroundings = [[[[f32; LANES]; 4]; 4]; 4];

/// The samples around cells: 4 along each axis, where the grid has them, but not the corners of that block. Several points of a cell are
/// interpolated from the same.
pub(crate) struct Around<S: Simd> {
    samples: Surroundings,
    /// In which lanes they are read.
    pub known: Mask<S>,
}

impl<S: Simd> Around<S> {
    #[inline(always)]
    pub fn unknown(simd: S) -> Self {
        Self { samples: [[[[0.0; LANES]; 4]; 4]; 4], known: Mask::splat(simd, false) }
    }
}

/// Differences along an axis around cells' lower samples (`n` = 0) or higher ones (1), interpolated between the four columns through the cell.
/// What is interpolated are differences, as in the shader: of equal samples nothing may be left, however it is rounded.
#[inline(always)]
fn across<S: Simd>(simd: S, v: &Surroundings, axis: usize, n: usize, u: Floats<S>, w: Floats<S>) -> Floats<S> {
    let low = mix(difference(simd, v, axis, n, [1, 1]), difference(simd, v, axis, n, [2, 1]), u);
    let high = mix(difference(simd, v, axis, n, [1, 2]), difference(simd, v, axis, n, [2, 2]), u);
    mix(low, high, w)
}

/// Of samples n and n + 2 of the column along an axis that is at p and q of the other two.
#[inline(always)]
fn difference<S: Simd>(simd: S, v: &Surroundings, axis: usize, n: usize, [p, q]: [usize; 2]) -> Floats<S> {
    let (from, to) = match axis {
        0 => (&v[q][p][n], &v[q][p][n + 2]),
        1 => (&v[q][n][p], &v[q][n + 2][p]),
        _ => (&v[n][q][p], &v[n + 2][q][p]),
    };
    Floats::load_array_ref(simd, to) - Floats::load_array_ref(simd, from)
}

/// The samples from one before a cell to one behind it, but those at the corners of that block; at the grid's border the nearest.
#[inline(always)]
fn surroundings<T: Sample>(block: &Block<'_, T>, dims: [i32; 3], cell: [i32; 3], mut put: impl FnMut([usize; 3], f32)) {
    let [xs, ys, zs] = around(dims, cell);
    // Away from the border samples of a row lie side by side: one check for four of them.
    let is_inner = xs[3] - xs[0] == 3;
    for z in 0..4 {
        for y in 0..4 {
            let (y_outer, z_outer) = (y % 3 == 0, z % 3 == 0);
            if y_outer && z_outer {
                continue;
            }
            let columns = if y_outer || z_outer { 1..3 } else { 0..4 };
            if is_inner {
                let four = &block.onward([xs[0], ys[y], zs[z]])[..4];
                for x in columns {
                    put([x, y, z], four[x].to_f32());
                }
            } else {
                for x in columns {
                    put([x, y, z], block.at([xs[x], ys[y], zs[z]]).to_f32());
                }
            }
        }
    }
}
