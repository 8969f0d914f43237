//! A map of differences as a picture: one of the two surfaces in the colours of what it differs by, with a legend.

use crate::chart::fonts::{FONT, fonts};
use crate::coat::{self, Coat, Figure, dye, share, white};
use crate::difference::{Half, Measured};
use crate::print::Legend;
use bregma_field::crossings::{self, Kind};
use bregma_field::{Ray, WorldPoint};
use bregma_measure::difference::Statistics;
use bregma_measure::numbers::{fixed, signed};
use bregma_measure::thickness::cell_at;
use bregma_renderer::{Color, Mode, Picture, Scene};
use glam::DVec3;
use plotters::prelude::{BitMapBackend, DrawingArea, DrawingBackend, IntoDrawingArea, IntoFont, RGBColor, Rectangle, Text, WHITE};
use plotters::style::Color as _;
use std::error::Error;
use std::sync::Arc;

/// Differences as colours: a diverging map about bone's colour, symmetric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The difference of the last colour, mm; its negative has the first.
    pub range_mm: f64,
    /// What lies within its ± is grey.
    pub grey_within_error: bool,
    /// Lines of equal difference so far apart, mm.
    pub isolines_mm: Option<f64>,
}

/// The narrowest range of colours, mm: far below what any scan tells.
pub const LEAST_RANGE_MM: f64 = 0.001;
/// Of what is not sure to differ.
const WITHIN_ERROR: [u8; 3] = [188, 188, 188];
/// Stripes of what has no partner.
const WITHOUT: [[u8; 3]; 2] = [[235, 235, 235], [120, 120, 120]];
/// Of what was not asked for.
const NOT_ASKED: [u8; 3] = [255, 255, 255];
/// Width of a stripe, pixels.
const STRIPE: u32 = 4;
/// How much of the light is left on a line of equal difference.
const ON_LINE: [u8; 3] = [70, 70, 70];

impl Scale {
    /// Decimals of what is written beside the colours: two digits of the end, and two decimals at least.
    pub fn decimals(&self) -> usize {
        (1.0 - self.range_mm.log10().floor()).clamp(2.0, 4.0) as usize
    }

    /// The colour of a difference with its ±, mm; sRGB.
    pub fn color(&self, mm: f32, error_mm: f32) -> [u8; 3] {
        if mm.is_nan() {
            return WITHOUT[1];
        }
        if self.grey_within_error && mm.abs() <= error_mm {
            return WITHIN_ERROR;
        }
        Color::diverging(mm / self.range_mm as f32).0.map(|c| (c * 255.0).round() as u8)
    }
}

/// A map of differences with its colours, on one of its two surfaces.
#[derive(Debug)]
pub struct DifferenceCoat {
    /// The map.
    pub measured: Arc<Measured>,
    /// On the first surface, 0, or on the second, 1.
    pub on: usize,
    /// Its colours.
    pub scale: Scale,
}

/// What a map says where a ray first meets its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Along {
    /// The difference, in words.
    pub told: String,
    /// Where, LPS mm.
    pub point_mm: DVec3,
    /// What belongs to it on the other surface; none where nothing does.
    pub partner_mm: Option<DVec3>,
}

/// What is seen of a map at a point.
#[derive(Clone, Copy)]
enum Seen {
    NotAsked,
    Without,
    Known { mm: f32, error_mm: f32 },
}

impl DifferenceCoat {
    /// The surface that wears it.
    pub fn half(&self) -> &Half {
        &self.measured.halves[self.on]
    }

    /// The scene to paint on: the surface alone, where it was measured.
    pub fn scene(&self, scene: &Scene) -> Scene {
        let mut scene = white(scene.clone());
        scene.mode = Mode::Iso;
        let shown = self.measured.order.pair[self.on];
        scene.layers.iter_mut().enumerate().for_each(|(n, layer)| layer.visible = n == shown);
        // A mirror image lies elsewhere than its scan.
        if let Some(layer) = scene.layers.get_mut(shown) {
            layer.transform = self.half().transform;
        }
        scene
    }

    /// The colour of a vertex.
    pub fn vertex_color(&self, vertex: usize) -> [u8; 3] {
        let half = self.half();
        if half.asked[vertex] { self.scale.color(half.map.values_mm[vertex], half.map.errors_mm[vertex]) } else { NOT_ASKED }
    }

