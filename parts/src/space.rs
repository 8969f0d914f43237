//! The space that belongs to parts: their samples with all cells around these, and no nearer to another part than to them.
//!
//! ```text
//!   φ = min(reach − d, (d′ − d) / 2)     d, d′: how far the nearest sample of these parts is, and of others; mm
//! ```
//! A part's samples lie inside of its bone, whose surface passes between them and the samples beside: with a reach of a cell's diagonal it is whole.

use crate::brush::Span;
use crate::envelope::Envelope;
use crate::labels::Labels;
use bregma_field::solid::Tile;
use bregma_field::{Cancelled, Progress, Solid, Surface};
use glam::{DVec3, USizeVec3};

/// How far all cells around a sample reach, in diagonals of a cell, and more than rounding beyond: their corners must not be changed.
const REACH_DIAGONALS: f64 = 1.001;

/// Whose a sample is.
#[derive(Clone, Copy, PartialEq)]
enum Whose {
    Theirs,
    Another,
    Nobody,
}

/// What of the parts is meant.
#[derive(Clone, Copy, Debug)]
pub struct Meant<'a> {
    /// Their numbers.
    pub numbers: &'a [u16],
    /// How far they are grown beyond the cells around their samples, mm; shrunk where negative.
    pub grow_mm: f64,
    /// Bone that belongs to no part is another's.
    pub bone: Option<&'a Surface>,
}

impl Labels {
    /// The space that belongs to some of the parts. `progress` counts tiles.
    pub fn space_of(&self, meant: Meant<'_>, progress: &Progress) -> Result<Solid, Cancelled> {
        let work = self.work(meant);
        Solid::of_tiles(self.grid(), progress, |first, size| work.tile(first, size))
    }

    /// The same where it is known of labels that differ from these only at samples of `changed`: tiles as near to these as matters are made anew.
    pub fn space_again(&self, meant: Meant<'_>, known: &Solid, changed: Span, progress: &Progress) -> Result<Solid, Cancelled> {
        let work = self.work(meant);
        let is_near = |first: USizeVec3, size: USizeVec3| {
            let (low, high) = (first.saturating_sub(work.apron), first + size + work.apron);
            changed.high.cmpge(low).all() && changed.low.cmplt(high).all()
        };
        known.with_tiles(self.grid(), progress, |first, size| is_near(first, size).then(|| work.tile(first, size)))
    }

    fn work<'a>(&'a self, meant: Meant<'a>) -> Work<'a> {
        let grid = self.grid();
        let spacing_mm = grid.spacing_mm();
        let reach_mm = REACH_DIAGONALS * spacing_mm.length() + meant.grow_mm;
        // Beyond the band nothing need be known but the side; depths are counted from a sample within.
        let apron_mm = reach_mm.abs() + Solid::band_mm(grid) + spacing_mm.min_element();
        let apron = (DVec3::splat(apron_mm) / spacing_mm).ceil().as_usizevec3().min(grid.dims().into());
        let mut whose = vec![Whose::Another; 1 << 16];
        whose[0] = Whose::Nobody;
        meant.numbers.iter().for_each(|&number| whose[usize::from(number)] = Whose::Theirs);
        Work { labels: self, whose, bone: meant.bone, dims: grid.dims().into(), spacing_mm, reach_mm, apron }
    }
}

/// What tiles are worked out from.
struct Work<'a> {
    labels: &'a Labels,
    /// By the numbers of labels.
    whose: Vec<Whose>,
    bone: Option<&'a Surface>,
    dims: USizeVec3,
    spacing_mm: DVec3,
    reach_mm: f64,
    /// Samples around a tile that may be the nearest of one in it.
    apron: USizeVec3,
}

