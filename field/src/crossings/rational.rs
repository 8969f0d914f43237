//! The reference against exact rational arithmetic, where samples are integers and rays run through eighths of voxels.
//!
//! Every number that the reference meets there is a float64, so nothing is left to rounding: count, order and kind of the crossings
//! must be those of the cubic itself, contacts and ties included.

use super::*;
use bregma_synthetic::Random;
use bregma_volume::{Grid, Raster, Samples, Unit, Volume};
use dashu_int::ops::Abs;
use dashu_int::{IBig, UBig};
use dashu_ratio::RBig;
use rayon::prelude::*;
use std::fmt;
use std::ops::{Add, Mul, Sub};
use std::sync::Arc;

/// Coefficients, lowest power first, the last not 0; none for the polynomial 0.
type Polynomial = Vec<RBig>;

fn exact(v: f64) -> RBig {
    RBig::try_from(v).expect("a finite number")
}

fn point(p: DVec3) -> [RBig; 3] {
    p.to_array().map(exact)
}

fn trimmed(mut p: Polynomial) -> Polynomial {
    while p.last().is_some_and(RBig::is_zero) {
        p.pop();
    }
    p
}

fn derivative(p: &Polynomial) -> Polynomial {
    p.iter().enumerate().skip(1).map(|(n, c)| c * IBig::from(n)).collect()
}

/// Quotient and remainder.
fn divide(a: &Polynomial, b: &Polynomial) -> (Polynomial, Polynomial) {
    let mut rest = a.clone();
    let mut quotient = vec![];
    while rest.len() >= b.len() {
        let factor = &rest[rest.len() - 1] / &b[b.len() - 1];
        let shift = rest.len() - b.len();
        for (n, c) in b.iter().enumerate() {
            rest[shift + n] -= &factor * c;
        }
        rest.pop();
        quotient.push(factor);
    }
    quotient.reverse();
    (quotient, trimmed(rest))
}

fn gcd(a: &Polynomial, b: &Polynomial) -> Polynomial {
    if b.is_empty() { a.clone() } else { gcd(b, &divide(a, b).1) }
}

/// The interpolant of `corners` along `from` → `to` in powers of u, from its definition.
fn cubic<T: Clone + From<u8> + Add<Output = T> + Sub<Output = T> + Mul<Output = T>>(corners: [T; 8], from: [T; 3], to: [T; 3]) -> Vec<T> {
    let mut values: Vec<Vec<T>> = corners.map(|c| vec![c]).into();
    for (from, to) in from.into_iter().zip(to) {
        let weight = [from.clone(), to - from];
        let mix = |pair: &[Vec<T>]| {
            let mut sum = [&pair[0][..], &[T::from(0)]].concat();
            for n in 0..pair[0].len() {
                let step = pair[1][n].clone() - pair[0][n].clone();
                sum[n] = sum[n].clone() + step.clone() * weight[0].clone();
                sum[n + 1] = sum[n + 1].clone() + step * weight[1].clone();
            }
            sum
        };
        values = values.chunks(2).map(mix).collect();
    }
    values.remove(0)
}

/// Roots are told apart and given in units of 2⁻⁶⁰ of a chord.
const BITS: usize = 60;
const ONE: u64 = 1 << BITS;

/// The sign of a polynomial at multiples of 2⁻⁶⁰, in integers.
struct Signs(Vec<IBig>);

impl Signs {
    fn new(p: &Polynomial) -> Self {
        // Every denominator divides the product: a positive factor leaves signs as they are.
        let factor: UBig = p.iter().map(RBig::denominator).product();
        let scaled = |(n, c): (usize, &RBig)| (c * &factor).trunc() << (BITS * (p.len() - 1 - n));
        Self(p.iter().enumerate().map(scaled).collect())
    }

    /// −1, 0 or 1.
    fn at(&self, n: u64) -> i32 {
        let value = self.0.iter().rev().fold(IBig::ZERO, |v, c| v * n + c);
        i32::from(value > IBig::ZERO) - i32::from(value < IBig::ZERO)
    }
}

/// Sturm's chain of a polynomial without multiple roots.
struct Sturm(Vec<Signs>);

