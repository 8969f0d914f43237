//! What is cut away: half-spaces, cylinders and spheres, and what of a volume's rays they leave.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A part of the world that is kept; LPS mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// One side of a plane: n·x ≤ offset.
    Plane {
        /// Toward what is cut away; unit.
        normal: DVec3,
        /// How far the plane lies along it from the origin.
        offset_mm: f64,
    },
    /// What lies within a box along the axes of the world.
    Box {
        /// Its lowest corner.
        low_mm: DVec3,
        /// Its highest.
        high_mm: DVec3,
    },
    /// What lies within an endless cylinder.
    Cylinder {
        /// A point of its axis.
        centre_mm: DVec3,
        /// Along its axis; unit.
        axis: DVec3,
        /// Its radius.
        radius_mm: f64,
    },
    /// What lies within a sphere.
    Sphere {
        /// Its middle.
        centre_mm: DVec3,
        /// Its radius.
        radius_mm: f64,
    },
}

/// A cut through one volume or all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clip {
    /// What is kept.
    #[serde(flatten)]
    pub shape: Shape,
    /// The layers that it cuts, from 0; all when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers: Option<Vec<usize>>,
    /// Whether it cuts at the moment.
    #[serde(default = "yes")]
    pub enabled: bool,
}

fn yes() -> bool {
    true
}

impl Clip {
    /// Through all layers.
    pub fn all(shape: Shape) -> Self {
        Self { shape, layers: None, enabled: true }
    }

    /// The plane through three points, keeping what is on the side that they are counted around clockwise; none where they lie on a line.
    pub fn through([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let normal = (b - a).cross(c - a).try_normalize()?;
        Some(Self::all(Shape::Plane { normal, offset_mm: normal.dot(a) }))
    }

    /// The same cut, where the `count` layers that it belonged to are those from `first` on.
    pub fn moved(&self, first: usize, count: usize) -> Self {
        let own = self.layers.clone().unwrap_or_else(|| (0..count).collect());
        Self { layers: Some(own.into_iter().map(|n| n + first).collect()), ..self.clone() }
    }

    /// Makes its directions unit, where they have a length and are not; a plane stays where it is.
    pub fn normalize(&mut self) {
        // Normalizing again would change last digits.
        let is_unit = |v: DVec3| (v.length() - 1.0).abs() < 1e-12;
        match &mut self.shape {
            Shape::Plane { normal, offset_mm } if normal.length() > 0.0 && !is_unit(*normal) => {
                *offset_mm /= normal.length();
                *normal = normal.normalize();
            }
            Shape::Cylinder { axis, .. } if !is_unit(*axis) => *axis = axis.normalize_or_zero(),
            _ => {}
        }
    }

    /// Whether every number of it is one, and its directions are unit.
    pub fn is_sound(&self) -> bool {
        let is_unit = |v: DVec3| (v.length() - 1.0).abs() < 1e-6;
        match self.shape {
            Shape::Plane { normal, offset_mm } => is_unit(normal) && offset_mm.is_finite(),
            Shape::Box { low_mm, high_mm } => low_mm.is_finite() && high_mm.is_finite() && low_mm.cmplt(high_mm).all(),
            Shape::Cylinder { centre_mm, axis, radius_mm } => centre_mm.is_finite() && is_unit(axis) && radius_mm > 0.0,
            Shape::Sphere { centre_mm, radius_mm } => centre_mm.is_finite() && radius_mm > 0.0,
        }
    }

    /// Whether it cuts the layer of number `index`.
    pub fn cuts(&self, index: usize) -> bool {
        self.enabled && self.layers.as_ref().is_none_or(|layers| layers.contains(&index))
    }
}

/// One side of a plane: normal·p ≤ offset; the normal is unit.
#[derive(Clone, Copy, Debug)]
pub struct Half {
    /// Toward what is cut away; unit.
    pub normal: DVec3,
    /// How far the plane lies along it from the origin.
    pub offset_mm: f64,
}

/// The inside of a cylinder or a sphere: how far p is from its axis or its middle, along directions at right angles, each as a normal and an offset,
/// is at most the radius.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// The directions. A cylinder has two: the normal and the offset of its third are 0, so that along its axis nothing is far.
    pub across: [Half; 3],
    /// Its radius.
    pub radius_mm: f64,
}

/// What the cuts leave of one volume, in the world.
#[derive(Clone, Debug, Default)]
pub struct Region {
    /// Half-spaces.
    pub halves: Vec<Half>,
    /// Cylinders and spheres.
    pub rounds: Vec<Round>,
}

