//! Following a ray to its first hit: leaps between range bricks, until one may hold the surface; what is done there is
//! `cells.rs` or `steps.rs`.
//!
//! The twin of `shaders/walk.wgsl`. There, where no float64 exists, a line is a pair of float32 numbers; here it is float64.
//! In both, positions become float32 only relative to a brick's corner, where they are good to a millionth of a voxel:
//! a float32 position across a whole scan is not, and at grazing incidence a small error sideways is a large one in depth.

use crate::cell_masks::{CellMasks, Mask};
use crate::occupancy::DistanceMap;
use bregma_volume::{BRICK, Sample};
use glam::{DVec3, IVec3, Vec3};

/// A pixel's ray in index space: `origin + s·direction`, s in mm of depth behind the picture's base plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub origin: DVec3,
    pub direction: DVec3,
}

impl Line {
    fn at(&self, s: f32) -> DVec3 {
        self.origin + f64::from(s) * self.direction
    }
}

/// Where a ray first enters the bone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Depth behind the base plane, mm.
    pub s: f32,
    /// The cell, by its lowest sample.
    pub cell: IVec3,
    /// Position in the cell, [0, 1]³.
    pub local: Vec3,
    /// What was met.
    pub met: Met,
}

/// What a ray meets at its hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Met {
    /// The isosurface.
    Isosurface,
    /// The cut face of a bone that the scan's box cuts: its outward normal in index space.
    Face(Vec3),
    /// The viewer stands inside bone.
    Eye,
}

/// One volume, ready to be walked.
pub(crate) struct Field<'a, T> {
    pub samples: &'a [T],
    pub dims: [usize; 3],
    pub map: &'a DistanceMap,
    pub masks: &'a CellMasks,
    pub level: f32,
    pub sign: f32,
}

/// Below this a direction component (voxels per mm of depth) counts as none: over the 10 m that a scene may be deep it
/// moves a ray by less than 1e-8 voxel, far below what a float32 position resolves.
const STILL: f32 = 1e-12;
/// Farther than any scene, and finite: shaders may not rely on infinities.
pub(super) const FAR: f32 = 1e30;

/// A direction with what stepping along it needs. Arrays, as components are asked for by number.
pub(crate) struct Pace {
    pub direction: Vec3,
    inverse: [f32; 3],
    /// Whether it moves along each axis, and upward.
    pub moves: [bool; 3],
    pub forward: [bool; 3],
}

impl Pace {
    #[inline(always)]
    fn new(direction: Vec3) -> Self {
        let d = direction.to_array();
        let moves = d.map(|d| d.abs() >= STILL);
        let inverse = std::array::from_fn(|a| if moves[a] { 1.0 / d[a] } else { 0.0 });
        Self { direction, inverse, moves, forward: d.map(|d| d > 0.0) }
    }

    /// Distance from the coordinate `p` to `plane` along axis `a`; `other` when it is never reached.
    #[inline(always)]
    pub fn to_plane(&self, a: usize, plane: f32, p: f32, other: f32) -> f32 {
        if self.moves[a] { (plane - p) * self.inverse[a] } else { other }
    }
}

/// A way to follow a ray through a brick that may hold the surface.
pub(crate) trait WalkBrick {
    /// The first entry into the bone within the brick.
    fn walk<T: Sample>(field: &Field<'_, T>, pace: &Pace, at: &InBrick<'_>) -> Option<Hit>;
}

/// A ray in a brick. Positions are relative to its corner, t to s.
pub(crate) struct InBrick<'a> {
    pub brick: [i32; 3],
    mask: &'a Mask,
    /// First sample of the brick.
    pub corner: IVec3,
    /// Cells along each side.
    pub size: [i32; 3],
    /// Depth behind the base plane where t is 0, mm.
    pub s: f32,
    /// Depth beyond which nothing is asked for.
    pub s_max: f32,
    /// Position where t is 0.
    pub origin: Vec3,
    /// Where the ray enters and leaves.
    pub t: f32,
    pub t_out: f32,
    /// Position where it enters; exact on the axis that it enters along.
    pub p: Vec3,
    pub entry: Option<usize>,
}

