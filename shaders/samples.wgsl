// The samples of the volume at hand, relative to its level and positive inside.
// The twin of renderer/src/cpu/samples.rs.

#import volume

// Values at (0,0), (1,0), (0,1) and (1,1) from a sample in its layer; those beyond the grid are the nearest in it.
fn corners(at: vec3<i32>) -> vec4<f32> {
    return params.sign * (texels(at) - params.level);
}
