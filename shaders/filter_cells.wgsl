// Within a brick: cell by cell, as in cells.wgsl, with the solver `filter`. It loads no corners, so no cell is passed over.

fn walk_brick(pace: Pace, at: InBrick) -> Hit {
    var t = at.t;
    var p = at.p;
    var cell = vec3<i32>(floor(p));
    let below = !pace.forward & pace.moves & (p == vec3<f32>(cell));
    cell = clamp(cell - select(vec3<i32>(0), vec3<i32>(1), below), vec3<i32>(0), at.size - 1);
    let first = cell;
    var at_entry = filtered(at.corner, p);
    loop {
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
        let b = cubic_through(vec4<f32>(at_entry, filtered(at.corner, p + step), filtered(at.corner, q - step), at_exit));
        let u = cubic_entry(b);
        if u >= 0.0 {
            var met = MET_ISOSURFACE;
            if u == 0.0 && all(cell == first) {
                met = met_at_entry(pace, at);
            }
            let face = select(vec3<f32>(0.0), -sign(pace.direction), at.entry);
            let start = p - local_corner;
            let end = q - local_corner;
            return Hit(at.s + t + u * (t_next - t), at.corner + cell, start * (1.0 - u) + end * u, met, face);
        }
        cell = select(cell, cell + select(vec3<i32>(-1), vec3<i32>(1), pace.forward), axis);
        if any(cell < vec3<i32>(0)) || any(cell >= at.size) || at.s + t_next > at.s_max {
            return missed();
        }
        t = t_next;
        p = q;
        at_entry = at_exit;
    }
    return missed();
}
