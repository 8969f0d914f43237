//! Slices: what the plane through the camera's target, across its view, shows of the scans, with the contours of their surfaces. From the numbers
//! of its nodes to a picture, the same for both renderers.
//!
//! Nodes lie at the middles of pixels, or evenly closer where a pixel is larger than a voxel: then each pixel shows the mean of its own.

mod contour;
mod lines;
mod plane;

pub use contour::Contour;
pub use lines::stroke;
pub use plane::{BodyPlane, view_of_plane};

use crate::InstructionSet;
use crate::cpu::face_color;
use crate::frame::{Frame, FrameLayer};
use crate::lanes::{Doubles, Floats, Ints, LANES, Mask, numbers};
use crate::modes::RayValue;
use crate::named;
use crate::picture::Picture;
use crate::scene::{CutFace, Scene, Window};
use crate::skip::BLOCK;
use bregma_field::Surface;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

named! {
    /// What a thick slice shows of the values through its thickness.
    #[derive(Default)]
    pub enum Slab {
        /// Their mean.
        #[default]
        Mean = "mean",
        /// The largest.
        Max = "max",
        /// The smallest.
        Min = "min",
    }
}

impl Slab {
    pub(crate) fn sought(self) -> RayValue {
        match self {
            Self::Mean => RayValue::Mean,
            Self::Max => RayValue::Max,
            Self::Min => RayValue::Min,
        }
    }
}

/// How a slice is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Slice {
    /// How thick it is, half of it on either side of the plane, mm; 0 for the plane itself.
    pub thickness_mm: f64,
    /// What it shows of its thickness.
    pub slab: Slab,
    /// How values are coloured.
    pub face: CutFace,
    /// Which values are black and white; of Hounsfield units 1000 about 400, else all that the first scan holds when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// How wide the contours of the isosurfaces on the plane are drawn, pixels; 0 for none.
    pub contour_px: f32,
}

impl Default for Slice {
    fn default() -> Self {
        Self { thickness_mm: 0.0, slab: Slab::Mean, face: CutFace::Density, window: None, contour_px: 1.5 }
    }
}

impl Slice {
    /// What is sought through the thickness; none of the plane itself.
    pub(crate) fn sought(&self) -> Option<RayValue> {
        (self.thickness_mm > 0.0).then(|| self.slab.sought())
    }
}

/// A wider line is a bar.
pub const WIDEST_CONTOUR_PX: f32 = 64.0;

/// Nodes along a pixel's side: more than this, and what is smaller than a pixel goes unseen.
const MOST_NODES: u32 = 8;

/// How many nodes a pixel has along each side, so that they lie no farther apart than the samples of the finest scan.
pub(crate) fn nodes_per_pixel(scene: &Scene, surfaces: &[(usize, Surface)], [width, height]: [u32; 2]) -> u32 {
    let rays = scene.viewed_from().pixel_rays(width, height);
    let pixel_mm = rays.origin.per_x.length().max(rays.origin.per_y.length());
    let finest_mm = surfaces.iter().map(|(_, s)| s.grid.spacing_mm().min_element()).fold(f64::INFINITY, f64::min);
    // A hair less than a pixel's size is the size itself, rounded.
    ((pixel_mm / finest_mm - 1e-9).ceil() as u32).clamp(1, MOST_NODES)
}

/// What some rows of nodes know of one layer, node by node.
#[derive(Clone, Copy)]
pub(crate) struct Nodes<'a> {
    /// Relative to the level, in sample units; NaN outside of the scan.
    pub values: &'a [f32],
    /// Where the contour crosses the way to the right and to the lower neighbour, as a share of it; negative where it does not.
    pub crossings: &'a [[f32; 2]],
    /// The nodes at which a crossing begins, in any order, some twice.
    pub crossed: &'a [usize],
}

/// Where there is no crossing.
pub(crate) const NO_CROSSING: f32 = -1.0;

/// A row of blocks of a slice's picture, with the nodes of its pixels and one more row of them below, if there is one.
pub(crate) struct NodeBand<'a> {
    /// Nodes across.
    pub width: usize,
    /// Of each layer of the frame.
    pub layers: Vec<Nodes<'a>>,
}