impl Work<'_> {
    /// How far within the space each sample of a tile is, mm.
    fn tile(&self, first: USizeVec3, size: USizeVec3) -> Tile {
        let low = USizeVec3::new(
            first.x.saturating_sub(self.apron.x),
            first.y.saturating_sub(self.apron.y),
            first.z.saturating_sub(self.apron.z),
        );
        let box_size = (first + size + self.apron).min(self.dims) - low;
        let whose = self.whose(low, box_size);
        let count = |who: Whose| whose.iter().filter(|w| **w == who).count();
        let (own, others) = (count(Whose::Theirs), count(Whose::Another));
        if own == 0 || own == whose.len() {
            return Tile::Side(own > 0);
        }
        let to = |is: &dyn Fn(Whose) -> bool| {
            let mut squares: Vec<f32> = whose.iter().map(|w| if is(*w) { 0.0 } else { f32::INFINITY }).collect();
            squared_distances(&mut squares, box_size, self.spacing_mm);
            squares
        };
        let own = to(&|w| w == Whose::Theirs);
        let beside = to(&|w| w != Whose::Theirs);
        let other = (others > 0).then(|| to(&|w| w == Whose::Another));
        let mut tile = Vec::with_capacity(size.element_product());
        for n in 0..size.element_product() {
            let at = USizeVec3::new(n % size.x, n / size.x % size.y, n / (size.x * size.y)) + first - low;
            let m = (at.z * box_size.y + at.y) * box_size.x + at.x;
            let from_own = f64::from(own[m].sqrt());
            // Deep in it: how far it is out of it, so that what is far from its surface is known to be.
            let depth = if from_own > 0.0 { -from_own } else { f64::from(beside[m].sqrt()) - self.spacing_mm.min_element() };
            let from_other = other.as_ref().map_or(f64::INFINITY, |other| f64::from(other[m].sqrt()));
            tile.push((self.reach_mm + depth).min((from_other - from_own) / 2.0) as f32);
        }
        Tile::Distances(tile)
    }

    fn whose(&self, low: USizeVec3, size: USizeVec3) -> Vec<Whose> {
        let mut whose = Vec::with_capacity(size.element_product());
        let mut numbers = vec![0; size.x];
        for z in low.z..low.z + size.z {
            for y in low.y..low.y + size.y {
                self.labels.numbers().read(USizeVec3::new(low.x, y, z), &mut numbers);
                whose.extend(numbers.iter().map(|n| self.whose[usize::from(*n)]));
                if let Some(bone) = self.bone {
                    let row = whose.len() - size.x;
                    add_others(bone, [low.x, y, z], &mut whose[row..]);
                }
            }
        }
        whose
    }
}

/// Bone of a row of samples that is nobody's is another's.
fn add_others(surface: &Surface, [i, j, k]: [usize; 3], row: &mut [Whose]) {
    let nobodys = row.iter_mut().enumerate().filter(|(_, whose)| **whose == Whose::Nobody);
    nobodys.filter(|(n, _)| surface.holds([i + n, j, k])).for_each(|(_, whose)| *whose = Whose::Another);
}

