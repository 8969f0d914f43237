//! A figure of a few methods on each backend: how far off each is, against the time of a frame.

use super::fonts::{FONT, PNG_SCALE, fonts};
use bregma_renderer::Backend;
use plotters::prelude::*;
use std::error::Error;

/// One method on one backend.
pub struct Mark {
    /// What stands beside it.
    pub name: String,
    /// What drew.
    pub backend: Backend,
    /// Across.
    pub ms_per_frame: f64,
    /// Up; above 0.
    pub off: f64,
    /// Whether a line joins it to the others of its backend that are.
    pub is_joined: bool,
}

/// The figure.
pub struct Figure {
    /// Its title.
    pub caption: &'static str,
    /// What is charted upward.
    pub off: &'static str,
    /// What the names are.
    pub legend: &'static str,
    /// The methods.
    pub marks: Vec<Mark>,
}

/// Width and height, in the figure's own units.
const SIZE: (u32, u32) = (760, 560);

impl Figure {
    /// As SVG.
    pub fn svg(&self) -> Result<String, Box<dyn Error>> {
        fonts();
        let mut text = String::new();
        self.draw(&SVGBackend::with_string(&mut text, SIZE).into_drawing_area(), 1)?;
        Ok(text)
    }

    /// As RGB pixels, row by row, with its width and height.
    pub fn pixels(&self) -> Result<(Vec<u8>, u32, u32), Box<dyn Error>> {
        fonts();
        let (width, height) = (SIZE.0 * PNG_SCALE, SIZE.1 * PNG_SCALE);
        let mut rgb = vec![0; (width * height * 3) as usize];
        self.draw(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area(), PNG_SCALE as i32)?;
        Ok((rgb, width, height))
    }

    fn draw<DB: DrawingBackend>(&self, root: &DrawingArea<DB, plotters::coord::Shift>, scale: i32) -> Result<(), Box<dyn Error>>
    where
        DB::ErrorType: 'static,
    {
        root.fill(&WHITE)?;
        let font = |size: i32| (FONT, size * scale).into_font();
        let ends = |of: fn(&Mark) -> f64| self.marks.iter().map(of).fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
        let ((fast, slow), (least, most)) = (ends(|m| m.ms_per_frame), ends(|m| m.off));
        let mut chart = ChartBuilder::on(root)
            .caption(self.caption, font(20))
            .margin(14 * scale)
            .x_label_area_size(44 * scale)
            .y_label_area_size(64 * scale)
            .build_cartesian_2d((fast / 1.4..slow * 1.6).log_scale(), (least / 1.5..most * 1.6).log_scale())?;
        chart
            .configure_mesh()
            .x_labels(6)
            .x_desc("ms a frame")
            .y_desc(self.off)
            .label_style(font(15))
            .axis_desc_style(font(16))
            .light_line_style(TRANSPARENT)
            .draw()?;
        for (backend, color) in [(Backend::Cpu, RGBColor(0, 114, 178)), (Backend::Gpu, RGBColor(213, 94, 0))] {
            let own: Vec<&Mark> = self.marks.iter().filter(|m| m.backend == backend).collect();
            if own.is_empty() {
                continue;
            }
            let place = |m: &Mark| (m.ms_per_frame, m.off);
            let joined = own.iter().filter(|m| m.is_joined).map(|m| place(m));
            chart.draw_series(LineSeries::new(joined, color.stroke_width(scale as u32)))?;
            let named = own.iter().map(|m| {
                let text = Text::new(m.name.clone(), (8 * scale, -6 * scale), font(14));
                EmptyElement::at(place(m)) + Circle::new((0, 0), 4 * scale, color.filled()) + text
            });
            chart
                .draw_series(named)?
                .label(format!("{backend}; {}", self.legend))
                .legend(move |(x, y)| Circle::new((x + 10 * scale, y), 4 * scale, color.filled()));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .margin(12 * scale)
            .legend_area_size(24 * scale)
            .label_font(font(15))
            .background_style(WHITE)
            .border_style(BLACK.mix(0.3))
            .draw()?;
        root.present()?;
        Ok(())
    }
}