/// Draws a slice in a blank picture band by band; `gather` gives a band of nodes from row `first` of them on to whom it is told, and may work in what `begin` makes for
/// each thread.
pub(crate) fn draw<W>(
    level: InstructionSet,
    frame: &Frame,
    scene: &Scene,
    mut picture: Picture,
    begin: impl Fn() -> W + Send + Sync,
    gather: impl Fn(&mut W, usize, usize, &mut dyn FnMut(&NodeBand<'_>)) + Send + Sync,
) -> Picture {
    let per_pixel = frame.nodes_per_pixel;
    let (width, height, background) = (picture.width, picture.height, scene.background_bytes());
    let band = BLOCK as usize * width as usize;
    let nodes_down = (height * per_pixel) as usize;
    let pixels = picture.rgba.par_chunks_mut(band).zip(picture.depth_mm.par_chunks_mut(band));
    let pixels = pixels.zip(picture.volume_id.par_chunks_mut(band)).zip(picture.values.par_chunks_mut(band));
    let segments: Vec<Vec<Vec<[f32; 4]>>> = pixels
        .enumerate()
        .map_init(begin, |work, (row, (((rgba, depth_mm), volume_id), values))| {
            let first = row * (BLOCK * per_pixel) as usize;
            let rows = (first + (BLOCK * per_pixel) as usize + 1).min(nodes_down) - first;
            rgba.fill(background);
            depth_mm.fill(f32::NAN);
            volume_id.fill(0);
            values.fill(f32::NAN);
            let mut segments = vec![];
            gather(work, first, rows, &mut |nodes| {
                let mut pixels = Pixels { rgba: &mut *rgba, depth_mm: &mut *depth_mm, volume_id: &mut *volume_id, values: &mut *values };
                paint(level, frame, scene, per_pixel as usize, nodes, &mut pixels, width as usize);
                segments = contour::segments(frame, nodes, first, rows, per_pixel);
            });
            segments
        })
        .collect();
    lines::draw(frame, scene, &segments, &mut picture);
    picture.contours = contour::of_layers(frame, segments);
    picture
}

/// A row of blocks of the picture.
struct Pixels<'a> {
    rgba: &'a mut [[u8; 4]],
    depth_mm: &'a mut [f32],
    volume_id: &'a mut [u8],
    values: &'a mut [f32],
}

/// Colours the pixels of a band by the values of their nodes.
fn paint(
    level: InstructionSet,
    frame: &Frame,
    scene: &Scene,
    per_pixel: usize,
    nodes: &NodeBand<'_>,
    pixels: &mut Pixels<'_>,
    width: usize,
) {
    let plane_mm = (frame.base_mm + scene.slice.thickness_mm / 2.0) as f32;
    if scene.slice.face == CutFace::Density {
        for (layer, nodes) in frame.layers.iter().zip(&nodes.layers) {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || paint_density(simd, layer, nodes, per_pixel, plane_mm, pixels, width),
            ));
        }
        return;
    }
    let mut there: Vec<(usize, f32)> = vec![];
    for at in 0..pixels.rgba.len() {
        there.clear();
        let (x, y) = (at % width, at / width);
        for (n, layer) in nodes.layers.iter().enumerate() {
            let value = mean(layer.values, nodes.width, [x, y], per_pixel);
            if !value.is_nan() {
                there.push((n, value));
            }
        }
        let Some(&(first, value)) = there.first() else { continue };
        let Some(color) = color(frame, scene, &there) else { continue };
        pixels.rgba[at] = color;
        let first = &frame.layers[first];
        pixels.depth_mm[at] = plane_mm;
        pixels.volume_id[at] = (first.placement.index + 1) as u8;
        pixels.values[at] = (first.appearance.value_at_level + f64::from(value) * first.appearance.value_scale) as f32;
    }
}

