//! Following a ray to its first hit: leaps between range bricks, until one may hold the surface; what is done there is
//! `cells.rs` or `steps.rs`.
//!
//! The twin of `shaders/walk.wgsl`. There, where no float64 exists, a line is a pair of float32 numbers; here it is float64.
//! In both, positions become float32 only relative to a brick's corner, where they are good to a millionth of a voxel:
//! a float32 position across a whole scan is not, and at grazing incidence a small error sideways is a large one in depth.

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
    pub level: f32,
    pub sign: f32,
}

/// Below this a direction component (voxels per mm of depth) counts as none: over the 10 m that a scene may be deep it
/// moves a ray by less than 1e-8 voxel, far below what a float32 position resolves.
const STILL: f32 = 1e-12;
/// Farther than any scene, and finite: shaders may not rely on infinities.
pub(super) const FAR: f32 = 1e30;

/// A direction with what stepping along it needs.
pub(crate) struct Pace {
    pub direction: Vec3,
    inverse: Vec3,
    pub moves: [bool; 3],
}

impl Pace {
    fn new(direction: Vec3) -> Self {
        let moves = direction.to_array().map(|d| d.abs() >= STILL);
        let inverse = Vec3::from_array(std::array::from_fn(|a| if moves[a] { 1.0 / direction[a] } else { 0.0 }));
        Self { direction, inverse, moves }
    }

    /// Distance from `p` to the coordinate `plane` along axis `a`; `other` when it is never reached.
    pub fn to_plane(&self, a: usize, plane: f32, p: Vec3, other: f32) -> f32 {
        if self.moves[a] { (plane - p[a]) * self.inverse[a] } else { other }
    }

    pub fn forward(&self, a: usize) -> bool {
        self.direction[a] > 0.0
    }
}

/// A way to follow a ray through a brick that may hold the surface.
pub(crate) trait WalkBrick {
    /// The first entry into the bone within the brick.
    fn walk<T: Sample>(field: &Field<'_, T>, pace: &Pace, at: &InBrick) -> Option<Hit>;
}

/// A ray in a brick. Positions are relative to its corner, t to s.
pub(crate) struct InBrick {
    pub brick: IVec3,
    /// First sample of the brick.
    pub corner: IVec3,
    /// Cells along each side.
    pub size: IVec3,
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

impl<T: Sample> Field<'_, T> {
    /// The first entry into the bone along `line` for 0 ≤ s ≤ `s_max`, or at s = 0 or the box's face where that is inside.
    pub fn first_hit<W: WalkBrick>(&self, line: &Line, s_max: f32) -> Option<Hit> {
        let pace = Pace::new(line.direction.as_vec3());
        let bricks = IVec3::from_array(self.map.dims().map(|n| n as i32));
        if bricks.min_element() == 0 {
            return None;
        }
        let (mut s, s_out) = self.clip_to_box(line, &pace, s_max)?;
        let mut brick = brick_of(line.at(s)).clamp(IVec3::ZERO, bricks - 1);
        loop {
            let [bx, by, _] = self.map.dims();
            let distance = self.map.distances()[(brick.z as usize * by + brick.y as usize) * bx + brick.x as usize];
            if distance == 0
                && let Some(at) = self.enter_brick(line, &pace, brick, s, s_max)
                && let Some(hit) = W::walk(self, &pace, &at)
            {
                return (hit.s <= s_max).then_some(hit);
            }
            // Leave the block of bricks that are known to be empty, or this brick alone.
            let reach = i32::from(distance.max(1)) - 1;
            let (low, high) = (brick - reach, brick + reach);
            let (mut s_exit, mut axis) = (FAR, 0);
            for a in 0..3 {
                let plane = if pace.forward(a) { high[a] + 1 } else { low[a] } * BRICK as i32;
                let s_plane = pace.to_plane(a, plane as f32, line.origin.as_vec3(), FAR);
                if s_plane < s_exit {
                    (s_exit, axis) = (s_plane, a);
                }
            }
            if s_exit >= s_out {
                return None;
            }
            s = s.max(s_exit);
            // A ray never turns back: other axes stay between this brick and the block's far side.
            let there = brick_of(line.at(s));
            for a in 0..3 {
                let (from, to) = if pace.forward(a) { (brick[a], high[a]) } else { (low[a], brick[a]) };
                brick[a] = there[a].clamp(from, to).clamp(0, bricks[a] - 1);
            }
            brick[axis] = if pace.forward(axis) { high[axis] + 1 } else { low[axis] - 1 };
            if brick[axis] < 0 || brick[axis] >= bricks[axis] {
                return None;
            }
        }
    }

    /// First and last s within the box of the interpolant.
    fn clip_to_box(&self, line: &Line, pace: &Pace, s_max: f32) -> Option<(f32, f32)> {
        let origin = line.origin.as_vec3();
        let (mut s_in, mut s_out) = (0.0_f32, s_max);
        for a in 0..3 {
            let last = (self.dims[a] - 1) as f32;
            if !pace.moves[a] {
                if origin[a] < 0.0 || origin[a] > last {
                    return None;
                }
                continue;
            }
            let (near, far) = if pace.forward(a) { (0.0, last) } else { (last, 0.0) };
            s_in = s_in.max(pace.to_plane(a, near, origin, 0.0));
            s_out = s_out.min(pace.to_plane(a, far, origin, FAR));
        }
        (s_in <= s_out).then_some((s_in, s_out))
    }

    /// Where the ray is within a brick, of which `s` is at or near its entry; `None` when it misses it.
    fn enter_brick(&self, line: &Line, pace: &Pace, brick: IVec3, s: f32, s_max: f32) -> Option<InBrick> {
        let corner = brick * BRICK as i32;
        let cells = IVec3::from_array(self.dims.map(|n| n as i32 - 1));
        let size = (cells - corner).min(IVec3::splat(BRICK as i32));
        let origin = (line.at(s) - corner.as_dvec3()).as_vec3();
        // From here on t is relative to s: small numbers, small errors. Never before the eye.
        let (mut t, mut t_out, mut entry) = (-s, FAR, None);
        for a in 0..3 {
            let (near, far) = if pace.forward(a) { (0, size[a]) } else { (size[a], 0) };
            let (t_near, t_far) = (pace.to_plane(a, near as f32, origin, -FAR), pace.to_plane(a, far as f32, origin, FAR));
            if t_near > t {
                (t, entry) = (t_near, Some(a));
            }
            t_out = t_out.min(t_far);
        }
        let mut p = (origin + t * pace.direction).clamp(Vec3::ZERO, size.as_vec3());
        if let Some(a) = entry {
            p[a] = if pace.forward(a) { 0.0 } else { size[a] as f32 };
        }
        (t < t_out).then_some(InBrick { brick, corner, size, s, s_max, origin, t, t_out, p, entry })
    }

    /// What a ray meets that is inside where it enters a brick: the box's face, the eye's position, or (within rounding of a
    /// face between two bricks) the isosurface.
    pub fn met_at_entry(&self, pace: &Pace, at: &InBrick) -> Met {
        let Some(a) = at.entry else { return Met::Eye };
        let outermost = if pace.forward(a) { 0 } else { self.map.dims()[a] as i32 - 1 };
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

fn brick_of(p: DVec3) -> IVec3 {
    (p / BRICK as f64).floor().as_ivec3()
}
