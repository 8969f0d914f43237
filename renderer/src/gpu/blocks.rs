//! The blocks of 8 × 8 pixels in which something may be seen: the others have no invocations, and take no time.
//!
//! The twin of `shaders/blocks.wgsl`.

use super::layout::Block;
use crate::frame::FrameLayer;
use crate::skip::BLOCK;

/// Pixels of a block.
pub(super) const BLOCK_PIXELS: usize = (BLOCK * BLOCK) as usize;

/// The pixel of a block that invocation `n` draws, from its first.
pub(super) fn pixel_in_block(n: u32) -> [u32; 2] {
    [n & 3 | n >> 1 & 4, n >> 2 & 1 | n >> 3 & 6]
}

/// The first pixels of the blocks in which any of `layers` may be seen, row by row: first the rows with an even number, then the odd, and
/// within these halves so again. llvmpipe gives each of its threads one part of a dispatch, one after the other, and these parts are to
/// cost alike, be the surface at the top of the picture or at the bottom.
pub(super) fn seen(layers: &[&FrameLayer]) -> Vec<[u32; 2]> {
    let Some(first) = layers.first() else { return vec![] };
    let across = first.skip.spans.across;
    let mut rows: Vec<u32> = (0..first.skip.spans.blocks.len() as u32 / across).collect();
    rows.sort_unstable_by_key(|row| row.reverse_bits());
    let is_seen = |&[x, y]: &[u32; 2]| {
        layers.iter().any(|l| {
            let [near, far] = l.skip.spans.at(x, y);
            near <= far
        })
    };
    rows.into_iter().flat_map(|row| (0..across).map(move |column| [column * BLOCK, row * BLOCK])).filter(is_seen).collect()
}

/// For each of the blocks that begin at `pixels` what passes over each of `layers` read of it, side by side.
pub(super) fn spans(layers: &[&FrameLayer], pixels: &[[u32; 2]]) -> Vec<Block> {
    let of_all = |&pixel: &[u32; 2]| layers.iter().map(move |layer| Block { pixel, span: layer.skip.spans.at(pixel[0], pixel[1]) });
    pixels.iter().flat_map(of_all).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invocations_side_by_side_have_all_pixels_of_a_compact_part_of_the_block() {
        // Fails if a bit of an invocation's number goes nowhere, or to where another one goes: pixels would be missing.
        for (count, width, height) in [(4, 4, 1), (8, 4, 2), (16, 8, 2), (32, 8, 4), (64, 8, 8)] {
            let mut pixels: Vec<_> = (0..count).map(pixel_in_block).map(|[x, y]| y * width + x).collect();
            pixels.sort_unstable();
            assert_eq!(pixels, (0..width * height).collect::<Vec<_>>());
        }
    }
}