impl Sturm {
    fn new(p: &Polynomial) -> Self {
        let mut chain = vec![p.clone(), derivative(p)];
        while let [.., a, b] = &chain[..] {
            if b.is_empty() {
                chain.pop();
                break;
            }
            let next = divide(a, b).1.into_iter().map(|c| -c).collect();
            chain.push(next);
        }
        Self(chain.iter().map(Signs::new).collect())
    }

    fn variations(&self, n: u64) -> usize {
        let signs: Vec<i32> = self.0.iter().map(|p| p.at(n)).filter(|&s| s != 0).collect();
        signs.windows(2).filter(|w| w[0] != w[1]).count()
    }

    /// How many roots lie in (low, high].
    fn count(&self, low: u64, high: u64) -> usize {
        self.variations(low) - self.variations(high)
    }

    /// The roots in (low, high], each rounded up to a multiple of 2⁻⁶⁰.
    fn roots(&self, low: u64, high: u64, found: &mut Vec<u64>) {
        match self.count(low, high) {
            0 => {}
            1 => {
                let (mut low, mut high) = (low, high);
                let mut at_high = self.0[0].at(high);
                while at_high != 0 && high - low > 1 {
                    let middle = low.midpoint(high);
                    let sign = self.0[0].at(middle);
                    // The only root is simple: it lies above the middle when the signs there and at the end differ.
                    if sign == -at_high { low = middle } else { (high, at_high) = (middle, sign) }
                }
                found.push(high);
            }
            _ => {
                assert!(high - low > 1, "two roots within 2⁻⁶⁰");
                let middle = low.midpoint(high);
                self.roots(low, middle, found);
                self.roots(middle, high, found);
            }
        }
    }
}

/// What a chord meets.
struct Truth {
    /// The cubic is 0: all is inside, and no roots are listed.
    vanishes: bool,
    /// Distinct roots in [0, 1] with their multiplicities.
    roots: Vec<(u64, usize)>,
    /// The parts of [0, 1] that are inside: closed, some of them points.
    inside: Vec<[u64; 2]>,
}

impl Truth {
    fn new(p: &Polynomial) -> Self {
        // The sign just behind u = 0 is that of the first coefficient.
        let Some(first) = p.iter().find(|c| !c.is_zero()) else {
            return Self { vanishes: true, roots: vec![], inside: vec![[0, ONE]] };
        };
        let mut was_inside = *first > RBig::ZERO;
        // A root of multiplicity m is one of the first m of p, gcd(p, p′), gcd of that and its derivative …
        let mut repeated = vec![];
        let mut common = gcd(p, &derivative(p));
        let simple = divide(p, &common).0;
        while common.len() > 1 {
            let next = gcd(&common, &derivative(&common));
            repeated.push(Sturm::new(&divide(&common, &next).0));
            common = next;
        }
        let (mut at, sturm) = (vec![], Sturm::new(&simple));
        if p[0].is_zero() {
            at.push(0);
        }
        sturm.roots(0, ONE, &mut at);
        let multiplicity = |n: u64| match n {
            0 => p.iter().take_while(|c| c.is_zero()).count(),
            _ => 1 + repeated.iter().filter(|s| s.count(n - 1, n) > 0).count(),
        };
        let roots: Vec<(u64, usize)> = at.into_iter().map(|n| (n, multiplicity(n))).collect();
        let mut inside: Vec<[u64; 2]> = vec![];
        if was_inside || p[0].is_zero() {
            inside.push([0, 0]);
        }
        for &(n, multiplicity) in &roots {
            let leaves = was_inside && n > 0;
            if leaves && let Some(last) = inside.last_mut() {
                last[1] = n;
            } else if n > 0 {
                inside.push([n, n]);
            }
            was_inside ^= n > 0 && multiplicity % 2 == 1;
        }
        if was_inside && let Some(last) = inside.last_mut() {
            last[1] = ONE;
        }
        Self { vanishes: false, roots, inside }
    }
}

/// What was compared, and how far apart it was: the columns that the test prints.
#[derive(Default)]
struct Tally {
    /// Cells crossed, those where the cubic vanishes, distinct roots, and those of them that are double, triple, or at an end.
    counts: [usize; 6],
    /// Rays walked, their crossings, those that are touches, and rays whose numbers are no float64.
    walks: [usize; 4],
    /// Largest |Δu|; largest |Δt| in parts of its stated error, and largest stated error, mm.
    worst: [f64; 3],
    /// What disagrees.
    wrong: Vec<String>,
}

