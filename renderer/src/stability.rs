//! Where solvers fail: hard families of cells and segments, each solver's first entry against every root in float64.
//!
//! A family is a way to make segments of a cell. What it asks may be beyond float32 as such: where moving the cell's values by a few
//! units in their last place changes the reference's own answer. Such segments are counted as undecidable and not judged. Fixed steps
//! know no cells and are not judged here.

use crate::reference;
use crate::roots::{Analytic, Exact, FirstEntry, Linear, Marmitt, Neubauer, Solver, Steps};
use bregma_volume::{Cancelled, Progress};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

/// A cell and a segment of a ray through it, in local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Corner values relative to the level; corner x + 2y + 4z is at (x, y, z).
    pub corners: [f32; 8],
    /// Where the ray enters.
    pub from: Vec3,
    /// Where it leaves.
    pub to: Vec3,
}

/// A family of hard segments.
pub struct Family {
    /// Its name in tables.
    pub name: &'static str,
    /// What is hard about it.
    pub about: &'static str,
    make: fn(&mut Random) -> Segment,
}

/// What a solver made of a family.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The family.
    pub family: &'static str,
    /// `cpu` or `gpu`.
    pub backend: &'static str,
    /// The solver.
    pub solver: Solver,
    /// Segments judged.
    pub segments: u32,
    /// Segments that float32 cannot decide; not judged.
    pub undecidable: u32,
    /// Entries that were not found.
    pub missed: u32,
    /// Entries that are none.
    pub false_hits: u32,
    /// Answers nearer to a later root than to the first entry.
    pub wrong_root: u32,
    /// Median error of the others, in voxels.
    pub p50: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// Largest.
    pub worst: f64,
}

/// A small deterministic generator (PCG, O'Neill 2014).
pub(crate) struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        x.rotate_right((self.0 >> 59) as u32)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / 16_777_216.0
    }

    /// Uniform in the unit cell.
    pub fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    /// Uniform in [−1, 1).
    fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    fn below(&mut self, n: u32) -> u32 {
        self.bits() % n
    }
}

/// A chord between two different faces of the cell.
fn chord(r: &mut Random) -> (Vec3, Vec3) {
    let mut on_face = |face: u32| {
        let mut p = r.point();
        p[face as usize / 2] = (face % 2) as f32;
        p
    };
    let (a, b) = (on_face(0), on_face(1));
    let turned = r.below(6) as usize;
    let turn = |p: Vec3| Vec3::new(p[turned % 3], p[(turned + 1) % 3], p[(turned + 2) % 3]);
    if turned < 3 { (turn(a), turn(b)) } else { (turn(b), turn(a)) }
}

fn segment(r: &mut Random, corners: [f32; 8]) -> Segment {
    let (from, to) = chord(r);
    Segment { corners, from, to }
}

fn rough(r: &mut Random) -> Segment {
    let corners = std::array::from_fn(|_| r.signed() - 0.2);
    segment(r, corners)
}

/// A rough cell, shifted so that its highest point along the chord is `top` (of a range of 1) above the level.
fn nearly_tangent(r: &mut Random, top: f32) -> Segment {
    loop {
        let s = rough(r);
        let values: Vec<f64> = (0..=64).map(|i| s.value(f64::from(i) / 64.0)).collect();
        let (at, _) = values.iter().enumerate().fold((0, f64::MIN), |best, (i, &v)| if v > best.1 { (i, v) } else { best });
        if at == 0 || at == 64 {
            continue;
        }
        // The highest point lies within one step of the best sample; a third of that is left each time.
        let (mut low, mut high) = ((at as f64 - 1.0) / 64.0, (at as f64 + 1.0) / 64.0);
        for _ in 0..60 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if s.value(a) < s.value(b) { low = a } else { high = b }
        }
        let shift = f64::from(top) - s.value(low);
        return Segment { corners: s.corners.map(|c| (f64::from(c) + shift) as f32), ..s };
    }
}

fn three_roots(r: &mut Random) -> Segment {
    loop {
        let s = rough(r);
        let entries = (0..64).filter(|&i| (s.value(f64::from(i) / 64.0) >= 0.0) != (s.value(f64::from(i + 1) / 64.0) >= 0.0)).count();
        if entries == 3 {
            return s;
        }
    }
}

/// a + b·x + c·y + d·z + e·xyz with e a multiple of the rest: leading coefficients that vanish or rule.
fn leading(r: &mut Random, e: f32) -> Segment {
    let k: [f32; 4] = std::array::from_fn(|_| r.signed());
    let e = e * r.signed();
    let corners = std::array::from_fn(|c| {
        let [x, y, z] = [c & 1, c >> 1 & 1, c >> 2].map(|v| v as f32);
        k[0] + k[1] * x + k[2] * y + k[3] * z + e * x * y * z
    });
    segment(r, corners)
}

