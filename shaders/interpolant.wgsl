// The trilinear interpolant of a cell. Corner x + 2y + 4z is at (x, y, z): lower holds the corners with z = 0, upper those with z = 1.
// The twin of renderer/src/roots/mod.rs.

// Inside bone: ties included, everywhere.
fn inside(v: f32) -> bool {
    return v >= 0.0;
}

// a at w = 0 to b at w = 1; keeps the sign that a and b share, which the builtin mix need not.
fn blend(a: f32, b: f32, w: f32) -> f32 {
    return a * (1.0 - w) + b * w;
}

fn trilinear(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>) -> f32 {
    let y0z0 = blend(lower.x, lower.y, p.x);
    let y1z0 = blend(lower.z, lower.w, p.x);
    let y0z1 = blend(upper.x, upper.y, p.x);
    let y1z1 = blend(upper.z, upper.w, p.x);
    return blend(blend(y0z0, y1z0, p.y), blend(y0z1, y1z1, p.y), p.z);
}

// Its gradient; in Rust it stands in renderer/src/cpu/gradient.rs. Splines, which have another, need it of solids.
fn gradient(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        blend(blend(lower.y - lower.x, lower.w - lower.z, p.y), blend(upper.y - upper.x, upper.w - upper.z, p.y), p.z),
        blend(blend(lower.z - lower.x, lower.w - lower.y, p.x), blend(upper.z - upper.x, upper.w - upper.y, p.x), p.z),
        blend(blend(upper.x - lower.x, upper.y - lower.y, p.x), blend(upper.z - lower.z, upper.w - lower.w, p.x), p.y),
    );
}
