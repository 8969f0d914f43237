//! A section as a figure: the thickness of each scan along the curve, and below it how they differ, each with its ± as a band.

use super::fonts::{FONT, PNG_SCALE, fonts};
use crate::section_order::{Column, Told};
use bregma_measure::numbers::{at_most, fixed};
use bregma_measure::section::Station;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use std::error::Error;

/// Width of the figure, and height of the panel of thicknesses and of that of differences, in its own units.
const SIZE: (u32, u32, u32) = (1100, 460, 260);

/// Colours of Okabe and Ito (2008), which the colour-blind tell apart: of the first and the second scan, and of both differences.
pub const COLORS: [[u8; 3]; 4] = [[0, 114, 178], [213, 94, 0], [0, 0, 0], [0, 158, 115]];

/// A stretch of a curve without gaps: places along it, mm, each with its number and its ±, mm.
pub type Run = Vec<[f64; 3]>;

/// What of a section is drawn of one column; a station without a number is a gap, and a ± without bound is none that could be drawn.
pub fn runs(stations: &[Station], (_, of): &Column) -> Vec<Run> {
    let all: Vec<Option<[f64; 3]>> = stations.iter().map(|s| of(s).map(|length| [s.along_mm, length.mm, length.error_mm])).collect();
    let known = |run: &[Option<[f64; 3]>]| run.iter().flatten().copied().collect::<Run>();
    all.split(Option::is_none).filter(|run| !run.is_empty()).map(known).collect()
}

/// The lower and the upper side of a run's band, mm. A thickness is not below 0.
pub fn sides(run: &Run, is_thickness: bool) -> [Vec<f64>; 2] {
    let least = if is_thickness { 0.0 } else { f64::NEG_INFINITY };
    [-1.0, 1.0].map(|sign| run.iter().map(|[_, y, error]| (y + sign * if error.is_finite() { *error } else { 0.0 }).max(least)).collect())
}

/// The figure as SVG.
pub fn svg(told: &Told) -> Result<String, Box<dyn Error>> {
    fonts();
    let mut text = String::new();
    draw(&SVGBackend::with_string(&mut text, size(told)).into_drawing_area(), told, 1)?;
    Ok(text)
}

/// The figure as RGB pixels, row by row, with its width and height.
pub fn pixels(told: &Told) -> Result<(Vec<u8>, u32, u32), Box<dyn Error>> {
    fonts();
    let (width, height) = size(told);
    let (width, height) = (width * PNG_SCALE, height * PNG_SCALE);
    let mut rgb = vec![0; (width * height * 3) as usize];
    draw(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area(), told, PNG_SCALE as i32)?;
    Ok((rgb, width, height))
}

fn size(told: &Told) -> (u32, u32) {
    (SIZE.0, if told.differences().is_empty() { SIZE.1 } else { SIZE.1 + SIZE.2 })
}

type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// One panel.
struct Panel<'a> {
    told: &'a Told,
    columns: Vec<Column>,
    /// The colour of the first column.
    first_color: usize,
    /// What is charted upward, mm.
    what: &'static str,
    /// Numbers may be of either sign, and the axis shows where none is.
    is_signed: bool,
    /// Names of landmarks and what is along the curve stand at this one.
    has_names: bool,
    scale: i32,
}

fn draw<DB: DrawingBackend>(root: &DrawingArea<DB, Shift>, told: &Told, scale: i32) -> Result<(), Box<dyn Error>>
where
    DB::ErrorType: 'static,
{
    root.fill(&WHITE)?;
    let panel = |columns, first_color, what, is_signed, has_names| Panel { told, columns, first_color, what, is_signed, has_names, scale };
    let (above, below) = root.split_vertically(SIZE.1 as i32 * scale);
    panel(told.thicknesses(), 0, "thickness, mm", false, true).draw(&above)?;
    if !told.differences().is_empty() {
        panel(told.differences(), 2, "difference, mm", true, false).draw(&below)?;
    }
    root.present()?;
    Ok(())
}

