// The solver `filter`: the interpolant as the hardware's trilinear filter has it, at four points of the chord. It exists on the GPU only.

// Bernstein coefficients of the cubic that has the values f at u = 0, 1/3, 2/3 and 1.
fn cubic_through(f: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(
        f.x,
        (-5.0 * f.x + 18.0 * f.y - 9.0 * f.z + 2.0 * f.w) / 6.0,
        (2.0 * f.x - 9.0 * f.y + 18.0 * f.z - 5.0 * f.w) / 6.0,
        f.w,
    );
}
