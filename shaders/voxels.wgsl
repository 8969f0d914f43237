// Samples as they are: each stands for the box of a voxel's size around it, along a ray's way through a cell.
// The twin of renderer/src/roots/voxels.rs, which says why.

#import constants, interpolant, cells, samples

// The corner value in whose box a segment is, by the sides of the middle that it is on.
fn corner_in(lower: vec4<f32>, upper: vec4<f32>, high: vec3<bool>) -> f32 {
    let layer = select(lower, upper, high.z);
    let row = select(layer.xy, layer.zw, high.y);
    return select(row.x, row.y, high.x);
}

// The first entry into the box of a sample that is inside; less than 0 where there is none.
fn entry_in(way: CellPass) -> f32 {
    let u = (VOXEL_MIDDLE - way.start) / (way.end - way.start);
    let passes = u >= vec3<f32>(0.0) & u <= vec3<f32>(1.0);
    let passed = select(vec3<f32>(VOXEL_NEVER), u, passes);
    let begins_high = (passes & way.end < way.start) | (!passes & way.start > vec3<f32>(VOXEL_MIDDLE));
    let low = min(passed.x, passed.y);
    let far = max(passed.x, passed.y);
    let sorted = array<f32, 4>(0.0, min(low, passed.z), min(max(low, passed.z), far), max(far, passed.z));
    for (var n = 0u; n < 4u; n++) {
        let high = begins_high != (passed <= vec3<f32>(sorted[n]));
        if sorted[n] <= 1.0 && inside(corner_in(way.lower, way.upper, high)) {
            return sorted[n];
        }
    }
    return -1.0;
}

// The value at a point of a cell.
fn value_in(cell: vec3<i32>, local: vec3<f32>) -> f32 {
    return corner_in(corners(cell), corners(cell + vec3<i32>(0, 0, 1)), local > vec3<f32>(VOXEL_MIDDLE));
}

// The axis across which a hit lies on a box: that whose middle plane is nearest.
fn gradient_at(cell: vec3<i32>, local: vec3<f32>) -> vec3<f32> {
    let away = abs(local - VOXEL_MIDDLE);
    if away.x <= away.y && away.x <= away.z {
        return vec3<f32>(1.0, 0.0, 0.0);
    }
    return select(vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(0.0, 1.0, 0.0), away.y <= away.z);
}
