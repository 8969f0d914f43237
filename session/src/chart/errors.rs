//! A picture of errors: how far each pixel's depth is from the truth, in false colours; what was missed or invented is marked.

use super::fonts::{FONT, fonts};
use bregma_renderer::accuracy::Verdict;
use plotters::prelude::*;
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use std::error::Error;

/// Ends of the colour scale, voxels, logarithmic: what a float32 depth resolves, and a whole voxel.
pub const SCALE_VOXEL: [f64; 2] = [1e-5, 1.0];
/// Surfaces not found: vermilion, which viridis has not.
pub const MISSED: [u8; 3] = [213, 94, 0];
/// Surfaces found where none is.
pub const FALSE: [u8; 3] = [255, 255, 255];
/// Tangent rays, which nothing can be held to.
pub const TANGENT: [u8; 3] = [120, 120, 120];
/// Nothing there.
const NOTHING: [u8; 3] = [24, 26, 30];

/// What is marked instead of coloured, for legends.
pub const MARKS: [([u8; 3], &str); 3] = [(MISSED, "missed"), (FALSE, "false hit"), (TANGENT, "tangent")];

/// The colour of an error in voxels.
pub fn color(voxel: f64) -> [u8; 3] {
    let [low, high] = SCALE_VOXEL.map(f64::log10);
    let part = ((voxel.abs().max(f64::MIN_POSITIVE).log10() - low) / (high - low)).clamp(0.0, 1.0);
    let RGBColor(r, g, b) = ViridisRGB.get_color(part);
    [r, g, b]
}

/// The pixels of the picture, sRGB, in the order of the verdicts.
pub fn pixels(verdicts: &[Verdict]) -> Vec<[u8; 3]> {
    let pixel = |verdict: &Verdict| match verdict {
        Verdict::Nothing => NOTHING,
        Verdict::Hit(off) => color(f64::from(off.voxel)),
        Verdict::Missed => MISSED,
        Verdict::False => FALSE,
        Verdict::Tangent => TANGENT,
    };
    verdicts.iter().map(pixel).collect()
}

/// Units of the legend beside the picture.
const LEGEND: u32 = 190;

/// The picture with its legend as RGB pixels, and its width and height.
pub fn figure(pixels: &[[u8; 3]], width: u32, title: &str) -> Result<(Vec<u8>, u32, u32), Box<dyn Error>> {
    fonts();
    let height = pixels.len() as u32 / width.max(1);
    // Small pictures still have room for the legend.
    let (full_width, full_height) = (width + LEGEND, height.max(300));
    let mut rgb = vec![255; (full_width * full_height * 3) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut rgb, (full_width, full_height)).into_drawing_area();
        area.fill(&WHITE)?;
        let font = |size: i32| (FONT, size).into_font();
        let x = width as i32 + 16;
        area.draw(&Text::new(title.to_owned(), (x, 10), font(17)))?;
        area.draw(&Text::new("depth error, voxels", (x, 36), font(14)))?;
        let (top, bar) = (62, 120);
        for y in 0..bar {
            let part = 1.0 - f64::from(y) / f64::from(bar - 1);
            let color = ViridisRGB.get_color(part);
            area.draw(&Rectangle::new([(x, top + y), (x + 22, top + y + 1)], color.filled()))?;
        }
        let decades = (SCALE_VOXEL[1] / SCALE_VOXEL[0]).log10().round() as i32;
        for n in 0..=decades {
            let y = top + bar * n / decades;
            let value = SCALE_VOXEL[1].log10().round() as i32 - n;
            area.draw(&Text::new(if value == 0 { "1 and more".into() } else { format!("1e{value}") }, (x + 30, y - 8), font(14)))?;
        }
        for (n, ([r, g, b], name)) in MARKS.into_iter().chain([(NOTHING, "nothing there")]).enumerate() {
            let y = top + bar + 22 + 22 * n as i32;
            area.draw(&Rectangle::new([(x, y), (x + 14, y + 14)], RGBColor(r, g, b).filled()))?;
            area.draw(&Rectangle::new([(x, y), (x + 14, y + 14)], BLACK.stroke_width(1)))?;
            area.draw(&Text::new(name, (x + 24, y), font(14)))?;
        }
        area.present()?;
    }
    for (row, line) in pixels.chunks(width.max(1) as usize).enumerate() {
        let start = row * full_width as usize * 3;
        rgb[start..start + line.len() * 3].copy_from_slice(line.as_flattened());
    }
    Ok((rgb, full_width, full_height))
}