impl Tally {
    fn add(mut self, other: Self) -> Self {
        self.counts = std::array::from_fn(|n| self.counts[n] + other.counts[n]);
        self.walks = std::array::from_fn(|n| self.walks[n] + other.walks[n]);
        self.worst = std::array::from_fn(|n| self.worst[n].max(other.worst[n]));
        self.wrong.extend(other.wrong);
        self
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [u, part, error] = self.worst;
        write!(f, "{:?} | {:?} | {u:.1e}, {part:.2}, {error:.1e}; {} wrong", self.counts, self.walks, self.wrong.len())
    }
}

/// Cells in a row along x, and a ray's way through them, in index space.
#[derive(Debug)]
struct Row {
    /// At x + (cells + 1)·(y + 2z).
    samples: Vec<f64>,
    cells: usize,
    from: DVec3,
    to: DVec3,
}

impl Row {
    fn one(corners: [f64; 8], (from, to): (DVec3, DVec3)) -> Self {
        Self { samples: corners.into(), cells: 1, from, to }
    }

    /// The corners of each cell in the order of the ray, and its chord there.
    fn parts(&self) -> Vec<([f64; 8], DVec3, DVec3)> {
        let step = self.step();
        let part = |n: usize| {
            let x = if step.x < 0.0 { self.cells - 1 - n } else { n };
            let corners = std::array::from_fn(|c| self.samples[x + (c & 1) + (self.cells + 1) * (c >> 1)]);
            let from = self.from + n as f64 * step - DVec3::X * x as f64;
            (corners, from, from + step)
        };
        (0..self.cells).map(part).collect()
    }

    fn step(&self) -> DVec3 {
        (self.to - self.from) / self.cells as f64
    }

    /// Compares cell by cell, and by the walk of a ray that begins `behind` steps before the row.
    fn check(&self, behind: f64, slope: f64) -> Tally {
        let mut tally = Tally::default();
        let parts = self.parts();
        let truths: Vec<Truth> = parts.iter().map(|&(f, p, q)| Truth::new(&trimmed(cubic(f.map(exact), point(p), point(q))))).collect();
        for truth in &truths {
            let count = |is: &dyn Fn(&(u64, usize)) -> bool| truth.roots.iter().filter(|r| is(r)).count();
            let vanishes = usize::from(truth.vanishes);
            let counts = [1, vanishes, truth.roots.len(), count(&|r| r.1 == 2), count(&|r| r.1 == 3), count(&|r| r.0 == 0 || r.0 == ONE)];
            tally = tally.add(Tally { counts, ..Tally::default() });
        }
        for (truth, (f, p, q)) in truths.iter().zip(parts) {
            // A stretch that reaches the end of the chord does not leave; a point before it enters and leaves.
            let ends = |&[a, b]: &[u64; 2]| [Some((a, true)), (b < ONE).then_some((b, false))];
            let expected: Vec<(u64, bool)> = truth.inside.iter().flat_map(ends).flatten().collect();
            let found = segment_crossings(&f, p, q);
            if !found.iter().map(|c| c.1).eq(expected.iter().map(|c| c.1)) {
                tally.wrong.push(format!("{self:?}: {found:?} are not {expected:?}, roots {:?}", truth.roots));
                continue;
            }
            let off = found.iter().zip(&expected).map(|(f, e)| (f.0 - unit(e.0)).abs()).fold(0.0, f64::max);
            tally.worst[0] = tally.worst[0].max(off);
        }
        self.check_walk(&truths, behind, slope, &mut tally);
        tally
    }

