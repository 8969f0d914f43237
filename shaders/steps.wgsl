// Within a brick: steps of fixed length, with one linear interpolation where two samples lie on different sides.
// The twin of renderer/src/cpu/steps.rs.

#import brick, interpolant, samples, line, part_within

// Steps in a voxel's length.
override PER_VOXEL: f32;

// A step along a ray, the count-th behind the one at `begin`: the samples before and behind it. Before the first step both are the first
// sample.
struct Place {
    begin: f32,
    count: f32,
    t0: f32,
    p0: vec3<f32>,
    f0: f32,
    t1: f32,
    p1: vec3<f32>,
    f1: f32,
}

fn step_length(pace: Pace) -> f32 {
    return 1.0 / (PER_VOXEL * length(pace.direction));
}

fn first_place(pace: Pace, at: InBrick) -> Place {
    let step = step_length(pace);
    // The last sample before the brick, but not before the box or the line's start, where the first sample is taken.
    let n = floor((at.s + at.t) / step);
    var t = n * step - at.s;
    var p = at.origin + t * pace.direction;
    if met_at_entry(pace, at) != MET_ISOSURFACE || n * step < at.begin {
        t = at.t;
        p = at.p;
    }
    let f = value(at.corner, p);
    return Place(n * step - at.s, 0.0, t, p, f, t, p, f);
}

// On to the next step that ends inside; false where there is none.
fn advance(pace: Pace, at: InBrick, place: ptr<function, Place>) -> bool {
    let step = step_length(pace);
    while !inside((*place).f1) {
        // Counted from the brick on: a large number would not grow by 1.
        let begin = (*place).begin;
        let count = (*place).count + 1.0;
        let t0 = (*place).t1;
        let t1 = begin + count * step;
        if t1 > at.t_out || t0 > at.t_end {
            return false;
        }
        let p1 = at.origin + t1 * pace.direction;
        *place = Place(begin, count, t0, (*place).p1, (*place).f1, t1, p1, value(at.corner, p1));
    }
    return true;
}

// The entry within the step.
fn solve(pace: Pace, at: InBrick, place: ptr<function, Place>) -> Hit {
    let f0 = (*place).f0;
    // The first sample may be inside itself.
    let is_first = inside(f0);
    let u = select(f0 / (f0 - (*place).f1), 0.0, is_first);
    let t = (*place).t0 + u * ((*place).t1 - (*place).t0);
    let p = (*place).p0 * (1.0 - u) + (*place).p1 * u;
    let cell = cell_of(at.corner, p);
    let local = clamp(p - vec3<f32>(cell - at.corner), vec3<f32>(0.0), vec3<f32>(1.0));
    let met = select(MET_ISOSURFACE, met_at_entry(pace, at), is_first);
    return Hit(at.s + t, cell, local, met, select(vec3<f32>(0.0), -sign(pace.direction), at.entry));
}

// The cell of a point, which may lie a step outside the brick, but is taken within the box.
fn cell_of(corner: vec3<i32>, p: vec3<f32>) -> vec3<i32> {
    return clamp(corner + vec3<i32>(floor(p)), vec3<i32>(0), params.dims - 2);
}

// Outside of a solid as far outside as it would be inside: its face is taken to lie in the middle of a step.
fn value(corner: vec3<i32>, p: vec3<f32>) -> f32 {
    let cell = cell_of(corner, p);
    let local = clamp(p - vec3<f32>(cell - corner), vec3<f32>(0.0), vec3<f32>(1.0));
    let value = trilinear(corners(cell), corners(cell + vec3<i32>(0, 0, 1)), local);
    return select(-max(abs(value), SMALLEST), value, holds(cell, local));
}