fn scaled(r: &mut Random, scale: f32) -> Segment {
    let s = rough(r);
    Segment { corners: s.corners.map(|c| c * scale), ..s }
}

/// Every family.
pub const FAMILIES: &[Family] = &[
    Family { name: "rough", about: "random corners", make: rough },
    Family {
        name: "ties",
        about: "corners in {−1, 0, 1}: integer data at an isovalue that samples have",
        make: |r| {
            let corners = std::array::from_fn(|_| r.below(3) as f32 - 1.0);
            segment(r, corners)
        },
    },
    Family {
        name: "plateau",
        about: "one face of the cell at the isovalue",
        make: |r| {
            let (face, side) = (r.below(3), r.below(2) as usize);
            let corners = std::array::from_fn(|c| if c >> face & 1 == side { 0.0 } else { r.signed() });
            segment(r, corners)
        },
    },
    Family { name: "three roots", about: "the first of three entries and exits", make: three_roots },
    Family { name: "double root 1e-1", about: "two roots, the value between them 0.1 above", make: |r| nearly_tangent(r, 1e-1) },
    Family { name: "double root 1e-2", about: "0.01 above", make: |r| nearly_tangent(r, 1e-2) },
    Family { name: "double root 1e-4", about: "1e-4 above", make: |r| nearly_tangent(r, 1e-4) },
    Family { name: "double root 1e-6", about: "1e-6 above: a few units in the last place", make: |r| nearly_tangent(r, 1e-6) },
    Family { name: "double root 1e-12", about: "1e-12 above: nothing in float32", make: |r| nearly_tangent(r, 1e-12) },
    Family { name: "near miss 1e-4", about: "the highest value 1e-4 below", make: |r| nearly_tangent(r, -1e-4) },
    Family { name: "near miss 1e-6", about: "1e-6 below", make: |r| nearly_tangent(r, -1e-6) },
    Family { name: "leading 0", about: "a linear field: no cubic, no quadratic term", make: |r| leading(r, 0.0) },
    Family { name: "leading 1e-7", about: "a cubic term of 1e-7 of the rest", make: |r| leading(r, 1e-7) },
    Family { name: "leading 1e7", about: "a cubic term of 1e7 times the rest", make: |r| leading(r, 1e7) },
    Family {
        name: "16-bit extremes",
        about: "corners of ±32767 and near the level",
        make: |r| {
            let corners = std::array::from_fn(|_| [-32768.0, 32767.0, -0.5, 0.5][r.below(4) as usize]);
            segment(r, corners)
        },
    },
    Family { name: "scale 1e-30", about: "float32 values of 1e-30", make: |r| scaled(r, 1e-30) },
    Family { name: "scale 1e30", about: "float32 values of 1e30", make: |r| scaled(r, 1e30) },
    Family {
        name: "along an axis",
        about: "a ray parallel to an axis",
        make: |r| {
            let s = rough(r);
            let axis = r.below(3) as usize;
            let mut to = s.from;
            to[axis] = 1.0;
            let mut from = s.from;
            from[axis] = 0.0;
            Segment { from, to, ..s }
        },
    },
    Family {
        name: "in a face",
        about: "a ray within a face of the cell",
        make: |r| {
            let s = rough(r);
            let (axis, side) = (r.below(3) as usize, r.below(2) as f32);
            let (mut from, mut to) = (s.from, s.to);
            (from[axis], to[axis]) = (side, side);
            Segment { from, to, ..s }
        },
    },
    Family {
        name: "through corners",
        about: "from a corner of the cell to another, along edges, faces and diagonals",
        make: |r| {
            let s = rough(r);
            let corner = |n: u32| Vec3::new((n & 1) as f32, (n >> 1 & 1) as f32, (n >> 2) as f32);
            let a = r.below(8);
            let b = (a + 1 + r.below(7)) % 8;
            Segment { from: corner(a), to: corner(b), ..s }
        },
    },
    Family {
        name: "clipped corner",
        about: "chords of a thousandth of a voxel and less",
        make: |r| {
            let s = rough(r);
            let size = 10.0_f32.powf(-3.0 - 3.0 * r.unit());
            let at = |u: f32, v: f32| Vec3::new(u * size, v * size, 0.0);
            let (from, mut to) = (at(r.unit(), r.unit()), at(r.unit(), 0.0));
            to.z = size * r.unit();
            // The values are centred on the corner that is clipped, so that the surface passes there.
            let centre = s.corners[0];
            Segment { corners: s.corners.map(|c| c - centre + 0.3 * size * r.signed()), from, to }
        },
    },
];