    /// In the world a step is 1 mm along x, so that all numbers of the ray are exact.
    fn check_walk(&self, truths: &[Truth], behind: f64, slope: f64, tally: &mut Tally) {
        let (d, cells) = (self.step(), DVec3::new(self.cells as f64, 1.0, 1.0));
        let passes = |p: DVec3, d: DVec3| (0..3).any(|a| d[a] > 0.0 && p[a] == cells[a] || d[a] < 0.0 && p[a] == 0.0);
        let at_face = passes(self.from, -d);
        // A ray that begins in the box begins there; one that ends in it does not exist.
        let behind = if at_face { behind } else { 0.0 };
        if !passes(self.to, d) {
            return;
        }
        let long = d.abs().max_position();
        let to_index = DMat3::from_cols(d, DVec3::AXES[(long + 1) % 3], DVec3::AXES[(long + 2) % 3]);
        let to_world = DAffine3::from_mat3(to_index.inverse());
        let grid = Grid::from_affine([self.cells + 1, 2, 2], to_world).expect("a grid");
        let start = self.from - behind * d;
        let ray = Ray { origin: WorldPoint(to_world.transform_point3(start)), direction: DVec3::X };
        if grid.world_to_index().matrix3.x_axis != d || grid.index(ray.origin).0 != start {
            tally.walks[3] += 1;
            return;
        }
        let surface = surface(grid, &self.samples, slope);

        let mut inside: Vec<[u64; 2]> = vec![];
        for (n, truth) in truths.iter().enumerate() {
            for [a, b] in truth.inside.iter().map(|ends| ends.map(|u| u + n as u64 * ONE)) {
                match inside.last_mut() {
                    Some(last) if last[1] == a => last[1] = b,
                    _ => inside.push([a, b]),
                }
            }
        }
        let end = self.cells as u64 * ONE;
        let expected: Vec<(u64, Kind, bool, bool)> = inside
            .iter()
            .flat_map(|&[a, b]| {
                let at = |u: u64, kind: Kind| (u, kind, u == 0 && at_face || u == end, u == 0 && !at_face);
                if a == b { vec![at(a, Kind::Touch)] } else { vec![at(a, Kind::Enter), at(b, Kind::Exit)] }
            })
            .collect();
        let found = crossings(&surface, &ray);
        let off = |c: &Crossing, u: u64| ((c.t_mm - behind) - unit(u)).abs();
        let same = |(c, e): (&Crossing, &(u64, Kind, bool, bool))| {
            (c.kind, c.clipped, c.at_origin) == (e.1, e.2, e.3) && off(c, e.0) <= c.error_mm
        };
        let first = first_entry(&surface, &ray);
        let same_first = match (first, expected.first()) {
            (Some(c), Some(e)) => off(&c, e.0) <= c.error_mm && c.kind != Kind::Exit && (c.at_origin == e.3),
            (c, e) => c.is_none() && e.is_none(),
        };
        if found.len() != expected.len() || !found.iter().zip(&expected).all(same) || !same_first {
            tally.wrong.push(format!("{self:?} from {behind}: {found:#?}, first {first:?} are not {expected:?}"));
            return;
        }
        tally.walks[0] += 1;
        tally.walks[1] += found.len();
        tally.walks[2] += found.iter().filter(|c| c.kind == Kind::Touch).count();
        for (c, e) in found.iter().zip(&expected) {
            tally.worst[1] = tally.worst[1].max(if c.error_mm > 0.0 { off(c, e.0) / c.error_mm } else { 0.0 });
            tally.worst[2] = tally.worst[2].max(c.error_mm);
        }
    }
}

