// Within a brick: steps of fixed length, with one linear interpolation where two samples lie on different sides.
// The twin of renderer/src/cpu/steps.rs. PER_VOXEL is replaced by the number of steps in a voxel's length.

fn walk_brick(pace: Pace, at: InBrick) -> Hit {
    let step = 1.0 / (PER_VOXEL * length(pace.direction));
    // The last sample before the brick, but not before the box or the eye, where the first sample is taken.
    var n = floor((at.s + at.t) / step);
    var t0 = n * step - at.s;
    var p0 = at.origin + t0 * pace.direction;
    let met = met_at_entry(pace, at);
    if met != MET_ISOSURFACE || n * step < 0.0 {
        t0 = at.t;
        p0 = at.p;
    }
    var f0 = value(at.corner, p0);
    if inside(f0) {
        return hit_at(pace, at, t0, p0, met);
    }
    loop {
        n += 1.0;
        let t1 = n * step - at.s;
        if t1 > at.t_out || at.s + t0 > at.s_max {
            return missed();
        }
        let p1 = at.origin + t1 * pace.direction;
        let f1 = value(at.corner, p1);
        if inside(f1) {
            let u = f0 / (f0 - f1);
            return hit_at(pace, at, t0 + u * (t1 - t0), p0 + u * (p1 - p0), MET_ISOSURFACE);
        }
        t0 = t1;
        p0 = p1;
        f0 = f1;
    }
    return missed();
}

// The cell of a point, which may lie a step outside the brick, but is taken within the box.
fn cell_of(corner: vec3<i32>, p: vec3<f32>) -> vec3<i32> {
    return clamp(corner + vec3<i32>(floor(p)), vec3<i32>(0), params.dims - 2);
}

fn value(corner: vec3<i32>, p: vec3<f32>) -> f32 {
    let cell = cell_of(corner, p);
    let local = clamp(p - vec3<f32>(cell - corner), vec3<f32>(0.0), vec3<f32>(1.0));
    return trilinear(corners(cell), corners(cell + vec3<i32>(0, 0, 1)), local);
}

fn hit_at(pace: Pace, at: InBrick, t: f32, p: vec3<f32>, met: u32) -> Hit {
    let cell = cell_of(at.corner, p);
    let local = clamp(p - vec3<f32>(cell - at.corner), vec3<f32>(0.0), vec3<f32>(1.0));
    return Hit(at.s + t, cell, local, met, select(vec3<f32>(0.0), -sign(pace.direction), at.entry));
}
