//! Thin lines over the picture that say where cuts and scans end.

use super::super::widgets::color;
use super::cut_handles::COLOR;
use super::marks::{self, Screen};
use super::outlines::{around, box_edges, of_cut, on_plane};
use bregma_renderer::Shape;
use bregma_session::Opened;
use egui::{Color32, Painter, Stroke};
use glam::DVec3;

/// How strong what lies behind a box is, and a plane that is not the active one.
const DIM: f32 = 0.35;
/// How strong the many lines of a box, a cylinder and a sphere are.
const SOLID: f32 = 0.7;

/// The outline of each cut, that of number `active` stronger, and, where they are on, the boxes of the scans.
pub fn show(painter: &Painter, screen: &Screen<'_>, opened: &Opened, active: Option<usize>) {
    if !opened.boxes && opened.scene.clips.is_empty() {
        return;
    }
    let surfaces = opened.scene.surfaces(&opened.volumes).unwrap_or_default();
    let grids: Vec<_> = surfaces.iter().map(|(_, surface)| surface.grid.clone()).collect();
    if opened.boxes {
        for ((n, _), grid) in surfaces.iter().zip(&grids) {
            for (edge, is_hidden) in box_edges(&grid.corners_mm(), screen.camera) {
                let own = color(opened.scene.layers[*n].color);
                line(painter, screen, &edge, if is_hidden { own.gamma_multiply(DIM) } else { own });
            }
        }
    }
    let Some(shown) = around(&grids) else { return };
    for (n, clip) in opened.scene.clips.iter().enumerate().filter(|(_, clip)| clip.enabled) {
        let own = match clip.shape {
            Shape::Plane { .. } if active == Some(n) => COLOR,
            Shape::Plane { .. } => COLOR.gamma_multiply(DIM),
            _ => COLOR.gamma_multiply(SOLID),
        };
        of_cut(&clip.shape, shown, screen.camera).iter().for_each(|points| line(painter, screen, points, own));
    }
}

/// A thin line without an edge: many of them lie over the bone.
fn line(painter: &Painter, screen: &Screen<'_>, points: &[DVec3], color: Color32) {
    for ends in points.windows(2) {
        if let Some(ends) = screen.line([ends[0], ends[1]]) {
            painter.line_segment(ends, Stroke::new(1.0, color));
        }
    }
}

/// Where cuts meet a slice through `at_mm`.
pub fn on_slice(painter: &Painter, screen: &Screen<'_>, opened: &Opened, at_mm: DVec3) {
    let forward = screen.camera.basis().forward;
    let reach_mm = 2.0 * opened.bounds().radius_mm;
    for clip in opened.scene.clips.iter().filter(|clip| clip.enabled) {
        if let Shape::Plane { normal, offset_mm } = clip.shape
            && let Some(ends) = marks::cut(screen, normal, offset_mm)
        {
            marks::line(painter, ends, 1.5, COLOR);
        }
        for points in on_plane(&clip.shape, forward, at_mm, reach_mm) {
            let sides = points.windows(2).filter_map(|ends| screen.line([ends[0], ends[1]]));
            sides.for_each(|ends| marks::line(painter, ends, 1.5, COLOR));
        }
    }
}