/// The surface where the values are 0, of samples that are the values divided by `slope`.
fn surface(grid: Grid, values: &[f64], slope: f64) -> Surface {
    let samples = Samples::F32(values.iter().map(|v| (v / slope) as f32).collect());
    let raster = Raster { grid, samples, slope, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
    let volume = Arc::new(Volume::new(String::new(), "test", raster).expect("a volume"));
    Surface::new(&volume, 0.0, DAffine3::IDENTITY).expect("a surface")
}

fn unit(n: u64) -> f64 {
    n as f64 / ONE as f64
}

/// An integer from `low` to `high`.
fn integer(r: &mut Random, low: i32, high: i32) -> f64 {
    f64::from(low) + (r.unit() * f64::from(high - low + 1)).floor()
}

fn corners(r: &mut Random, size: i32) -> [f64; 8] {
    std::array::from_fn(|_| integer(r, -size, size))
}

/// A chord between eighths of a cell: from a corner to a corner, along an axis, within a face, between faces, or from within.
fn chord(r: &mut Random) -> (DVec3, DVec3) {
    let mut eighths = || DVec3::from_array(std::array::from_fn(|_| integer(r, 0, 8) / 8.0));
    let (mut p, mut q) = (eighths(), eighths());
    let (a, side) = (integer(r, 0, 2) as usize, integer(r, 0, 1));
    let b = (a + integer(r, 1, 2) as usize) % 3;
    match integer(r, 0, 5) as i32 {
        0 => (p, q) = (p.round(), q.round()),
        1 => (p, p[a], q, q[a]) = (p, 0.0, p, 1.0),
        2 => (p[a], q[a], p[b], q[b]) = (side, side, 0.0, 1.0),
        3 => (p[a], q[a]) = (0.0, 1.0),
        4 => (p[a], q[b]) = (side, integer(r, 0, 1)),
        _ => q[a] = side,
    }
    match integer(r, 0, 1) {
        _ if p == q => chord(r),
        0.0 => (q, p),
        _ => (p, q),
    }
}

/// A cell whose cubic from a corner to the opposite one is the product of a constant and the given factors a·u + b.
fn product(r: &mut Random, constant: f64, factors: [[f64; 2]; 3]) -> Row {
    let mut power = vec![constant];
    for [a, b] in factors {
        power = [&[0.0], &power[..]].concat().iter().zip([&power[..], &[0.0]].concat()).map(|(low, high)| a * low + b * high).collect();
    }
    // Thrice the middle Bernstein coefficients are sums of three corners.
    let sums = [3.0 * power[0] + power[1], 3.0 * power[0] + 2.0 * power[1] + power[2]];
    let mut f = corners(r, 9);
    (f[0], f[7]) = (power[0], power.iter().sum());
    (f[4], f[6]) = (sums[0] - f[1] - f[2], sums[1] - f[3] - f[5]);
    let flip = integer(r, 0, 7) as usize;
    let corner = |c: usize| DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
    Row::one(std::array::from_fn(|c| f[c ^ flip]), (corner(flip), corner(flip ^ 7)))
}

/// A factor m·u − k that vanishes in [0, 1].
fn vanishing(r: &mut Random) -> [f64; 2] {
    let m = integer(r, 1, 9);
    [m, -integer(r, 0, m as i32)]
}

/// A cell and a chord that happen to have a double root, as far as float64 tells.
fn searched(r: &mut Random) -> Row {
    loop {
        let row = Row::one(corners(r, 3), chord(r));
        let (f, p, q) = row.parts()[0];
        let k = cubic(f, p.to_array(), q.to_array());
        let [d, c, b, a] = [k[0], k[1], k[2], k[3]];
        let discriminant = 18.0 * a * b * c * d - 4.0 * b * b * b * d + b * b * c * c - 4.0 * a * c * c * c - 27.0 * a * a * d * d;
        if discriminant == 0.0 && (a != 0.0 || b != 0.0) {
            return row;
        }
    }
}

/// A family of rows and how many of them are tried.
type Family = (&'static str, usize, fn(&mut Random) -> Row);

const FAMILIES: [Family; 9] = [
    ("corners in -1..=1", 20_000, |r| Row::one(corners(r, 1), chord(r))),
    ("corners in -2..=2", 20_000, |r| Row::one(corners(r, 2), chord(r))),
    ("corners in -100..=100", 20_000, |r| Row::one(corners(r, 100), chord(r))),
    ("16-bit extremes", 15_000, |r| {
        let corners = std::array::from_fn(|_| [-32768.0, 32767.0, -1.0, 0.0, 1.0][integer(r, 0, 4) as usize]);
        Row::one(corners, chord(r))
    }),
    ("a face of zeros", 10_000, |r| {
        let (axis, side) = (integer(r, 0, 2) as usize, integer(r, 0, 1) as usize);
        let f = corners(r, 3);
        Row::one(std::array::from_fn(|c| if c >> axis & 1 == side { 0.0 } else { f[c] }), chord(r))
    }),
    ("double roots made", 10_000, |r| {
        let (double, constant) = (vanishing(r), [-1.0, 1.0, 5.0][integer(r, 0, 2) as usize]);
        let other = [integer(r, -4, 4), integer(r, -4, 4)];
        product(r, constant, [double, double, other])
    }),
    ("triple roots made", 5_000, |r| {
        let (triple, constant) = (vanishing(r), [-1.0, 1.0, 5.0][integer(r, 0, 2) as usize]);
        product(r, constant, [triple; 3])
    }),
    ("double roots met", 5_000, searched),
    ("two cells", 20_000, |r| {
        let samples = (0..12).map(|_| integer(r, -2, 2)).collect();
        let mut at = |x: f64| DVec3::new(x, integer(r, 0, 8) / 8.0, integer(r, 0, 8) / 8.0);
        let (from, to) = (at(0.0), at(2.0));
        let (from, to) = if integer(r, 0, 1) == 0.0 { (from, to) } else { (to, from) };
        Row { samples, cells: 2, from, to }
    }),
];

#[test]
fn crossings_are_those_of_exact_arithmetic() {
    // Fails if a root is missed, doubled, out of order or of the wrong kind, a contact is taken for a miss or a wall, a cut at a face is
    // not said to be one, or a crossing is further from the root than its stated error.
    let mut all = Tally::default();
    println!(
        "cells, vanishing, roots, double, triple, at an end | rays, crossings, touches, inexact | largest |Δu|, |Δt| / error, error in mm"
    );
    for (number, (name, rows, make)) in FAMILIES.into_iter().enumerate() {
        let check = |n: usize| {
            let mut r = Random((number as u64) << 32 | n as u64);
            // The first numbers of neighbouring seeds are alike.
            r.unit();
            let row = make(&mut r);
            row.check(integer(&mut r, 0, 3), if r.unit() < 0.5 { 1.0 } else { -1.0 })
        };
        let tally = (0..rows).into_par_iter().map(check).reduce(Tally::default, Tally::add);
        println!("{name}: {tally}");
        all = all.add(tally);
    }
    println!("all: {all}");
    assert!(all.wrong.is_empty(), "{} wrong: {:#?}", all.wrong.len(), &all.wrong[..all.wrong.len().min(4)]);
    let ([cells, _, _, double, triple, _], [rays, _, touches, inexact]) = (all.counts, all.walks);
    assert!(cells > 100_000 && double > 10_000 && triple > 5_000 && rays > 100_000 && touches > 10_000, "{all}");
    // A chord of 3, 5, 6 or 7 eighths has no exact map from the world; its cell is compared without a walk.
    assert!(inexact < rays / 20, "{all}");
    // Where two roots are one, nothing is placed better.
    assert!(all.worst[0] <= MAX_HALVINGS, "{all}");
}

/// Values are moved by this part of the largest to see what float64 can decide: points of a ray from 1,000 voxels away are off by so many
/// voxels.
const DOUBT: f64 = 1e-12;

/// Nearest multiple of 2⁻⁸⁰, far below any doubt: short numbers make short work.
fn short(v: &RBig) -> RBig {
    let unit = exact(2.0_f64.powi(80));
    RBig::from((v * &unit).round()) / unit
}

/// A cell of integers, and a ray of any direction that passes through two points of it, from there or from up to 1,000 mm away.
fn any_ray(r: &mut Random, grid: &Grid) -> ([f64; 8], Ray) {
    let mut within = || grid.world(IndexPoint(DVec3::from_array(std::array::from_fn(|_| integer(r, 1, 7) / 8.0)))).0;
    let (p, q) = (within(), within());
    let behind = [0.0, 3.3, 1000.0][integer(r, 0, 2) as usize];
    let size = [2, 100, 32767][integer(r, 0, 2) as usize];
    match (q - p).try_normalize().and_then(|d| Ray::new(WorldPoint(p - behind * d), d)) {
        Some(ray) => (corners(r, size), ray),
        None => any_ray(r, grid),
    }
}

/// Where a ray is in the box of the cell (0, 0, 0), and the points where it enters and leaves.
fn exact_span(grid: &Grid, ray: &Ray) -> ([RBig; 2], [[RBig; 3]; 2]) {
    let map = grid.world_to_index();
    let turned = |v: [RBig; 3], a: usize| (0..3).fold(RBig::ZERO, |sum, c| sum + exact(map.matrix3.col(c)[a]) * &v[c]);
    let o: [RBig; 3] = std::array::from_fn(|a| turned(point(ray.origin.0), a) + exact(map.translation[a]));
    let d: [RBig; 3] = std::array::from_fn(|a| turned(point(ray.direction), a));
    let mut span = [RBig::ZERO, exact(f64::MAX)];
    for a in (0..3).filter(|&a| !d[a].is_zero()) {
        let ends = [0.0, 1.0].map(|face| short(&((exact(face) - &o[a]) / &d[a])));
        let [low, high] = ends;
        let (near, far) = if d[a] > RBig::ZERO { (low, high) } else { (high, low) };
        span = [near.max(span[0].clone()), far.min(span[1].clone())];
    }
    let points = span.each_ref().map(|t| std::array::from_fn(|a| &o[a] + t * &d[a]));
    (span, points)
}

#[test]
fn crossings_of_any_ray_lie_within_their_stated_error() {
    // Fails if the stated error leaves out a rounding: of the map to index space, of the points where the ray meets faces, of the cubic.
    let rows = 1500;
    let check = |n: usize| {
        let mut r = Random(1 << 40 | n as u64);
        r.unit();
        let grid = match n % 2 {
            0 => Grid::new([2; 3], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY),
            _ => Grid::new([2; 3], DVec3::new(0.7, 0.9, 1.3), DVec3::new(-300.1, 17.3, 99.9), DMat3::from_rotation_y(0.3)),
        }
        .expect("a grid");
        let (f, ray) = any_ray(&mut r, &grid);
        let (span, [from, to]) = exact_span(&grid, &ray);
        let cubic: Vec<RBig> = cubic(f.map(exact), from, to).iter().map(short).collect();
        let inside = |shift: f64| {
            let mut moved = cubic.clone();
            moved[0] += exact(shift);
            Truth::new(&trimmed(moved)).inside
        };
        let shape = |inside: &[[u64; 2]]| inside.iter().map(|[a, b]| (*a == 0, *b == ONE, a == b)).collect::<Vec<_>>();
        let doubt = DOUBT * f.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        let truth = inside(0.0);
        if [doubt, -doubt].iter().any(|&d| shape(&inside(d)) != shape(&truth)) {
            return None;
        }
        let found = crossings(&surface(grid, &f, 1.0), &ray);
        let cut = |c: &Crossing| c.clipped || c.at_origin;
        let kinds = truth.iter().flat_map(|&[a, b]| [(a, Kind::Enter, a == 0), (b, Kind::Exit, b == ONE)]);
        let same = found.iter().map(|c| (c.kind, cut(c))).eq(kinds.clone().map(|(_, kind, is_cut)| (kind, is_cut)));
        assert!(same, "{f:?} {ray:?}: {found:#?} are not {truth:?}");
        let parts = found.iter().zip(kinds).map(|(c, (u, ..))| {
            let t = &span[0] + RBig::from_parts(u.into(), ONE.into()) * (&span[1] - &span[0]);
            let off = (exact(c.t_mm) - t).abs().to_f64().value();
            assert!(off <= c.error_mm, "{f:?} {ray:?}: {off} mm off: {c:#?}");
            [off, off / c.error_mm.max(f64::MIN_POSITIVE), c.error_mm]
        });
        Some((found.len(), parts.fold([0.0; 3], |m, p| std::array::from_fn(|n| f64::max(m[n], p[n])))))
    };
    let found: Vec<_> = (0..rows).into_par_iter().filter_map(check).collect();
    let crossings: usize = found.iter().map(|f| f.0).sum();
    let [off, part, error] = found.iter().fold([0.0; 3], |m, f| std::array::from_fn(|n| f64::max(m[n], f.1[n])));
    let undecided = rows - found.len();
    println!(
        "{rows} rays of any direction, {undecided} beyond float64, {crossings} crossings: off by at most {off:.1e} mm, {part:.2} of the stated error, which is at most {error:.1e} mm"
    );
    // Ties and contacts, which rounding of the ray's own numbers makes or undoes.
    assert!(undecided <= rows / 100 && crossings > rows);
}
