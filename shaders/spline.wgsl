// The tricubic B-spline of the samples, which are its coefficients, along a ray's way through a cell, and where it first enters the inside.
// The twin of renderer/src/roots/spline.rs, which says why each step is as it is.

#import constants, interpolant, cells, samples

// Its coefficients along a segment.
alias Bernstein = array<f32, 10>;

// One weight along an axis as a polynomial from p to q: its blossoms there, scaled by binomial coefficients.
fn weight_along(c: vec4<f32>, p: f32, q: f32) -> vec4<f32> {
    let at_p = c.xyz * (1.0 - p) + c.yzw * p;
    let at_q = c.xyz * (1.0 - q) + c.yzw * q;
    let pp = at_p.xy * (1.0 - p) + at_p.yz * p;
    let pq = at_p.xy * (1.0 - q) + at_p.yz * q;
    let qq = at_q.xy * (1.0 - q) + at_q.yz * q;
    return OF_3 * vec4<f32>(blend(pp.x, pp.y, p), blend(pp.x, pp.y, q), blend(pq.x, pq.y, q), blend(qq.x, qq.y, q));
}

// The four of them, by their places along the segment: what a row's four coefficients are multiplied with.
fn weights_along(p: f32, q: f32) -> mat4x4<f32> {
    let sixth = 1.0 / 6.0;
    return mat4x4<f32>(
        weight_along(sixth * SPLINE_WEIGHTS[0], p, q),
        weight_along(sixth * SPLINE_WEIGHTS[1], p, q),
        weight_along(sixth * SPLINE_WEIGHTS[2], p, q),
        weight_along(sixth * SPLINE_WEIGHTS[3], p, q),
    );
}

// Two rows of coefficients in a slice, from the one before a cell to the one behind it.
struct Rows {
    first: vec4<f32>,
    second: vec4<f32>,
}

fn rows_at(at: vec3<i32>) -> Rows {
    let low = corners(at);
    let high = corners(at + vec3<i32>(2, 0, 0));
    return Rows(vec4<f32>(low.xy, high.xy), vec4<f32>(low.zw, high.zw));
}

// The product of two polynomials of degree 3 with scaled coefficients, the first seven of these; that of degree 6 comes last.
struct Plane {
    low: vec4<f32>,
    high: vec3<f32>,
}

fn product(a: vec4<f32>, b: vec4<f32>) -> Plane {
    return Plane(
        vec4<f32>(
            a.x * b.x,
            a.x * b.y + a.y * b.x,
            a.x * b.z + a.y * b.y + a.z * b.x,
            a.x * b.w + a.y * b.z + a.z * b.y + a.w * b.x,
        ),
        vec3<f32>(a.y * b.w + a.z * b.z + a.w * b.y, a.z * b.w + a.w * b.z, a.w * b.w),
    );
}

fn sum(a: Plane, b: Plane) -> Plane {
    return Plane(a.low + b.low, a.high + b.high);
}

// Bernstein coefficients of the spline along the way.
fn spline_along(way: CellPass) -> Bernstein {
    let along_x = weights_along(way.start.x, way.end.x);
    let along_y = weights_along(way.start.y, way.end.y);
    let along_z = weights_along(way.start.z, way.end.z);
    var b = Bernstein();
    for (var z = 0; z < 4; z++) {
        let front = rows_at(way.cell + vec3<i32>(-1, -1, z - 1));
        let back = rows_at(way.cell + vec3<i32>(-1, 1, z - 1));
        let near = sum(product(along_x * front.first, along_y[0]), product(along_x * front.second, along_y[1]));
        let far = sum(product(along_x * back.first, along_y[2]), product(along_x * back.second, along_y[3]));
        let plane = sum(near, far);
        let w = along_z[z];
        b[0] += plane.low.x * w.x;
        b[1] += plane.low.x * w.y + plane.low.y * w.x;
        b[2] += plane.low.x * w.z + plane.low.y * w.y + plane.low.z * w.x;
        b[3] += plane.low.x * w.w + plane.low.y * w.z + plane.low.z * w.y + plane.low.w * w.x;
        b[4] += plane.low.y * w.w + plane.low.z * w.z + plane.low.w * w.y + plane.high.x * w.x;
        b[5] += plane.low.z * w.w + plane.low.w * w.z + plane.high.x * w.y + plane.high.y * w.x;
        b[6] += plane.low.w * w.w + plane.high.x * w.z + plane.high.y * w.y + plane.high.z * w.x;
        b[7] += plane.high.x * w.w + plane.high.y * w.z + plane.high.z * w.y;
        b[8] += plane.high.y * w.w + plane.high.z * w.z;
        b[9] += plane.high.z * w.w;
    }
    return Bernstein(
        b[0], b[1] / OF_9[1], b[2] / OF_9[2], b[3] / OF_9[3], b[4] / OF_9[4], b[5] / OF_9[5], b[6] / OF_9[6], b[7] / OF_9[7], b[8] / OF_9[8], b[9],
    );
}

