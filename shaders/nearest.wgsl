// Which of a pixel's hits, one of each pass, are drawn.

// In the numbers that shadow rays leave.
const FIRST_IS_DARK: u32 = 1u;
const SECOND_IS_DARK: u32 = 2u;

// Greater than any part of a normal: what was hit is the face of a cut that shows values.
const FACE: f32 = 8.0;

const NONE: u32 = 0xffffffffu;

// The pass with the nearest hit, leaving out one; NONE when there is none.
fn nearest(index: u32, skip: u32) -> u32 {
    var best = NONE;
    var best_s = 0.0;
    for (var l = 0u; l < params.passes; l++) {
        let s = hits[l * params.stride + index].w;
        if l != skip && s >= 0.0 && (best == NONE || s < best_s) {
            best = l;
            best_s = s;
        }
    }
    return best;
}
