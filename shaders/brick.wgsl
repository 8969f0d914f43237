// Range bricks, and a ray's way into one.
// The twin of renderer/src/cpu/brick.rs, which says why each step is as it is.

#import constants, line, volume

const MISSED: u32 = 0u;
const MET_ISOSURFACE: u32 = 1u;
const MET_FACE: u32 = 2u;
const MET_START: u32 = 3u;
const MET_SOLID: u32 = 4u;

struct Hit {
    s: f32,
    cell: vec3<i32>,
    local: vec3<f32>,
    met: u32,
    // Outward normal of the box's face in index space, where met is MET_FACE.
    face: vec3<f32>,
}

fn missed() -> Hit {
    return Hit(0.0, vec3<i32>(0), vec3<f32>(0.0), MISSED, vec3<f32>(0.0));
}

// A direction with what stepping along it needs.
struct Pace {
    direction: vec3<f32>,
    inverse: vec3<f32>,
    moves: vec3<bool>,
    forward: vec3<bool>,
}

fn pace_of(direction: vec3<f32>) -> Pace {
    let moves = abs(direction) >= vec3<f32>(STILL);
    let inverse = select(vec3<f32>(0.0), 1.0 / select(vec3<f32>(1.0), direction, moves), moves);
    return Pace(direction, inverse, moves, direction > vec3<f32>(0.0));
}

// Distances from p to a plane across each axis; `other` where it is never reached.
fn to_planes(pace: Pace, planes: vec3<f32>, p: vec3<f32>, other: f32) -> vec3<f32> {
    return select(vec3<f32>(other), (planes - p) * pace.inverse, pace.moves);
}

fn least(v: vec3<f32>) -> f32 {
    return min(v.x, min(v.y, v.z));
}

fn greatest(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

// The first axis on which v has the value of its extreme.
fn axis_of(v: vec3<f32>, extreme: f32) -> vec3<bool> {
    if v.x == extreme {
        return vec3<bool>(true, false, false);
    }
    if v.y == extreme {
        return vec3<bool>(false, true, false);
    }
    return vec3<bool>(false, false, true);
}

fn brick_of(p: Double) -> vec3<i32> {
    let guess = floor(p.hi / f32(BRICK));
    let local = relative_to(p, guess * f32(BRICK));
    let below = select(vec3<i32>(0), vec3<i32>(1), local < vec3<f32>(0.0));
    let above = select(vec3<i32>(0), vec3<i32>(1), local >= vec3<f32>(f32(BRICK)));
    return vec3<i32>(guess) - below + above;
}

// A ray in a brick. Positions are relative to its corner, t to s.
struct InBrick {
    // First number of its mask.
    mask: vec2<i32>,
    // First sample of the brick.
    corner: vec3<i32>,
    // The box of the cells that can hold the surface: its lowest cell, and where it ends.
    first: vec3<i32>,
    end: vec3<i32>,
    // Depth behind the base plane where t is 0, mm.
    s: f32,
    // Position where t is 0.
    origin: vec3<f32>,
    // Where the line begins; in s.
    begin: f32,
    // Where the ray enters and leaves it.
    t: f32,
    t_out: f32,
    // Where it leaves or nothing more is asked for.
    t_end: f32,
    // Position where it enters that box; exact on the axis that it enters along.
    p: vec3<f32>,
    entry: vec3<bool>,
}

// Whether a ray that comes to a cell at t has left the box, or what is asked for. The last cell's exit is the box's: the same number,
// unless a driver rounds it otherwise there than here.
fn has_left(at: InBrick, cell: vec3<i32>, t: f32) -> bool {
    return !(t < at.t_end) || any(cell < at.first) || any(cell >= at.end);
}

// Whether a cell of the brick can hold the surface.
fn may_hold(at: InBrick, cell: vec3<i32>) -> bool {
    let word = mask_word(at.mask + vec2<i32>(cell.z * 2 + (cell.y >> 2u), 0));
    return ((word >> u32((cell.y & 3) * 8 + cell.x)) & 1u) == 1u;
}

// Where the ray enters the box of `cells` that can hold the surface, in a brick at or near whose entry it is at `position` at s; it misses
// them when t is not below t_out.
fn enter_brick(pace: Pace, brick: vec3<i32>, slot: u32, cells: u32, s: f32, position: Double, begin: f32, s_max: f32) -> InBrick {
    let mask = vec2<i32>(vec2<u32>(slot % MASKS_ACROSS * WORDS, slot / MASKS_ACROSS));
    let corner = brick * BRICK;
    let first = vec3<i32>((vec3<u32>(cells) >> vec3<u32>(0u, 4u, 8u)) & vec3<u32>(15u));
    let end = vec3<i32>((vec3<u32>(cells) >> vec3<u32>(12u, 16u, 20u)) & vec3<u32>(15u));
    let origin = relative_to(position, vec3<f32>(corner));
    // From here on t is relative to s: small numbers, small errors. Never before the line begins.
    let t_begin = begin - s;
    let near = vec3<f32>(select(end, first, pace.forward));
    let far = vec3<f32>(select(first, end, pace.forward));
    let t_near = to_planes(pace, near, origin, -FAR);
    let t_entry = greatest(t_near);
    let from_begin = t_entry <= t_begin;
    let entry = axis_of(t_near, t_entry) & vec3<bool>(!from_begin);
    let t = max(t_begin, t_entry);
    let t_out = least(to_planes(pace, far, origin, FAR));
    let p = select(clamp(origin + t * pace.direction, vec3<f32>(first), vec3<f32>(end)), near, entry);
    return InBrick(mask, corner, first, end, s, origin, begin, t, t_out, min(t_out, s_max - s), p, entry);
}

// What a ray meets that is inside where it enters a brick.
fn met_at_entry(pace: Pace, at: InBrick) -> u32 {
    if !any(at.entry) {
        return MET_START;
    }
    let outermost = select(params.dims - 1, vec3<i32>(0), pace.forward);
    return select(MET_ISOSURFACE, MET_FACE, any(at.entry & (at.corner + vec3<i32>(at.p) == outermost)));
}
