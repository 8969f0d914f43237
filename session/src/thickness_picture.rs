//! A map of thickness as a picture: the surface in the colours of its values, with a legend.

use crate::chart::fonts::{FONT, fonts};
use crate::coat::{Figure, beside, share};
use bregma_measure::numbers::fixed;
use bregma_measure::thickness::Statistics;
use bregma_renderer::{Picture, named};
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

/// Width of the legend beside the picture.
const LEGEND: u32 = 230;

/// The picture with its legend and histogram as RGB pixels, and its width and height.
pub fn figure(picture: &Picture, title: &str, scale: &Scale, statistics: &Statistics) -> Result<Figure, Box<dyn Error>> {
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
            if let Some(share) = share(statistics.bin_ends_mm, &statistics.bins_mm2, mm) {
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
    Ok(beside(picture, rgb, width, height))
}
