// Following a ray to its first hit: leaps between range bricks, until one may hold the surface; what is done there is `advance` and
// `solve` of cells.wgsl, filter_cells.wgsl or steps.wgsl.
// The twin of renderer/src/cpu/walk.rs, which says why each step is as it is.

// For each brick its distance from the surface, and above 8 bits the number of its mask; and the box of the cells that this names.
@group(0) @binding(2) var map: texture_storage_3d<rg32uint, read>;
// 16 numbers for each mask, side by side, two for each layer of cells: bit x + 8y of a layer is cell (x, y).
@group(0) @binding(5) var masks: texture_storage_2d<r32uint, read>;

const BRICK: i32 = 8;
// Masks in a row.
const MASKS_ACROSS: u32 = 512u;
const STILL: f32 = 1e-12;
const FAR: f32 = 1e30;

const MISSED: u32 = 0u;
const MET_ISOSURFACE: u32 = 1u;
const MET_FACE: u32 = 2u;
const MET_START: u32 = 3u;

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

// A ray on its way from place to place where something must be solved.
struct Walk {
    line: Line,
    pace: Pace,
    // Where the line begins: at the eye, a hit, or a cut.
    begin: f32,
    // After here nothing is asked for, and where the ray leaves the box or that.
    s_max: f32,
    s_out: f32,
    // At or near the entry of the brick.
    s: f32,
    p: Double,
    brick: vec3<i32>,
    distance: i32,
    // Whether the brick is yet to be entered.
    is_new: bool,
    at: InBrick,
    place: Place,
}

// A ray at the start of its way, for s from `begin` on within a span, before which there is nothing; `s` is behind `s_out` where it has none.
fn begin_walk(line: Line, begin: f32, s_min: f32, s_max: f32) -> Walk {
    var walk: Walk;
    walk.line = line;
    walk.pace = pace_of(line.direction.hi);
    let span = clip_to_box(line, walk.pace, max(begin, s_min), s_max);
    walk.begin = begin;
    walk.s_max = s_max;
    walk.s_out = span.y;
    walk.s = span.x;
    walk.p = line_at(line, span.x);
    walk.brick = clamp(brick_of(walk.p), vec3<i32>(0), params.bricks - 1);
    walk.is_new = true;
    return walk;
}

// On to the next place where something must be solved, be it bricks away; false where there is none.
fn arrive(state: ptr<function, Walk>) -> bool {
    let line = (*state).line;
    let pace = (*state).pace;
    let bricks = params.bricks;
    var s = (*state).s;
    var p = (*state).p;
    var brick = (*state).brick;
    var distance = (*state).distance;
    var is_new = (*state).is_new;
    var at = (*state).at;
    var place = (*state).place;
    var is_there = false;
    // All rays of a subgroup first come to a place where they have to solve, and then solve together. A branch costs as much for one of
    // them as for all.
    loop {
        var is_within = true;
        if is_new {
            let known = textureLoad(map, brick).rg;
            distance = i32(known.x & 0xffu);
            at = enter_brick(pace, brick, known.x >> 8u, known.y, s, p, (*state).begin, (*state).s_max);
            is_within = distance == 0 && at.t < at.t_out;
            if is_within {
                place = first_place(pace, at);
            }
        }
        if is_within {
            is_within = advance(pace, at, &place);
        }
        is_new = !is_within;
        if is_within {
            is_there = true;
            break;
        }
        // Leave the block of bricks that are known to be empty, or this brick alone.
        let reach = max(distance, 1) - 1;
        let low = brick - reach;
        let high = brick + reach;
        let planes = select(low, high + 1, pace.forward) * BRICK;
        let s_planes = to_planes(pace, vec3<f32>(planes), line.origin.hi, FAR);
        let s_exit = least(s_planes);
        let axis = axis_of(s_planes, s_exit);
        s = max(s, s_exit);
        p = line_at(line, s);
        // A ray never turns back: other axes stay between this brick and the block's far side.
        let stay = clamp(brick_of(p), select(low, brick, pace.forward), select(brick, high, pace.forward));
        brick = select(clamp(stay, vec3<i32>(0), bricks - 1), select(low - 1, high + 1, pace.forward), axis);
        if s_exit >= (*state).s_out || any(brick < vec3<i32>(0)) || any(brick >= bricks) {
            break;
        }
    }
    (*state).s = s;
    (*state).p = p;
    (*state).brick = brick;
    (*state).distance = distance;
    (*state).is_new = is_new;
    (*state).at = at;
    (*state).place = place;
    return is_there;
}

