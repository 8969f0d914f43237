// The solver `analytic`. The twin of renderer/src/roots/analytic.rs.

#import constants, bernstein

fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    let b = bernstein(lower, upper, p, q);
    if inside(b.x) {
        return 0.0;
    }
    if !any(b >= vec4<f32>(0.0)) {
        return -1.0;
    }
    // Scaled to 1: products of four coefficients would vanish for values of 1e-10, and overflow for 1e10.
    let largest = max(max(abs(b.x), abs(b.y)), max(abs(b.z), abs(b.w)));
    let u = first_root(b / largest);
    return select(-1.0, u, u >= 0.0 && u <= 1.0);
}

// u of the root x : w, where it lies in the segment.
fn parameter(root: vec2<f32>) -> f32 {
    let sum = root.x + root.y;
    if root.x * root.y >= 0.0 && sum != 0.0 {
        return root.x / sum;
    }
    return NO_ROOT;
}

// The least parameter of the real roots x : w of A·x³ + 3B·x²w + 3C·xw² + D·w³, where bernstein is (D, C, B, A).
fn first_root(bernstein: vec4<f32>) -> f32 {
    let a = bernstein.w;
    let b = bernstein.z;
    let c = bernstein.y;
    let d = bernstein.x;
    let d1 = a * c - b * b;
    let d2 = a * d - b * c;
    let d3 = b * d - c * c;
    let discriminant = 4.0 * d1 * d3 - d2 * d2;
    if discriminant <= 0.0 {
        let from_a = b * b * b * d >= a * c * c * c;
        let lead = select(d, a, from_a);
        let c_bar = select(d3, d1, from_a);
        let d_bar = select(-d * d2 + 2.0 * c * d3, -2.0 * b * d1 + a * d2, from_a);
        let t0 = -signum(d_bar) * abs(lead) * sqrt(-discriminant);
        let t1 = t0 - d_bar;
        let p = cube_root(0.5 * t1);
        var q = -p;
        if !(t1 == t0 || p == 0.0) {
            q = -c_bar / p;
        }
        let divisor = p * p + q * q + c_bar;
        var x = p + q;
        if !(c_bar <= 0.0 || divisor == 0.0) {
            x = -d_bar / divisor;
        }
        return parameter(select(vec2<f32>(-d, x + c), vec2<f32>(x - b, a), from_a));
    }
    let root = sqrt(discriminant);
    // The largest and the smallest root, each from the end of the polynomial where it is well determined.
    let at_a = depressed(a, d1, -2.0 * b * d1 + a * d2, root);
    let large = vec2<f32>(select(at_a.y, at_a.x, at_a.x + at_a.y > 2.0 * b) - b, a);
    let at_d = depressed(d, d3, -d * d2 + 2.0 * c * d3, root);
    let small = vec2<f32>(-d, select(at_d.y, at_d.x, at_d.x + at_d.y < 2.0 * c) + c);
    let e = large.y * small.y;
    let f = -large.x * small.y - large.y * small.x;
    let g = large.x * small.x;
    return min(parameter(large), min(parameter(small), parameter(vec2<f32>(c * f - b * g, c * e - b * f))));
}

fn depressed(lead: f32, c_bar: f32, d_bar: f32, root: f32) -> vec2<f32> {
    let angle = abs(atan2(lead * root, -d_bar)) / 3.0;
    let size = 2.0 * sqrt(max(-c_bar, 0.0));
    return vec2<f32>(size * cos(angle), size * (-0.5 * cos(angle) - 0.5 * sqrt(3.0) * sin(angle)));
}

// 1 for zero, unlike the builtin.
fn signum(v: f32) -> f32 {
    return select(1.0, -1.0, v < 0.0);
}

fn cube_root(v: f32) -> f32 {
    return signum(v) * pow(abs(v), 1.0 / 3.0);
}
