//! The curve of a section over the picture.

use super::marks::{self, Screen};
use bregma_measure::section::Station;
use bregma_session::section::Measured;
use egui::{Color32, Painter, Stroke};
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
        let stations = &self.measured.told.stations;
        let faces = |s: &Station| s.normal.dot(screen.camera.eye_mm - s.point_mm) > 0.0;
        let last = stations.last().zip(stations.first()).filter(|_| self.measured.told.is_closed);
        for (a, b) in stations.iter().zip(stations.iter().skip(1)).chain(last) {
            let Some(ends) = screen.line([a.point_mm, b.point_mm]) else { continue };
            if faces(a) && faces(b) {
                marks::line(painter, ends, 2.0, COLOR);
            } else {
                painter.line_segment(ends, Stroke::new(1.0, COLOR.gamma_multiply(0.5)));
            }
        }
        if let Some(at) = self.hovered.and_then(|n| stations.get(n)).and_then(|station| screen.point(station.point_mm)) {
            marks::dot(painter, at, 6.0, Color32::WHITE);
        }
    }
}
