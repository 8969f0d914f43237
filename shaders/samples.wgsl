// The samples of a scan, relative to the level and positive inside. SAMPLE is replaced by u32, i32 or f32, the component type of the
// scan's texture, which has a layer for each k.

@group(0) @binding(1) var samples: texture_2d_array<SAMPLE>;
@group(0) @binding(4) var nearest_texels: sampler;

// Values at (0,0), (1,0), (0,1) and (1,1) from a sample in its layer, four texels in one fetch; those beyond the grid are the nearest in
// it.
fn corners(at: vec3<i32>) -> vec4<f32> {
    // The middle of the four: no rounding comes near the next texel.
    let middle = vec2<f32>(at.xy + 1) / vec2<f32>(params.dims.xy);
    // A layer beyond the grid is not clamped in every language that this is turned into.
    let layer = clamp(at.z, 0, params.dims.z - 1);
    let texels = vec4<f32>(textureGather(0, samples, nearest_texels, middle, layer));
    return params.sign * (texels.wzxy - params.level);
}