/// Where a line comes to what is kept or leaves it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Where on the line.
    pub s: f64,
    /// Of the cut there, outward, unit; none where the line itself begins or ends.
    pub normal: Option<DVec3>,
}

impl Region {
    /// What `clips` leave of the layer of number `index`.
    pub fn of(clips: &[Clip], index: usize) -> Self {
        let half = |normal: DVec3, offset_mm: f64| Half { normal, offset_mm };
        let mut region = Self::default();
        for clip in clips.iter().filter(|clip| clip.cuts(index)) {
            match clip.shape {
                Shape::Plane { normal, offset_mm } => {
                    // One that has no direction cuts nothing.
                    region.halves.extend(normal.try_normalize().map(|unit| half(unit, offset_mm / normal.length())));
                }
                Shape::Box { low_mm, high_mm } => {
                    for axis in DVec3::AXES {
                        region.halves.extend([half(axis, high_mm.dot(axis)), half(-axis, -low_mm.dot(axis))]);
                    }
                }
                Shape::Cylinder { centre_mm, axis, radius_mm } => {
                    // One without a direction or a radius cuts nothing.
                    let Some(axis) = axis.try_normalize().filter(|_| radius_mm > 0.0) else { continue };
                    let (u, v) = axis.any_orthonormal_pair();
                    region.rounds.push(Round { across: [u, v, DVec3::ZERO].map(|n| half(n, n.dot(centre_mm))), radius_mm });
                }
                Shape::Sphere { centre_mm, radius_mm } if radius_mm > 0.0 => {
                    region.rounds.push(Round { across: DVec3::AXES.map(|n| half(n, n.dot(centre_mm))), radius_mm });
                }
                Shape::Sphere { .. } => {}
            }
        }
        region
    }

    /// Whether nothing is cut away.
    pub fn is_all(&self) -> bool {
        self.halves.is_empty() && self.rounds.is_empty()
    }

    /// How far within a point is, mm; negative outside, and infinite where nothing is cut away. It changes by at most 1 mm per mm.
    pub fn depth_mm(&self, p: DVec3) -> f64 {
        let flat = self.halves.iter().map(|half| half.offset_mm - half.normal.dot(p));
        let away = |round: &Round| DVec3::from(round.across.map(|half| half.normal.dot(p) - half.offset_mm)).length();
        flat.chain(self.rounds.iter().map(|round| round.radius_mm - away(round))).fold(f64::INFINITY, f64::min)
    }

    /// Outward of the cut that is nearest to a point; none where nothing is cut away.
    pub fn nearest_normal(&self, p: DVec3) -> Option<DVec3> {
        let flat = self.halves.iter().map(|half| (half.offset_mm - half.normal.dot(p), half.normal));
        let away = |round: &Round| DVec3::from(round.across.map(|half| half.normal.dot(p) - half.offset_mm)).length();
        let round = self.rounds.iter().map(|round| (round.radius_mm - away(round), round.normal(p)));
        flat.chain(round).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).map(|(_, normal)| normal)
    }

    /// Where the line `origin + s·direction` is within, for s from `from` to `to`: the first is not the smaller where it is not.
    pub fn interval(&self, origin: DVec3, direction: DVec3, [from, to]: [f64; 2]) -> [End; 2] {
        let mut ends = [from, to].map(|s| End { s, normal: None });
        for half in &self.halves {
            let (rate, room) = (half.normal.dot(direction), half.offset_mm - half.normal.dot(origin));
            if rate < 0.0 {
                ends[0] = ends[0].later(room / rate, half.normal);
            } else if rate > 0.0 {
                ends[1] = ends[1].earlier(room / rate, half.normal);
            } else if room < 0.0 {
                ends[1].s = f64::NEG_INFINITY;
            }
        }
        for round in &self.rounds {
            let [enter, leave] = round.interval(origin, direction);
            ends[0] = ends[0].later(enter, round.normal(origin + enter * direction));
            ends[1] = ends[1].earlier(leave, round.normal(origin + leave * direction));
        }
        ends
    }
}

/// Rounding of points a metre from the origin, a thousand times over.
const AT_CUT_MM: f64 = 1e-10;

impl End {
    fn later(self, s: f64, normal: DVec3) -> Self {
        // A line that begins within rounding of a cut begins at it.
        let begins_here = self.normal.is_none() && (s - self.s).abs() <= AT_CUT_MM;
        if begins_here {
            Self { s: s.max(self.s), normal: Some(normal) }
        } else if s > self.s {
            Self { s, normal: Some(normal) }
        } else {
            self
        }
    }

