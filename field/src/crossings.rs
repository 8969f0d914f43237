//! Every crossing of a ray and an isosurface, in order, with its certified bracket, in float64: the reference.
//!
//! It shares nothing with the fast renderers but the definition of the surface: no bricks, no leaps, no float32, and roots
//! isolated by Descartes' rule of signs in the Bernstein basis (Lane and Riesenfeld 1981) instead of turning points.
//! Pictures are held to it by tests; the difference ray is it.

use crate::interpolant::{self, corners, gradient};
use crate::ray::Ray;
use crate::surface::Surface;
use bregma_volume::{IndexPoint, WorldPoint};
use glam::{DAffine3, DMat3, DVec3, USizeVec3};
use serde::Serialize;
use std::ops::ControlFlow;

/// What a ray does where it meets the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// From outside into the bone.
    Enter,
    /// From the bone to the outside.
    Exit,
    /// Contact from outside in a single point: a root without a change of sides. (Contact from inside changes nothing, as ties
    /// are inside.)
    Touch,
}

/// One meeting of the ray and the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance from the ray's origin, mm.
    pub t_mm: f64,
    /// What happens there.
    pub kind: Kind,
    /// Half the width of the certified bracket of the root, plus how far rounding of positions and of the cubic can move it; mm.
    pub error_mm: f64,
    /// The cell, by its lowest sample.
    pub cell: USizeVec3,
    /// The point in index space.
    pub point: IndexPoint,
    /// Outward normal in the world, unit; of the volume's face where `clipped`.
    pub normal: DVec3,
    /// Change of the sample along the ray per mm (sample units); 0 where `clipped` or `at_origin`.
    pub slope_per_mm: f64,
    /// The ray enters or leaves the volume's box, or what cuts leave of it, here while inside bone.
    pub clipped: bool,
    /// The ray begins here, inside bone.
    pub at_origin: bool,
}

/// The stretch of a ray within a volume's box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxSpan {
    /// First and last t in the box, mm.
    pub t_mm: [f64; 2],
    /// What is passed there; `None` where the ray's origin is inside.
    faces: [Option<Face>; 2],
}

/// Where a surface is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Face {
    /// At a face of the volume's box: its axis and side (−1 or 1).
    OfBox(usize, f64),
    /// At a cut: its outward normal in the world.
    OfCut(DVec3),
}

/// The ray in the index space of a surface's volume: same t, not a unit direction.
struct IndexLine {
    origin: DVec3,
    direction: DVec3,
}

fn index_line(surface: &Surface, ray: &Ray) -> IndexLine {
    let to_index = surface.grid.world_to_index();
    IndexLine { origin: surface.grid.index(ray.origin).0, direction: to_index.transform_vector3(ray.direction) }
}

/// Positions of a few thousand voxels, mapped to the world and back, are good to 1e-12 of themselves.
const AT_FACE_VOXEL: f64 = 1e-9;

/// Where `ray` (t ≥ 0) is inside the box of the surface's volume; `None` when it misses, or the volume has no cells.
pub fn box_span(surface: &Surface, ray: &Ray) -> Option<BoxSpan> {
    let line = index_line(surface, ray);
    let mut span = BoxSpan { t_mm: [0.0, f64::INFINITY], faces: [None; 2] };
    for axis in 0..3 {
        let (o, d, n) = (line.origin[axis], line.direction[axis], surface.grid.cells()[axis] as f64);
        if d == 0.0 {
            if !(0.0..=n).contains(&o) {
                return None;
            }
            continue;
        }
        let (near, far, side) = if d > 0.0 { (0.0, n, 1.0) } else { (n, 0.0, -1.0) };
        let (t_near, t_far) = ((near - o) / d, (far - o) / d);
        // A ray that begins within rounding of a face begins at it.
        let begins_here = span.faces[0].is_none() && (near - o).abs() <= AT_FACE_VOXEL;
        if t_near > span.t_mm[0] || begins_here {
            (span.t_mm[0], span.faces[0]) = (t_near.max(span.t_mm[0]), Some(Face::OfBox(axis, -side)));
        }
        if t_far < span.t_mm[1] {
            (span.t_mm[1], span.faces[1]) = (t_far, Some(Face::OfBox(axis, side)));
        }
    }
    let [from, to] = surface.region.interval(ray.origin.0, ray.direction, span.t_mm);
    span.t_mm = [from.s, to.s];
    for (face, end) in span.faces.iter_mut().zip([from, to]) {
        *face = end.normal.map(Face::OfCut).or(*face);
    }
    (!surface.grid.is_flat() && span.t_mm[0] < span.t_mm[1]).then_some(span)
}

