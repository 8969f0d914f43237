// The samples of a scan, relative to the level and positive inside. SAMPLE is replaced by u32, i32 or f32, the component type of the
// scan's texture.

@group(0) @binding(1) var samples: texture_3d<SAMPLE>;

fn relative(at: vec3<i32>) -> f32 {
    return params.sign * (f32(textureLoad(samples, at, 0).r) - params.level);
}