    /// What the surface differs by where a ray first enters it, what belongs to that place.
    pub fn along(&self, ray: &Ray) -> Option<Along> {
        let half = self.half();
        let entry = crossings::crossings(&half.surface, ray).into_iter().find(|c| c.kind == Kind::Enter && !c.clipped)?;
        let point = crossings::world(&half.surface, &entry);
        let vertex = half.mesh.vertex_of(cell_at(&half.surface, point))? as usize;
        let told = self.told_at(point)?;
        // A vertex lies in the cell, but seldom at the point.
        let partner = half.map.partners_mm[vertex].as_dvec3() + (point.0 - half.mesh.vertices[vertex]);
        Some(Along { told, partner_mm: partner.is_finite().then_some(partner), point_mm: point.0 })
    }

    /// What the map says at a point of the surface: of the vertices of the cells around, those that face as the point's own does, each counted
    /// as near as its cell is.
    fn at(&self, point: WorldPoint) -> Seen {
        let half = self.half();
        let cell = cell_at(&half.surface, point);
        let Some(own) = half.mesh.vertex_of(cell).map(|n| n as usize) else { return Seen::NotAsked };
        if !half.asked[own] {
            return Seen::NotAsked;
        }
        if half.map.values_mm[own].is_nan() {
            return Seen::Without;
        }
        let index = half.surface.grid.index(point).0.to_array();
        let (mut sum, mut errors, mut weights) = (0.0, 0.0, 0.0);
        for corner in 0..8 {
            let mut weight = 1.0;
            let mut beside = [0; 3];
            for a in 0..3 {
                // Middles of cells lie half a voxel behind their lowest samples.
                let from_middle = index[a] - cell[a] as f64 - 0.5;
                let over = corner >> a & 1 == 1;
                weight *= if over { from_middle.abs() } else { 1.0 - from_middle.abs() };
                let step = if over { from_middle.signum() as isize } else { 0 };
                beside[a] = cell[a].checked_add_signed(step).unwrap_or(cell[a]);
            }
            let vertex = half.mesh.vertex_of(beside).map(|n| n as usize);
            let faces = |n: &usize| half.mesh.normals[*n].dot(half.mesh.normals[own]) > 0.0 && !half.map.values_mm[*n].is_nan();
            if let Some(n) = vertex.filter(faces) {
                sum += weight * f64::from(half.map.values_mm[n]);
                errors += weight * f64::from(half.map.errors_mm[n]);
                weights += weight;
            }
        }
        // The cell's own counts at least an eighth.
        Seen::Known { mm: (sum / weights) as f32, error_mm: (errors / weights) as f32 }
    }
}

impl Coat for DifferenceCoat {
    fn paint(&self, picture: &mut Picture, scene: &Scene, through: [f64; 2]) {
        let seen = coat::seen(picture, scene, through, |point| self.at(point));
        let width = picture.width as usize;
        // No line of no difference, which would follow the noise of all that agrees; nor one through what is not sure to differ.
        let band = |n: usize| match (self.scale.isolines_mm, seen.get(n)) {
            (Some(step), Some(Some(Seen::Known { mm, error_mm }))) => {
                let is_grey = self.scale.grey_within_error && mm.abs() <= *error_mm;
                Some(if is_grey { 0.0 } else { (f64::from(*mm) / step).trunc() })
            }
            _ => None,
        };
        for n in 0..seen.len() {
            let Some(at) = seen[n] else { continue };
            let color = match at {
                Seen::NotAsked => NOT_ASKED,
                Seen::Without => WITHOUT[((n as u32 % picture.width + n as u32 / picture.width) / STRIPE % 2) as usize],
                Seen::Known { mm, error_mm } => self.scale.color(mm, error_mm),
            };
            dye(&mut picture.rgba[n], color);
            let differs = |other: usize| band(n).zip(band(other)).is_some_and(|(a, b)| a != b);
            if ((n + 1) % width != 0 && differs(n + 1)) || differs(n + width) {
                dye(&mut picture.rgba[n], ON_LINE);
            }
        }
    }

    fn color_at(&self, point: WorldPoint) -> Option<[u8; 3]> {
        match self.at(point) {
            Seen::NotAsked => None,
            Seen::Without => Some(WITHOUT[1]),
            Seen::Known { mm, error_mm } => Some(self.scale.color(mm, error_mm)),
        }
    }

    fn told_at(&self, point: WorldPoint) -> Option<String> {
        match self.at(point) {
            Seen::NotAsked => None,
            Seen::Without => Some("no difference is known".into()),
            Seen::Known { mm, error_mm } => Some(format!("difference {} ± {} mm", signed(f64::from(mm), 2), fixed(f64::from(error_mm), 2))),
        }
    }

