// Lines toward the light.
// The twin of renderer/src/cpu/to_light.rs.

#import constants, line, volume, cuts

// A line from what a pixel shows toward the light, and what cuts leave of it.
struct ToLight {
    line: Line,
    part: Kept,
}

// From depth s, and a little nearer to the light.
fn to_light(line: Line, world_line: Line, s: f32) -> ToLight {
    let seen = line_at(line, s);
    let seen_mm = line_at(world_line, s);
    let start_mm = two_sum(seen_mm.hi, seen_mm.lo + params.shadow_start * params.toward_light);
    return ToLight(
        Line(two_sum(seen.hi, seen.lo + params.shadow_start * params.to_light.hi), params.to_light),
        kept(Line(start_mm, Double(params.toward_light, vec3<f32>(0.0)))),
    );
}

// Depth at which each block's nearest brick begins, as the light sees it, row by row.
@group(0) @binding(LIGHT_SPANS) var<storage, read> light_spans: array<f32>;

// How far from a point in index space toward the light a surface can lie, mm.
fn until_light(p: vec3<f32>) -> f32 {
    let seen = params.to_light_spans * p + params.light_spans_origin;
    let block = vec2<u32>(clamp(vec2<i32>(floor(seen.xy)), vec2<i32>(0), vec2<i32>(params.light_blocks) - 1));
    return seen.z - light_spans[block.y * params.light_blocks.x + block.x];
}
