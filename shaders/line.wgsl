// A pixel's ray in index space as pairs of float32, since a GPU has no float64: the value is hi + lo.
// The twin of renderer/src/cpu/line.rs; `PixelAffine` is that of renderer/src/camera.rs.
//
// Every product that must be exact is of factors short enough to be so, and is therefore the same whether or not a driver
// fuses it with the sum that follows.

struct Double {
    hi: vec3<f32>,
    lo: vec3<f32>,
}

// A point that moves linearly with the pixel. The hi parts of per_x and per_y have 16 significant bits, so that their products
// with 8 bits of a pixel's number are exact.
struct PixelAffine {
    base_hi: vec3<f32>,
    base_lo: vec3<f32>,
    per_x_hi: vec3<f32>,
    per_x_lo: vec3<f32>,
    per_y_hi: vec3<f32>,
    per_y_lo: vec3<f32>,
}

// An affine map, by its columns.
struct Affine {
    x: Double,
    y: Double,
    z: Double,
    at: Double,
}

struct Line {
    origin: Double,
    direction: Double,
}

// Always 0, but only known when the shader runs: a pass takes it from its parameters.
var<private> zero: u32;

// v, by a detour that no compiler sees through. Drivers may rearrange sums as if they were exact (Mesa's do), and then nothing would be left
// of what rounding lost.
fn opaque(v: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(v) | vec3<u32>(zero));
}

// a + b and what rounding lost of it (Knuth, TAOCP 2, 4.2.2, theorem B).
fn two_sum(a: vec3<f32>, b: vec3<f32>) -> Double {
    let sum = opaque(a + b);
    let b_part = opaque(sum - a);
    let a_part = opaque(sum - b_part);
    return Double(sum, (a - a_part) + (b - b_part));
}

// The value at a pixel, whose numbers are below 65536.
fn at_pixel(a: PixelAffine, pixel: vec2<u32>) -> Double {
    let coarse = vec2<f32>(pixel & vec2<u32>(0xff00u));
    let within = vec2<f32>(pixel & vec2<u32>(0xffu));
    let first = two_sum(a.base_hi, coarse.x * a.per_x_hi);
    let second = two_sum(first.hi, coarse.y * a.per_y_hi);
    let third = two_sum(second.hi, within.x * a.per_x_hi);
    let fourth = two_sum(third.hi, within.y * a.per_y_hi);
    let p = vec2<f32>(pixel);
    let lo = (first.lo + second.lo) + (third.lo + fourth.lo) + a.base_lo + p.x * a.per_x_lo + p.y * a.per_y_lo;
    return two_sum(fourth.hi, lo);
}

// The upper 12 significant bits: products of two such numbers are exact.
fn upper(v: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(v) & vec3<u32>(0xfffff000u));
}

// The point at s.
fn line_at(line: Line, s: f32) -> Double {
    let s_hi = upper(vec3<f32>(s));
    let s_lo = vec3<f32>(s) - s_hi;
    let d_hi = upper(line.direction.hi);
    let d_lo = line.direction.hi - d_hi;
    let sum = two_sum(line.origin.hi, s_hi * d_hi);
    let small = (s_hi * d_lo + s_lo * d_hi) + s_lo * d_lo + s * line.direction.lo;
    return Double(sum.hi, sum.lo + line.origin.lo + small);
}

// p relative to a corner with integer coordinates near it.
fn relative_to(p: Double, corner: vec3<f32>) -> vec3<f32> {
    return (p.hi - corner) + p.lo;
}
