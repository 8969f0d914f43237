// The solver `exact`: where a ray first crosses the isosurface within one cell.
// The twin of renderer/src/roots/exact.rs, which says why each step is as it is.

// The cubic at u. Called `cubic_value` and `cubic_slope` here, as WGSL has no modules.
fn cubic_value(b: vec4<f32>, u: f32) -> f32 {
    let m = 1.0 - u;
    return (b.x * m + 3.0 * b.y * u) * m * m + (3.0 * b.z * m + b.w * u) * u * u;
}

// Its derivative at u.
fn cubic_slope(b: vec4<f32>, u: f32) -> f32 {
    let m = 1.0 - u;
    return 3.0 * ((b.y - b.x) * m * m + 2.0 * (b.z - b.y) * m * u + (b.w - b.z) * u * u);
}

// n / d where that lies in (0, 1), else 1. The divisor is guarded before it divides.
fn ratio(n: f32, d: f32) -> f32 {
    if abs(n) < abs(d) && n * sign(d) > 0.0 {
        return n / d;
    }
    return 1.0;
}

// Where the derivative vanishes, ascending; 1 stands for none.
fn turning_points(b: vec4<f32>) -> vec2<f32> {
    let differences = b.yzw - b.xyz;
    let largest = max(abs(differences.x), max(abs(differences.y), abs(differences.z)));
    if largest == 0.0 {
        return vec2<f32>(1.0, 1.0);
    }
    let q0 = differences.x / largest;
    let q1 = differences.y / largest;
    let q2 = differences.z / largest;
    let a = q0 - 2.0 * q1 + q2;
    let w = q0 - q1;
    let discriminant = q1 * q1 - q0 * q2;
    if discriminant < 0.0 {
        return vec2<f32>(1.0, 1.0);
    }
    let root = sqrt(discriminant);
    let k = select(w + root, w - root, w < 0.0);
    let e = ratio(k, a);
    let f = ratio(q0, k);
    return vec2<f32>(min(e, f), max(e, f));
}

const MAX_STEPS: u32 = 20u;
const STEP_TOLERANCE: f32 = 1e-6;

// The crossing in (low, high), where the cubic is monotonic and the ends lie on different sides.
fn refine(b: vec4<f32>, first_low: f32, first_high: f32) -> f32 {
    var low = first_low;
    var high = first_high;
    let f_low = cubic_value(b, low);
    let f_high = cubic_value(b, high);
    let from_inside = inside(f_low);
    let span = f_high - f_low;
    var u = low;
    if span != 0.0 {
        u = clamp(low - f_low * ((high - low) / span), low, high);
    }
    for (var i = 0u; i < MAX_STEPS; i++) {
        let f = cubic_value(b, u);
        let d = cubic_slope(b, u);
        if inside(f) == from_inside {
            low = u;
        } else {
            high = u;
        }
        let room = select(high - u, u - low, (f < 0.0) == (d < 0.0));
        var next = 0.5 * (low + high);
        if abs(f) < abs(d) * room {
            next = u - f / d;
        }
        let step = abs(next - u);
        u = next;
        if step <= STEP_TOLERANCE {
            break;
        }
    }
    return u;
}

// The first u in [0, 1] where the cubic enters the inside; negative when it stays outside.
fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    let b = bernstein(lower, upper, p, q);
    if inside(b.x) {
        return 0.0;
    }
    if !any(b >= vec4<f32>(0.0)) {
        return -1.0;
    }
    let turns = turning_points(b);
    if turns.x < 1.0 && inside(cubic_value(b, turns.x)) {
        return refine(b, 0.0, turns.x);
    }
    let low = select(0.0, turns.x, turns.x < 1.0);
    if turns.y < 1.0 && inside(cubic_value(b, turns.y)) {
        return refine(b, low, turns.y);
    }
    let last_low = select(low, turns.y, turns.y < 1.0);
    if inside(b.w) {
        return refine(b, last_low, 1.0);
    }
    return -1.0;
}
