//! The contours of isosurfaces on a slice: where they cross the ways between nodes, joined within each square of four.

use super::{NO_CROSSING, NodeBand, Nodes};
use crate::frame::{Frame, FrameLayer};

/// The contour of a layer's isosurface on a slice.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// 1-based layer.
    pub volume_id: u8,
    /// From x, y to x, y in pixels, measured from the middle of the first pixel. Their ends lie on the surface to 1e-3 pixel.
    pub segments: Vec<[f32; 4]>,
}

/// The segments of each layer between `rows` rows of nodes, of which the first is row `first` of the picture's, in pixels.
pub(super) fn segments(frame: &Frame, nodes: &NodeBand<'_>, first: usize, rows: usize, per_pixel: u32) -> Vec<Vec<[f32; 4]>> {
    // Nodes of a pixel lie evenly about its middle.
    let (scale, shift) = (1.0 / per_pixel as f32, 0.5 / per_pixel as f32 - 0.5);
    let in_pixels = |[x, y]: [f32; 2]| [x * scale + shift, (y + first as f32) * scale + shift];
    let of_layer = |(layer, of): (&Nodes<'_>, &FrameLayer)| {
        let width = nodes.width;
        // A way is the top or the left side of the square at its node, and another's bottom or right side.
        let around = layer.crossed.iter().flat_map(|&n| [Some(n), n.checked_sub(width), n.checked_sub(1)]).flatten();
        let mut squares: Vec<usize> = around.filter(|n| n % width + 1 < width && n / width + 1 < rows).collect();
        squares.sort_unstable();
        squares.dedup();
        let mut segments = Vec::with_capacity(squares.len());
        for n in squares {
            // Top, left, right, bottom.
            let sides = [layer.crossings[n][0], layer.crossings[n][1], layer.crossings[n + 1][1], layer.crossings[n + width][0]];
            let square = [n, n + 1, n + width, n + width + 1].map(|n| layer.values[n] - of.appearance.contour);
            for [from, to] in within(sides, square).into_iter().flatten() {
                let at = |[dx, dy]: [f32; 2]| in_pixels([(n % width) as f32 + dx, (n / width) as f32 + dy]);
                let ([x0, y0], [x1, y1]) = (at(from), at(to));
                segments.push([x0, y0, x1, y1]);
            }
        }
        segments
    };
    nodes.layers.iter().zip(&frame.layers).map(of_layer).collect()
}

/// The one or two segments within a square whose sides are crossed there (top, left, right, bottom), whose corners have these values relative to
/// the contour (upper left, upper right, lower left, lower right); in the square's own coordinates.
fn within(sides: [f32; 4], [a, b, c, d]: [f32; 4]) -> [Option<[[f32; 2]; 2]>; 2] {
    let [top, left, right, bottom] = [[sides[0], 0.0], [0.0, sides[1]], [1.0, sides[2]], [sides[3], 1.0]];
    if sides.iter().all(|side| *side >= 0.0) {
        // Which corners are joined is what a bilinear value has at its saddle
        // (Nielson and Hamann 1991).
        let saddle = (a * d - b * c) / (a + d - b - c);
        let joins_a = (saddle >= 0.0) == (a >= 0.0);
        return if joins_a { [Some([top, right]), Some([left, bottom])] } else { [Some([top, left]), Some([right, bottom])] };
    }
    let mut ends = [top, left, right, bottom].into_iter().zip(sides).filter(|(_, side)| *side > NO_CROSSING).map(|(end, _)| end);
    // At the scan's border a side may have no value.
    [ends.next().zip(ends.next()).map(|(from, to)| [from, to]), None]
}

/// The contours of the layers of a frame, from the segments of each band.
pub(super) fn of_layers(frame: &Frame, bands: Vec<Vec<Vec<[f32; 4]>>>) -> Vec<Contour> {
    let mut contours: Vec<Contour> =
        frame.layers.iter().map(|layer| Contour { volume_id: (layer.placement.index + 1) as u8, segments: vec![] }).collect();
    for band in bands {
        contours.iter_mut().zip(band).for_each(|(contour, mut segments)| contour.segments.append(&mut segments));
    }
    contours
}