/// The first crossing of the ray that enters the bone or touches it: the point a picture shows. What comes behind it is not looked at: a
/// touch at a face between cells is an `Enter` here.
pub fn first_entry(surface: &Surface, ray: &Ray) -> Option<Crossing> {
    let mut first = None;
    walk(surface, ray, &mut |crossing| {
        if crossing.kind == Kind::Exit {
            return ControlFlow::Continue(());
        }
        first = Some(crossing);
        ControlFlow::Break(())
    });
    first
}

/// The first wall of bone that the ray passes: where it enters, or begins inside, and where it leaves. What comes behind it is not looked at.
pub fn first_wall(surface: &Surface, ray: &Ray) -> Option<[Crossing; 2]> {
    let mut wall = [None; 2];
    walk(surface, ray, &mut |crossing| {
        let end = match crossing.kind {
            Kind::Enter => 0,
            Kind::Exit => 1,
            Kind::Touch => return ControlFlow::Continue(()),
        };
        wall[end] = Some(crossing);
        if end == 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    Some([wall[0]?, wall[1]?])
}

/// Every crossing of the ray (t ≥ 0), in order. Entries and exits alternate, beginning with an entry.
///
/// ```
/// use bregma_field::crossings::{Kind, crossings};
/// use bregma_field::{Grid, Ray, Surface, WorldPoint};
/// use bregma_synthetic::analytic::Plane;
/// use glam::{DAffine3, DMat3, DVec3};
/// use std::sync::Arc;
///
/// // Bone is what lies below z = 2.5 mm.
/// let grid = Grid::new([4, 4, 6], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY)?;
/// let slab = Plane { point: DVec3::Z * 2.5, normal: DVec3::Z }.volume(&grid);
/// let surface = Surface::new(&Arc::new(slab), 0.0, DAffine3::IDENTITY)?;
/// let ray = Ray::new(WorldPoint(DVec3::new(1.5, 1.5, 10.0)), DVec3::NEG_Z).expect("that is a direction");
///
/// let [enter, exit] = crossings(&surface, &ray).try_into().expect("a wall has two sides");
/// assert!(enter.kind == Kind::Enter && (enter.t_mm - 7.5).abs() <= enter.error_mm);
/// // There the scan ends, not the bone.
/// assert!(exit.kind == Kind::Exit && exit.clipped && exit.t_mm == 10.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn crossings(surface: &Surface, ray: &Ray) -> Vec<Crossing> {
    let mut all: Vec<Crossing> = Vec::new();
    walk(surface, ray, &mut |crossing| {
        match all.last_mut().filter(|last| is_same_point(last, &crossing)) {
            // In and out at one point, as through a corner whose sample equals the isovalue: the ray only touches there.
            Some(last) if last.kind == Kind::Enter && crossing.kind == Kind::Exit => {
                *last = Crossing { kind: Kind::Touch, ..if crossing.clipped { crossing } else { *last } };
            }
            // Out and in at one point: it never left.
            Some(last) if last.kind == Kind::Exit && crossing.kind == Kind::Enter => drop(all.pop()),
            _ => all.push(crossing),
        }
        ControlFlow::Continue(())
    });
    all
}

/// True when the rounding of t cannot tell two crossings apart.
fn is_same_point(a: &Crossing, b: &Crossing) -> bool {
    b.t_mm - a.t_mm <= 2.0 * ROUNDING * b.t_mm.abs()
}

/// Visits every crossing in order until told to stop. A tangential root is reported as `Touch`.
fn walk(surface: &Surface, ray: &Ray, visit: &mut dyn FnMut(Crossing) -> ControlFlow<()>) {
    let Some(span) = box_span(surface, ray) else { return };
    let line = index_line(surface, ray);
    let cells = USizeVec3::from(surface.grid.cells());
    let [t_first, t_last] = span.t_mm;
    let off = position_error(surface, ray, t_last);
    let entry = snapped(&line, t_first, span.faces[0], cells);
    let mut cell = first_cell(&line, entry, cells);
    let (mut t, mut p) = (t_first, entry);
    let (mut was_inside, mut is_first) = (false, true);
    loop {
        let (t_out, axis) = exit_of(&line, cell, t, t_last);
        let mut q = line.origin + t_out * line.direction;
        if let Some(a) = axis {
            q[a] = (cell[a] + usize::from(line.direction[a] > 0.0)) as f64;
        } else {
            q = snapped(&line, t_last, span.faces[1], cells);
        }
        q = q.clamp(cell.as_dvec3(), (cell + USizeVec3::ONE).as_dvec3());
        let f = corners(surface, cell);
        let mut stop = false;
        let pass = CellPass { surface, ray, line: &line, off, cell, t: [t, t_out], p: [p, q], f: &f };
        let mut found =
            |u: f64, kind: Kind, width: f64, cut: Option<Cut>| stop = stop || visit(pass.crossing(u, kind, width, cut)).is_break();
        let begin = is_first.then(|| span.faces[0].map_or(Cut::Origin, Cut::Face));
        was_inside = pass.cross(was_inside, begin, &mut found);
        is_first = false;
        let ahead = |a: usize| cell[a].wrapping_add_signed(if line.direction[a] > 0.0 { 1 } else { -1 });
        let next = axis.map(|a| (a, ahead(a))).filter(|&(a, ahead)| ahead < cells[a]);
        if next.is_none() && was_inside {
            let face = axis.map(|a| Face::OfBox(a, line.direction[a].signum())).or(span.faces[1]);
            found(1.0, Kind::Exit, 0.0, face.map(Cut::Face));
        }
        let Some((a, ahead)) = next.filter(|_| !stop) else { return };
        cell[a] = ahead;
        (t, p) = (t_out, q);
    }
}

/// The cell that a ray is in just behind its entry into the box.
fn first_cell(line: &IndexLine, entry: DVec3, cells: USizeVec3) -> USizeVec3 {
    let mut cell = USizeVec3::ZERO;
    for a in 0..3 {
        let at_face = entry[a].fract() == 0.0 && line.direction[a] < 0.0 && entry[a] > 0.0;
        cell[a] = (entry[a] as usize - usize::from(at_face)).min(cells[a] - 1);
    }
    cell
}

/// Where a ray that is in a cell at `t` leaves it, and across which axis; none where that is the end of its way at `t_last`.
fn exit_of(line: &IndexLine, cell: USizeVec3, t: f64, t_last: f64) -> (f64, Option<usize>) {
    let (mut t_out, mut axis) = (t_last, None);
    for a in 0..3 {
        let d = line.direction[a];
        if d != 0.0 {
            let face = (cell[a] + usize::from(d > 0.0)) as f64;
            let t_face = (face - line.origin[a]) / d;
            if t_face < t_out {
                (t_out, axis) = (t_face.max(t), Some(a));
            }
        }
    }
    (t_out, axis)
}

/// A ray's way through a cell: t and the position at its entry and at its exit.
struct CellPass<'a> {
    surface: &'a Surface,
    ray: &'a Ray,
    line: &'a IndexLine,
    off: f64,
    cell: USizeVec3,
    t: [f64; 2],
    p: [DVec3; 2],
    f: &'a [f64; 8],
}

