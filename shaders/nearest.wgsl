// Which of a pixel's hits, one of each pass, are drawn.
// The twin of renderer/src/cpu/nearest.rs.

#import constants, hits

const NO_PASS: u32 = 0xffffffffu;

// The pass with the nearest hit, leaving out one; NO_PASS when there is none.
fn nearest(index: u32, skip: u32, passes: u32, stride: u32) -> u32 {
    var best = NO_PASS;
    var best_s = 0.0;
    for (var l = 0u; l < passes; l++) {
        let s = hits[l * stride + index].w;
        if l != skip && s >= 0.0 && (best == NO_PASS || s < best_s) {
            best = l;
            best_s = s;
        }
    }
    return best;
}
