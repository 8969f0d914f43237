// The interpolant along a ray through a cell, interval by interval: between where it turns, and where it passes one of some ascending levels.
// The twin of renderer/src/cpu/intervals.rs, which says why each step is as it is.

#import volume, cubic

// How many of the levels lie at or below a value.
fn count_levels(v: f32) -> i32 {
    var count = 0;
    for (var n = 0; n < i32(params.levels.count); n++) {
        count += select(0, 1, v >= level_at(n));
    }
    return count;
}

// The next end of an interval of the cubic b on the way from u to u_end, where `above` levels lie at or below the value at u.
fn next_end(b: vec4<f32>, u: f32, u_end: f32, above: i32) -> Next {
    let turns = turning_points(b);
    let turn = select(select(1.0, turns.y, turns.y > u), turns.x, turns.x > u);
    let end = min(turn, u_end);
    let there = count_levels(cubic_value(b, end));
    if there == above {
        return Next(end, false, false);
    }
    let rises = there > above;
    let level = level_at(select(above - 1, above, rises));
    let g = select(-1.0, 1.0, rises) * (b - level);
    let g_low = cubic_value(g, u);
    if g_low >= 0.0 {
        return Next(u, true, rises);
    }
    return Next(refine(g, u, g_low, end, cubic_value(g, end)), true, rises);
}

// The next end of an interval: where, whether a level is passed there, and whether values rise.
struct Next {
    u: f32,
    passes: bool,
    rises: bool,
}

// A level, and its paint: linear colour, and opacity or extinction per mm.
fn level_at(n: i32) -> f32 {
    return extras[params.levels.first + 2u * u32(n)].x;
}

fn paint_at(n: i32) -> vec4<f32> {
    return extras[params.levels.first + 2u * u32(n) + 1u];
}

// What lies, at value v in the interval of number `above`, between what belongs to the levels on either side of it.
fn paint_between(above: i32, v: f32) -> vec4<f32> {
    let low = max(above - 1, 0);
    let high = min(above, i32(params.levels.count) - 1);
    let apart = level_at(high) - level_at(low);
    var w = 0.0;
    if apart > 0.0 {
        w = clamp((v - level_at(low)) / apart, 0.0, 1.0);
    }
    return paint_at(low) + (paint_at(high) - paint_at(low)) * w;
}

// The next crossing of a level from u on to u_end; it passes none where there is none.
fn next_crossing(cubic: vec4<f32>, above: i32, first: f32, u_end: f32, fresh: bool) -> Next {
    // Where a cell is entered on the other side of a level than the one before was left: at the box's face, a cut, or by rounding.
    let at_start = count_levels(cubic.x);
    if fresh && at_start != above {
        return Next(first, true, at_start > above);
    }
    var u = first;
    while u < u_end {
        let next = next_end(cubic, u, u_end, above);
        if next.passes {
            return next;
        }
        u = next.u;
    }
    return Next(u, false, false);
}