impl Panel<'_> {
    /// The lowest and the highest number that its axis has to show.
    fn ends(&self) -> (f64, f64) {
        let all = self.columns.iter().flat_map(|column| runs(&self.told.stations, column));
        let numbers = all.flat_map(|run| sides(&run, !self.is_signed)).flatten();
        let (low, high) = numbers.fold((0.0_f64, 0.0_f64), |(low, high), y| (low.min(y), high.max(y)));
        let room = 0.06 * (high - low).max(0.1);
        (if self.is_signed { low - room } else { low }, high + room)
    }

    /// Of a text, in pixels: letters of this font are about 0.52 of their height wide.
    fn width(&self, text: &str) -> i32 {
        (text.chars().count() as f64 * 0.52 * f64::from(15 * self.scale)) as i32
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Result<(), Box<dyn Error>>
    where
        DB::ErrorType: 'static,
    {
        let (scale, length_mm) = (self.scale, self.told.length_mm.max(self.told.order.step_mm));
        let (low, high) = self.ends();
        let font = |size: i32| (FONT, size * scale).into_font();
        // Above the panel stand what its lines are and the names of landmarks.
        let mut chart = ChartBuilder::on(area)
            .margin(12 * scale)
            .margin_top(if self.has_names { 56 * scale } else { 34 * scale })
            .x_label_area_size(46 * scale)
            .y_label_area_size(64 * scale)
            .build_cartesian_2d(0.0..length_mm, low..high)?;
        let number = |v: &f64| fixed(*v, if high - low < 2.0 { 2 } else { 1 });
        chart
            .configure_mesh()
            .x_desc("mm along the curve")
            .y_desc(self.what)
            .x_label_formatter(&|v| at_most(*v, 3))
            .y_label_formatter(&number)
            .label_style(font(15))
            .axis_desc_style(font(16))
            .bold_line_style(BLACK.mix(0.14))
            .light_line_style(TRANSPARENT)
            .draw()?;
        if self.is_signed {
            chart.draw_series(LineSeries::new([(0.0, 0.0), (length_mm, 0.0)], BLACK.mix(0.6)))?;
        }
        self.marks(area, &mut chart, [low, high])?;
        self.lines(area, &mut chart)
    }

    /// Landmarks, by their names where those leave room for each other.
    fn marks<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
        chart: &mut Chart<'_, DB>,
        [low, high]: [f64; 2],
    ) -> Result<(), Box<dyn Error>>
    where
        DB::ErrorType: 'static,
    {
        let scale = self.scale;
        let mut room_from = i32::MIN;
        for mark in &self.told.marks {
            chart.draw_series(DashedLineSeries::new(
                [(mark.along_mm, low), (mark.along_mm, high)],
                4 * scale,
                4 * scale,
                BLACK.mix(0.5).stroke_width(scale as u32),
            ))?;
            let (x, y) = chart.backend_coord(&(mark.along_mm, high));
            // A name that would cover the one before it is left out.
            let width = self.width(&mark.name);
            let right = SIZE.0 as i32 * scale - width - 4 * scale;
            let left = (x - width / 2).clamp(0, right.max(0));
            if self.has_names && left > room_from {
                let origin = area.get_base_pixel();
                area.draw(&Text::new(mark.name.clone(), (left - origin.0, y - origin.1 - 20 * scale), (FONT, 15 * scale).into_font()))?;
                room_from = left + width + 6 * scale;
            }
        }
        Ok(())
    }

    /// Each column's band and line, and what it is.
    fn lines<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>, chart: &mut Chart<'_, DB>) -> Result<(), Box<dyn Error>>
    where
        DB::ErrorType: 'static,
    {
        let scale = self.scale;
        let mut key = 76 * scale;
        for (column, color) in self.columns.iter().zip(COLORS.iter().skip(self.first_color)) {
            let color = RGBColor(color[0], color[1], color[2]);
            let outline = |run: &Run| {
                let [low, high] = sides(run, !self.is_signed);
                let along = || run.iter().map(|[x, ..]| *x);
                along().zip(high).chain(along().zip(low).rev()).collect::<Vec<_>>()
            };
            // A station between two gaps is a point with a bar.
            let (alone, long): (Vec<Run>, Vec<Run>) = runs(&self.told.stations, column).into_iter().partition(|run| run.len() == 1);
            chart.draw_series(long.iter().map(|run| Polygon::new(outline(run), color.mix(0.22))))?;
            chart.draw_series(alone.iter().map(|run| PathElement::new(outline(run), color.mix(0.5).stroke_width(2 * scale as u32))))?;
            let points = |run: &Run| run.iter().map(|[x, y, _]| (*x, *y)).collect::<Vec<_>>();
            chart.draw_series(long.iter().map(|run| PathElement::new(points(run), color.stroke_width(2 * scale as u32))))?;
            chart.draw_series(alone.iter().flat_map(points).map(|at| Circle::new(at, 2 * scale, color.filled())))?;
            let y = 16 * scale;
            area.draw(&Rectangle::new([(key, y - 6 * scale), (key + 24 * scale, y + 6 * scale)], color.mix(0.22).filled()))?;
            area.draw(&PathElement::new(vec![(key, y), (key + 24 * scale, y)], color.stroke_width(2 * scale as u32)))?;
            let text = format!("{} (band: ±, 95 %)", column.0);
            area.draw(&Text::new(text.clone(), (key + 30 * scale, y - 8 * scale), (FONT, 15 * scale).into_font()))?;
            key += 56 * scale + self.width(&text);
        }
        Ok(())
    }
}
