//! Solids made smooth: their surface moves along its normal by its mean curvature, so that a ball shrinks as `R² − 4·t` and a plane stays.
//!
//! ```text
//!   ∂φ/∂t = |∇φ| div(∇φ / |∇φ|)
//! ```
//! A step is semi-implicit and taken apart by axes: three times a system of three bands along each line of samples, whose mean is the step's result, stable
//! however long it is (Weickert and Kühne 2003, "Fast methods for implicit active contour models"). Only blocks of samples near the surface are kept, so that a
//! step costs what these hold; every few steps they are chosen anew, and what is far from the surface gets distances from what is near. Axes are taken
//! to be at right angles.

use crate::solid::{Solid, Tile};
use bregma_volume::{BRICK, Cancelled, Grid, Progress};
use glam::{DVec3, IVec3, USizeVec3};
use rayon::prelude::*;

/// Samples of a block.
const SAMPLES: usize = BRICK * BRICK * BRICK;
/// How far within each sample of a block is, mm, i fastest.
type Block = [f32; SAMPLES];

/// A step of time in squares of the shortest spacing: its error is of the second order in how far the surface moves in it, a quarter of a voxel at a radius
/// of four.
const STEP: f64 = 0.5;
/// Steps between two choices of blocks: what is wrong at their ends, eight samples from the surface at least, travels four voxels in them.
const STEPS: usize = 8;
/// What is at most so many of the longest spacings from the surface is not made anew from what is nearer.
const NEAR: f64 = 3.0;
/// Distances travel a sample in each round, and blocks reach sixteen samples beyond the surface's own.
const ROUNDS: usize = 24;
/// Added to gradients, which are near 1 mm per mm, so that nothing is divided by 0 where there is none.
const LEAST_GRADIENT: f32 = 1e-3;

impl Solid {
    /// Smoothed so far that what is a ball of `radius_mm` vanishes just so: for a time of `radius_mm²/4`, mm². `grid` is the solid's.
    ///
    /// # Panics
    /// Where the grid has other samples.
    pub fn smoothed(&self, grid: &Grid, radius_mm: f64, progress: &Progress) -> Result<Self, Cancelled> {
        assert_eq!(self.dims(), grid.dims(), "a solid on the samples of its grid");
        let time_mm2 = radius_mm * radius_mm / 4.0;
        let shortest = grid.spacing_mm().min_element();
        let steps = (time_mm2 / (STEP * shortest * shortest)).ceil().max(1.0) as usize;
        let mut band = Band::of(self, grid);
        progress.begin(steps as u64);
        for step in 0..steps {
            progress.advance(1)?;
            if step > 0 && step % STEPS == 0 {
                band = band.chosen_anew(false);
            }
            band.step(time_mm2 / steps as f64);
        }
        band.chosen_anew(true).solid(grid)
    }
}

/// Blocks of samples near a surface.
struct Band {
    count: USizeVec3,
    spacing_mm: DVec3,
    /// For each block of the grid, i fastest, its number among those that are kept, or which side it is on.
    slots: Vec<Result<u32, bool>>,
    /// Where each that is kept lies.
    places: Vec<USizeVec3>,
    values: Vec<Block>,
}

impl Band {
    fn of(solid: &Solid, grid: &Grid) -> Self {
        let (dims, spacing_mm) = (USizeVec3::from(grid.dims()), grid.spacing_mm());
        let count = (dims + BRICK - 1) / BRICK;
        // As far as distances are kept.
        let known_mm = Solid::band_mm(grid) as f32;
        let inner = |at: USizeVec3| (f64::from(solid.units_at(at.to_array())) * solid.unit_mm()) as f32;
        // Beyond the grid it goes on straight.
        let value = |at: USizeVec3| {
            let last = at.min(dims - 1);
            let beyond = |axis: usize, step: USizeVec3| {
                let over = (at - last)[axis] as f32;
                if over > 0.0 && last[axis] > 0 { over * (inner(last) - inner(last - step)) } else { 0.0 }
            };
            inner(last) + beyond(0, USizeVec3::X) + beyond(1, USizeVec3::Y) + beyond(2, USizeVec3::Z)
        };
        let block = |n: usize| -> (Block, bool) {
            let first = place_of(n, count) * BRICK;
            let block: Block = std::array::from_fn(|n| value(first + place_of(n, USizeVec3::splat(BRICK))));
            let is_one_sided = block.iter().all(|v| (*v >= 0.0) == (block[0] >= 0.0));
            (block, is_one_sided)
        };
        let sides: Vec<Result<u32, bool>> = (0..count.element_product())
            .into_par_iter()
            .map(|n| {
                let (block, is_one_sided) = block(n);
                if is_one_sided { Err(block[0] >= 0.0) } else { Ok(0) }
            })
            .collect();
        let mut band = Self { count, spacing_mm, slots: sides, places: vec![], values: vec![] };
        band.keep_around(|n| block(n).0);
        band.extend(|v, _| v.abs() <= known_mm);
        band
    }