impl CellPass<'_> {
    /// Finds what is crossed on the way, which is entered inside or outside of bone, and begins at `begin` if it is the first; says where it
    /// ends.
    fn cross(&self, was_inside: bool, begin: Option<Cut>, found: &mut dyn FnMut(f64, Kind, f64, Option<Cut>)) -> bool {
        let sides = self.f.iter().filter(|&&v| v >= 0.0).count();
        let parts = self.parts_within();
        if parts.is_none() && (sides == 0 && !was_inside || sides == 8 && was_inside) {
            return was_inside;
        }
        let (b, rounding) = self.cubic(self.f);
        let roots = roots(b, rounding);
        let Some(parts) = parts else {
            return cross_part((&b, &roots), [Bound::BEGIN, Bound::END], was_inside, begin, found);
        };
        let mut inside = was_inside;
        if inside && parts.first().is_none_or(|[from, _]| from.u > 0.0) {
            found(0.0, Kind::Exit, 0.0, Some(self.solid_face(0.0)));
            inside = false;
        }
        for [from, to] in parts {
            let at_face = || (from.u > 0.0 || !was_inside).then(|| self.solid_face(from.u));
            inside = cross_part((&b, &roots), [from, to], inside, begin.filter(|_| from.u == 0.0).or_else(at_face), found);
            if inside && to.u < 1.0 {
                found(to.u, Kind::Exit, to.width, Some(self.solid_face(to.u)));
                inside = false;
            }
        }
        inside
    }

    /// The cubic along the way of values at the cell's corners, and how wrong values of it may be.
    fn cubic(&self, f: &[f64; 8]) -> ([f64; 4], f64) {
        let [p, q] = self.p.map(|p| p - self.cell.as_dvec3());
        // Rounding of an interpolated value, and of a cubic's at u, is together below 16 units of the largest corner, and a step along
        // each of three axes changes a value by at most twice that corner; all of it thrice, as the coefficients are.
        let largest = f.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        (bernstein(f, p, q), 3.0 * largest * (16.0 * f64::EPSILON + 6.0 * self.off))
    }

    /// The parts of the way within the solid, no more than two; `None` where all of it is.
    fn parts_within(&self) -> Option<Vec<[Bound; 2]>> {
        let f = self.surface.solid.as_ref()?.corners(self.cell.to_array()).map(f64::from);
        if f.iter().all(|units| *units >= 0.0) {
            return None;
        }
        let (b, rounding) = self.cubic(&f);
        let mut bounds = if b[0] >= 0.0 { vec![Bound::BEGIN] } else { vec![] };
        // In a point that only touches it there is no part.
        bounds.extend(roots(b, rounding).iter().filter(|root| root.kind != Kind::Touch).map(|root| Bound { u: root.u, width: root.width }));
        if bounds.len() % 2 == 1 {
            bounds.push(Bound::END);
        }
        Some(bounds.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
    }

    /// The face that the solid cuts bone with at u of the way.
    fn solid_face(&self, u: f64) -> Cut {
        let inward = self.surface.solid.as_ref().map(|solid| solid.distance_and_gradient(IndexPoint(self.p[0].lerp(self.p[1], u))).1);
        let outward = self.surface.grid.world_to_index().matrix3.transpose() * -inward.unwrap_or_default();
        Cut::Face(Face::OfCut(outward.try_normalize().unwrap_or(-self.ray.direction)))
    }

    /// What is crossed at u of the way, known to `width`.
    fn crossing(&self, u: f64, kind: Kind, width: f64, cut: Option<Cut>) -> Crossing {
        let Self { surface, ray, line, off, cell, t: [t, t_out], p: [p, q], f } = *self;
        let local = p.lerp(q, u) - cell.as_dvec3();
        let g = gradient(f, local);
        let to_world = surface.grid.world_to_index().matrix3.transpose();
        let outward = match cut {
            None => to_world * -g,
            Some(Cut::Face(Face::OfBox(a, side))) => to_world * (DVec3::AXES[a] * side),
            Some(Cut::Face(Face::OfCut(normal))) => normal,
            Some(Cut::Origin) => -ray.direction,
        };
        let t_mm = t + u * (t_out - t);
        // Where a face is met moves with the position.
        let moved = if let Some(Cut::Face(Face::OfBox(a, _))) = cut { off / line.direction[a].abs() } else { 0.0 };
        Crossing {
            t_mm,
            kind,
            error_mm: width * (t_out - t) + moved + ROUNDING * t_mm.abs(),
            cell,
            point: IndexPoint(cell.as_dvec3() + local),
            normal: outward.try_normalize().unwrap_or(-ray.direction),
            slope_per_mm: if cut.is_some() { 0.0 } else { g.dot(line.direction) * f64::from(surface.sign) },
            clipped: matches!(cut, Some(Cut::Face(..))),
            at_origin: matches!(cut, Some(Cut::Origin)),
        }
    }
}

