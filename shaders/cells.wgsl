// Within a brick: from cell to cell that can hold the surface, with one solver compiled in for them.
// The twin of renderer/src/cpu/cells.rs.

#import constants, brick, samples, cell_entry, part_within

// A cell, the depth at which a ray enters it, and the axis that it crosses there; none where it enters the brick.
struct Place {
    cell: vec3<i32>,
    t: f32,
    entry: vec3<bool>,
    // The ray has left the brick.
    is_left: bool,
    // The first part of the cell's way within the solid is behind.
    is_second: bool,
}

// The cell in which a ray enters a brick.
fn first_place(pace: Pace, at: InBrick) -> Place {
    let cell = vec3<i32>(at.p);
    // On a face and moving down, the ray is in the cell below.
    let below = !pace.forward & pace.moves & (at.p == vec3<f32>(cell));
    let first = clamp(cell - select(vec3<i32>(0), vec3<i32>(1), below), at.first, at.end - 1);
    return Place(first, at.t, vec3<bool>(false), has_left(at, first, at.t), false);
}

// The exit of a ray from a cell that it enters at t: its depth and its axis.
struct Exit {
    t: f32,
    axis: vec3<bool>,
}

fn exit_of(pace: Pace, at: InBrick, cell: vec3<i32>, t: f32) -> Exit {
    let t_faces = to_planes(pace, vec3<f32>(select(cell, cell + 1, pace.forward)), at.origin, FAR);
    let t_least = least(t_faces);
    return Exit(max(t_least, t), axis_of(t_faces, t_least));
}

// On to a cell that can hold the surface, if the one at hand cannot; false where there is none.
fn advance(pace: Pace, at: InBrick, place: ptr<function, Place>) -> bool {
    let step = select(vec3<i32>(-1), vec3<i32>(1), pace.forward);
    var cell = (*place).cell;
    var t = (*place).t;
    var entry = (*place).entry;
    var is_left = (*place).is_left;
    var is_second = (*place).is_second;
    loop {
        let exit = exit_of(pace, at, cell, t);
        if is_left || may_hold(at, cell) {
            break;
        }
        cell = select(cell, cell + step, exit.axis);
        t = exit.t;
        entry = exit.axis;
        is_left = has_left(at, cell, t);
        is_second = false;
    }
    *place = Place(cell, t, entry, is_left, is_second);
    return !is_left;
}

// A ray on its way through a cell, or through what of it lies within a solid.
struct CellPass {
    // By its lowest sample.
    cell: vec3<i32>,
    // Corner values.
    lower: vec4<f32>,
    upper: vec4<f32>,
    // Where the ray enters and leaves it, in [0, 1]³, and at which depths.
    start: vec3<f32>,
    end: vec3<f32>,
    s: vec2<f32>,
    // The same from the brick's s on.
    t: vec2<f32>,
    // It is the first in its brick.
    is_first: bool,
    // It begins at a face that the solid cuts, and whether there is a part within the solid.
    at_face: bool,
    is_there: bool,
}

// The way through the cell at hand, which is read and left for the next; of what lies within a solid one part after the other.
fn cross_cell(pace: Pace, at: InBrick, place: ptr<function, Place>) -> CellPass {
    let cell = (*place).cell;
    let t = (*place).t;
    let entry = (*place).entry;
    let exit = exit_of(pace, at, cell, t);
    let lower = corners(at.corner + cell);
    let upper = corners(at.corner + cell + vec3<i32>(0, 0, 1));
    // Where it enters is where it left the cell before, the same number.
    let is_first = !any(entry);
    let p = select(point(pace, at, t, cell, entry, select(cell + 1, cell, pace.forward)), at.p, vec3<bool>(is_first));
    let q = point(pace, at, exit.t, cell, exit.axis, select(cell, cell + 1, pace.forward));
    let next = select(cell, cell + select(vec3<i32>(-1), vec3<i32>(1), pace.forward), exit.axis);
    // Where the line begins is the same number for all volumes: cuts of several meet there.
    let s = vec2<f32>(select(at.s + t, at.begin, is_first && !any(at.entry)), at.s + exit.t);
    let start = p - vec3<f32>(cell);
    let end = q - vec3<f32>(cell);
    let part = part_within(at.corner + cell, start, end, (*place).is_second);
    var way = CellPass(at.corner + cell, lower, upper, start, end, s, vec2<f32>(t, exit.t), is_first, part.at_face, part.is_there);
    if part.has_more {
        (*place).is_second = true;
    } else {
        *place = Place(next, exit.t, exit.axis, has_left(at, next, exit.t), false);
    }
    if part.from_u > 0.0 {
        way.start = start * (1.0 - part.from_u) + end * part.from_u;
        way.t.x = t + part.from_u * (exit.t - t);
        way.s.x = s.x + (way.t.x - t);
        way.is_first = false;
    }
    if part.to_u < 1.0 {
        way.end = start * (1.0 - part.to_u) + end * part.to_u;
        way.t.y = t + part.to_u * (exit.t - t);
        way.s.y = max(s.y - (exit.t - way.t.y), way.s.x);
    }
    return way;
}

// Ends where nothing more is asked for.
fn until(whole: CellPass, s_max: f32) -> CellPass {
    var way = whole;
    if way.s.y > s_max {
        let u = max((s_max - way.s.x) / (way.s.y - way.s.x), 0.0);
        way.end = way.start * (1.0 - u) + way.end * u;
        way.s.y = max(s_max, way.s.x);
    }
    return way;
}

// The first entry within the cell; where there is none, the place is the next cell.
fn solve(pace: Pace, at: InBrick, place: ptr<function, Place>) -> Hit {
    let way = cross_cell(pace, at, place);
    if !way.is_there {
        return missed();
    }
    let u = entry_in(way);
    var met = select(MISSED, MET_ISOSURFACE, u >= 0.0);
    if u == 0.0 && way.is_first {
        met = met_at_entry(pace, at);
    }
    if u == 0.0 && way.at_face && met == MET_ISOSURFACE {
        met = MET_SOLID;
    }
    let face = select(vec3<f32>(0.0), -sign(pace.direction), at.entry);
    let s = select(at.s + way.t.x + u * (way.t.y - way.t.x), at.begin, met == MET_START);
    return Hit(s, way.cell, way.start * (1.0 - u) + way.end * u, met, face);
}

// Where the ray is at t, on the face of a cell across `axis`.
fn point(pace: Pace, at: InBrick, t: f32, cell: vec3<i32>, axis: vec3<bool>, face: vec3<i32>) -> vec3<f32> {
    let p = clamp(at.origin + t * pace.direction, vec3<f32>(cell), vec3<f32>(cell + 1));
    return select(p, vec3<f32>(face), axis);
}