impl InBrick<'_> {
    /// Whether a cell of the brick can hold the surface.
    #[inline(always)]
    pub fn may_hold(&self, [x, y, z]: [i32; 3]) -> bool {
        self.mask[z as usize] >> (8 * y + x) & 1 == 1
    }
}

impl<'a, T: Sample> Field<'a, T> {
    /// The first entry into the bone along `line` for s ≥ 0 within a span, before which there is none, or at s = 0 or the box's face
    /// where that is inside.
    pub fn first_hit<W: WalkBrick>(&self, line: &Line, [s_min, s_max]: [f32; 2]) -> Option<Hit> {
        let pace = Pace::new(line.direction.as_vec3());
        let bricks = self.map.dims().map(|n| n as i32);
        if bricks.contains(&0) {
            return None;
        }
        let origin = line.origin.as_vec3().to_array();
        let (mut s, s_out) = self.clip_to_box(&origin, &pace, s_min, s_max)?;
        let mut brick = brick_of(line.at(s));
        for a in 0..3 {
            brick[a] = brick[a].clamp(0, bricks[a] - 1);
        }
        loop {
            let number = ((brick[2] * bricks[1] + brick[1]) * bricks[0] + brick[0]) as usize;
            let distance = self.map.distances()[number];
            if distance == 0
                && let Some(at) = self.enter_brick(line, &pace, brick, number, s, s_max)
                && let Some(hit) = W::walk(self, &pace, &at)
            {
                return (hit.s <= s_max).then_some(hit);
            }
            // Leave the block of bricks that are known to be empty, or this brick alone.
            let reach = i32::from(distance.max(1)) - 1;
            let s_planes: [f32; 3] = std::array::from_fn(|a| {
                let plane = if pace.forward[a] { brick[a] + reach + 1 } else { brick[a] - reach } * BRICK as i32;
                pace.to_plane(a, plane as f32, origin[a], FAR)
            });
            let axis = least(&s_planes);
            if s_planes[axis] >= s_out {
                return None;
            }
            s = s.max(s_planes[axis]);
            // A ray never turns back: other axes stay between this brick and the block's far side.
            let there = brick_of(line.at(s));
            for a in 0..3 {
                let ahead = if pace.forward[a] { reach } else { -reach };
                let (from, to) = (brick[a].min(brick[a] + ahead), brick[a].max(brick[a] + ahead));
                brick[a] = if a == axis { brick[a] + ahead + if pace.forward[a] { 1 } else { -1 } } else { there[a].clamp(from, to) };
                if a == axis && !(0..bricks[a]).contains(&brick[a]) {
                    return None;
                }
                brick[a] = brick[a].clamp(0, bricks[a] - 1);
            }
        }
    }

    /// First and last s within the box of the interpolant, and the span that is asked for.
    #[inline(always)]
    fn clip_to_box(&self, origin: &[f32; 3], pace: &Pace, s_min: f32, s_max: f32) -> Option<(f32, f32)> {
        let (mut s_in, mut s_out) = (s_min.max(0.0), s_max);
        for a in 0..3 {
            let last = (self.dims[a] - 1) as f32;
            if !pace.moves[a] {
                if origin[a] < 0.0 || origin[a] > last {
                    return None;
                }
                continue;
            }
            let (near, far) = if pace.forward[a] { (0.0, last) } else { (last, 0.0) };
            s_in = s_in.max(pace.to_plane(a, near, origin[a], 0.0));
            s_out = s_out.min(pace.to_plane(a, far, origin[a], FAR));
        }
        (s_in <= s_out).then_some((s_in, s_out))
    }

