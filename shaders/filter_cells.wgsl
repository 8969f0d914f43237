// Within a brick: cell by cell, as in cells.wgsl, with the solver `filter`. It loads no corners, so no cell is passed over.

#import constants, brick, filtered, filter, cubic_entry

// A cell, where a ray enters it, and the value there.
struct Place {
    cell: vec3<i32>,
    t: f32,
    p: vec3<f32>,
    at_entry: f32,
    is_first: bool,
    // The ray has left the brick.
    is_left: bool,
}

fn first_place(pace: Pace, at: InBrick) -> Place {
    let cell = vec3<i32>(floor(at.p));
    let below = !pace.forward & pace.moves & (at.p == vec3<f32>(cell));
    let first = clamp(cell - select(vec3<i32>(0), vec3<i32>(1), below), at.first, at.end - 1);
    return Place(first, at.t, at.p, filtered(at.corner, at.p), true, false);
}

fn advance(pace: Pace, at: InBrick, place: ptr<function, Place>) -> bool {
    return !(*place).is_left;
}

// The first entry within the cell; where there is none, the place is the next cell.
fn solve(pace: Pace, at: InBrick, place: ptr<function, Place>) -> Hit {
    let cell = (*place).cell;
    let t = (*place).t;
    let p = (*place).p;
    let faces = vec3<f32>(cell + select(vec3<i32>(0), vec3<i32>(1), pace.forward));
    let t_faces = to_planes(pace, faces, at.origin, FAR);
    let t_least = least(t_faces);
    let axis = axis_of(t_faces, t_least);
    let t_next = max(t_least, t);
    let local_corner = vec3<f32>(cell);
    let q = select(clamp(at.origin + t_next * pace.direction, local_corner, local_corner + 1.0), faces, axis);
    let step = (q - p) / 3.0;
    // The value at the exit is that at the next cell's entry: nothing falls between.
    let at_exit = filtered(at.corner, q);
    let b = cubic_through(vec4<f32>((*place).at_entry, filtered(at.corner, p + step), filtered(at.corner, q - step), at_exit));
    let u = cubic_entry(b);
    if u >= 0.0 {
        var met = MET_ISOSURFACE;
        if u == 0.0 && (*place).is_first {
            met = met_at_entry(pace, at);
        }
        let face = select(vec3<f32>(0.0), -sign(pace.direction), at.entry);
        let start = p - local_corner;
        let end = q - local_corner;
        return Hit(at.s + t + u * (t_next - t), at.corner + cell, start * (1.0 - u) + end * u, met, face);
    }
    let next = select(cell, cell + select(vec3<i32>(-1), vec3<i32>(1), pace.forward), axis);
    *place = Place(next, t_next, q, at_exit, false, has_left(at, next, t_next));
    return missed();
}