    /// Keeps the blocks that the surface passes, which are those that are marked, and where it passes between two, and those around them.
    fn keep_around(&mut self, values: impl Fn(usize) -> Block + Sync) {
        let (count, slots) = (self.count, &self.slots);
        let passes = |n: usize| {
            let side = slots[n].err();
            side.is_none() || beside(place_of(n, count), count).any(|m| slots[m].err().is_some_and(|other| Some(other) != side))
        };
        let passed: Vec<bool> = (0..slots.len()).into_par_iter().map(passes).collect();
        let kept: Vec<usize> = (0..slots.len()).into_par_iter().filter(|&n| around(place_of(n, count), count).any(|m| passed[m])).collect();
        self.values = kept.par_iter().map(|&n| values(n)).collect();
        self.places = kept.iter().map(|&n| place_of(n, count)).collect();
        kept.iter().zip(0..).for_each(|(&n, number)| self.slots[n] = Ok(number));
    }

    /// The number of the block that is kept at a place, if one is.
    fn kept(&self, at: IVec3) -> Option<usize> {
        let is_there = at.cmpge(IVec3::ZERO).all() && at.as_usizevec3().cmplt(self.count).all();
        is_there.then(|| self.slots[number_of(at.as_usizevec3(), self.count)].ok()).flatten().map(|n| n as usize)
    }

    /// Of a block, those that lie before and behind it along each axis.
    fn neighbours(&self, block: usize) -> [[Option<usize>; 2]; 3] {
        let at = self.places[block].as_ivec3();
        [IVec3::X, IVec3::Y, IVec3::Z].map(|step| [self.kept(at - step), self.kept(at + step)])
    }

    /// The values before and behind a sample along an axis, where they are kept.
    #[inline]
    fn beside(&self, block: usize, near: &[[Option<usize>; 2]; 3], n: usize, axis: usize) -> [Option<f32>; 2] {
        let stride = BRICK.pow(axis as u32);
        let at = n / stride % BRICK;
        let of = |other: Option<usize>, n: usize| other.map(|other| self.values[other][n]);
        [
            if at > 0 { Some(self.values[block][n - stride]) } else { of(near[axis][0], n + (BRICK - 1) * stride) },
            if at + 1 < BRICK { Some(self.values[block][n + stride]) } else { of(near[axis][1], n - (BRICK - 1) * stride) },
        ]
    }

    /// Differences along each axis at all samples, per mm.
    fn differences(&self) -> Vec<[Block; 3]> {
        let one = |block: usize| {
            let near = self.neighbours(block);
            [0, 1, 2].map(|axis| {
                std::array::from_fn(|n| {
                    let here = self.values[block][n];
                    let [before, behind] = self.beside(block, &near, n, axis);
                    let width = f32::from(u8::from(before.is_some()) + u8::from(behind.is_some())).max(1.0);
                    (behind.unwrap_or(here) - before.unwrap_or(here)) / (width * self.spacing_mm[axis] as f32)
                })
            })
        };
        (0..self.values.len()).into_par_iter().map(one).collect()
    }

    /// Lengths of gradients at all samples.
    fn gradients(&self) -> Vec<Block> {
        self.differences().par_iter().map(|along| std::array::from_fn(|n| length([0, 1, 2].map(|axis| along[axis][n])))).collect()
    }