/// Where a part of a way begins or ends: u, and how far its bracket and rounding can move it.
#[derive(Clone, Copy)]
struct Bound {
    u: f64,
    width: f64,
}

impl Bound {
    const BEGIN: Self = Self { u: 0.0, width: 0.0 };
    const END: Self = Self { u: 1.0, width: 0.0 };
}

/// Finds what is crossed on a part of a way through a cell, of the cubic `b` with its `roots`: it comes to it inside or outside of bone, and is cut
/// at `cut` where it begins inside. Says where it ends.
fn cross_part(
    (b, roots): (&[f64; 4], &[Root]),
    [from, to]: [Bound; 2],
    was_inside: bool,
    cut: Option<Cut>,
    found: &mut dyn FnMut(f64, Kind, f64, Option<Cut>),
) -> bool {
    // By how many roots are passed: the same as what is found.
    let passed = |u: f64| roots.iter().filter(|root| root.kind != Kind::Touch && root.u <= u).count();
    let inside_at = |u: f64| (b[0] >= 0.0) != (passed(u) % 2 == 1);
    let begins_inside = if from.u > 0.0 { inside_at(from.u) } else { b[0] >= 0.0 };
    if begins_inside != was_inside {
        // Entered already inside: the surface is closed here. Later: a face value that rounding moved across zero.
        found(from.u, if was_inside { Kind::Exit } else { Kind::Enter }, from.width, cut);
    }
    for root in roots.iter().filter(|root| (from.u == 0.0 || root.u > from.u) && root.u <= to.u) {
        found(root.u, root.kind, root.width, None);
    }
    if to.u < 1.0 { inside_at(to.u) } else { b[3] >= 0.0 }
}

