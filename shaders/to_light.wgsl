// Lines toward the light.
// The twin of `to_light` in renderer/src/cpu/shadows.rs.

#import line, volume, cuts

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
