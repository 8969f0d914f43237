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

/// The gradients at points of cells in index space, the interpolant's own and a smooth one, of samples that are read once; where none is asked
/// for, the smooth one is the own.
#[inline(always)]
pub(crate) fn both_gradients<S: Simd>(
    simd: S,
    source: Source<'_>,
    dims: [i32; 3],
    cell: &[Ints<S>; 3],
    local: &Vecs<S>,
    of: Mask<S>,
    asks_smooth: bool,
) -> [Vecs<S>; 2] {
    if !asks_smooth {
        let own = gradient(&source.corners(simd, cell, of), local);
        return [own; 2];
    }
    let mut around = Around::unknown(simd);
    let smooth = source.smooth_gradient(simd, dims, cell, local, of, &mut around);
    let corner = |c: usize| Floats::load_array_ref(simd, &around.samples[1 + (c >> 2)][1 + (c >> 1 & 1)][1 + (c & 1)]);
    let own = gradient(&[corner(0), corner(1), corner(2), corner(3), corner(4), corner(5), corner(6), corner(7)], local);
    [own, smooth]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::roots::tests::trilinear_f64;
    use bregma_field::{Samples, Store};
    use bregma_synthetic::Random;
    use fearless_simd::{Level, dispatch};
    use glam::DVec3;

    const DIMS: [usize; 3] = [5, 4, 3];

    fn samples(r: &mut Random) -> Samples {
        Samples::I16((0..DIMS.iter().product()).map(|_| (2000.0 * r.unit() - 1000.0) as i16).collect())
    }

    fn sample(samples: &Samples, at: [i32; 3]) -> f64 {
        let Samples::I16(s) = samples else { panic!("the samples are i16") };
        let [i, j, k]: [usize; 3] = std::array::from_fn(|a| at[a].clamp(0, DIMS[a] as i32 - 1) as usize);
        f64::from(s[i + DIMS[0] * (j + DIMS[1] * k)])
    }

    fn cells(r: &mut Random) -> [[i32; LANES]; 3] {
        std::array::from_fn(|a| std::array::from_fn(|_| ((DIMS[a] - 1) as f64 * r.unit()) as i32))
    }

    #[test]
    fn corners_and_what_is_around_are_the_samples_that_lie_there() {
        // Fails if a stride is another's, a border is read beyond its end, or a lane that is not asked for is filled.
        let mut r = Random(1);
        for _ in 0..100 {
            let (samples, cells) = (samples(&mut r), cells(&mut r));
            let asked = (65536.0 * r.unit()) as u16;
            let dims = DIMS.map(|n| n as i32);
            let (corners, taps) = dispatch!(Level::new(), simd => {
                let source = Source::Samples(Store::new(&samples, DIMS).whole());
                let of = Mask::from_bitmask(simd, u64::from(asked));
                let cell = cells.map(|c| Ints::load_array(simd, c));
                (source.corners(simd, &cell, of).map(|f| f.to_array()), source.taps(dims, &cell, of))
            });
            for lane in 0..LANES {
                let is_asked = asked >> lane & 1 == 1;
                let there =
                    |at: [i32; 3]| if is_asked { sample(&samples, std::array::from_fn(|a| cells[a][lane] + at[a])) as f32 } else { 0.0 };
                for (c, corner) in corners.iter().enumerate() {
                    assert_eq!(corner[lane], there([c & 1, c >> 1 & 1, c >> 2].map(|n| n as i32)));
                }
                for (n, tap) in taps.iter().enumerate() {
                    assert_eq!(tap[lane], there([n % 4, n / 4 % 4, n / 16].map(|n| n as i32 - 1)));
                }
            }
        }
    }

    #[test]
    fn smooth_gradients_are_central_differences_and_do_not_jump_between_cells() {
        // Fails if a difference is of other samples, a border is not one-sided, or a cell's face has two gradients.
        let mut r = Random(2);
        for _ in 0..100 {
            let (samples, cells) = (samples(&mut r), cells(&mut r));
            let mut local: [[f32; LANES]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| r.unit() as f32));
            // Some lie on faces.
            (0..4).for_each(|lane| local[lane % 3][lane] = (lane / 2) as f32);
            let found = dispatch!(Level::new(), simd => {
                let source = Source::Samples(Store::new(&samples, DIMS).whole());
                let (cell, local) = (cells.map(|c| Ints::load_array(simd, c)), local.map(|c| Floats::load_array(simd, c)));
                let all = Mask::splat(simd, true);
                source.smooth_gradient(simd, DIMS.map(|n| n as i32), &cell, &local, all, &mut Around::unknown(simd)).map(|g| g.to_array())
            });
            for lane in 0..LANES {
                for axis in 0..3 {
                    let mut expected = 0.0;
                    for corner in 0..8 {
                        let at: [i32; 3] = std::array::from_fn(|a| cells[a][lane] + (corner >> a & 1));
                        let beside =
                            |step: i32| std::array::from_fn(|a| (at[a] + if a == axis { step } else { 0 }).clamp(0, DIMS[a] as i32 - 1));
                        let (low, high): ([i32; 3], [i32; 3]) = (beside(-1), beside(1));
                        let slope = (sample(&samples, high) - sample(&samples, low)) / f64::from(high[axis] - low[axis]);
                        let share = |a: usize| f64::from(if corner >> a & 1 == 1 { local[a][lane] } else { 1.0 - local[a][lane] });
                        expected += slope * share(0) * share(1) * share(2);
                    }
                    assert!((f64::from(found[axis][lane]) - expected).abs() < 1e-2, "{} is not {expected}", found[axis][lane]);
                }
            }
        }
    }

    #[test]
    fn a_gradient_is_what_the_interpolant_changes_by() {
        // Fails if a corner stands at another's place, or an axis is interpolated along itself.
        let mut r = Random(2);
        for _ in 0..500 {
            let f: [f32; 8] = std::array::from_fn(|_| (2.0 * r.unit() - 1.0) as f32);
            let p: [f32; 3] = std::array::from_fn(|_| r.unit() as f32);
            let at = DVec3::from_array(p.map(f64::from));
            let found = dispatch!(Level::new(), simd => {
                let splat = |v: f32| Floats::splat(simd, v);
                gradient(&f.map(splat), &p.map(splat)).map(|g| g[0])
            });
            for (axis, found) in DVec3::AXES.into_iter().zip(found) {
                // Along an axis the interpolant is linear.
                let change = trilinear_f64(&f, at + 0.5 * axis) - trilinear_f64(&f, at - 0.5 * axis);
                assert!((f64::from(found) - change).abs() < 1e-5, "{f:?} at {p:?}: {found} is not {change}");
            }
        }
    }
}