    fn legend(&self) -> Legend {
        let range_mm = self.scale.range_mm;
        Legend::between(self.measured.legend(), [-range_mm, range_mm], |mm| self.scale.color(mm as f32, 0.0))
    }
}

/// The picture alone.
pub fn without_legend((rgb, width, height): Figure) -> Figure {
    let narrow = width.saturating_sub(LEGEND);
    let row = |n: u32| &rgb[(n * width) as usize * 3..][..narrow as usize * 3];
    ((0..height).flat_map(row).copied().collect(), narrow, height)
}

/// Width of the legend beside the picture, and height of its bar of colours.
const LEGEND: u32 = 270;
const BAR: i32 = 200;

impl DifferenceCoat {
    /// The painted picture with its legend and its statistics.
    pub fn figure(&self, picture: &Picture) -> Result<Figure, Box<dyn Error>> {
        fonts();
        let statistics = self.half().statistics.as_ref();
        let lines = [words(&self.measured.legend()), vec![String::new()], words(&format!("on {}", self.half().name))].concat();
        let (top, told) = (24 + 17 * lines.len() as i32, statistics.map(told).unwrap_or_default());
        let below = top + BAR + 18;
        let (width, height) = (picture.width + LEGEND, picture.height.max((below + 18 * told.len() as i32) as u32 + 10));
        let mut rgb = vec![255; (width * height * 3) as usize];
        {
            let area = BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area();
            area.fill(&WHITE)?;
            let x = picture.width as i32 + 16;
            for (n, line) in lines.iter().enumerate() {
                area.draw(&Text::new(line.clone(), (x, 10 + 17 * n as i32), (FONT, 14).into_font()))?;
            }
            self.bar(&area, (x, top), statistics)?;
            for (n, line) in told.iter().enumerate() {
                area.draw(&Text::new(line.clone(), (x, below + 18 * n as i32), (FONT, 14).into_font()))?;
            }
            area.present()?;
        }
        Ok(coat::beside(picture, rgb, width, height))
    }

    /// The colours with their millimetres, and beside them how much of the surface differs by that.
    fn bar<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, plotters::coord::Shift>,
        (x, top): (i32, i32),
        statistics: Option<&Statistics>,
    ) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        let range = self.scale.range_mm;
        let line = |y: i32, from: i32, to: i32, [r, g, b]: [u8; 3]| Rectangle::new([(from, y), (to, y + 1)], RGBColor(r, g, b).filled());
        for y in 0..BAR {
            let mm = range * (1.0 - 2.0 * f64::from(y) / f64::from(BAR - 1));
            // The bar shows the colours themselves.
            let color = self.scale.color(mm as f32, 0.0);
            area.draw(&line(top + y, x, x + 24, color))?;
            if let Some(share) = statistics.and_then(|s| share(s.bin_ends_mm, &s.bins_mm2, mm)) {
                area.draw(&line(top + y, x + 96, x + 96 + (share * 150.0) as i32, [140, 140, 140]))?;
            }
        }
        for n in 0..=4 {
            let mm = range * (1.0 - f64::from(n) / 2.0);
            area.draw(&Text::new(
                format!("{} mm", signed(mm, self.scale.decimals())),
                (x + 30, top + BAR * n / 4 - 8),
                (FONT, 14).into_font(),
            ))?;
        }
        Ok(())
    }
}

/// The statistics in a few lines.
fn told(s: &Statistics) -> Vec<String> {
    vec![
        format!("mean {} ± {} mm", signed(s.mean_mm, 3), fixed(s.mean_uncertainty.error_mm, 3)),
        format!("RMS {} mm, SD {} mm", fixed(s.rms_mm, 3), fixed(s.deviation_mm, 3)),
        format!("5 to 95 %: {} to {} mm", signed(s.quantiles_mm[1], 2), signed(s.quantiles_mm[5], 2)),
        format!("beyond its ±: {} % of the area", fixed(100.0 * s.sure, 1)),
        "grey: within its ±".into(),
        format!("hatched, no number: {} %", fixed(100.0 * s.without(), 1)),
    ]
}

/// A sentence in lines that fit beside a picture.
fn words(sentence: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in sentence.split(' ') {
        // There is always a last line.
        if lines.last().is_some_and(|line| line.chars().count() + word.chars().count() > 34) {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            *line += word;
            *line += " ";
        }
    }
    lines
}
