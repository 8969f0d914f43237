//! The curve of a section over the picture and over slices.

use super::marks::{self, Screen};
use bregma_measure::section::Station;
use bregma_session::section::Measured;
use egui::{Color32, Painter, Stroke};
use glam::DVec3;
use std::sync::Arc;

/// A section, and the station that the mouse is on in its chart.
#[derive(Clone, Debug)]
pub struct SectionCurve {
    /// What was measured.
    pub measured: Arc<Measured>,
    /// Number of the station.
    pub hovered: Option<usize>,
}

/// Stands out from bone and from the yellow of rays.
const COLOR: Color32 = Color32::from_rgb(230, 80, 200);

impl SectionCurve {
    /// Draws it: thin where the surface there faces away, as nothing hides it.
    pub fn show(&self, painter: &Painter, screen: &Screen<'_>) {
        let faces = |s: &Station| s.normal.dot(screen.camera.eye_mm - s.point_mm) > 0.0;
        for (a, b) in self.pairs() {
            let Some(ends) = screen.line([a.point_mm, b.point_mm]) else { continue };
            if faces(a) && faces(b) {
                marks::line(painter, ends, 2.0, COLOR);
            } else {
                painter.line_segment(ends, Stroke::new(1.0, COLOR.gamma_multiply(0.5)));
            }
        }
        self.dot(painter, screen);
    }

    /// Draws what of it is `near` a slice.
    pub fn on_slice(&self, painter: &Painter, screen: &Screen<'_>, near: impl Fn(DVec3) -> bool) {
        let pairs = self.pairs().filter(|(a, b)| near(a.point_mm) && near(b.point_mm));
        pairs.filter_map(|(a, b)| screen.line([a.point_mm, b.point_mm])).for_each(|ends| marks::line(painter, ends, 2.0, COLOR));
        self.dot(painter, screen);
    }

    /// Stations with those behind them.
    fn pairs(&self) -> impl Iterator<Item = (&Station, &Station)> {
        let told = &self.measured.told;
        let last = told.stations.last().zip(told.stations.first()).filter(|_| told.is_closed);
        told.stations.iter().zip(told.stations.iter().skip(1)).chain(last)
    }

    /// The station that the mouse is on in the chart.
    fn dot(&self, painter: &Painter, screen: &Screen<'_>) {
        let station = self.hovered.and_then(|n| self.measured.told.stations.get(n));
        if let Some(at) = station.and_then(|station| screen.point(station.point_mm)) {
            marks::dot(painter, at, 6.0, Color32::WHITE);
        }
    }
}
