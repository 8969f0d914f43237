// Fixed steps along a segment of one cell, for the stability table. The twin of renderer/src/roots/segment_steps.rs.

#import interpolant

// Steps in a voxel's length.
override PER_VOXEL: f32;

fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    let steps = PER_VOXEL * distance(p, q);
    var n = 0.0;
    var u0 = 0.0;
    var f0 = trilinear(lower, upper, p);
    if inside(f0) {
        return 0.0;
    }
    while n < steps {
        n += 1.0;
        let u1 = select(1.0, n / steps, n < steps);
        let f1 = trilinear(lower, upper, p * (1.0 - u1) + q * u1);
        if inside(f1) {
            return u0 + (u1 - u0) * (f0 / (f0 - f1));
        }
        u0 = u1;
        f0 = f1;
    }
    return -1.0;
}