impl Segment {
    /// The interpolant at u of the segment, in float64.
    fn value(&self, u: f64) -> f64 {
        let p = self.from.as_dvec3().lerp(self.to.as_dvec3(), u);
        (0..8).map(|c| f64::from(self.corners[c]) * (0..3).map(|a| if c >> a & 1 == 1 { p[a] } else { 1.0 - p[a] }).product::<f64>()).sum()
    }

    /// Every crossing with all corners raised by `shift`: u, and whether it enters.
    fn crossings(&self, shift: f64) -> Vec<(f64, bool)> {
        let corners = self.corners.map(|c| f64::from(c) + shift);
        reference::segment_crossings(&corners, self.from.as_dvec3(), self.to.as_dvec3())
    }

    /// The first entry: 0 when it starts inside.
    fn first_entry(crossings: &[(f64, bool)]) -> Option<f64> {
        crossings.iter().find(|c| c.1).map(|c| c.0)
    }
}

/// Values are moved by this part of the largest to see what float32 can decide: 16 units in the last place, for the two dozen
/// roundings of an interpolation, of which a few add up.
const DOUBT: f64 = 16.0 * f32::EPSILON as f64;
/// Answers that move by more than this, in voxels, when values are moved by the doubt are not decidable.
const DECIDED_VOXEL: f64 = 1e-3;
/// Segments of a family.
const SEGMENTS: usize = 20_000;

/// A family's segments with the truth about each.
struct Judged {
    segments: Vec<Segment>,
    /// All crossings, and whether float32 can decide the first entry.
    truths: Vec<(Vec<(f64, bool)>, bool)>,
}

impl Family {
    fn judged(&self, number: usize) -> Judged {
        let make = |n: usize| {
            // Each segment has its own generator, so that the order of work does not matter.
            let mut random = Random((number as u64) << 32 | n as u64);
            random.bits();
            (self.make)(&mut random)
        };
        let segments: Vec<Segment> = (0..SEGMENTS).into_par_iter().map(make).collect();
        let truth = |s: &Segment| {
            let doubt = DOUBT * s.corners.iter().fold(0.0_f64, |m, &c| m.max(f64::from(c).abs()));
            let crossings = s.crossings(0.0);
            let length = f64::from(s.from.distance(s.to));
            let first = Segment::first_entry(&crossings);
            let same = |shift: f64| match (Segment::first_entry(&s.crossings(shift)), first) {
                (Some(a), Some(b)) => (a - b).abs() * length <= DECIDED_VOXEL,
                (a, b) => a.is_none() && b.is_none(),
            };
            let decidable = same(doubt) && same(-doubt);
            (crossings, decidable)
        };
        let truths = segments.par_iter().map(truth).collect();
        Judged { segments, truths }
    }
}

impl Judged {
    fn row(&self, family: &'static str, backend: &'static str, solver: Solver, answers: &[Option<f32>]) -> Row {
        let undecidable = self.truths.iter().filter(|t| !t.1).count() as u32;
        let segments = SEGMENTS as u32 - undecidable;
        let mut row = Row {
            family,
            backend,
            solver,
            segments,
            undecidable,
            missed: 0,
            false_hits: 0,
            wrong_root: 0,
            p50: 0.0,
            p999: 0.0,
            worst: 0.0,
        };
        let mut errors = Vec::new();
        for ((s, (crossings, decidable)), answer) in self.segments.iter().zip(&self.truths).zip(answers) {
            if !decidable {
                continue;
            }
            match (answer, Segment::first_entry(crossings)) {
                (None, None) => {}
                (None, Some(_)) => row.missed += 1,
                (Some(_), None) => row.false_hits += 1,
                (Some(u), Some(truth)) => {
                    let off = (f64::from(*u) - truth).abs();
                    let later = crossings.iter().any(|c| c.0 > truth && (f64::from(*u) - c.0).abs() < off);
                    row.wrong_root += u32::from(later);
                    errors.push(off * f64::from(s.from.distance(s.to)));
                }
            }
        }
        errors.sort_by(f64::total_cmp);
        let at = |part: f64| errors.get(((errors.len().max(1) - 1) as f64 * part).round() as usize).copied().unwrap_or(0.0);
        (row.p50, row.p999, row.worst) = (at(0.5), at(0.999), at(1.0));
        row
    }
}

/// Judges every solver that works within a cell over every family, on the CPU and, where there is one, on the GPU. Progress counts
/// families.
pub fn run(mut gpu: Option<&mut dyn SolveSegments>, progress: &Progress) -> Result<Vec<Row>, StabilityError> {
    progress.begin(FAMILIES.len() as u64);
    let mut rows = Vec::new();
    for (number, family) in FAMILIES.iter().enumerate() {
        let judged = family.judged(number);
        for solver in Solver::ALL.into_iter().filter(|s| !matches!(s, Solver::Step(_))) {
            let answers: Vec<Option<f32>> = judged.segments.par_iter().map(|s| solve(solver, s)).collect();
            rows.push(judged.row(family.name, "cpu", solver, &answers));
            if let Some(gpu) = &mut gpu {
                let answers = gpu.first_entries(solver, &judged.segments)?;
                rows.push(judged.row(family.name, "gpu", solver, &answers));
            }
        }
        progress.advance(1)?;
    }
    Ok(rows)
}

