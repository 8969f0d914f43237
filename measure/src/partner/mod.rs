//! The point of one surface that belongs to a point of another: the nearest of all, or the nearest that faces the same way.

mod patch;
mod tree;

use bregma_field::interpolant::{corners, depth_at};
use bregma_field::{Cancelled, IndexPoint, Progress, Surface, WorldPoint};
use glam::{DMat3, DVec3, USizeVec3};
use patch::{Part, Stationary, Trilinear, at_edges, is_turned, leads_nearer, stationary, stationary_from};
use tree::Tree;

/// A surface, made ready to be asked for the points that are nearest to others.
#[derive(Debug)]
pub struct Partners<'a> {
    surface: &'a Surface,
    tree: Tree,
    /// From index space to mm: uᵀGu is the square of a step's length.
    metric: DMat3,
    /// Its diagonal.
    steps: DVec3,
    /// How far a ball of 1 mm reaches along each axis of index space.
    reach_per_mm: DVec3,
    /// The grid's axes are not at right angles, or only to rounding.
    is_sheared: bool,
}

/// A point of a surface that belongs to another point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partner {
    /// Where it is.
    pub point: WorldPoint,
    /// Outward unit normal of the interpolant's surface there, in the cell that it was found in.
    pub normal: DVec3,
    /// How far it is away, mm.
    pub distance_mm: f64,
    /// The cell of its scan in which it was found, by its lowest sample.
    pub cell: USizeVec3,
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    /// Any point.
    Closest,
    /// A foot of a perpendicular whose normal makes less than a right angle with this one (unit, world).
    Facing(DVec3),
}

/// The best point so far of those that are asked for.
#[derive(Clone, Copy)]
struct Best {
    /// mm².
    square: f64,
    found: Option<(USizeVec3, DVec3)>,
    /// Parts of cells that may still be looked at.
    parts_left: u32,
}

/// As many parts of cells as a point may cost: where more are undecided, as at the centre of a ball, all of their points are equally far but for
/// what is not told apart, and the best of them is taken.
const MOST_PARTS: u32 = 20_000;
/// Cells through which a hint is followed downhill: beyond a few it leads nowhere near.
const MOST_CELLS_WALKED: usize = 8;
/// Steps toward the surface until a cell is chosen to begin in: two lead into the right one or the one beside it.
const STEPS_BELOW: usize = 2;
/// Parts of a cell that are smaller are not halved again, voxels: what they could add to a distance is below 1e-6 voxel.
const SMALLEST_VOXEL: f64 = 1e-6;
/// Feet that are nearer to each other are not told apart, voxels: they are about as far away.
const ONE_FOOT_VOXEL: f64 = 1.0 / 16.0;
/// How far into the neighbouring cells a foot on a cell's face is looked for something nearer, voxels.
const BESIDE_VOXEL: f64 = 1.0 / 64.0;
/// A part of a distance's square by which something nearer must be so: a place is settled to 1e-6 voxel at worst, and that to its square.
const NEARER: f64 = 1e-9;
/// Products of axes of unlike directions, as a part of the first one's square, that are rounding.
const NOT_SHEARED: f64 = 1e-12;
/// A point as near as that to the surface lies on it, voxels: positions of thousands of voxels are good to 1e-12.
const ON_SURFACE_VOXEL: f64 = 1e-9;

impl<'a> Partners<'a> {
    /// Of `surface`. `progress` counts its layers of cells.
    pub fn of(surface: &'a Surface, progress: &Progress) -> Result<Self, Cancelled> {
        let steps = surface.grid.index_to_world().matrix3;
        let rows = surface.grid.world_to_index().matrix3.transpose();
        let reach_per_mm = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
        let metric = steps.transpose() * steps;
        let steps = DVec3::new(metric.x_axis.x, metric.y_axis.y, metric.z_axis.z);
        let is_sheared = [metric.x_axis.y, metric.y_axis.z, metric.z_axis.x].iter().any(|m| m.abs() > NOT_SHEARED * metric.x_axis.x);
        Ok(Self { surface, tree: Tree::of(surface, progress)?, metric, steps, reach_per_mm, is_sheared })
    }