/// Where bone is cut rather than bounded.
#[derive(Clone, Copy)]
enum Cut {
    /// Where the surface is closed.
    Face(Face),
    /// At the ray's origin.
    Origin,
}

/// How far a computed point of the ray up to `t` may lie from the ray along an axis, voxels.
fn position_error(surface: &Surface, ray: &Ray, t: f64) -> f64 {
    let DAffine3 { matrix3: m, translation } = surface.grid.world_to_index();
    let sizes = DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    // Five roundings of half a unit each on the way of any term: the map's product and sums, t·direction, its sum with the origin.
    2.5 * f64::EPSILON * (sizes * (ray.origin.0.abs() + t * ray.direction.abs()) + translation.abs()).max_element()
}

/// Rounding of t itself, relative.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The point at t with the coordinate of the face that is passed there exact, and the others within the box.
fn snapped(line: &IndexLine, t: f64, face: Option<Face>, cells: USizeVec3) -> DVec3 {
    let mut p = line.origin + t * line.direction;
    if let Some(Face::OfBox(axis, side)) = face {
        p[axis] = if side > 0.0 { cells[axis] as f64 } else { 0.0 };
    }
    p.clamp(DVec3::ZERO, cells.as_dvec3())
}

/// Thrice the Bernstein coefficients of the interpolant along p → q, by its blossom: as in `roots/bernstein.rs`, but written from the
/// definition. Thrice, since a third is no float64: so they are exact for integers of 17 bits where p and q are multiples of 1/2048.
pub(crate) fn bernstein(f: &[f64; 8], p: DVec3, q: DVec3) -> [f64; 4] {
    let at = |x: DVec3, y: DVec3, z: DVec3| interpolant::value(f, DVec3::new(x.x, y.y, z.z));
    [3.0 * at(p, p, p), at(q, p, p) + at(p, q, p) + at(p, p, q), at(q, q, p) + at(q, p, q) + at(p, q, q), 3.0 * at(q, q, q)]
}