/// Makes of 0 and infinity the squared distance of each sample from the nearest with 0, along one axis after the other.
fn squared_distances(squares: &mut [f32], size: USizeVec3, spacing_mm: DVec3) {
    let strides = [1, size.x, size.x * size.y];
    let (mut line, mut envelope) = (vec![0.0_f32; size.max_element()], Envelope::default());
    for axis in 0..3 {
        let (count, stride) = (size[axis], strides[axis]);
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        for (b, a) in (0..size[v]).flat_map(|b| (0..size[u]).map(move |a| (b, a))) {
            let first = a * strides[u] + b * strides[v];
            (0..count).for_each(|n| line[n] = squares[first + n * stride]);
            // All at it, or nothing known yet.
            if line[..count].iter().all(|square| *square == line[0] && matches!(*square, 0.0 | f32::INFINITY)) {
                continue;
            }
            envelope.lower(&mut line[..count], spacing_mm[axis]);
            (0..count).for_each(|n| squares[first + n * stride] = line[n]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::Part;
    use bregma_field::{Grid, IndexPoint, Samples};
    use bregma_synthetic::Random;
    use glam::{DAffine3, DMat3};
    use std::sync::Arc;

    fn labels(dims: [usize; 3], spacing: DVec3, numbers: Vec<u8>) -> Labels {
        let grid = Grid::new(dims, spacing, DVec3::ZERO, DMat3::IDENTITY).unwrap();
        Labels::new(grid, Samples::U8(numbers), vec![Part::new(1, "a".into()), Part::new(2, "b".into())]).unwrap()
    }

    #[test]
    fn the_space_of_a_part_is_what_is_nearer_to_it_than_a_cell_is_long_and_than_others() {
        // Fails if a distance is not the nearest one, an axis has another's spacing, tiles do not fit together, or another part's space is taken.
        let (dims, spacing) = ([41, 35, 37], DVec3::new(0.7, 1.0, 1.3));
        let mut r = Random(5);
        let numbers: Vec<u8> =
            (0..dims.iter().product()).map(|_| if r.unit() < 0.001 { 1 + u8::from(r.unit() < 0.5) } else { 0 }).collect();
        let labels = labels(dims, spacing, numbers.clone());
        let places = |number: u8| -> Vec<DVec3> {
            let at =
                |n: usize| DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / (dims[0] * dims[1])) as f64) * spacing;
            (0..numbers.len()).filter(|n| numbers[*n] == number).map(at).collect()
        };
        let (own, other) = (places(1), places(2));
        for grow_mm in [0.0, 0.8, -0.6] {
            let solid = labels.space_of(Meant { numbers: &[1], grow_mm, bone: None }, &Progress::default()).unwrap();
            let (mut worst, mut near, band_mm) = (0.0_f64, 0, Solid::band_mm(labels.grid()));
            for n in 0..numbers.len() {
                let at = [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
                let p = DVec3::from(at.map(|i| i as f64)) * spacing;
                let nearest = |of: &[DVec3]| of.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
                let exact = (REACH_DIAGONALS * spacing.length() + grow_mm - nearest(&own)).min((nearest(&other) - nearest(&own)) / 2.0);
                let found = f64::from(solid.units_at(at)) * solid.unit_mm();
                if nearest(&own) > 0.0 && exact.abs() < band_mm {
                    worst = worst.max((found - exact).abs() / 0.7);
                    near += 1;
                }
                // As near float32 is on either side.
                assert!((found >= 0.0) == (exact >= 0.0) || exact.abs() < 1e-6, "{at:?}: {found} for {exact}");
            }
            println!("grown by {grow_mm} mm: {near} samples in the band, worst {worst:.1e} voxel");
            assert!(near > 1000 && worst < 1e-3);
        }
    }

    #[test]
    fn a_jaw_and_its_skull_take_little_memory() {
        // Fails if what is far from the surface of a part's space is kept.
        let size = std::env::var("BREGMA_SIZE").ok().and_then(|n| n.parse().ok()).unwrap_or(96);
        let volume = bregma_synthetic::skull(bregma_synthetic::Which::A, size, &Progress::default()).unwrap();
        let surface = Surface::new(&Arc::new(volume), 226.0, DAffine3::IDENTITY).unwrap();
        let labels = crate::separate(&surface, crate::Neck { mm: 4.0, least_mm3: None }, &Progress::default()).unwrap();
        for part in labels.parts() {
            let begun = std::time::Instant::now();
            let meant = Meant { numbers: &[part.number], grow_mm: 0.0, bone: Some(&surface) };
            let mb = labels.space_of(meant, &Progress::default()).unwrap().bytes() as f64 / 1e6;
            println!("{} of skull A, {size}³: {mb:.1} MB, made in {:.2} s", part.name, begun.elapsed().as_secs_f64());
            // By area; the samples themselves take 268 MB at 512³.
            assert!(mb < 40.0 * (size as f64 / 512.0).powi(2));
        }
    }

    #[test]
    fn a_space_made_anew_where_it_was_painted_is_the_same_as_all_of_it() {
        // Fails if a tile that a dab reaches stays as it was, or blocks are put together in another order. BREGMA_SIZE=512 for the figures.
        let size = std::env::var("BREGMA_SIZE").ok().and_then(|n| n.parse().ok()).unwrap_or(128);
        let volume = Arc::new(bregma_synthetic::skull(bregma_synthetic::Which::A, size, &Progress::default()).unwrap());
        let bone = Surface::new(&volume, 226.0, DAffine3::IDENTITY).unwrap();
        let islands = crate::Islands::of_bone(&bone, &Progress::default()).unwrap();
        let mut labels = islands.labels(volume.grid(), &[(0, "a".into())]).unwrap();
        let meant = Meant { numbers: &[1], grow_mm: 0.0, bone: Some(&bone) };
        let begun = std::time::Instant::now();
        let known = labels.space_of(meant, &Progress::default()).unwrap();
        let whole_s = begun.elapsed().as_secs_f64();
        let touched = |n: &usize| bone.holds([n % size, n / size % size, n / size / size]);
        let all: Vec<usize> = (0..volume.grid().len()).filter(touched).step_by(50_000).take(3).collect();
        for n in all {
            let at = IndexPoint(DVec3::new((n % size) as f64, (n / size % size) as f64, (n / size / size) as f64));
            let dab = crate::Dab { at, radius_mm: 4.0, number: 0 };
            let begun = std::time::Instant::now();
            let Some(changed) = labels.paint(&bone, dab, |_| true) else { continue };
            let painted_ms = begun.elapsed().as_secs_f64() * 1e3;
            let again = labels.space_again(meant, &known, changed, &Progress::default()).unwrap();
            let ms = begun.elapsed().as_secs_f64() * 1e3;
            println!("{size}³: a dab of 4 mm {painted_ms:.2} ms, with its part's space {ms:.0} ms; all of the space {whole_s:.2} s");
            if size <= 128 {
                assert!(again == labels.space_of(meant, &Progress::default()).unwrap());
                assert!(again != known);
            }
            labels = islands.labels(volume.grid(), &[(0, "a".into())]).unwrap();
        }
    }

    #[test]
    fn what_is_grown_and_shrunk_is_the_offset_of_its_samples() {
        // Fails if a face or an edge of a box of samples is not where its offset is, or a ball's is farther from it than its samples are from the ball. Of
        // bodies that lie at samples distances are exact; of others a label map knows no more than its samples.
        let spacing = DVec3::ONE;
        // Larger than a tile, with tiles wholly within.
        let dims = [80, 80, 80];
        let within_box = |p: DVec3, half: DVec3| {
            let out = (p - 40.0).abs() - half;
            -(out.max(DVec3::ZERO).length() + out.max_element().min(0.0))
        };
        let slab = |p: DVec3| 20.0 - (p.z - 40.0).abs();
        let cube = |p: DVec3| within_box(p, DVec3::new(25.0, 24.0, 23.0));
        let ball = |p: DVec3| 26.3 - (p - 40.0).length();
        // A ball's samples lie up to half a diagonal of a voxel within it, and those around it up to a voxel outside.
        type Body<'a> = (&'a str, &'a dyn Fn(DVec3) -> f64, f64);
        let bodies: [Body<'_>; 3] = [("slab", &slab, 1e-3), ("box", &cube, 1e-3), ("ball", &ball, 1.0)];
        for (name, distance, bound) in bodies {
            let place = |n: usize| DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / dims[0] / dims[1]) as f64);
            let count = dims.iter().product();
            let labels = labels(dims, spacing, (0..count).map(|n| u8::from(distance(place(n)) >= 0.0)).collect());
            let reach_mm = REACH_DIAGONALS * spacing.length();
            for grow_mm in [0.0, 2.5, 6.0, -3.0, -9.5] {
                let meant = Meant { numbers: &[1], grow_mm, bone: None };
                let solid = labels.space_of(meant, &Progress::default()).unwrap();
                let near = Solid::band_mm(labels.grid());
                let off = |n: usize| {
                    let exact = distance(place(n)) + reach_mm + grow_mm;
                    let at = place(n).as_usizevec3().to_array();
                    let found = f64::from(solid.units_at(at)) * solid.unit_mm();
                    (exact.abs() < near).then(|| (found.clamp(-near, near) - exact).abs())
                };
                let all: Vec<f64> = (0..count).filter_map(off).collect();
                let worst = all.iter().copied().fold(0.0, f64::max);
                println!("a {name} of samples grown by {grow_mm} mm: at most {worst:.1e} voxel off, of {} samples", all.len());
                assert!(worst < bound && all.len() > 1000, "{name}, {grow_mm} mm: {worst}");
            }
        }
    }

    #[test]
    fn all_cells_around_a_part_are_in_its_space_and_bone_of_nobody_is_not() {
        // Fails if the surface of a part's bone is cut, or bone beside it that has no label counts as its own.
        let dims = [24, 20, 22];
        let holds = |solid: &Solid, x: f64| solid.distance_and_gradient(IndexPoint(DVec3::new(x, 9.0, 9.0))).0 >= 0.0;
        let numbers: Vec<u8> = (0..dims.iter().product()).map(|n: usize| u8::from((6..12).contains(&(n % 24)))).collect();
        let labels = labels(dims, DVec3::ONE, numbers);
        let solid = labels.space_of(Meant { numbers: &[1], grow_mm: 0.0, bone: None }, &Progress::default()).unwrap();
        assert!(holds(&solid, 5.0) && holds(&solid, 12.0));
        assert!(!holds(&solid, 3.0));
        let value = |p: DVec3| if (6.0..12.0).contains(&p.x) || p.x >= 13.0 { 9.0 } else { 0.0 };
        let volume = bregma_synthetic::analytic::sampled("bone", labels.grid(), value);
        let surface = Surface::new(&Arc::new(volume), 5.0, DAffine3::IDENTITY).unwrap();
        let solid = labels.space_of(Meant { numbers: &[1], grow_mm: 0.0, bone: Some(&surface) }, &Progress::default()).unwrap();
        assert!(holds(&solid, 11.9) && !holds(&solid, 12.1));
    }
}