    /// The point of the surface that is nearest to `point`, within `reach_mm`: the distance to it is right to 1e-6 voxel, but
    /// where so many places are about as near, as to a ball's centre, that they are not all looked at. `hint`, that of a point
    /// beside this one, makes it quicker and changes nothing.
    pub fn closest(&self, point: WorldPoint, reach_mm: f64, hint: Option<&Partner>) -> Option<Partner> {
        self.here(point).or_else(|| self.search(point, Wanted::Closest, reach_mm, hint))
    }

    /// The partner of `point`, whose own surface has the outward unit `normal` there: of the places where the distance to this surface is least
    /// against all around, and the surface faces the same way as at `point`, by less than a right angle, the nearest within `reach_mm`. A place
    /// where only the scan's box ends the surface is none. A point of the surface itself is its own.
    ///
    /// ```text
    ///   point •──▶ normal                 the other side of a wall is nearer to a point in it,
    ///         ╎                           but faces the other way
    ///    ─────┴─────▶  partner
    /// ```
    ///
    /// `hint` as for [`closest`](Self::closest).
    pub fn facing(&self, point: WorldPoint, normal: DVec3, reach_mm: f64, hint: Option<&Partner>) -> Option<Partner> {
        self.here(point).or_else(|| self.search(point, Wanted::Facing(normal), reach_mm, hint))
    }

    /// The point itself, where the surface passes it.
    pub(crate) fn here(&self, point: WorldPoint) -> Option<Partner> {
        let (depth, rise) = depth_at(self.surface, point)?;
        let last = USizeVec3::from(self.surface.grid.cells()) - 1;
        let cell = self.surface.grid.index(point).0.max(DVec3::ZERO).as_usizevec3().min(last);
        let per_voxel = rise.length() / self.reach_per_mm.max_element();
        (depth.abs() < ON_SURFACE_VOXEL * per_voxel).then_some(Partner { point, normal: -rise.normalize_or_zero(), distance_mm: 0.0, cell })
    }

    /// Whether the surface's own value says that `point` is in its bone; `None` outside the scan's box.
    pub fn holds(&self, point: WorldPoint) -> Option<bool> {
        depth_at(self.surface, point).map(|(depth, _)| depth >= 0.0)
    }

    /// What of a part of a cell can lie in the ball of radius² `square` (mm²) about a point.
    fn within(&self, part: Part, target: DVec3, square: f64) -> Option<Part> {
        let beyond = (part.low - target).max(target - part.high).max(DVec3::ZERO);
        if self.is_sheared {
            return part.within(target, self.reach_per_mm * square.sqrt());
        }
        // What the ball reaches along an axis, as far off as the part is along the others.
        let squares = beyond * beyond * self.steps;
        let reach = (square - (squares.element_sum() - squares)).max(DVec3::ZERO) / self.steps;
        part.within(target, reach.map(f64::sqrt))
    }

    /// A cell that the surface passes beside a point that is near it, by Newton's method along the slope.
    fn below(&self, mut point: WorldPoint) -> Option<USizeVec3> {
        let voxel_mm = self.reach_per_mm.max_element().recip();
        for _ in 0..STEPS_BELOW {
            let (depth, rise) = depth_at(self.surface, point)?;
            let step = -depth / rise.length_squared() * rise;
            // Farther off, the slope says little, and nothing where there is none.
            if !step.is_finite() || step.length() > voxel_mm {
                return None;
            }
            point.0 += step;
        }
        let IndexPoint(at) = self.surface.grid.index(point);
        let cells = USizeVec3::from(self.surface.grid.cells()).as_dvec3();
        (at.cmpge(DVec3::ZERO).all() && at.cmplt(cells).all()).then(|| at.as_usizevec3())
    }