/// Every crossing of a segment of a cell with the given corner values (corner x + 2y + 4z at (x, y, z); inside is ≥ 0), in order: u in
/// [0, 1], and whether it enters. Starting inside counts as entering at 0, ending inside not as leaving; a touch enters and leaves at
/// one u.
pub fn segment_crossings(corners: &[f64; 8], from: DVec3, to: DVec3) -> Vec<(f64, bool)> {
    let b = bernstein(corners, from, to);
    let mut crossings = if b[0] >= 0.0 { vec![(0.0, true)] } else { vec![] };
    for root in roots(b, 0.0) {
        let sides: &[bool] = match root.kind {
            Kind::Enter => &[true],
            Kind::Exit => &[false],
            Kind::Touch => &[true, false],
        };
        crossings.extend(sides.iter().map(|&enters| (root.u, enters)));
    }
    crossings
}

/// A root of a cubic in [0, 1].
#[derive(Clone, Copy, Debug)]
struct Root {
    u: f64,
    /// How far the bracket, and values wrong by `rounding`, can move it.
    width: f64,
    kind: Kind,
}

/// The roots in [0, 1], in order, of the cubic with the Bernstein coefficients `b`, values of which are wrong by up to `rounding`. Their
/// number and kinds are those of the cubic that `b` is, without rounding.
fn roots(b: [f64; 4], rounding: f64) -> Vec<Root> {
    let mut found = vec![];
    // Most cells have none: they need no exact sums.
    if b.iter().all(|&c| c < 0.0) || b.iter().all(|&c| c >= 0.0) {
        return found;
    }
    isolate(&b.map(|c| Sum(vec![c])), rounding, 0.0, 1.0, &mut found);
    found
}

/// Halvings before two roots are taken as one: 2⁻⁴⁸ of a cell is finer than float64 places a point in a scan of 16 cells. Where signs
/// still vary twice, two roots, real or complex, lie within 2⁻⁴⁷ (the two-circle theorem): what is taken for a contact there comes
/// nearer to 0 than 2⁻⁹⁰ of the largest coefficient.
const MAX_HALVINGS: f64 = 1.0 / (1_u64 << 48) as f64;

