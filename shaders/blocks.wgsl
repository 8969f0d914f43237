// The blocks of 8 × 8 pixels in which something may be seen, a workgroup each. The twin of renderer/src/gpu/blocks.rs.

#import constants

struct Block {
    // Its first pixel.
    pixel: vec2<u32>,
    // Nearest and farthest depth; the first is the larger where there is nothing.
    span: vec2<f32>,
}

// For each block of the batch one of these for each volume that is drawn, side by side.
@group(0) @binding(BLOCKS) var<storage, read> blocks: array<Block>;

// The pixel of invocation n. Invocations that run side by side, be it 4, 8, 16 or 32, have pixels that lie close together.
fn pixel_in_block(n: u32) -> vec2<u32> {
    return vec2<u32>((n & 3u) | ((n >> 1u) & 4u), ((n >> 2u) & 1u) | ((n >> 3u) & 6u));
}
