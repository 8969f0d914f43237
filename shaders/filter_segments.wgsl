// The solver `filter` in one of many cells, whose corners are blocks of 2×2×2 samples of a texture, with the sign of the values turned or
// not.

#import constants, filter, cubic

@group(0) @binding(SEGMENT_CELLS) var blocks: texture_3d<f32>;
@group(0) @binding(SAMPLER) var trilinear_filter: sampler;

// The interpolant at a point of the cell whose lowest sample is at `block`.
fn filtered(block: vec3<u32>, p: vec3<f32>) -> f32 {
    let texel = (vec3<f32>(block) + p + 0.5) / vec3<f32>(textureDimensions(blocks));
    return textureSampleLevel(blocks, trilinear_filter, texel, 0.0).r;
}

fn entry_of(cell: u32, sign: f32, p: vec3<f32>, q: vec3<f32>) -> f32 {
    let count = textureDimensions(blocks) / 2u;
    let block = 2u * vec3<u32>(cell % count.x, cell / count.x % count.y, cell / (count.x * count.y));
    let step = (q - p) / 3.0;
    let f = vec4<f32>(filtered(block, p), filtered(block, p + step), filtered(block, q - step), filtered(block, q));
    return cubic_entry(cubic_through(sign * f));
}