    fn search(&self, point: WorldPoint, wanted: Wanted, reach_mm: f64, hint: Option<&Partner>) -> Option<Partner> {
        let IndexPoint(at) = self.surface.grid.index(point);
        let facing = match wanted {
            Wanted::Closest => None,
            // The normal at u is −M⁻ᵀ∇f(u), so it is at less than a right angle to n where ∇f(u)·(−M⁻¹n) > 0.
            Wanted::Facing(normal) => Some(-(self.surface.grid.world_to_index().matrix3 * normal)),
        };
        let mut best = Best { square: reach_mm * reach_mm, found: None, parts_left: MOST_PARTS };
        let in_cell = |cell: USizeVec3, f: &[f64; 8]| {
            let f = Trilinear::of(f);
            InCell { partners: self, cell, f, target: at - cell.as_dvec3(), facing: facing.map(|step| f.along(step)) }
        };
        if let Some(start) = self.below(point).or(hint.map(|hint| hint.cell)) {
            let mut cell = Some(start);
            for _ in 0..MOST_CELLS_WALKED {
                let Some(here) = cell else { break };
                cell = in_cell(here, &corners(self.surface, here)).walk(&mut best);
            }
        }
        // What one attempt in a cell leaves open is looked at when all cells had theirs: the best is near then, and little is left.
        let mut open = vec![];
        self.tree.near(at, best.square.sqrt(), |passed| {
            if !in_cell(passed.cell, &passed.f).attempt(&mut best) {
                open.push(*passed);
            }
            best.square.sqrt()
        });
        open.iter().for_each(|passed| in_cell(passed.cell, &passed.f).search(&mut best));
        let (cell, local) = best.found?;
        let gradient = self.surface.grid.world_to_index().matrix3.transpose() * Trilinear::of(&corners(self.surface, cell)).gradient(local);
        let found = cell.as_dvec3() + local;
        let is_here = (found - at).abs().max_element() < ON_SURFACE_VOXEL;
        Some(Partner {
            point: self.surface.grid.world(IndexPoint(found)),
            normal: -gradient.normalize_or_zero(),
            distance_mm: if is_here { 0.0 } else { best.square.sqrt() },
            cell,
        })
    }
}

/// A cell in which the surface is looked for, in its own coordinates.
struct InCell<'a> {
    partners: &'a Partners<'a>,
    cell: USizeVec3,
    f: Trilinear,
    target: DVec3,
    /// What must be positive where the surface faces the right way.
    facing: Option<Trilinear>,
}