// The first entry into the bone along the line for s >= begin within a span, before which there is none, or where the line begins, or at the
// box's face, where that is inside.
fn first_hit(line: Line, begin: f32, s_min: f32, s_max: f32) -> Hit {
    var walk = begin_walk(line, begin, s_min, s_max);
    var hit = missed();
    if walk.s > walk.s_out {
        return hit;
    }
    while arrive(&walk) {
        var place = walk.place;
        hit = solve(walk.pace, walk.at, &place);
        walk.place = place;
        if hit.met != MISSED {
            break;
        }
    }
    if hit.s > s_max {
        return missed();
    }
    return hit;
}

// First and last s within the box of the interpolant, and the span that is asked for; the first is the larger when it is missed.
fn clip_to_box(line: Line, pace: Pace, s_min: f32, s_max: f32) -> vec2<f32> {
    let last = vec3<f32>(params.dims - 1);
    let origin = line.origin.hi;
    if any(!pace.moves & ((origin < vec3<f32>(0.0)) | (origin > last))) {
        return vec2<f32>(1.0, 0.0);
    }
    let near = select(last, vec3<f32>(0.0), pace.forward);
    let far = select(vec3<f32>(0.0), last, pace.forward);
    let s_in = max(s_min, greatest(to_planes(pace, near, origin, 0.0)));
    let s_out = min(s_max, least(to_planes(pace, far, origin, FAR)));
    return vec2<f32>(s_in, s_out);
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
    let word = textureLoad(masks, at.mask + vec2<i32>(cell.z * 2 + (cell.y >> 2u), 0)).r;
    return ((word >> u32((cell.y & 3) * 8 + cell.x)) & 1u) == 1u;
}

// Where the ray enters the box of `cells` that can hold the surface, in a brick at or near whose entry it is at `position` at s; it misses
// them when t is not below t_out.
fn enter_brick(pace: Pace, brick: vec3<i32>, slot: u32, cells: u32, s: f32, position: Double, begin: f32, s_max: f32) -> InBrick {
    let mask = vec2<i32>(vec2<u32>(slot % MASKS_ACROSS * 16u, slot / MASKS_ACROSS));
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

// Gradient at a point of a cell, in index space and pointing inward: central differences of samples, one-sided at the grid's border,
// interpolated. Differences come first: where all samples are equal nothing is left, however a driver rounds.
fn smooth_gradient(cell: vec3<i32>, local: vec3<f32>) -> vec3<f32> {
    let low = around(cell, local.xy);
    let high = around(cell + vec3<i32>(0, 0, 1), local.xy);
    let below = corners(cell - vec3<i32>(0, 0, 1));
    let above = corners(cell + vec3<i32>(0, 0, 2));
    let x = mix(low.along_x, high.along_x, local.z);
    let y = mix(low.along_y, high.along_y, local.z);
    let z = vec2<f32>(bilinear(high.corners - below, local.xy), bilinear(above - low.corners, local.xy));
    // At the border the sample beyond is the one at the border.
    let at_low = select(vec3<f32>(0.5), vec3<f32>(1.0), cell == vec3<i32>(0)) * vec3<f32>(x.x, y.x, z.x);
    let at_high = select(vec3<f32>(0.5), vec3<f32>(1.0), cell == params.dims - 2) * vec3<f32>(x.y, y.y, z.y);
    return mix(at_low, at_high, local);
}

// In a layer of samples, along each axis the differences around a cell's lower samples and around its higher ones, interpolated across; and its
// corners there.
struct Around {
    along_x: vec2<f32>,
    along_y: vec2<f32>,
    corners: vec4<f32>,
}

fn around(cell: vec3<i32>, local: vec2<f32>) -> Around {
    let low_low = corners(cell + vec3<i32>(-1, -1, 0));
    let high_low = corners(cell + vec3<i32>(1, -1, 0));
    let low_high = corners(cell + vec3<i32>(-1, 1, 0));
    let high_high = corners(cell + vec3<i32>(1, 1, 0));
    return Around(
        mix(high_low.zw - low_low.zw, high_high.xy - low_high.xy, local.y),
        mix(low_high.yw - low_low.yw, high_high.xz - high_low.xz, local.x),
        vec4<f32>(low_low.w, high_low.z, low_high.y, high_high.x),
    );
}

fn bilinear(v: vec4<f32>, p: vec2<f32>) -> f32 {
    return mix(mix(v.x, v.y, p.x), mix(v.z, v.w, p.x), p.y);
}