    /// A step of time.
    fn step(&mut self, time_mm2: f64) {
        let differences = self.differences();
        let mut sum = vec![[0.0; SAMPLES]; self.values.len()];
        for axis in 0..3 {
            let along = self.along(axis, &differences, time_mm2);
            sum.par_iter_mut().zip(along).for_each(|(sum, along)| sum.iter_mut().zip(along).for_each(|(sum, value)| *sum += value / 3.0));
        }
        self.values = sum;
    }

    /// What three times the part of the step along one axis makes of the values.
    fn along(&self, axis: usize, differences: &[[Block; 3]], time_mm2: f64) -> Vec<Block> {
        let step = [IVec3::X, IVec3::Y, IVec3::Z][axis];
        let firsts = (0..self.places.len()).into_par_iter().filter(|&n| self.kept(self.places[n].as_ivec3() - step).is_none());
        let chain = |first: usize| {
            let next = |n: &usize| self.kept(self.places[*n].as_ivec3() + step);
            let blocks: Vec<usize> = std::iter::successors(Some(first), next).collect();
            let mut solved: Vec<(usize, Block)> = blocks.iter().map(|&block| (block, self.values[block])).collect();
            let (stride, weight) = (BRICK.pow(axis as u32), (3.0 * time_mm2 / self.spacing_mm[axis].powi(2)) as f32);
            let (mut line, [u, v]) = (Line::default(), [(axis + 1) % 3, (axis + 2) % 3]);
            for at in (0..SAMPLES).filter(|n| n / stride % BRICK == 0) {
                [&mut line.values, &mut line.gradients, &mut line.across].into_iter().for_each(Vec::clear);
                for (&block, n) in blocks.iter().flat_map(|block| (0..BRICK).map(move |n| (block, at + n * stride))) {
                    let [x, y, z] = [axis, u, v].map(|axis| differences[block][axis][n]);
                    line.values.push(self.values[block][n]);
                    line.gradients.push(length([x, y, z]));
                    line.across.push(y * y + z * z);
                }
                line.solve(weight, self.spacing_mm[axis] as f32);
                for (n, value) in line.values.iter().enumerate() {
                    solved[n / BRICK].1[at + n % BRICK * stride] = *value;
                }
            }
            solved
        };
        let solved: Vec<Vec<(usize, Block)>> = firsts.map(chain).collect();
        let mut all = vec![[0.0; SAMPLES]; self.values.len()];
        solved.into_iter().flatten().for_each(|(block, values)| all[block] = values);
        all
    }

    /// Distances where a value is not near the surface by what `is_near` says of it and its gradient: the least ways from those that are (Godunov's
    /// scheme, in rounds).
    fn extend(&mut self, is_near: impl Fn(f32, f32) -> bool + Sync) {
        let gradients = self.gradients();
        let near: Vec<[bool; SAMPLES]> = self
            .values
            .par_iter()
            .zip(&gradients)
            .map(|(values, gradients)| std::array::from_fn(|n| is_near(values[n], gradients[n])))
            .collect();
        let far = (self.spacing_mm.length() * (3 * BRICK) as f64) as f32;
        self.values.par_iter_mut().zip(&near).for_each(|(values, near)| {
            let far_of = |value: f32| if value >= 0.0 { far } else { -far };
            values.iter_mut().zip(near).filter(|(_, near)| !**near).for_each(|(value, _)| *value = far_of(*value));
        });
        let mut moved = vec![true; self.values.len()];
        for _ in 0..ROUNDS {
            let round = |block: usize| -> Option<Block> {
                let beside = self.neighbours(block);
                let may_move = moved[block] || beside.iter().flatten().flatten().any(|&other| moved[other]);
                may_move
                    .then(|| std::array::from_fn(|n| if near[block][n] { self.values[block][n] } else { self.nearer(block, &beside, n) }))
            };
            let anew: Vec<Option<Block>> = (0..self.values.len()).into_par_iter().map(round).collect();
            for ((values, moved), anew) in self.values.iter_mut().zip(&mut moved).zip(anew) {
                *moved = anew.is_some_and(|anew| anew != *values);
                *values = anew.unwrap_or(*values);
            }
        }
    }

