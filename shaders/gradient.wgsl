// Gradients of the interpolant in index space: its own, and a smooth one.
// The twin of renderer/src/cpu/gradient.rs.

#import volume, interpolant, samples

// The gradient that shades, in index space.
fn gradient_at(cell: vec3<i32>, local: vec3<f32>) -> vec3<f32> {
    if params.analytic_normals == 1u {
        return gradient(corners(cell), corners(cell + vec3<i32>(0, 0, 1)), local);
    }
    return smooth_gradient(cell, local);
}

// The value at a point of a cell.
fn value_in(cell: vec3<i32>, local: vec3<f32>) -> f32 {
    return trilinear(corners(cell), corners(cell + vec3<i32>(0, 0, 1)), local);
}

// Gradient at a point of a cell, in index space and pointing inward: central differences of samples, one-sided at the grid's border,
// interpolated. Differences come first: where all samples are equal nothing is left, however a driver rounds.
fn smooth_gradient(cell: vec3<i32>, local: vec3<f32>) -> vec3<f32> {
    let low = around(cell, local.xy);
    let high = around(cell + vec3<i32>(0, 0, 1), local.xy);
    let below = corners(cell - vec3<i32>(0, 0, 1));
    let above = corners(cell + vec3<i32>(0, 0, 2));
    let x = mix(low.along_x, high.along_x, local.z);
    let y = mix(low.along_y, high.along_y, local.z);
    let z = vec2<f32>(bilinear(high.corners - below, local.xy), bilinear(above - low.corners, local.xy));
    // At the border the sample beyond is the one at the border.
    let at_low = select(vec3<f32>(0.5), vec3<f32>(1.0), cell == vec3<i32>(0)) * vec3<f32>(x.x, y.x, z.x);
    let at_high = select(vec3<f32>(0.5), vec3<f32>(1.0), cell == params.dims - 2) * vec3<f32>(x.y, y.y, z.y);
    return mix(at_low, at_high, local);
}

// In a layer of samples, along each axis the differences around a cell's lower samples and around its higher ones, interpolated across; and its
// corners there.
struct Around {
    along_x: vec2<f32>,
    along_y: vec2<f32>,
    corners: vec4<f32>,
}

fn around(cell: vec3<i32>, local: vec2<f32>) -> Around {
    let low_low = corners(cell + vec3<i32>(-1, -1, 0));
    let high_low = corners(cell + vec3<i32>(1, -1, 0));
    let low_high = corners(cell + vec3<i32>(-1, 1, 0));
    let high_high = corners(cell + vec3<i32>(1, 1, 0));
    return Around(
        mix(high_low.zw - low_low.zw, high_high.xy - low_high.xy, local.y),
        mix(low_high.yw - low_low.yw, high_high.xz - high_low.xz, local.x),
        vec4<f32>(low_low.w, high_low.z, low_high.y, high_high.x),
    );
}

fn bilinear(v: vec4<f32>, p: vec2<f32>) -> f32 {
    return mix(mix(v.x, v.y, p.x), mix(v.z, v.w, p.x), p.y);
}
