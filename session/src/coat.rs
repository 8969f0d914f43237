//! Colours that a surface wears in a picture: those of a map of it.

use crate::print::Legend;
use bregma_field::WorldPoint;
use bregma_renderer::{Color, Light, Picture, Reconstruction, Scene, stroke};
use fast_srgb8::{f32_to_srgb8, srgb8_to_f32};
use std::fmt::Debug;

/// A map with its colours, for the picture.
pub trait Coat: Debug + Send + Sync {
    /// Paints `picture`, drawn of [`white`] through a point of its pixels.
    fn paint(&self, picture: &mut Picture, scene: &Scene, through: [f64; 2]);

    /// The colour of a point of its surface, sRGB; none where the map is of no such point.
    fn color_at(&self, point: WorldPoint) -> Option<[u8; 3]>;

    /// What the map says at a point of its surface, in words.
    fn told_at(&self, point: WorldPoint) -> Option<String>;

    /// What its colours mean, on paper.
    fn legend(&self) -> Legend;
}

/// RGB pixels, their width and their height.
pub type Figure = (Vec<u8>, u32, u32);

/// The scene that a map is painted on: the surface white, without highlights, and lit enough on all sides for its colours to be read.
pub fn white(mut scene: Scene) -> Scene {
    // The mesh is the interpolant's.
    scene.reconstruction = Reconstruction::Trilinear;
    scene.light = Light { ambient: 0.4, diffuse: 0.6, specular: 0.0, ..scene.light };
    scene.layers.iter_mut().for_each(|layer| layer.color = Color([1.0; 3]));
    scene
}

/// What each pixel of `picture` shows of the surface; `None` beside it.
pub fn seen<T>(picture: &Picture, scene: &Scene, [dx, dy]: [f64; 2], what: impl Fn(WorldPoint) -> T) -> Vec<Option<T>> {
    let (width, height) = (picture.width, picture.height);
    let at = |n: usize| {
        let (x, y) = (n as u32 % width, n as u32 / width);
        let ray = scene.camera.ray(f64::from(x) + dx, f64::from(y) + dy, width, height);
        (picture.volume_id[n] != 0).then(|| what(ray.at(f64::from(picture.depth_mm[n]))))
    };
    (0..picture.rgba.len()).map(at).collect()
}

/// How much wider than a scan's own line that of a map is, so that its colours are told.
const WIDER: f32 = 2.0;

/// Draws the contour of a layer on a slice in the colours of a map of its surface, wider than it is: what the map knows nothing of stays.
pub fn on_slice(coat: &dyn Coat, layer: usize, picture: &mut Picture, scene: &Scene) {
    if scene.slice.contour_px <= 0.0 {
        return;
    }
    let (width, height) = (picture.width, picture.height);
    let on_plane = |x: f32, y: f32| {
        let ray = scene.camera.ray(f64::from(x), f64::from(y), width, height);
        // Rays of a slice are parallel, and its plane lies across them through the target.
        ray.at((scene.camera.target_mm - ray.origin.0).dot(ray.direction))
    };
    let own = picture.contours.iter().filter(|contour| usize::from(contour.volume_id) == layer + 1);
    let colored = own.flat_map(|contour| &contour.segments).filter_map(|segment| {
        let [x0, y0, x1, y1] = *segment;
        let color = coat.color_at(on_plane(0.5 * (x0 + x1), 0.5 * (y0 + y1)))?;
        Some((*segment, Color(color.map(|c| f32::from(c) / 255.0))))
    });
    let segments: Vec<([f32; 4], Color)> = colored.collect();
    stroke(picture, &segments, WIDER * scene.slice.contour_px);
}

/// How much of a surface has a value, of that which most of it has: the height of a histogram beside a legend. By the ends of all bins and the area
/// in each.
pub fn share([first, last]: [f64; 2], bins_mm2: &[f64], value: f64) -> Option<f64> {
    let bin = (value - first) / (last - first).max(f64::MIN_POSITIVE) * bins_mm2.len() as f64;
    let largest = bins_mm2.iter().fold(f64::MIN_POSITIVE, |m, b| m.max(*b));
    (0.0..bins_mm2.len() as f64).contains(&bin).then(|| bins_mm2[bin as usize] / largest)
}

/// Light that falls on white, on a colour (sRGB).
pub fn dye(pixel: &mut [u8; 4], color: [u8; 3]) {
    for (channel, value) in pixel.iter_mut().zip(color) {
        *channel = f32_to_srgb8(srgb8_to_f32(*channel) * srgb8_to_f32(value));
    }
}

/// A figure with a picture at its left, over what was drawn there.
pub fn beside(picture: &Picture, mut rgb: Vec<u8>, width: u32, height: u32) -> Figure {
    for (row, line) in picture.rgba.chunks(picture.width as usize).enumerate() {
        let start = row * width as usize * 3;
        for (n, [r, g, b, _]) in line.iter().enumerate() {
            rgb[start + 3 * n..start + 3 * n + 3].copy_from_slice(&[*r, *g, *b]);
        }
    }
    (rgb, width, height)
}