    /// A distance as those beside have it, if that is nearer.
    fn nearer(&self, block: usize, beside: &[[Option<usize>; 2]; 3], n: usize) -> f32 {
        let value = self.values[block][n];
        let side = if value >= 0.0 { 1.0 } else { -1.0 };
        // One of the other side is nearer than any of its own.
        let least = |axis: usize| {
            let both = self.beside(block, beside, n, axis).into_iter().flatten();
            both.map(|value| (value * side).max(0.0)).fold(f32::INFINITY, f32::min)
        };
        let ways = [0, 1, 2].map(least);
        // Most are not reached yet, and come nearer by nobody.
        if ways.iter().all(|way| *way >= value.abs()) { value } else { side * way(ways, self.spacing_mm).min(value.abs()) }
    }

    /// The blocks that the surface passes now. What is near it stays as it is, or is a distance where `ends`.
    fn chosen_anew(mut self, ends: bool) -> Self {
        let gradients = self.gradients();
        if ends {
            self.values.par_iter_mut().zip(gradients).for_each(|(values, gradients)| {
                values.iter_mut().zip(gradients).for_each(|(value, gradient)| *value /= gradient);
            });
        }
        let side = |block: u32| {
            let values = &self.values[block as usize];
            let inside = values[0] >= 0.0;
            if values.iter().all(|v| (*v >= 0.0) == inside) { Err(inside) } else { Ok(0) }
        };
        let slots = self.slots.iter().map(|slot| slot.and_then(side));
        let mut anew = Self { count: self.count, spacing_mm: self.spacing_mm, slots: slots.collect(), places: vec![], values: vec![] };
        let far = (self.spacing_mm.length() * (3 * BRICK) as f64) as f32;
        anew.keep_around(|n| match self.slots[n] {
            Ok(block) => self.values[block as usize],
            Err(inside) => [if inside { far } else { -far }; SAMPLES],
        });
        let near_mm = (NEAR * self.spacing_mm.max_element()) as f32;
        anew.extend(|value, gradient| value.abs() <= near_mm * if ends { 1.0 } else { gradient.min(1.0) });
        anew
    }

    fn solid(self, grid: &Grid) -> Result<Solid, Cancelled> {
        let far = (self.spacing_mm.length() * (3 * BRICK) as f64) as f32;
        let value = |at: USizeVec3| match self.slots[number_of(at / BRICK, self.count)] {
            Ok(block) => self.values[block as usize][number_of(at % BRICK, USizeVec3::splat(BRICK))],
            Err(true) => far,
            Err(false) => -far,
        };
        let tile = |first: USizeVec3, size: USizeVec3| {
            Tile::Distances((0..size.element_product()).map(|n| value(first + place_of(n, size))).collect())
        };
        Solid::of_tiles(grid, &Progress::default(), tile)
    }
}

/// The length of a gradient, and a little more.
fn length([x, y, z]: [f32; 3]) -> f32 {
    (x * x + y * y + z * z).sqrt() + LEAST_GRADIENT
}

/// A line of samples, and room to solve its system.
#[derive(Default)]
struct Line {
    values: Vec<f32>,
    gradients: Vec<f32>,
    /// Squares of the gradients' parts across the line.
    across: Vec<f32>,
    /// One by the gradient between a sample and the one behind it.
    between: Vec<f32>,
    above: Vec<f32>,
}

impl Line {
    /// Solves `(1 − weight·A) x = values`; both ends stay, as though the line went on straight (Thomas's algorithm). The gradient between two samples is
    /// taken there, so that planes stay on both sides of the middle of a slab, where it has none.
    fn solve(&mut self, weight: f32, spacing_mm: f32) {
        let count = self.values.len();
        self.between.clear();
        self.between.extend((1..count).map(|n| {
            let along = (self.values[n] - self.values[n - 1]) / spacing_mm;
            1.0 / ((along * along + 0.5 * (self.across[n] + self.across[n - 1])).sqrt() + LEAST_GRADIENT)
        }));
        self.above.clear();
        self.above.resize(count, 0.0);
        let (values, above) = (&mut self.values, &mut self.above);
        for n in 1..count - 1 {
            let [before, behind] = [self.between[n - 1], self.between[n]].map(|between| weight * self.gradients[n] * between);
            let pivot = 1.0 + before + behind - before * above[n - 1];
            above[n] = behind / pivot;
            values[n] = (values[n] + before * values[n - 1]) / pivot;
        }
        for n in (1..count - 1).rev() {
            values[n] += above[n] * values[n + 1];
        }
    }
}