/// Finds the roots of a Bernstein cubic on [low, high]. No variation of sign proves no root, one proves exactly one (Descartes); more are
/// halved. A 0 counts as inside, that is as a sign of +: so counted are the roots of the cubic raised by next to nothing, which is inside
/// where this one is, and has no contacts from inside.
fn isolate(exact: &[Sum; 4], rounding: f64, low: f64, high: f64, found: &mut Vec<Root>) {
    let b = exact.each_ref().map(Sum::rounded);
    let variations = b.windows(2).filter(|w| (w[0] >= 0.0) != (w[1] >= 0.0)).count();
    let kind = match (b[0] >= 0.0, b[3] >= 0.0) {
        (false, true) => Kind::Enter,
        (true, false) => Kind::Exit,
        _ => Kind::Touch,
    };
    let mut at = |u: f64, width: f64| {
        let width = width + reach(&b, u, rounding, 1.0 / (high - low));
        let root = Root { u: low + u * (high - low), width: width * (high - low), kind };
        match found.last_mut().filter(|last| last.u == root.u && last.kind == Kind::Enter && kind == Kind::Exit) {
            // In and out at one point, where halves meet.
            Some(last) => *last = Root { width: last.width.max(root.width), kind: Kind::Touch, ..root },
            None => found.push(root),
        }
    };
    match variations {
        0 => {}
        // Nowhere above 0: its only root is the end that is not below.
        1 if b.iter().all(|&c| c <= 0.0) => at(if b[0] < 0.0 { 1.0 } else { 0.0 }, 0.0),
        1 => {
            let (u, width) = refine(b);
            at(u, width);
        }
        _ if high - low <= MAX_HALVINGS => {
            if kind != Kind::Touch || b[0] < 0.0 {
                at(0.5, 0.5);
            }
        }
        _ => {
            let (left, right) = halve(exact);
            let middle = (low + high) / 2.0;
            isolate(&left, rounding, low, middle, found);
            isolate(&right, rounding, middle, high, found);
        }
    }
}

/// A number without rounding, as a sum of floats that do not overlap, smallest first (Shewchuk 1997): halving needs three more bits each
/// time, and a double root shows itself only where none is lost.
#[derive(Clone)]
struct Sum(Vec<f64>);

impl Sum {
    /// The nearest float but for its last bits; of the same sign.
    fn rounded(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Half of the sum of two.
    fn middle(&self, other: &Self) -> Self {
        let mut parts = self.0.clone();
        for &part in &other.0 {
            let mut carry = part;
            parts.retain_mut(|p| {
                // What rounding takes from the sum (Knuth).
                let sum = carry + *p;
                let added = sum - carry;
                let lost = (carry - (sum - added)) + (*p - added);
                (carry, *p) = (sum, lost);
                lost != 0.0
            });
            parts.push(carry);
        }
        parts.iter_mut().for_each(|p| *p *= 0.5);
        Self(parts)
    }
}

/// De Casteljau's subdivision at ½.
fn halve([b0, b1, b2, b3]: &[Sum; 4]) -> ([Sum; 4], [Sum; 4]) {
    let (c0, c1, c2) = (b0.middle(b1), b1.middle(b2), b2.middle(b3));
    let (d0, d1) = (c0.middle(&c1), c1.middle(&c2));
    let e = d0.middle(&d1);
    ([b0.clone(), c0, d0, e.clone()], [e, d1, c2, b3.clone()])
}

/// How far from u, up to `most`, the cubic stays within `rounding` of zero: a flat root may lie anywhere there.
fn reach(b: &[f64; 4], u: f64, rounding: f64, most: f64) -> f64 {
    let mut reach = f64::EPSILON;
    while reach < most && (value(b, u + reach).abs() <= rounding || value(b, u - reach).abs() <= rounding) {
        reach *= 2.0;
    }
    reach
}

fn value(b: &[f64; 4], u: f64) -> f64 {
    let m = 1.0 - u;
    (b[0] * m + 3.0 * b[1] * u) * m * m + (3.0 * b[2] * m + b[3] * u) * u * u
}

/// The only root of a cubic with one variation of sign, and half its bracket: Newton inside a bracket, else bisection.
fn refine(b: [f64; 4]) -> (f64, f64) {
    let slope = |u: f64| {
        let m = 1.0 - u;
        3.0 * ((b[1] - b[0]) * m * m + 2.0 * (b[2] - b[1]) * m * u + (b[3] - b[2]) * u * u)
    };
    let from_inside = b[0] >= 0.0;
    let (mut low, mut high, mut u) = (0.0, 1.0, b[0] / (b[0] - b[3]));
    // Bisection alone needs 53 halvings; Newton shortens most brackets to a few steps.
    for _ in 0..80 {
        let f = value(&b, u);
        if (f >= 0.0) == from_inside {
            low = u;
        } else {
            high = u;
        }
        if high - low <= f64::EPSILON {
            break;
        }
        let newton = u - f / slope(u);
        // Just beyond the Newton point, so that the root is fenced from both sides and the bracket shrinks to nothing.
        let beyond = newton + (newton - u).signum() * 2.0 * f64::EPSILON;
        let step = if (newton - u).abs() < 1e-9 { beyond } else { newton };
        u = if step > low && step < high { step } else { 0.5 * (low + high) };
    }
    (0.5 * (low + high), 0.5 * (high - low))
}

/// The world position of a crossing.
pub fn world(surface: &Surface, crossing: &Crossing) -> WorldPoint {
    surface.grid.world(crossing.point)
}

#[cfg(test)]
mod rational;

#[cfg(test)]
mod tests {
    use super::*;