    /// Where the ray is within a brick, of which `s` is at or near its entry; `None` when it misses it.
    #[inline(always)]
    fn enter_brick(&self, line: &Line, pace: &Pace, brick: [i32; 3], number: usize, s: f32, s_max: f32) -> Option<InBrick<'a>> {
        let corner = IVec3::from_array(brick) * BRICK as i32;
        let size: [i32; 3] = std::array::from_fn(|a| (self.dims[a] as i32 - 1 - corner[a]).min(BRICK as i32));
        let origin = (line.at(s) - corner.as_dvec3()).as_vec3();
        let from = origin.to_array();
        // From here on t is relative to s: small numbers, small errors. Never before the eye.
        let (mut t, mut t_out, mut entry) = (-s, FAR, None);
        for a in 0..3 {
            let (near, far) = if pace.forward[a] { (0, size[a]) } else { (size[a], 0) };
            let (t_near, t_far) = (pace.to_plane(a, near as f32, from[a], -FAR), pace.to_plane(a, far as f32, from[a], FAR));
            if t_near > t {
                (t, entry) = (t_near, Some(a));
            }
            t_out = t_out.min(t_far);
        }
        if t >= t_out {
            return None;
        }
        let mut p = (origin + t * pace.direction).clamp(Vec3::ZERO, IVec3::from_array(size).as_vec3());
        if let Some(a) = entry {
            p[a] = if pace.forward[a] { 0.0 } else { size[a] as f32 };
        }
        let mask = &self.masks.masks()[self.masks.slots()[number] as usize];
        Some(InBrick { brick, mask, corner, size, s, s_max, origin, t, t_out, p, entry })
    }

    /// What a ray meets that is inside where it enters a brick: the box's face, the eye's position, or (within rounding of a
    /// face between two bricks) the isosurface.
    pub fn met_at_entry(&self, pace: &Pace, at: &InBrick<'_>) -> Met {
        let Some(a) = at.entry else { return Met::Eye };
        let outermost = if pace.forward[a] { 0 } else { self.map.dims()[a] as i32 - 1 };
        if at.brick[a] == outermost { Met::Face(Vec3::AXES[a] * -pace.direction[a].signum()) } else { Met::Isosurface }
    }

    /// Corner values of a cell relative to the level, positive inside; corner x + 2y + 4z is at (x, y, z).
    pub fn corners(&self, cell: IVec3) -> [f32; 8] {
        let [nx, ny, _] = self.dims;
        let base = (cell.z as usize * ny + cell.y as usize) * nx + cell.x as usize;
        let pair = |row: usize| [self.relative(row), self.relative(row + 1)];
        let [[a, b], [c, d], [e, f], [g, h]] = [pair(base), pair(base + nx), pair(base + nx * ny), pair(base + nx * ny + nx)];
        [a, b, c, d, e, f, g, h]
    }

    fn relative(&self, index: usize) -> f32 {
        self.sign * (self.samples[index].to_f32() - self.level)
    }

    /// Gradient at a point of a cell, in index space and pointing inward: central differences at the corners, interpolated.
    /// It is continuous from cell to cell, which the interpolant's own gradient is not; at the grid's faces it is one-sided.
    pub fn smooth_gradient(&self, cell: IVec3, local: Vec3) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for c in 0..8 {
            let offset = IVec3::new(c & 1, c >> 1 & 1, c >> 2);
            let weights = Vec3::select(offset.cmpeq(IVec3::ONE), local, 1.0 - local);
            sum += weights.x * weights.y * weights.z * self.central_difference(cell + offset);
        }
        sum
    }

    fn central_difference(&self, at: IVec3) -> Vec3 {
        let strides = [1, self.dims[0], self.dims[0] * self.dims[1]];
        let base: usize = (0..3).map(|a| at[a] as usize * strides[a]).sum();
        Vec3::from_array(std::array::from_fn(|a| {
            let (down, up) = (usize::from(at[a] > 0), usize::from((at[a] as usize) < self.dims[a] - 1));
            let difference = self.relative(base + up * strides[a]) - self.relative(base - down * strides[a]);
            difference / (down + up) as f32
        }))
    }
}

/// The brick of a point; one that lies below the grid, whose brick is taken within it anyhow, may be rounded up.
#[inline(always)]
fn brick_of(p: DVec3) -> [i32; 3] {
    p.to_array().map(|c| (c * (1.0 / BRICK as f64)) as i32)
}

/// The axis of the smallest value, the first of equal ones.
#[inline(always)]
pub(super) fn least(v: &[f32; 3]) -> usize {
    let first = if v[1] < v[0] { 1 } else { 0 };
    if v[2] < v[first] { 2 } else { first }
}
