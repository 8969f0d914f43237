// The gradient of the trilinear interpolant of corner values, in index space.
// The twin of `gradient` in renderer/src/cpu/project.rs.

fn gradient(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        blend(blend(lower.y - lower.x, lower.w - lower.z, p.y), blend(upper.y - upper.x, upper.w - upper.z, p.y), p.z),
        blend(blend(lower.z - lower.x, lower.w - lower.y, p.x), blend(upper.z - upper.x, upper.w - upper.y, p.x), p.z),
        blend(blend(upper.x - lower.x, upper.y - lower.y, p.x), blend(upper.z - lower.z, upper.w - lower.w, p.x), p.y),
    );
}

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
