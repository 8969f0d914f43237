//! Families of segments: ways to make a cell and a ray through it that are hard for solvers.

use super::DOUBT;
use super::random::Random;
use bregma_field::{crossings, interpolant};
use glam::Vec3;

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

impl Segment {
    /// The interpolant at u of the segment, in float64.
    pub fn value(&self, u: f64) -> f64 {
        let p = self.from.as_dvec3().lerp(self.to.as_dvec3(), u);
        interpolant::weighted(&self.corners.map(f64::from), p)
    }

    /// Every crossing with all corners raised by `shift`, in order: u, and whether it enters. One that starts inside enters at 0.
    pub(super) fn crossings(&self, shift: f64) -> Vec<(f64, bool)> {
        let corners = self.corners.map(|c| f64::from(c) + shift);
        crossings::segment_crossings(&corners, self.from.as_dvec3(), self.to.as_dvec3())
    }

    /// How wrong float32 may be about a value.
    pub(super) fn doubt(&self) -> f64 {
        DOUBT * self.corners.iter().fold(0.0_f64, |m, &c| m.max(f64::from(c).abs()))
    }
}

/// A family of hard segments.
pub(super) struct Family {
    pub name: &'static str,
    /// What is hard about it.
    pub about: &'static str,
    make: fn(&mut Random) -> Segment,
}

impl Family {
    /// Segment `n` of family number `number`. Each has its own generator, so that the order of work does not matter.
    pub fn segment(&self, number: usize, n: usize) -> Segment {
        let mut random = Random((number as u64) << 32 | n as u64);
        random.bits();
        (self.make)(&mut random)
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

/// A rough cell that rises, falls and rises along the chord, shifted to a level that is passed three times.
fn three_roots(r: &mut Random) -> Segment {
    loop {
        let s = rough(r);
        let values: Vec<f64> = (0..=16).map(|i| s.value(f64::from(i) / 16.0)).collect();
        let Some(top) = (1..16).find(|&i| values[i] > values[i - 1] && values[i] > values[i + 1]) else { continue };
        let Some(bottom) = (top + 1..16).find(|&i| values[i] < values[i - 1] && values[i] < values[i + 1]) else { continue };
        let (low, high) = (values[0].max(values[bottom]), values[top].min(values[16]));
        if low < high {
            let level = low + (high - low) * f64::from(r.unit());
            return Segment { corners: s.corners.map(|c| (f64::from(c) - level) as f32), ..s };
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

/// Every family of segments.
pub(super) const FAMILIES: &[Family] = &[
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
