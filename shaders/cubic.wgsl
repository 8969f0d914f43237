// The first entry of a cubic in Bernstein form.
// The twin of renderer/src/roots/cubic.rs, which says why each step is as it is.

#import constants, interpolant

// The cubic at u. Called `cubic_value` and `cubic_slope` here, as WGSL has no modules.
fn cubic_value(b: vec4<f32>, u: f32) -> f32 {
    let m = 1.0 - u;
    return (b.x * m + 3.0 * b.y * u) * m * m + (3.0 * b.z * m + b.w * u) * u * u;
}

// Its first derivative at u.
fn cubic_slope(b: vec4<f32>, u: f32) -> f32 {
    let m = 1.0 - u;
    return 3.0 * ((b.y - b.x) * m * m + 2.0 * (b.z - b.y) * m * u + (b.w - b.z) * u * u);
}

// Its second derivative at 0 and 1; between them it is linear.
fn cubic_bends(b: vec4<f32>) -> vec2<f32> {
    return 6.0 * vec2<f32>(b.x - 2.0 * b.y + b.z, b.y - 2.0 * b.z + b.w);
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

// The only entry in (low, high), from outside to inside; f_low and f_high are the values there.
fn refine(b: vec4<f32>, first_low: f32, f_low: f32, first_high: f32, f_high: f32) -> f32 {
    var low = first_low;
    var high = first_high;
    var u = clamp(low - f_low * ((high - low) / (f_high - f_low)), low, high);
    let bends = cubic_bends(b);
    for (var i = 0u; i < MAX_STEPS; i++) {
        let f = cubic_value(b, u);
        let d = cubic_slope(b, u);
        if inside(f) {
            high = u;
        } else {
            low = u;
        }
        let room = select(high - u, u - low, (f < 0.0) == (d < 0.0));
        let newton = abs(f) < abs(d) * room;
        var next = 0.5 * (low + high);
        if newton {
            next = u - f / d;
        }
        let step = abs(next - u);
        let bend = abs(bends.x * (1.0 - u) + bends.y * u) + abs(bends.y - bends.x) * step;
        let is_there = newton && bend * step * step <= 2.0 * REST_TOLERANCE * abs(d);
        u = next;
        if is_there || step <= STEP_TOLERANCE {
            break;
        }
    }
    return u;
}

// The first u in [0, 1] where the cubic with Bernstein coefficients b enters the inside; negative when it stays outside.
fn cubic_entry(b: vec4<f32>) -> f32 {
    if inside(b.x) {
        return 0.0;
    }
    if !any(b >= vec4<f32>(0.0)) {
        return -1.0;
    }
    var low = 0.0;
    var f_low = b.x;
    var high = 1.0;
    var f_high = b.w;
    let changes_once = inside(b.w) && (!inside(b.y) || inside(b.z));
    if !changes_once {
        let turns = turning_points(b);
        for (var i = 0; i < 2; i++) {
            let turn = select(turns.y, turns.x, i == 0);
            if turn < high {
                let f = cubic_value(b, turn);
                if inside(f) {
                    high = turn;
                    f_high = f;
                } else {
                    low = turn;
                    f_low = f;
                }
            }
        }
        if !inside(f_high) {
            return -1.0;
        }
    }
    return refine(b, low, f_low, high, f_high);
}
