// One volume on the way of a ray through all.
// The twin of renderer/src/cpu/traveller.rs.

#import volume, interpolant, brick, walk, cells, cuts, gradient, bernstein, part_within

struct Traveller {
    // Whether the ray is on its way, whether it is in a cell, and whether it has just come to that.
    open: bool,
    has: bool,
    fresh: bool,
    // How many of the levels lie at or below the value here.
    above: i32,
    way: CellPass,
    cubic: vec4<f32>,
    part: Kept,
}

fn begin_travel(line: Line, part: Kept, span: vec2<f32>) -> Walk {
    return begin_walk(line, part.begin, span.x, min(span.y, part.end));
}

// On to the next cell.
fn go_on(t: ptr<function, Traveller>, walk: ptr<function, Walk>) {
    var way: CellPass;
    // Of some cells nothing lies within the solid.
    loop {
        (*t).open = arrive(walk);
        if !(*t).open {
            return;
        }
        var place = (*walk).place;
        way = until(cross_cell((*walk).pace, (*walk).at, &place), (*walk).s_max);
        (*walk).place = place;
        if way.is_there {
            break;
        }
    }
    (*t).way = way;
    // Behind a gap that the solid leaves nothing is known of the side before.
    if way.at_face {
        (*t).above = 0;
    }
    (*t).cubic = bernstein(way.lower, way.upper, way.start, way.end);
    (*t).has = true;
    (*t).fresh = true;
}

// How far of the way through its cell a ray is at depth s, 0 to 1.
fn share_at(way: CellPass, s: f32) -> f32 {
    let length = way.s.y - way.s.x;
    if length > 0.0 {
        return clamp((s - way.s.x) / length, 0.0, 1.0);
    }
    return 0.0;
}

fn value_at(way: CellPass, u: f32) -> f32 {
    return trilinear(way.lower, way.upper, way.start * (1.0 - u) + way.end * u);
}

// The normal in the world at u, toward the viewer, unit; zero where there is no gradient.
fn normal_at(way: CellPass, direction: vec3<f32>, u: f32) -> vec3<f32> {
    let local = way.start * (1.0 - u) + way.end * u;
    var surface: vec3<f32>;
    if params.analytic_normals == 1u {
        surface = gradient(way.lower, way.upper, local);
    } else {
        surface = smooth_gradient(way.cell, local);
    }
    return toward_viewer(rim(way.cell, local, surface, direction, way.at_face && u == 0.0, params.rim_units), direction);
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
    let met = select(MET_ISOSURFACE, met_at_entry(walk.pace, walk.at), t.way.is_first && !t.way.at_face);
    if met == MET_START {
        return select(vec3<f32>(0.0), t.part.normal, t.part.is_cut);
    }
    if met == MET_FACE {
        return toward_viewer(select(vec3<f32>(0.0), -sign(walk.pace.direction), walk.at.entry), walk.pace.direction);
    }
    return normal_at(t.way, walk.pace.direction, 0.0);
}
