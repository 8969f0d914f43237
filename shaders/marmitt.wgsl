// The solver `marmitt`. The twin of renderer/src/roots/marmitt.rs.

#import interpolant

// How many times the interval is made smaller.
override STEP_COUNT: u32;

fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    let k = power_basis(lower, upper, p, q);
    var u0 = 0.0;
    var u1 = 1.0;
    var f0 = k.w;
    var f1 = horner(k, 1.0);
    if inside(f0) {
        return 0.0;
    }
    let e = extrema(k);
    for (var n = 0u; n < 2u; n++) {
        let extremum = select(e.y, e.x, n == 0u);
        if extremum >= u0 && extremum <= u1 {
            let value = horner(k, extremum);
            if inside(value) {
                u1 = extremum;
                f1 = value;
            } else {
                u0 = extremum;
                f0 = value;
            }
        }
    }
    if !inside(f1) {
        return -1.0;
    }
    for (var i = 0u; i < STEP_COUNT; i++) {
        let u = u0 + (u1 - u0) * (f0 / (f0 - f1));
        let value = horner(k, u);
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

// Coefficients A, B, C, D of A·u³ + B·u² + C·u + D: the interpolant with each coordinate written as a + u·b, multiplied out.
fn power_basis(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> vec4<f32> {
    var k = vec4<f32>(0.0);
    for (var c = 0u; c < 8u; c++) {
        let value = select(lower[c & 3u], upper[c & 3u], c >= 4u);
        let is_upper = vec3<bool>((c & 1u) != 0u, (c & 2u) != 0u, (c & 4u) != 0u);
        let a = select(1.0 - p, p, is_upper);
        let b = select(p - q, q - p, is_upper);
        k += value * vec4<f32>(
            b.x * b.y * b.z,
            a.x * b.y * b.z + b.x * a.y * b.z + b.x * b.y * a.z,
            b.x * a.y * a.z + a.x * b.y * a.z + a.x * a.y * b.z,
            a.x * a.y * a.z,
        );
    }
    return k;
}

fn horner(k: vec4<f32>, u: f32) -> f32 {
    return ((k.x * u + k.y) * u + k.z) * u + k.w;
}

// Roots of 3A·u² + 2B·u + C by the schoolbook formula, ascending; 2 (never in the segment) where there is none.
fn extrema(k: vec4<f32>) -> vec2<f32> {
    let discriminant = k.y * k.y - 3.0 * k.x * k.z;
    if discriminant < 0.0 || k.x == 0.0 {
        return vec2<f32>(2.0, 2.0);
    }
    let root = sqrt(discriminant);
    let e0 = (-k.y - root) / (3.0 * k.x);
    let e1 = (-k.y + root) / (3.0 * k.x);
    return vec2<f32>(min(e0, e1), max(e0, e1));
}