/// Another machine that runs the solvers.
pub trait SolveSegments {
    /// The first entry of each segment, as `solver` sees it.
    fn first_entries(&mut self, solver: Solver, segments: &[Segment]) -> Result<Vec<Option<f32>>, crate::RenderError>;
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum StabilityError {
    /// Stopped by request.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The GPU failed.
    #[error(transparent)]
    Render(#[from] crate::RenderError),
}

fn solve(solver: Solver, s: &Segment) -> Option<f32> {
    let Segment { corners: f, from: p, to: q } = s;
    match solver {
        Solver::Exact => Exact::first_entry(f, *p, *q),
        Solver::Linear => Linear::first_entry(f, *p, *q),
        Solver::Neubauer(Steps::Two) => Neubauer::<2>::first_entry(f, *p, *q),
        Solver::Neubauer(Steps::Three) => Neubauer::<3>::first_entry(f, *p, *q),
        Solver::Neubauer(Steps::Four) => Neubauer::<4>::first_entry(f, *p, *q),
        Solver::Marmitt(Steps::Two) => Marmitt::<2>::first_entry(f, *p, *q),
        Solver::Marmitt(Steps::Three) => Marmitt::<3>::first_entry(f, *p, *q),
        Solver::Marmitt(Steps::Four) => Marmitt::<4>::first_entry(f, *p, *q),
        Solver::Analytic => Analytic::first_entry(f, *p, *q),
        Solver::Step(_) => None,
    }
}

/// Why a method fails where it does, a line for each solver that does.
pub fn reason(solver: Solver) -> &'static str {
    match solver {
        Solver::Exact => "finds every root that float32 can decide",
        Solver::Linear => "takes the cubic for a line: off by its curvature, blind to what enters and leaves within the cell",
        Solver::Neubauer(_) => "blind to what enters and leaves within the cell; of three roots it may take the last",
        Solver::Marmitt(_) => "finds the part with the root, but repeated linear interpolation has not converged; powers lose digits",
        Solver::Analytic => "a closed form: products of coefficients lose digits near double roots",
        Solver::Step(_) => "blind to what enters and leaves between two steps",
    }
}

/// The columns of [`csv`].
const CSV_HEADER: &str = "family,backend,solver,segments,undecidable,missed,false,wrong_root,p50_voxel,p99.9_voxel,worst_voxel";

/// All rows for statistics.
pub fn csv(rows: &[Row]) -> String {
    let line = |r: &Row| {
        format!(
            "{},{},{},{},{},{},{},{},{:e},{:e},{:e}\n",
            r.family, r.backend, r.solver, r.segments, r.undecidable, r.missed, r.false_hits, r.wrong_root, r.p50, r.p999, r.worst
        )
    };
    format!("{CSV_HEADER}\n{}", rows.iter().map(line).collect::<String>())
}

/// A table for people: for each family the solvers, missed / false / wrong root in 10,000 and the 99.9th percentile of the error.
pub fn markdown(rows: &[Row]) -> String {
    let mut out = String::from(
        "# Where solvers fail\n\nOf 10,000 decidable segments: missed / false / wrong root; then the 99.9th percentile and the largest error in \
         voxels.\n`bregma stability --out DIR` makes this table and its CSV.\n",
    );
    for family in FAMILIES {
        let of_family: Vec<&Row> = rows.iter().filter(|r| r.family == family.name).collect();
        let undecidable = of_family.first().map_or(0, |r| r.undecidable);
        out += &format!("\n## {}\n{}; {undecidable} of {SEGMENTS} segments are beyond float32\n\n", family.name, family.about);
        out += "| solver | backend | missed / false / wrong root | p99.9 | largest | why |\n|---|---|---|---|---|---|\n";
        for r in of_family {
            let rate = |n: u32| f64::from(n) * 1e4 / f64::from(r.segments.max(1));
            let fails = r.missed + r.false_hits + r.wrong_root > 0 || r.p999 > DECIDED_VOXEL;
            out += &format!(
                "| {} | {} | {:.1} / {:.1} / {:.1} | {:.0e} | {:.0e} | {} |\n",
                r.solver,
                r.backend,
                rate(r.missed),
                rate(r.false_hits),
                rate(r.wrong_root),
                r.p999,
                r.worst,
                if fails { reason(r.solver) } else { "" }
            );
        }
    }
    out
}
