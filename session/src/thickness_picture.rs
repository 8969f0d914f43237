//! A map of thickness as a picture: the surface in the colours of its values, with a legend.

use crate::chart::fonts::{FONT, fonts};
use bregma_measure::mesh::Mesh;
use bregma_measure::numbers::fixed;
use bregma_measure::thickness::{Statistics, cell_at};
use bregma_renderer::{Light, Picture, Reconstruction, Scene, Surface, named};
use fast_srgb8::{f32_to_srgb8, srgb8_to_f32};
use plotters::prelude::*;
use std::error::Error;

named! {
    /// Colours that grow evenly brighter, for the colour-blind too.
    #[derive(Default)]
    pub enum Colors {
        /// Blue to yellow over green.
        #[default]
        Viridis = "viridis",
        /// Blue to yellow.
        Cividis = "cividis",
    }
}

/// Values as colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The colours.
    pub colors: Colors,
    /// Values of the first and the last colour, mm.
    pub ends_mm: [f64; 2],
}

/// Where no value is known.
const UNKNOWN: [u8; 3] = [150, 150, 150];

impl Scale {
    /// The colour of a value; sRGB.
    pub fn color(&self, mm: f32) -> [u8; 3] {
        let [low, high] = self.ends_mm;
        if mm.is_nan() {
            return UNKNOWN;
        }
        let part = ((f64::from(mm) - low) / (high - low)).clamp(0.0, 1.0);
        let gradient = match self.colors {
            Colors::Viridis => colorous::VIRIDIS,
            Colors::Cividis => colorous::CIVIDIS,
        };
        gradient.eval_continuous(part).as_array()
    }
}

/// How much of the surface is as thick as `mm`, of the thickness that most of it has: the height of a histogram beside a legend.
pub fn share(statistics: &Statistics, mm: f64) -> Option<f64> {
    let ([first, last], bins) = (statistics.bin_ends_mm, &statistics.bins_mm2);
    let bin = (mm - first) / (last - first).max(f64::MIN_POSITIVE) * bins.len() as f64;
    let largest = bins.iter().fold(f64::MIN_POSITIVE, |m, b| m.max(*b));
    (0.0..bins.len() as f64).contains(&bin).then(|| bins[bin as usize] / largest)
}

/// The scene that a map is painted on: the surface white, without highlights, and lit enough on all sides for its colours to be read.
pub fn white(mut scene: Scene) -> Scene {
    // The mesh is the interpolant's.
    scene.reconstruction = Reconstruction::Trilinear;
    scene.light = Light { ambient: 0.4, diffuse: 0.6, specular: 0.0, ..scene.light };
    scene.layers.iter_mut().for_each(|layer| layer.color = bregma_renderer::Color([1.0; 3]));
    scene
}

/// Paints `picture`, drawn of [`white`] through a point of its pixels, in the colours of the values at the vertices of the mesh of `surface`: each
/// pixel in that of the cell that it shows.
pub fn paint(picture: &mut Picture, scene: &Scene, [dx, dy]: [f64; 2], surface: &Surface, mesh: &Mesh, values: &[f32], scale: &Scale) {
    let (width, height) = (picture.width, picture.height);
    for n in 0..picture.rgba.len() {
        if picture.volume_id[n] == 0 {
            continue;
        }
        let (x, y) = (n as u32 % width, n as u32 / width);
        let seen = scene.camera.ray(f64::from(x) + dx, f64::from(y) + dy, width, height).at(f64::from(picture.depth_mm[n]));
        let value = mesh.vertex_of(cell_at(surface, seen)).map_or(f32::NAN, |vertex| values[vertex as usize]);
        let color = scale.color(value);
        for (channel, value) in picture.rgba[n].iter_mut().zip(color) {
            // Light that falls on white, on this colour.
            *channel = f32_to_srgb8(srgb8_to_f32(*channel) * srgb8_to_f32(value));
        }
    }
}

/// Width of the legend beside the picture.
const LEGEND: u32 = 230;

/// The picture with its legend and histogram as RGB pixels, and its width and height.
pub fn figure(picture: &Picture, title: &str, scale: &Scale, statistics: &Statistics) -> Result<(Vec<u8>, u32, u32), Box<dyn Error>> {
    fonts();
    let (width, height) = (picture.width + LEGEND, picture.height.max(420));
    let mut rgb = vec![255; (width * height * 3) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
        area.fill(&WHITE)?;
        let text = |size: i32| (FONT, size).into_font();
        let x = picture.width as i32 + 16;
        area.draw(&Text::new(title.to_owned(), (x, 12), text(16)))?;
        area.draw(&Text::new("thickness, mm", (x, 34), text(15)))?;
        let (top, bar) = (66, 256);
        let [low, high] = scale.ends_mm;
        for y in 0..bar {
            let mm = high - (high - low) * f64::from(y) / f64::from(bar - 1);
            let [r, g, b] = scale.color(mm as f32);
            let line = |from: i32, to: i32| Rectangle::new([(from, top + y), (to, top + y + 1)], RGBColor(r, g, b).filled());
            area.draw(&line(x, x + 24))?;
            // Beside the scale, how much of the surface has that thickness.
            if let Some(share) = share(statistics, mm) {
                area.draw(&line(x + 84, x + 84 + (share * 110.0) as i32))?;
            }
        }
        for n in 0..=4 {
            let mm = high - (high - low) * f64::from(n) / 4.0;
            let y = top + bar * n / 4;
            area.draw(&Text::new(fixed(mm, 2), (x + 30, y - 8), text(14)))?;
        }
        let lines = [
            format!("mean {} ± {} mm", fixed(statistics.mean_mm, 2), fixed(statistics.deviation_mm, 2)),
            format!("median {} mm", fixed(statistics.quantiles_mm[4], 2)),
            format!("5 to 95 %: {} to {} mm", fixed(statistics.quantiles_mm[2], 2), fixed(statistics.quantiles_mm[6], 2)),
        ];
        for (n, line) in lines.into_iter().enumerate() {
            area.draw(&Text::new(line, (x, top + bar + 20 + 20 * n as i32), text(15)))?;
        }
        area.present()?;
    }
    for (row, line) in picture.rgba.chunks(picture.width as usize).enumerate() {
        let start = row * width as usize * 3;
        for (n, [r, g, b, _]) in line.iter().enumerate() {
            rgb[start + 3 * n..start + 3 * n + 3].copy_from_slice(&[*r, *g, *b]);
        }
    }
    Ok((rgb, width, height))
}
