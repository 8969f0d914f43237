// The solver `exact`: where a ray first crosses the isosurface within one cell.
// The twin of renderer/src/roots/exact.rs.

#import bernstein, cubic

// The first u in [0, 1] where the interpolant enters the inside; negative when it stays outside.
fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    return cubic_entry(bernstein(lower, upper, p, q));
}
