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