// The coefficients over the part from `low` on that is `length` long (de Casteljau).
fn part_of(b: Bernstein, low: f32, length: f32) -> Bernstein {
    var c = b;
    let high = low + length;
    for (var r = 1; r <= SPLINE_DEGREE; r++) {
        for (var n = SPLINE_DEGREE; n >= r; n--) {
            c[n] = blend(c[n - 1], c[n], high);
        }
    }
    for (var r = 1; r <= SPLINE_DEGREE; r++) {
        for (var n = 0; n <= SPLINE_DEGREE - r; n++) {
            c[n] = blend(c[n], c[n + 1], low / high);
        }
    }
    return c;
}

// The value and the derivative at u (de Casteljau).
fn value_and_slope(b: Bernstein, u: f32) -> vec2<f32> {
    var c = b;
    for (var r = 1; r < SPLINE_DEGREE; r++) {
        for (var n = 0; n <= SPLINE_DEGREE - r; n++) {
            c[n] = blend(c[n], c[n + 1], u);
        }
    }
    return vec2<f32>(blend(c[0], c[1], u), f32(SPLINE_DEGREE) * (c[1] - c[0]));
}

// The only entry in (0, 1), from outside at 0 to inside at 1.
fn refine_spline(b: Bernstein) -> f32 {
    var low = 0.0;
    var high = 1.0;
    var u = clamp(b[0] / (b[0] - b[9]), low, high);
    for (var i = 0u; i < SPLINE_MAX_STEPS; i++) {
        let f = value_and_slope(b, u);
        if inside(f.x) {
            high = u;
        } else {
            low = u;
        }
        let room = select(high - u, u - low, (f.x < 0.0) == (f.y < 0.0));
        var next = 0.5 * (low + high);
        if abs(f.x) < abs(f.y) * room {
            next = u - f.x / f.y;
        }
        let step = abs(next - u);
        u = next;
        if step <= SPLINE_STEP_TOLERANCE {
            break;
        }
    }
    return u;
}

// The largest coefficient.
fn most(b: Bernstein) -> f32 {
    return max(max(max(b[0], b[1]), max(b[2], b[3])), max(max(max(b[4], b[5]), max(b[6], b[7])), max(b[8], b[9])));
}

// The first u in [0, 1] where the spline enters the inside on a ray's way through a cell; negative when it stays outside.
fn entry_in(way: CellPass) -> f32 {
    let b = spline_along(way);
    if !inside(most(b)) {
        return -1.0;
    }
    var low = 0.0;
    var length = 1.0;
    while low < 1.0 {
        let part = part_of(b, low, length);
        if inside(part[0]) {
            return low;
        }
        var changes = 0;
        for (var n = 0; n < SPLINE_DEGREE; n++) {
            changes += select(0, 1, inside(part[n]) != inside(part[n + 1]));
        }
        let is_least = length <= SPLINE_LEAST;
        let ends_inside = inside(part[9]);
        if ends_inside && (changes == 1 || is_least) {
            return low + length * refine_spline(part);
        }
        if changes == 0 || (is_least && !ends_inside) {
            low += length;
            length = min(2.0 * length, 1.0 - low);
        } else {
            length = 0.5 * length;
        }
    }
    return -1.0;
}

// The weights of the four coefficients along an axis at x, and their derivatives.
fn weights_at(x: f32) -> vec4<f32> {
    let y = 1.0 - x;
    return vec4<f32>(y * y * y, (3.0 * x - 6.0) * x * x + 4.0, (3.0 * y - 6.0) * y * y + 4.0, x * x * x) / 6.0;
}

fn slopes_at(x: f32) -> vec4<f32> {
    let y = 1.0 - x;
    return vec4<f32>(-0.5 * y * y, (1.5 * x - 2.0) * x, (2.0 - 1.5 * y) * y, 0.5 * x * x);
}

// The spline's gradient at a point of a cell, in index space, and its value.
fn gradient_and_value(cell: vec3<i32>, local: vec3<f32>) -> vec4<f32> {
    let wx = weights_at(local.x);
    let wy = weights_at(local.y);
    let wz = weights_at(local.z);
    let dx = slopes_at(local.x);
    let dy = slopes_at(local.y);
    let dz = slopes_at(local.z);
    var all = vec4<f32>(0.0);
    for (var z = 0; z < 4; z++) {
        let front = rows_at(cell + vec3<i32>(-1, -1, z - 1));
        let back = rows_at(cell + vec3<i32>(-1, 1, z - 1));
        let rows = vec4<f32>(dot(front.first, wx), dot(front.second, wx), dot(back.first, wx), dot(back.second, wx));
        let slopes = vec4<f32>(dot(front.first, dx), dot(front.second, dx), dot(back.first, dx), dot(back.second, dx));
        let value = dot(rows, wy);
        all += vec4<f32>(dot(slopes, wy) * wz[z], dot(rows, dy) * wz[z], value * dz[z], value * wz[z]);
    }
    return all;
}

fn value_in(cell: vec3<i32>, local: vec3<f32>) -> f32 {
    return gradient_and_value(cell, local).w;
}

// The gradient that shades.
fn gradient_at(cell: vec3<i32>, local: vec3<f32>) -> vec3<f32> {
    return gradient_and_value(cell, local).xyz;
}
