// One volume on the way of a ray through all.
// The twin of `Traveller` in renderer/src/cpu/march.rs.

#import constants, volume, brick, walk, cells, cuts, pieces, gradient, to_light, bernstein

struct Traveller {
    // Whether the ray is on its way, whether it is in a cell, and whether it has just come to that.
    open: bool,
    has: bool,
    fresh: bool,
    // How many of the levels lie at or below the value here.
    above: i32,
    way: Crossing,
    cubic: vec4<f32>,
    part: Kept,
}

fn begin_travel(line: Line, part: Kept, span: vec2<f32>) -> Walk {
    return begin_walk(line, part.begin, span.x, min(span.y, part.end));
}

// On to the next cell.
fn go_on(t: ptr<function, Traveller>, walk: ptr<function, Walk>) {
    (*t).open = arrive(walk);
    if !(*t).open {
        return;
    }
    var place = (*walk).place;
    let way = until(cross_cell((*walk).pace, (*walk).at, &place), (*walk).s_max);
    (*walk).place = place;
    (*t).way = way;
    (*t).cubic = bernstein(way.lower, way.upper, way.start, way.end);
    (*t).has = true;
    (*t).fresh = true;
}

// What this volume leaves of a share of the light on its way to what a pixel shows at depth s.
fn let_through(pixel: vec2<u32>, s: f32, share_before: f32) -> f32 {
    let way = to_light(line_of(pixel), world_line_of(pixel), s);
    var t: Traveller;
    t.part = way.part;
    var walk = begin_travel(way.line, t.part, vec2<f32>(0.0, FAR));
    t.open = walk.s <= walk.s_out;
    var share = share_before;
    while t.open && share > DARK {
        go_on(&t, &walk);
        if !t.open {
            break;
        }
        // What the light is on its way in from the start on it has not come into.
        if t.way.is_first && t.way.s.x == t.part.begin && !t.part.is_cut {
            t.above = count_levels(t.cubic.x);
        }
        var fresh = true;
        var next = next_crossing(t, 0.0, 1.0, fresh);
        while next.passes {
            share *= 1.0 - paint_at(select(t.above - 1, t.above, next.rises)).w;
            fresh = fresh && count_levels(t.cubic.x) != t.above;
            t.above += select(-1, 1, next.rises);
            next = next_crossing(t, next.u, 1.0, fresh);
        }
    }
    return share;
}

// How far of the way through its cell a ray is at depth s, 0 to 1.
fn share_at(way: Crossing, s: f32) -> f32 {
    let length = way.s.y - way.s.x;
    if length > 0.0 {
        return clamp((s - way.s.x) / length, 0.0, 1.0);
    }
    return 0.0;
}

fn value_at(way: Crossing, u: f32) -> f32 {
    return trilinear(way.lower, way.upper, way.start * (1.0 - u) + way.end * u);
}

// The normal in the world at u, toward the viewer, unit; zero where there is no gradient.
fn normal_at(way: Crossing, direction: vec3<f32>, u: f32) -> vec3<f32> {
    let local = way.start * (1.0 - u) + way.end * u;
    if params.analytic_normals == 1u {
        return toward_viewer(gradient(way.lower, way.upper, local), direction);
    }
    return toward_viewer(smooth_gradient(way.cell, local), direction);
}

// The same, but a cut's own as deep behind it as `skin`.
fn normal_behind_cut(t: Traveller, direction: vec3<f32>, u: f32, s: f32, skin: f32) -> vec3<f32> {
    if t.part.is_cut && s - t.part.begin < skin {
        return t.part.normal;
    }
    return normal_at(t.way, direction, u);
}

// The normal where a ray enters its cell at a crossing: of the box's face or the cut, where surfaces are closed, or of the surface.
fn closing_normal(t: Traveller, walk: Walk) -> vec3<f32> {
    let met = select(MET_ISOSURFACE, met_at_entry(walk.pace, walk.at), t.way.is_first);
    if met == MET_START {
        return select(vec3<f32>(0.0), t.part.normal, t.part.is_cut);
    }
    if met == MET_FACE {
        return toward_viewer(select(vec3<f32>(0.0), -sign(walk.pace.direction), walk.at.entry), walk.pace.direction);
    }
    return normal_at(t.way, walk.pace.direction, 0.0);
}

// The next crossing of a level from u on to u_end; it passes none where there is none.
fn next_crossing(t: Traveller, first: f32, u_end: f32, fresh: bool) -> Next {
    // Where a cell is entered on the other side of a level than the one before was left: at the box's face, a cut, or by rounding.
    let at_start = count_levels(t.cubic.x);
    if fresh && at_start != t.above {
        return Next(first, true, at_start > t.above);
    }
    var u = first;
    while u < u_end {
        let next = next_end(t.cubic, u, u_end, t.above);
        if next.passes {
            return next;
        }
        u = next.u;
    }
    return Next(u, false, false);
}
