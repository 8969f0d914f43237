// The solver `neubauer`. The twin of renderer/src/roots/neubauer.rs.

#import interpolant

// How many times the interval is made smaller.
override STEP_COUNT: u32;

fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    var f0 = trilinear(lower, upper, p);
    var f1 = trilinear(lower, upper, q);
    if inside(f0) {
        return 0.0;
    }
    if !inside(f1) {
        return -1.0;
    }
    var u0 = 0.0;
    var u1 = 1.0;
    for (var i = 0u; i < STEP_COUNT; i++) {
        let u = u0 + (u1 - u0) * (f0 / (f0 - f1));
        let value = trilinear(lower, upper, p * (1.0 - u) + q * u);
        if inside(value) {
            u1 = u;
            f1 = value;
        } else {
            u0 = u;
            f0 = value;
        }
    }
    return u0 + (u1 - u0) * (f0 / (f0 - f1));
}