/// The least way from samples that lie beside along each axis: the solution of Σ((u − aᵢ)/hᵢ)² = 1 over those that are below it.
fn way(mut ways: [f32; 3], spacing_mm: DVec3) -> f32 {
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a: &usize, &b| ways[a].total_cmp(&ways[b]));
    ways = axes.map(|a| ways[a]);
    let weights = axes.map(|a| (1.0 / (spacing_mm[a] * spacing_mm[a])) as f32);
    let mut found = f32::INFINITY;
    for count in 1..=3 {
        if ways[count - 1] >= found {
            break;
        }
        let [w, wa, waa] =
            (0..count).fold([0.0; 3], |[w, wa, waa], n| [w + weights[n], wa + weights[n] * ways[n], waa + weights[n] * ways[n] * ways[n]]);
        let root = wa * wa - w * (waa - 1.0);
        if root < 0.0 {
            break;
        }
        found = (wa + root.sqrt()) / w;
    }
    found
}

fn number_of(at: USizeVec3, count: USizeVec3) -> usize {
    (at.z * count.y + at.y) * count.x + at.x
}

fn place_of(n: usize, count: USizeVec3) -> USizeVec3 {
    USizeVec3::new(n % count.x, n / count.x % count.y, n / (count.x * count.y))
}

/// The numbers of places that share a face with one.
fn beside(at: USizeVec3, count: USizeVec3) -> impl Iterator<Item = usize> {
    let steps = [USizeVec3::X, USizeVec3::Y, USizeVec3::Z];
    let all = steps.into_iter().flat_map(move |step| [at.wrapping_add(step), at.wrapping_sub(step)]);
    all.filter(move |at| at.cmplt(count).all()).map(move |at| number_of(at, count))
}

