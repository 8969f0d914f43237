//! Which curve a section follows: what is asked for, and where that lies on the surface.

use super::curve::{Chain, Curve, chains};
use super::plane::{InPlane, Plane};
use super::{Mark, SectionError};
use crate::numbers::fixed;
use crate::partner::Partners;
use bregma_field::interpolant::smooth_normal;
use bregma_field::{Progress, Surface, WorldPoint};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A landmark by its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Named {
    /// What it is called.
    pub name: String,
    /// LPS mm.
    pub point_mm: DVec3,
}

/// Which curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "by", rename_all = "kebab-case")]
pub enum Path {
    /// From each landmark to the next in the plane that holds both and the mean of the outward normals there, along the shorter way: as the
    /// sagittal arcs of the vault are taken from landmark to landmark (Martin's M25 to M28), in the plane that the surface itself suggests.
    ///
    /// ```text
    ///       n₁ ▲     ▲ n₂         the plane of the page holds both points and (n₁ + n₂)/2
    ///      •━━━┷━━━━━┷━━•
    /// ```
    Profile {
        /// Two or more.
        landmarks: Vec<Named>,
    },
    /// From each landmark to the next in one plane, each at the place of the curve that is nearest to it.
    InPlane {
        /// Two or more.
        landmarks: Vec<Named>,
        /// The plane.
        plane: Plane,
    },
    /// A whole curve of a plane: that which passes the seed, or else the longest that no other goes round.
    Whole {
        /// The plane.
        plane: Plane,
        /// Where it begins, if it is closed.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        seed: Option<Named>,
        /// What is marked on it.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        landmarks: Vec<Named>,
    },
}

/// A landmark farther from the curve is not on it, mm: what the mouse and another isovalue may have done is less.
pub const LANDMARK_MM: f64 = 3.0;
/// A point of the surface and the plane is on one of its curves, to this; voxels. Between the curve's points the straight way is off by
/// less.
const ON_CURVE_VOXEL: f64 = 0.01;
/// How far the surface is from a landmark is told up to here, mm.
const FAR_MM: f64 = 1000.0;

/// The way along one curve from one of its places to another.
#[derive(Clone, Debug)]
struct Arc {
    /// Number of its curve.
    curve: usize,
    /// Where along the curve it begins, and in which sense it goes.
    from_mm: f64,
    sense: f64,
    length_mm: f64,
}

/// The curve of a section.
#[derive(Clone, Debug)]
pub struct Line<'a> {
    curves: Vec<Curve<'a>>,
    arcs: Vec<Arc>,
    /// Landmarks on it, in their order.
    pub marks: Vec<Mark>,
    /// Its end is its beginning.
    pub is_closed: bool,
    /// What the person should know.
    pub notes: Vec<String>,
}

impl<'a> Line<'a> {
    /// The curve of `path` on a surface, with that made ready for landmarks. `progress` counts rows of cells, for each plane.
    pub fn of(surface: &'a Surface, partners: &Partners<'a>, path: &Path, progress: &Progress) -> Result<Self, SectionError> {
        match path {
            Path::Profile { landmarks } => profile(surface, partners, landmarks, progress),
            Path::InPlane { landmarks, plane } => in_plane(InPlane::new(surface, *plane), landmarks, progress),
            Path::Whole { plane, seed, landmarks } => whole(InPlane::new(surface, *plane), seed.as_ref(), landmarks, progress),
        }
    }

    /// Its length, mm.
    pub fn length_mm(&self) -> f64 {
        self.arcs.iter().map(|arc| arc.length_mm).sum()
    }

    /// The point so far along it, LPS mm, and the plane that it lies in there.
    pub fn at(&self, along_mm: f64) -> Option<(DVec3, Plane)> {
        let (mut left_mm, last) = (along_mm, self.arcs.len().checked_sub(1)?);
        for (n, arc) in self.arcs.iter().enumerate() {
            if left_mm <= arc.length_mm || n == last {
                let curve = &self.curves[arc.curve];
                return Some((curve.at(arc.from_mm + arc.sense * left_mm.min(arc.length_mm)), curve.plane.plane));
            }
            left_mm -= arc.length_mm;
        }
        None
    }
}

