// The samples of a scan as in samples.wgsl, of a 3D texture: what the solver `filter` needs, and scans of more layers than a texture
// array has. SAMPLE is replaced by u32, i32 or f32, the component type of the texture.

@group(0) @binding(1) var samples: texture_3d<SAMPLE>;

fn relative(at: vec3<i32>) -> f32 {
    return params.sign * (f32(textureLoad(samples, clamp(at, vec3<i32>(0), params.dims - 1), 0).r) - params.level);
}

// Values at (0,0), (1,0), (0,1) and (1,1) from a sample in its layer; those beyond the grid are the nearest in it.
fn corners(at: vec3<i32>) -> vec4<f32> {
    return vec4<f32>(
        relative(at),
        relative(at + vec3<i32>(1, 0, 0)),
        relative(at + vec3<i32>(0, 1, 0)),
        relative(at + vec3<i32>(1, 1, 0)),
    );
}
