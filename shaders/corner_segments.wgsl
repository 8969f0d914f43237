// A solver of corner values in one of many cells, with the sign of the values turned or not.

#import segments, solver

fn entry_of(cell: u32, sign: f32, p: vec3<f32>, q: vec3<f32>) -> f32 {
    return first_entry(sign * segments[cell].lower, sign * segments[cell].upper, p, q);
}