/// The way from one place of a curve to another: of a closed one the shorter.
fn between(curves: &[Curve<'_>], curve: usize, from_mm: f64, to_mm: f64) -> Arc {
    let whole = &curves[curve];
    if !whole.is_closed {
        return Arc { curve, from_mm, sense: (to_mm - from_mm).signum(), length_mm: (to_mm - from_mm).abs() };
    }
    let ahead = (to_mm - from_mm).rem_euclid(whole.length_mm);
    let back = whole.length_mm - ahead;
    if ahead <= back { Arc { curve, from_mm, sense: 1.0, length_mm: ahead } } else { Arc { curve, from_mm, sense: -1.0, length_mm: back } }
}

fn two_or_more(landmarks: &[Named]) -> Result<(), SectionError> {
    if landmarks.len() < 2 { Err(SectionError::Few(landmarks.len())) } else { Ok(()) }
}

/// That a landmark does not lie on what is measured.
fn off_note(name: &str, off_mm: f64, of: &str) -> Option<String> {
    // A tenth of a millimetre is no more than a pick is off.
    (off_mm > 0.1).then(|| format!("{name} lies {} mm from the {of}; its nearest place there is taken", fixed(off_mm, 2)))
}

fn profile<'a>(surface: &'a Surface, partners: &Partners<'a>, landmarks: &[Named], progress: &Progress) -> Result<Line<'a>, SectionError> {
    two_or_more(landmarks)?;
    let mut line = Line { curves: vec![], arcs: vec![], marks: vec![], is_closed: false, notes: vec![] };
    let mut feet = vec![];
    for Named { name, point_mm } in landmarks {
        let nearest = partners.closest(WorldPoint(*point_mm), FAR_MM, None).ok_or(SectionError::Nothing)?;
        if nearest.distance_mm > LANDMARK_MM {
            return Err(SectionError::Far { name: name.clone(), off_mm: nearest.distance_mm });
        }
        line.notes.extend(off_note(name, nearest.distance_mm, "surface"));
        line.marks.push(Mark { name: name.clone(), along_mm: 0.0, off_mm: nearest.distance_mm });
        let normal = smooth_normal(surface, surface.grid.index(nearest.point)).unwrap_or(nearest.normal);
        feet.push((nearest.point.0, normal));
    }
    for n in 1..feet.len() {
        let [(a, na), (b, nb)] = [feet[n - 1], feet[n]];
        let names = || [landmarks[n - 1].name.clone(), landmarks[n].name.clone()];
        let plane = Plane::profile([a, b], [na, nb]).ok_or_else(|| SectionError::NoPlane(names().join(" and ")))?;
        let plane = InPlane::new(surface, plane);
        let points = [a, b].map(|p| plane.foot(p));
        let chains = chains(&plane, progress)?;
        let (chain, off_mm) = nearest_chain(&plane, &chains, &points).ok_or(SectionError::Nothing)?;
        if off_mm > ON_CURVE_VOXEL * surface.grid.spacing_mm().max_element() {
            let [from, to] = names();
            return Err(SectionError::Apart { from, to });
        }
        line.curves.push(Curve::of(plane, chain));
        let at = points.map(|p| line.curves[n - 1].nearest(p).0);
        line.arcs.push(between(&line.curves, n - 1, at[0], at[1]));
        line.marks[n].along_mm = line.length_mm();
    }
    Ok(line)
}

/// The chain whose farthest of some points is nearest, and how far that is, mm.
fn nearest_chain<'c>(plane: &InPlane<'_>, chains: &'c [Chain], points: &[DVec2]) -> Option<(&'c Chain, f64)> {
    let mut best: Option<(&Chain, f64)> = None;
    for chain in chains {
        let best_mm = best.map_or(f64::INFINITY, |(_, mm)| mm);
        let mm = points.iter().map(|p| chain.distance_mm(plane, *p, best_mm)).fold(0.0, f64::max);
        if mm < best_mm {
            best = Some((chain, mm));
        }
    }
    best
}

/// How far a landmark is from a place of a curve, mm.
fn off_mm(curve: &Curve<'_>, landmark: &Named) -> (f64, f64) {
    let along_mm = curve.nearest(curve.plane.foot(landmark.point_mm)).0;
    (along_mm, curve.at(along_mm).distance(landmark.point_mm))
}