/// The usual case, row by row: brightnesses of a layer, which are encoded as they are, where no layer before has been.
#[inline(always)]
fn paint_density<S: Simd>(
    simd: S,
    layer: &FrameLayer,
    nodes: &Nodes<'_>,
    per_pixel: usize,
    plane_mm: f32,
    pixels: &mut Pixels<'_>,
    width: usize,
) {
    let [gain, offset] = layer.appearance.brightness.map(|v| v * 255.0);
    let (scale, at_level, id) = (layer.appearance.value_scale, layer.appearance.value_at_level, (layer.placement.index + 1) as u8);
    let mut means = vec![];
    for y in 0..pixels.rgba.len() / width {
        let row = y * width..(y + 1) * width;
        let seen = if per_pixel == 1 {
            &nodes.values[row.clone()]
        } else {
            means.clear();
            means.extend((0..width).map(|x| mean(nodes.values, width * per_pixel, [x, y], per_pixel)));
            &means
        };
        let (rgba, depths) = (pixels.rgba[row.clone()].chunks_mut(LANES), pixels.depth_mm[row.clone()].chunks_mut(LANES));
        let (ids, shown) = (pixels.volume_id[row.clone()].chunks_mut(LANES), pixels.values[row].chunks_mut(LANES));
        for ((((rgba, depths), ids), shown), seen) in rgba.zip(depths).zip(ids).zip(shown).zip(seen.chunks(LANES)) {
            let mut value = [f32::NAN; LANES];
            value[..seen.len()].copy_from_slice(seen);
            let value = Floats::load_array(simd, value);
            let mut free = 0;
            for (lane, id) in ids.iter().enumerate() {
                free |= u64::from(*id == 0) << lane;
            }
            let is = value.simd_eq(value) & Mask::from_bitmask(simd, free);
            if !is.any_true() {
                continue;
            }
            let grey = (value * gain + offset + 0.5).max(0.0).min(255.0).to_int::<Ints<S>>();
            // Three times the same, and opaque.
            let color = ((grey * 0x01_0101) | Ints::splat(simd, i32::from_le_bytes([0, 0, 0, u8::MAX]))).to_array().map(i32::to_le_bytes);
            let value = (Doubles::splat(simd, at_level) + Doubles::of(value) * Doubles::splat(simd, scale)).to_floats().to_array();
            if is.all_true() {
                rgba.copy_from_slice(&color);
                depths.fill(plane_mm);
                ids.fill(id);
                shown.copy_from_slice(&value);
            } else {
                for lane in numbers(is) {
                    (rgba[lane], depths[lane], ids[lane], shown[lane]) = (color[lane], plane_mm, id, value[lane]);
                }
            }
        }
    }
}

/// The mean of a pixel's nodes that lie in the scan; NaN where none does.
fn mean(values: &[f32], across: usize, [x, y]: [usize; 2], per_pixel: usize) -> f32 {
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    for row in values[y * per_pixel * across..].chunks(across).take(per_pixel) {
        for value in row[x * per_pixel..(x + 1) * per_pixel].iter().filter(|value| !value.is_nan()) {
            (sum, count) = (sum + value, count + 1.0);
        }
    }
    sum / count
}

/// The colour of a pixel where some layers have values, by the numbers of the layers; none where nothing is drawn.
fn color(frame: &Frame, scene: &Scene, there: &[(usize, f32)]) -> Option<[u8; 4]> {
    let brightness = |layer: &FrameLayer, value: f32| value * layer.appearance.brightness[0] + layer.appearance.brightness[1];
    let first = &frame.layers[there[0].0];
    let light = match scene.slice.face {
        CutFace::Bone => {
            let inside =
                there.iter().map(|(n, value)| (&frame.layers[*n], value)).find(|(layer, value)| **value >= layer.appearance.contour);
            inside?.0.appearance.color
        }
        face => {
            let cut: Vec<(f32, Vec3)> = there
                .iter()
                .map(|(n, value)| (&frame.layers[*n], value))
                .map(|(layer, value)| (brightness(layer, *value), layer.appearance.color))
                .collect();
            face_color(face, &first.appearance.face_colors, &cut)
        }
    };
    let [r, g, b] = light.to_array().map(fast_srgb8::f32_to_srgb8);
    Some([r, g, b, 255])
}
