// Within a brick: cell by cell, with one solver compiled in for each that can hold the surface.
// The twin of renderer/src/cpu/cells.rs.

fn walk_brick(pace: Pace, at: InBrick) -> Hit {
    var cell = first_cell(pace, at);
    let first = cell;
    let ahead = select(vec3<i32>(0), vec3<i32>(1), pace.forward);
    let step = select(vec3<i32>(-1), vec3<i32>(1), pace.forward);
    var t = at.t;
    var entry = vec3<bool>(false);
    var t_next = t;
    var axis = entry;
    var hit = missed();
    loop {
        // All rays of a subgroup first come to a cell that can hold the surface, and then solve together: a branch that only some of
        // them take costs them all.
        var is_outside = false;
        loop {
            let t_faces = to_planes(pace, vec3<f32>(cell + ahead), at.origin, FAR);
            let t_least = least(t_faces);
            axis = axis_of(t_faces, t_least);
            t_next = max(t_least, t);
            if may_hold(at, cell) {
                break;
            }
            cell = select(cell, cell + step, axis);
            t = t_next;
            entry = axis;
            is_outside = is_left(at, cell, t);
            if is_outside {
                break;
            }
        }
        if is_outside {
            break;
        }
        let lower = corners(at.corner + cell);
        let upper = corners(at.corner + cell + vec3<i32>(0, 0, 1));
        // Where it enters is where it left the cell before, the same number.
        let p = select(at.p, point(pace, at, t, cell, entry, cell + 1 - ahead), vec3<bool>(any(entry)));
        let q = point(pace, at, t_next, cell, axis, cell + ahead);
        let start = p - vec3<f32>(cell);
        let end = q - vec3<f32>(cell);
        let u = first_entry(lower, upper, start, end);
        if u >= 0.0 {
            var met = MET_ISOSURFACE;
            if u == 0.0 && all(cell == first) {
                met = met_at_entry(pace, at);
            }
            let face = select(vec3<f32>(0.0), -sign(pace.direction), at.entry);
            hit = Hit(at.s + t + u * (t_next - t), at.corner + cell, start * (1.0 - u) + end * u, met, face);
            break;
        }
        cell = select(cell, cell + step, axis);
        t = t_next;
        entry = axis;
        if is_left(at, cell, t) {
            break;
        }
    }
    return hit;
}

// Whether a ray that comes to a cell at t is done with the brick.
fn is_left(at: InBrick, cell: vec3<i32>, t: f32) -> bool {
    return any(cell < vec3<i32>(0)) || any(cell >= at.size) || at.s + t > at.s_max;
}

// The cell that a ray is in behind its entry into a brick.
fn first_cell(pace: Pace, at: InBrick) -> vec3<i32> {
    let cell = vec3<i32>(at.p);
    // On a face and moving down, the ray is in the cell below.
    let below = !pace.forward & pace.moves & (at.p == vec3<f32>(cell));
    return clamp(cell - select(vec3<i32>(0), vec3<i32>(1), below), vec3<i32>(0), at.size - 1);
}

// Where the ray is at t, on the face of a cell across `axis`.
fn point(pace: Pace, at: InBrick, t: f32, cell: vec3<i32>, axis: vec3<bool>, face: vec3<i32>) -> vec3<f32> {
    let p = clamp(at.origin + t * pace.direction, vec3<f32>(cell), vec3<f32>(cell + 1));
    return select(p, vec3<f32>(face), axis);
}
