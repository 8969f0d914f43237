// Following a ray to its first hit: leaps between range bricks, until one may hold the surface; what is done there is `advance` and
// `solve` of cells.wgsl, filter_cells.wgsl or steps.wgsl.
// The twin of renderer/src/cpu/walk.rs, which says why each step is as it is.

#import constants, line, volume, brick, in_brick

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
            let known = map_at(brick);
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