    fn earlier(self, s: f64, normal: DVec3) -> Self {
        if s < self.s { Self { s, normal: Some(normal) } } else { self }
    }
}

impl Round {
    /// Outward from the axis or the middle at a point; any direction where there is no such one.
    fn normal(&self, p: DVec3) -> DVec3 {
        let outward: DVec3 = self.across.iter().map(|half| (half.normal.dot(p) - half.offset_mm) * half.normal).sum();
        outward.try_normalize().unwrap_or(self.across[0].normal)
    }

    /// Where a line is within; the first is the larger where it never is.
    fn interval(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let at = self.across.map(|half| half.normal.dot(origin) - half.offset_mm);
        let rate = self.across.map(|half| half.normal.dot(direction));
        let a = rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2];
        let b = at[0] * rate[0] + at[1] * rate[1] + at[2] * rate[2];
        let c = at[0] * at[0] + at[1] * at[1] + at[2] * at[2] - self.radius_mm * self.radius_mm;
        if a == 0.0 {
            return if c <= 0.0 { [f64::NEG_INFINITY, f64::INFINITY] } else { [f64::INFINITY, f64::NEG_INFINITY] };
        }
        let discriminant = b * b - a * c;
        if discriminant < 0.0 {
            return [f64::INFINITY, f64::NEG_INFINITY];
        }
        // Both roots without cancellation (Numerical Recipes, 5.6).
        let k = -(b + discriminant.sqrt().copysign(b));
        if k == 0.0 {
            return [0.0, 0.0];
        }
        let (first, second) = (k / a, c / k);
        [first.min(second), first.max(second)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_synthetic::Random;
    use glam::{DAffine3, DQuat};

    fn vector(r: &mut Random, size: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| size * (2.0 * r.unit() - 1.0)))
    }

    /// One to three cuts of any kind near the origin.
    fn clips(r: &mut Random) -> Vec<Clip> {
        let count = 1 + (3.0 * r.unit()) as usize;
        let mut shape = || match (4.0 * r.unit()) as usize {
            0 => Shape::Plane { normal: vector(r, 1.0).normalize(), offset_mm: 10.0 * r.unit() },
            1 => Shape::Box { low_mm: vector(r, 5.0) - 8.0, high_mm: vector(r, 5.0) + 8.0 },
            2 => Shape::Sphere { centre_mm: vector(r, 5.0), radius_mm: 5.0 + 5.0 * r.unit() },
            _ => Shape::Cylinder { centre_mm: vector(r, 5.0), axis: vector(r, 1.0).normalize(), radius_mm: 5.0 + 5.0 * r.unit() },
        };
        (0..count).map(|_| Clip::all(shape())).collect()
    }

    /// How far within all shapes a point is, mm; negative outside. By the definitions of the shapes.
    fn depth_mm(clips: &[Clip], p: DVec3) -> f64 {
        let depth = |clip: &Clip| match clip.shape {
            Shape::Plane { normal, offset_mm } => offset_mm - normal.dot(p),
            Shape::Box { low_mm, high_mm } => (p - low_mm).min(high_mm - p).min_element(),
            Shape::Cylinder { centre_mm, axis, radius_mm } => radius_mm - (p - centre_mm).reject_from_normalized(axis).length(),
            Shape::Sphere { centre_mm, radius_mm } => radius_mm - p.distance(centre_mm),
        };
        clips.iter().map(depth).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn an_interval_holds_the_points_within_all_shapes_and_no_others() {
        // Fails if a shape is turned inside out, one of several is forgotten, an end is the wrong root, or a normal points inward.
        let mut r = Random(1);
        let mut kept = 0;
        for _ in 0..2000 {
            let clips = clips(&mut r);
            let (region, origin, direction) = (Region::of(&clips, 0), vector(&mut r, 20.0), vector(&mut r, 1.0));
            let ends = region.interval(origin, direction, [-50.0, 50.0]);
            for n in 0..=40 {
                let s = -50.0 + 2.5 * f64::from(n) + r.unit();
                let within = ends[0].s <= s && s <= ends[1].s && s <= 50.0;
                let depth = depth_mm(&clips, origin + s * direction);
                assert!(within == (depth >= 0.0 && s <= 50.0) || depth.abs() < 1e-9, "{clips:?} {origin} {direction} {s}: {ends:?}");
                assert!((region.depth_mm(origin + s * direction) - depth).abs() < 1e-9, "{clips:?} {origin} {direction} {s}");
            }
            if ends[0].s < ends[1].s {
                kept += 1;
                for (end, outward) in ends.iter().zip([-1.0, 1.0]) {
                    let Some(normal) = end.normal else { continue };
                    let p = origin + end.s * direction;
                    assert!((normal.length() - 1.0).abs() < 1e-9 && outward * normal.dot(direction) > -1e-9, "{clips:?} {end:?}");
                    let nearest = region.nearest_normal(p).unwrap();
                    assert!(nearest.dot(normal) > 1.0 - 1e-9 || (depth_mm(&clips, p + 1e-6 * nearest)) < 0.0, "{clips:?} {end:?}");
                    assert!(depth_mm(&clips, p).abs() < 1e-9 && depth_mm(&clips, p + 1e-6 * normal) < 0.0, "{clips:?} {end:?}");
                }
            }
        }
        assert!(kept > 500, "only {kept} lines met what is kept");
    }

    #[test]
    fn a_cut_and_a_line_that_move_together_meet_where_they_did() {
        // Fails if an offset, a centre or an axis is taken in another frame than the line.
        let mut r = Random(2);
        for _ in 0..500 {
            let clips: Vec<Clip> = clips(&mut r).into_iter().filter(|clip| !matches!(clip.shape, Shape::Box { .. })).collect();
            let turn = DQuat::from_axis_angle(vector(&mut r, 1.0).normalize(), 6.0 * r.unit());
            let motion = DAffine3::from_rotation_translation(turn, vector(&mut r, 30.0));
            let moved = |clip: &Clip| match clip.shape {
                Shape::Plane { normal, offset_mm } => {
                    let normal = turn * normal;
                    Clip::all(Shape::Plane { normal, offset_mm: offset_mm + normal.dot(motion.translation) })
                }
                Shape::Cylinder { centre_mm, axis, radius_mm } => {
                    Clip::all(Shape::Cylinder { centre_mm: motion.transform_point3(centre_mm), axis: turn * axis, radius_mm })
                }
                Shape::Sphere { centre_mm, radius_mm } => {
                    Clip::all(Shape::Sphere { centre_mm: motion.transform_point3(centre_mm), radius_mm })
                }
                Shape::Box { .. } => unreachable!("boxes lie along the axes of the world"),
            };
            let (origin, direction) = (vector(&mut r, 20.0), vector(&mut r, 1.0));
            let before = Region::of(&clips, 0).interval(origin, direction, [-50.0, 50.0]);
            let there: Vec<Clip> = clips.iter().map(moved).collect();
            let after = Region::of(&there, 0).interval(motion.transform_point3(origin), turn * direction, [-50.0, 50.0]);
            if before[0].s >= before[1].s {
                assert!(after[0].s >= after[1].s - 1e-6, "{clips:?}: {before:?} but {after:?}");
                continue;
            }
            for (a, b) in before.iter().zip(&after) {
                // A grazed cylinder's ends are as uncertain as the root of a rounding.
                assert!((a.s - b.s).abs() < 1e-5, "{clips:?}: {before:?} but {after:?}");
            }
        }
    }

    #[test]
    fn a_cut_is_of_its_layers_alone_and_normalizing_moves_none() {
        // Fails if a cut of one scan cuts another, layers keep their numbers when scans are added, or a plane moves when it is normalized.
        let mut r = Random(3);
        for _ in 0..200 {
            let (normal, p) = (vector(&mut r, 3.0), vector(&mut r, 20.0));
            let offset_mm = 10.0 * r.unit();
            let mut clip = Clip { layers: Some(vec![1]), ..Clip::all(Shape::Plane { normal, offset_mm }) };
            assert!(Region::of(std::slice::from_ref(&clip), 0).is_all());
            let later = clip.moved(3, 2);
            assert!(later.cuts(4) && !later.cuts(1));
            clip.normalize();
            assert!(clip.is_sound());
            let side = depth_mm(std::slice::from_ref(&clip), p);
            assert!((side * normal.length() - (offset_mm - normal.dot(p))).abs() < 1e-9, "{clip:?} {p}");
            let again = clip.clone();
            clip.normalize();
            assert_eq!(clip, again);
            clip.enabled = false;
            assert!(Region::of(&[clip], 1).is_all());
        }
    }
}