impl InCell<'_> {
    /// What of a part of the cell can hold something nearer than `best`, as far as the surface's and its gradient's signs tell.
    fn left(&self, part: Part, best: &Best) -> Option<Part> {
        let part = self.partners.within(part, self.target, best.square)?;
        let ends = self.f.ends(part);
        let is_facing = || self.facing.is_none_or(|facing| facing.ends(part)[1] > 0.0);
        (ends[0] <= 0.0 && ends[1] >= 0.0 && is_facing()).then_some(part)
    }

    /// Takes the nearest point of the cell, if one step after the other leads to it; whether nothing in it is nearer than `best` now.
    fn attempt(&self, best: &mut Best) -> bool {
        self.left(Part::CELL, best).is_none_or(|part| self.attempt_in(part, best))
    }

    /// The same of what is left of a part of the cell.
    fn attempt_in(&self, part: Part, best: &mut Best) -> bool {
        let partners = self.partners;
        if !partners.is_sheared && self.f.is_farther(part, self.target, partners.steps, best.square) {
            return true;
        }
        let Some(found) = stationary(&self.f, part, self.target, &partners.metric) else { return false };
        let [is_nearer, is_taken] = self.take(&found, best);
        (is_taken || !is_nearer) && found.is_nearest_in(&self.f, part, &partners.metric)
    }

    /// Goes downhill: takes the nearest point of the cell if that is wanted; where it lies on a face, the cell behind that is the next.
    fn walk(&self, best: &mut Best) -> Option<USizeVec3> {
        let found = stationary(&self.f, Part::CELL, self.target, &self.partners.metric)?;
        self.take(&found, best);
        let over = |u: f64| if u <= 0.0 { -1.0 } else { f64::from(u >= 1.0) };
        let next = self.cell.as_dvec3() + found.point.map(over);
        let cells = USizeVec3::from(self.partners.surface.grid.cells()).as_dvec3();
        let is_in = next.cmpge(DVec3::ZERO).all() && next.cmplt(cells).all();
        (is_in && next != self.cell.as_dvec3()).then(|| next.as_usizevec3())
    }

    /// Takes a point if it is nearer and wanted: whether it is nearer, and whether it was taken.
    fn take(&self, found: &Stationary, best: &mut Best) -> [bool; 2] {
        let away = found.point - self.target;
        let square = away.dot(self.partners.metric * away);
        let is_nearer = square < best.square;
        let is_taken = is_nearer && self.is_wanted(found, square);
        if is_taken {
            (best.square, best.found) = (square, Some((self.cell, found.point)));
        }
        [is_nearer, is_taken]
    }

    /// Looks for something nearer than `best` in the cell until there is nothing.
    fn search(&self, best: &mut Best) {
        if self.attempt(best) {
            return;
        }
        if self.facing.is_none() {
            return self.nearest_in(Part::CELL, best);
        }
        // Feet lie on the cell's edges, on its faces, or within.
        for point in at_edges(&self.f, self.target, &self.partners.metric) {
            self.take(&Stationary::at(point), best);
        }
        // What is turned in all that is left of the cell is so on each of its faces.
        let Some(left) = self.left(Part::CELL, best) else { return };
        let turned = is_turned(&self.f, left, self.target, &self.partners.metric);
        for (axis, face) in Part::faces().into_iter().filter(|(axis, _)| !turned[*axis]) {
            self.feet_in(face, face, Some(axis), best);
        }
        if !turned.contains(&true) {
            self.feet_in(Part::CELL, Part::CELL, None, best);
        }
    }

    /// Looks for the nearest point in a part of the cell.
    fn nearest_in(&self, part: Part, best: &mut Best) {
        let Some(part) = self.left(part, best) else { return };
        let is_small = (part.high - part.low).max_element() < SMALLEST_VOXEL;
        if best.parts_left == 0 || is_small || self.attempt_in(part, best) {
            return;
        }
        best.parts_left -= 1;
        for half in part.halves(&self.partners.metric, self.target) {
            self.nearest_in(half, best);
        }
    }

    /// Looks for feet in a part of the cell, or of its face across an axis, of which it is `whole`.
    fn feet_in(&self, part: Part, whole: Part, face: Option<usize>, best: &mut Best) {
        let Some(part) = self.left(part, best) else { return };
        let metric = &self.partners.metric;
        let turned = is_turned(&self.f, part, self.target, metric);
        if face.map_or(turned.contains(&true), |axis| turned[axis]) || best.parts_left == 0 {
            return;
        }
        best.parts_left -= 1;
        if (part.high - part.low).max_element() <= ONE_FOOT_VOXEL {
            if let Some(found) = stationary_from(&self.f, part, whole, self.target, metric) {
                self.take(&found, best);
            }
            return;
        }
        for half in part.halves(metric, self.target) {
            self.feet_in(half, whole, face, best);
        }
    }

    fn is_wanted(&self, found: &Stationary, square: f64) -> bool {
        self.facing.is_none_or(|facing| facing.value(found.point) > 0.0 && self.is_foot(found, square))
    }

    /// Whether the surface goes on from there, and is nowhere nearer around. On a face, an edge or a corner of the cell that depends on what it
    /// does in those beside it.
    fn is_foot(&self, found: &Stationary, square: f64) -> bool {
        let cells = self.partners.surface.grid.cells();
        // Steps to the cells beside: none, or one over the face that the point lies on.
        let step = |a: usize| match found.point[a] {
            u if u <= ON_SURFACE_VOXEL => Some(-1),
            u if u >= 1.0 - ON_SURFACE_VOXEL => Some(1),
            _ if found.pull[a] == 0.0 => Some(0),
            // An end of a part within the cell holds it: it is nearer on the other side.
            _ => None,
        };
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(step) else { return false };
        let steps = [x, y, z];
        // The cells across one face first, where most have something nearer; the own one, where it was found, last.
        [1, 2, 4, 3, 5, 6, 7, 0].into_iter().all(|corner: usize| {
            let over = |a: usize| corner >> a & 1 == 1;
            if (0..3).any(|a| over(a) && steps[a] == 0) {
                return true;
            }
            let offset = DVec3::from([0, 1, 2].map(|a| if over(a) { f64::from(steps[a]) } else { 0.0 }));
            let cell = self.cell.as_dvec3() + offset;
            if (0..3).any(|a| cell[a] < 0.0 || cell[a] >= cells[a] as f64) {
                return false;
            }
            let f = Trilinear::of(&corners(self.partners.surface, cell.as_usizevec3()));
            // Across a face the point lies at the other cell's other end.
            let held = [0, 1, 2].map(|a| if over(a) { -steps[a] } else { steps[a] });
            if leads_nearer(&f, found.point - offset, held, self.target - offset, &self.partners.metric) {
                return false;
            }
            let Some(part) = Part::CELL.within(found.point - offset, DVec3::splat(BESIDE_VOXEL)) else { return true };
            stationary(&f, part, self.target - offset, &self.partners.metric).is_none_or(|other| {
                let away = other.point - (self.target - offset);
                away.dot(self.partners.metric * away) >= square * (1.0 - NEARER)
            })
        })
    }
}