fn in_plane<'a>(plane: InPlane<'a>, landmarks: &[Named], progress: &Progress) -> Result<Line<'a>, SectionError> {
    two_or_more(landmarks)?;
    let chains = chains(&plane, progress)?;
    let points: Vec<DVec2> = landmarks.iter().map(|l| plane.foot(l.point_mm)).collect();
    for (landmark, point) in landmarks.iter().zip(&points) {
        let (chain, _) = nearest_chain(&plane, &chains, &[*point]).ok_or(SectionError::Nothing)?;
        let (_, off_mm) = off_mm(&Curve::of(plane, chain), landmark);
        if off_mm > LANDMARK_MM {
            return Err(SectionError::Far { name: landmark.name.clone(), off_mm });
        }
    }
    let (chain, _) = nearest_chain(&plane, &chains, &points).ok_or(SectionError::Nothing)?;
    let mut line = Line { curves: vec![Curve::of(plane, chain)], arcs: vec![], marks: vec![], is_closed: false, notes: vec![] };
    let places: Vec<(f64, f64)> = landmarks.iter().map(|l| off_mm(&line.curves[0], l)).collect();
    for (n, (landmark, (at_mm, off_mm))) in landmarks.iter().zip(&places).enumerate() {
        if *off_mm > LANDMARK_MM {
            let from = landmarks[n.saturating_sub(1)].name.clone();
            return Err(SectionError::Apart { from, to: landmark.name.clone() });
        }
        if n > 0 {
            line.arcs.push(between(&line.curves, 0, places[n - 1].0, *at_mm));
        }
        line.notes.extend(off_note(&landmark.name, *off_mm, "curve"));
        line.marks.push(Mark { name: landmark.name.clone(), along_mm: line.length_mm(), off_mm: *off_mm });
    }
    Ok(line)
}

fn whole<'a>(plane: InPlane<'a>, seed: Option<&Named>, landmarks: &[Named], progress: &Progress) -> Result<Line<'a>, SectionError> {
    let chains = chains(&plane, progress)?;
    let chain = match seed {
        Some(seed) => nearest_chain(&plane, &chains, &[plane.foot(seed.point_mm)]).map(|(chain, _)| chain),
        None => longest_outer(&chains),
    };
    let curve = Curve::of(plane, chain.ok_or(SectionError::Nothing)?);
    let mut line = Line { is_closed: curve.is_closed, curves: vec![], arcs: vec![], marks: vec![], notes: vec![] };
    let on_curve = |landmark: &Named| {
        let (along_mm, off_mm) = off_mm(&curve, landmark);
        if off_mm <= LANDMARK_MM { Ok((along_mm, off_mm)) } else { Err(off_mm) }
    };
    let first = match seed {
        Some(seed) => Some(on_curve(seed).map_err(|off_mm| SectionError::Far { name: seed.name.clone(), off_mm })?.0),
        None => landmarks.iter().find_map(|l| on_curve(l).ok()).map(|(along_mm, _)| along_mm),
    };
    // Where nothing says, a closed curve begins at its front, or at its top where the plane faces the front.
    let front = Some(plane.direction(DVec3::NEG_Y)).filter(|front| front.length() > 0.1).unwrap_or(plane.direction(DVec3::Z));
    let from_mm = if curve.is_closed { first.unwrap_or_else(|| curve.farthest(front)) } else { 0.0 };
    let is_marked =
        |l: &&Named| landmarks.iter().chain(seed).find(|other| other.name == l.name).is_some_and(|other| std::ptr::eq(other, *l));
    for landmark in landmarks.iter().chain(seed).filter(is_marked) {
        let name = landmark.name.clone();
        match on_curve(landmark) {
            Ok((along_mm, off_mm)) => {
                let along_mm = along_mm - from_mm;
                let along_mm = if curve.is_closed { along_mm.rem_euclid(curve.length_mm) } else { along_mm };
                line.notes.extend(off_note(&name, off_mm, "curve"));
                line.marks.push(Mark { name, along_mm, off_mm });
            }
            Err(off_mm) => line.notes.push(format!("{name} lies {} mm from the curve and is not marked on it", fixed(off_mm, 2))),
        }
    }
    line.marks.sort_by(|a, b| a.along_mm.total_cmp(&b.along_mm));
    if !curve.is_closed {
        line.notes.push("the curve runs out of the scan, and is measured from where it comes in to where it leaves".into());
    }
    line.arcs.push(Arc { curve: 0, from_mm, sense: 1.0, length_mm: curve.length_mm });
    line.curves.push(curve);
    Ok(line)
}

/// The longest of the curves that no other goes round.
fn longest_outer(chains: &[Chain]) -> Option<&Chain> {
    let mut by_length: Vec<&Chain> = chains.iter().collect();
    by_length.sort_by(|a, b| b.about_mm().total_cmp(&a.about_mm()));
    let is_outer = |chain: &&Chain| {
        let point = chain.links.first().map_or(DVec2::NAN, |link| link.ends[0]);
        !chains.iter().any(|other| !std::ptr::eq(other, *chain) && other.holds(point))
    };
    by_length.into_iter().find(is_outer)
}
