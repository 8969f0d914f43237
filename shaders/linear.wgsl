// The solver `linear`. The twin of renderer/src/roots/linear.rs.

#import interpolant

fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    let f0 = trilinear(lower, upper, p);
    let f1 = trilinear(lower, upper, q);
    if inside(f0) {
        return 0.0;
    }
    if inside(f1) {
        return f0 / (f0 - f1);
    }
    return -1.0;
}
