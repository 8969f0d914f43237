// What of the light comes to surfaces: none where an opaque one lies between, hard.
// The twin of renderer/src/cpu/shadows.rs.

#import constants, line, volume, blocks, hits, nearest, walk, to_light

// For each pixel FIRST_IS_DARK and SECOND_IS_DARK.
@group(0) @binding(SHADOWS) var<storage, read_write> shadows: array<u32>;

// Whether bone of this volume lies between what a pixel draws and the light.
@compute @workgroup_size(BLOCK_PIXELS)
fn shadow(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    read_params();
    let block = block_of(group.x);
    let index = group.x * BLOCK_PIXELS + n;
    var dark = select(shadows[index], 0u, params.pass_number == 0u);
    let pixel = block.pixel + pixel_in_block(n);
    let line = line_of(pixel);
    let world_line = world_line_of(pixel);
    var drawn = nearest(index, NO_PASS, params.passes, params.stride);
    var bit = FIRST_IS_DARK;
    while drawn != NO_PASS {
        let hit = hits[drawn * params.stride + index];
        // What is turned away from the light has none; without a normal it is seen from the front.
        let is_turned_away = dot(hit.xyz, params.toward_light) <= 0.0 && any(hit.xyz != vec3<f32>(0.0));
        if (dark & bit) == 0u && !is_turned_away && hit.y != FACE {
            let lit = to_light(line, world_line, hit.w);
            let s_max = min(until_light(line_at(line, hit.w).hi), lit.part.end);
            dark |= select(0u, bit, first_hit(lit.line, lit.part.begin, 0.0, s_max).met != MISSED);
        }
        if bit == SECOND_IS_DARK || params.only_nearest == 1u {
            break;
        }
        drawn = nearest(index, drawn, params.passes, params.stride);
        bit = SECOND_IS_DARK;
    }
    shadows[index] = dark;
}