/// The numbers of a place and of all that share a corner with it.
fn around(at: USizeVec3, count: USizeVec3) -> impl Iterator<Item = usize> {
    let all = (0..27).map(move |n| at.wrapping_add(place_of(n, USizeVec3::splat(3))).wrapping_sub(USizeVec3::ONE));
    all.filter(move |at| at.cmplt(count).all()).map(move |at| number_of(at, count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_volume::IndexPoint;
    use glam::DMat3;
    use std::time::Instant;

    fn grid(dims: [usize; 3], spacing: DVec3) -> Grid {
        Grid::new(dims, spacing, DVec3::ZERO, DMat3::IDENTITY).unwrap()
    }

    /// The mean distance of a solid's surface from a point, along the axes' lines of samples through it; none where it is gone.
    fn radius_mm(solid: &Solid, grid: &Grid, centre: DVec3) -> f64 {
        let directions: Vec<DVec3> =
            (0..200).map(|n| DVec3::new((n as f64).sin(), (1.7 * n as f64).cos(), (0.3 * n as f64 + 1.0).sin())).collect();
        let radius = |d: &DVec3| {
            let d = d.normalize();
            let value = |r: f64| solid.distance_and_gradient(grid.index(bregma_volume::WorldPoint(centre + r * d))).0;
            let [mut low, mut high] = [0.0, 14.0];
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if value(middle) >= 0.0 { low = middle } else { high = middle }
            }
            low
        };
        directions.iter().map(radius).sum::<f64>() / directions.len() as f64
    }

    #[test]
    fn a_ball_shrinks_as_the_formula_has_it() {
        // Fails if time is another's, an axis counts twice, or blocks that are chosen anew hold the surface back: R² − 4·t.
        for spacing in [DVec3::splat(0.5), DVec3::new(0.5, 0.6, 0.7)] {
            let grid = grid([64, 56, 48], spacing);
            let centre = grid.world(IndexPoint(DVec3::new(31.3, 27.6, 23.2))).0;
            for (radius, by) in [(10.0, 4.0), (10.0, 8.0), (8.0, 7.0), (4.0, 2.0)] {
                let solid = Solid::of(&grid, |p| radius - grid.world(p).0.distance(centre));
                let begun = Instant::now();
                let smooth = solid.smoothed(&grid, by, &Progress::default()).unwrap();
                let (found, expected) = (radius_mm(&smooth, &grid, centre), (radius * radius - by * by).sqrt());
                let off = (found - expected) / spacing.min_element();
                println!(
                    "{spacing}: a ball of {radius} mm after {} mm²: {found:.4} for {expected:.4} mm, {off:.3} voxel off, in {:.2} s",
                    by * by / 4.0,
                    begun.elapsed().as_secs_f64()
                );
                // Three parts in a hundred of its way, and the roundness of a surface between samples.
                let way = (radius - expected) / spacing.min_element();
                assert!(off.abs() < 0.03 * way + 0.02, "{off} of {way}");
            }
            let solid = Solid::of(&grid, |p| 4.0 - grid.world(p).0.distance(centre));
            let gone = solid.smoothed(&grid, 4.6, &Progress::default()).unwrap();
            assert!(gone.slots().iter().all(|slot| *slot == 0), "what is smaller than the radius is gone");
        }
    }

    #[test]
    fn a_slab_does_not_move_and_its_steps_do_not_depend_on_threads() {
        // Fails if the end of a band pulls at the surface, a plane between blocks is lost, or rounding comes in another order.
        let grid = grid([40, 40, 44], DVec3::new(0.5, 0.6, 0.7));
        let normal = DVec3::new(0.3, -0.2, 0.93).normalize();
        // What the middle of a slab makes wrong where it lies askew reaches its faces in this time, ten voxels of way for what moves.
        for (normal, at, bound) in [(DVec3::Z, 15.4, 2e-3), (DVec3::Z, 16.8, 2e-3), (normal, 13.0, 0.1)] {
            let slab = Solid::of(&grid, |p| 4.1 - (grid.world(p).0.dot(normal) - at).abs());
            let smooth = slab.smoothed(&grid, 5.0, &Progress::default()).unwrap();
            let mut worst: f64 = 0.0;
            for n in 0..grid.len() {
                let at = [n % 40, n / 40 % 40, n / 1600];
                let [was, is] = [&slab, &smooth].map(|solid| f64::from(solid.units_at(at)) * solid.unit_mm());
                if was.abs() < 0.9 {
                    worst = worst.max((is - was).abs() / 0.5);
                }
            }
            println!("a slab across {normal:.2} moved {worst:.1e} voxel");
            assert!(worst < bound, "{worst}");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            let alone = pool.install(|| slab.smoothed(&grid, 5.0, &Progress::default()).unwrap());
            assert!(alone == smooth, "one thread or more");
        }
    }

    #[test]
    fn a_step_costs_what_the_band_holds() {
        // Fails if a step's time grows with the grid around the same ball.
        let time = |side: usize| {
            let grid = grid([side; 3], DVec3::ONE);
            let centre = DVec3::splat(side as f64 / 2.0);
            let solid = Solid::of(&grid, |p| 20.0 - p.0.distance(centre));
            let times = (0..3).map(|_| {
                let begun = Instant::now();
                let mut band = Band::of(&solid, &grid);
                let made = begun.elapsed().as_secs_f64();
                (0..4).for_each(|_| band.step(0.5));
                (begun.elapsed().as_secs_f64() - made, band.values.len())
            });
            times.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
        };
        let [small, large] = [64, 192].map(time);
        println!("4 steps of {} blocks in 64³: {:.3} s; of {} in 192³: {:.3} s", small.1, small.0, large.1, large.0);
        assert!(small.1.abs_diff(large.1) * 5 < small.1 && large.0 < 3.0 * small.0 + 0.02);
    }

    #[test]
    fn a_grid_of_few_samples_is_smoothed_too() {
        // Fails if a line of one block, or a grid without a surface, is no line or no band.
        for dims in [[2, 2, 2], [3, 40, 2], [9, 8, 7]] {
            let grid = grid(dims, DVec3::ONE);
            for solid in [Solid::of(&grid, |_| 1.0), Solid::of(&grid, |_| -9.0), Solid::of(&grid, |p| p.0.y - 2.2)] {
                let smooth = solid.smoothed(&grid, 2.0, &Progress::default()).unwrap();
                assert_eq!(smooth.units_at([1, 1, 1]) >= 0, solid.units_at([1, 1, 1]) >= 0);
            }
        }
    }
}
