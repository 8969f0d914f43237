//! Contours as lines of a width over a picture.

use crate::color::Color;
use crate::frame::Frame;
use crate::picture::Picture;
use crate::scene::Scene;
use crate::skip::BLOCK;
use fast_srgb8::{f32_to_srgb8, srgb8_to_f32};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Of a lone scan's contour, and where contours agree: bone's colour is not told from dense bone.
const AMBER: Color = Color([0.95, 0.75, 0.3]);

/// How far the lines of the layers cover a pixel.
#[derive(Clone, Copy, Default)]
struct Cover {
    /// The most, of the layer of that number, and the most of another one.
    most: f32,
    layer: u8,
    second: f32,
}

/// Draws the segments of each band and layer. A pixel is covered as far as the line reaches into it, measured along the line's normal from its
/// middle: an edge one pixel wide.
pub(super) fn draw(frame: &Frame, scene: &Scene, bands: &[Vec<Vec<[f32; 4]>>], picture: &mut Picture) {
    let half = scene.slice.contour_px / 2.0;
    if half <= 0.0 {
        return;
    }
    let amber = AMBER.linear();
    let is_alone = frame.layers.len() == 1;
    let width = picture.width as usize;
    // So many bands above and below reach into one.
    let reach = ((half + 0.5) / BLOCK as f32).ceil() as usize;
    picture.rgba.par_chunks_mut(BLOCK as usize * width).enumerate().for_each(|(row, rgba)| {
        let size = [row * BLOCK as usize, width, rgba.len() / width];
        let near = &bands[row.saturating_sub(reach)..(row + reach + 1).min(bands.len())];
        if near.iter().all(|band| band.iter().all(Vec::is_empty)) {
            return;
        }
        let mut covers = vec![Cover::default(); rgba.len()];
        for n in 0..frame.layers.len() {
            near.iter().flat_map(|band| &band[n]).for_each(|segment| put(segment, half, n as u8, &mut covers, size));
        }
        for (pixel, cover) in rgba.iter_mut().zip(&covers).filter(|(_, cover)| cover.most > 0.0) {
            let own = if is_alone { amber } else { frame.layers[usize::from(cover.layer)].appearance.color };
            let color = own.lerp(amber, cover.second / cover.most);
            *pixel = over(*pixel, color, cover.most);
        }
    });
}

/// Draws segments of a picture's contours over it, `width_px` wide, each in a colour of its own; where they meet, the one that covers more is seen.
pub fn stroke(picture: &mut Picture, segments: &[([f32; 4], Color)], width_px: f32) {
    let size = [0, picture.width as usize, picture.height as usize];
    let mut covers: Vec<(f32, usize)> = vec![(0.0, 0); picture.rgba.len()];
    for (n, (segment, _)) in segments.iter().enumerate() {
        each_covered(segment, width_px / 2.0, size, |at, covered| {
            if covered > covers[at].0 {
                covers[at] = (covered, n);
            }
        });
    }
    for (pixel, (covered, n)) in picture.rgba.iter_mut().zip(&covers).filter(|(_, (covered, _))| *covered > 0.0) {
        *pixel = over(*pixel, segments[*n].1.linear(), *covered);
    }
}

/// A line's colour over a pixel that it covers by so much. Over a clear background the line is as clear as it covers.
fn over(pixel: [u8; 4], color: Vec3, covered: f32) -> [u8; 4] {
    let alpha = (covered * 255.0).round() as u8;
    let below = Vec3::from([0, 1, 2].map(|a| srgb8_to_f32(pixel[a])));
    let mixed = if pixel[3] == 0 { color } else { below.lerp(color, covered) };
    let [r, g, b] = mixed.to_array().map(f32_to_srgb8);
    [r, g, b, pixel[3].max(alpha)]
}

/// Adds a segment of a layer to what is covered of the pixels of a band that begins at row `first`.
fn put(segment: &[f32; 4], half: f32, layer: u8, covers: &mut [Cover], size: [usize; 3]) {
    each_covered(segment, half, size, |at, covered| {
        let cover = &mut covers[at];
        if cover.most == 0.0 || cover.layer == layer {
            (cover.most, cover.layer) = (cover.most.max(covered), layer);
        } else if covered > cover.most {
            *cover = Cover { most: covered, layer, second: cover.most };
        } else {
            cover.second = cover.second.max(covered);
        }
    });
}

/// Tells each pixel of a band that begins at row `first` how far a segment of half a width covers it.
#[inline(always)]
fn each_covered([x0, y0, x1, y1]: &[f32; 4], half: f32, [first, width, rows]: [usize; 3], mut tell: impl FnMut(usize, f32)) {
    let reach = half + 0.5;
    let (a, b) = (Vec2::new(*x0, *y0 - first as f32), Vec2::new(*x1, *y1 - first as f32));
    let (low, high) = (a.min(b) - reach, a.max(b) + reach);
    let range = |low: f32, high: f32, count: usize| low.ceil().max(0.0) as usize..((high.floor() + 1.0).max(0.0) as usize).min(count);
    let along = b - a;
    // A segment without length is a point.
    let inverse = along.length_squared().max(f32::MIN_POSITIVE).recip();
    for y in range(low.y, high.y, rows) {
        for x in range(low.x, high.x, width) {
            let from = Vec2::new(x as f32, y as f32) - a;
            let share = (from.dot(along) * inverse).clamp(0.0, 1.0);
            let away = (from - share * along).length_squared();
            if away < reach * reach {
                tell(y * width + x, (reach - away.sqrt()).min(1.0));
            }
        }
    }
}