    /// Bernstein coefficients of a(u − r)(u − s)(u − t).
    fn cubic(a: f64, [r, s, t]: [f64; 3]) -> [f64; 4] {
        let (c0, c1, c2) = (-r * s * t, r * s + r * t + s * t, -(r + s + t));
        [c0, c0 + c1 / 3.0, c0 + (2.0 * c1 + c2) / 3.0, c0 + c1 + c2 + 1.0].map(|b| a * b)
    }

    fn certified(b: [f64; 4]) -> Vec<(f64, Kind)> {
        let found = roots(b, 0.0);
        assert!(found.iter().all(|r| r.width <= 1e-14), "a bracket certifies nothing: {found:?}");
        found.iter().map(|r| (r.u, r.kind)).collect()
    }

    #[test]
    fn every_root_is_isolated_in_order() {
        // Fails if a root is missed, doubled or out of order; roots down to 1e-7 apart are told apart.
        for (a, r) in [(1.0, [0.2, 0.5, 0.7]), (-3.0, [0.1, 0.1 + 1e-7, 0.9]), (1e-6, [0.3, 0.300_01, 0.300_02]), (1e9, [-2.0, 0.4, 3.0])] {
            let found = certified(cubic(a, r));
            let inside: Vec<f64> = r.into_iter().filter(|u| (0.0..1.0).contains(u)).collect();
            assert_eq!(found.len(), inside.len(), "{r:?}: {found:?}");
            let b = cubic(a, r);
            for ((u, kind), truth) in found.iter().zip(inside) {
                // What rounding the coefficients, about ten roundings each, does to a root of this slope.
                let slope = a * r.iter().filter(|&&other| other != truth).map(|other| truth - other).product::<f64>();
                let moved = 10.0 * f64::EPSILON * b.iter().fold(0.0_f64, |m, c| m.max(c.abs())) / slope.abs();
                assert!(*kind != Kind::Touch && (u - truth).abs() <= moved + 1e-15, "{r:?}: {u} is no {truth} within {moved}");
            }
        }
    }

    #[test]
    fn contact_from_outside_is_a_touch_and_from_inside_nothing() {
        // 12(u − ½)² has exact coefficients. Fails if a double root becomes two crossings, or a near miss a contact.
        let bowl = [3.0, -1.0, -1.0, 3.0];
        assert_eq!(certified(bowl), []);
        assert_eq!(certified(bowl.map(|b| b + 1e-9)), []);
        assert_eq!(certified(bowl.map(|b| b - 1e-9)).iter().map(|r| r.1).collect::<Vec<_>>(), [Kind::Exit, Kind::Enter]);
        // From below, at a point that halving reaches.
        assert_eq!(certified(bowl.map(|b| -b)), [(0.5, Kind::Touch)]);
        // At u = ⅓ no halving ends, and the bracket itself is the contact.
        let third = certified([-1.0, 1.0, 0.0, -4.0]);
        assert!(third.len() == 1 && third[0].1 == Kind::Touch && (third[0].0 - 1.0 / 3.0).abs() <= MAX_HALVINGS, "{third:?}");
    }
}
