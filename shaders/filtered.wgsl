// The interpolant as the hardware's trilinear filter has it, for the solver `filter`.

#import constants, volume

@group(0) @binding(SAMPLER) var trilinear_filter: sampler;

// The value at a point of the brick, relative to the level as corner values are. Sample (i, j, k) is the centre of its texel.
fn filtered(corner: vec3<i32>, p: vec3<f32>) -> f32 {
    let texel = (vec3<f32>(corner) + p + 0.5) / vec3<f32>(params.dims);
    return params.sign * (textureSampleLevel(samples_0, trilinear_filter, texel, 0.0).r - params.level);
}
