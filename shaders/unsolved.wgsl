// Instead of a solver, to time a walk that fetches but does not solve: never an entry, though no compiler knows.

#import line

fn never(bits: vec4<u32>) -> f32 {
    return bitcast<f32>(0xbf800000u ^ ((bits.x ^ bits.y ^ bits.z ^ bits.w) & zero));
}

fn first_entry(lower: vec4<f32>, upper: vec4<f32>, p: vec3<f32>, q: vec3<f32>) -> f32 {
    return never(bitcast<vec4<u32>>(lower) ^ bitcast<vec4<u32>>(upper));
}

fn cubic_entry(b: vec4<f32>) -> f32 {
    return never(bitcast<vec4<u32>>(b));
}
