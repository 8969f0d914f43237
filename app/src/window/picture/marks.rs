//! What is drawn over the picture: anatomical directions, the scale bar, the difference ray.

use super::super::measured::NamedRay;
use super::super::widgets::color;
use super::cast::Found;
use super::navigate::mm_per_pixel;
use bregma_renderer::{Camera, Projection};
use bregma_session::views::{anatomical, round_down};
use bregma_session::{Landmark, Slices};
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

/// Where the world lies on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Screen<'a> {
    /// The view.
    pub camera: &'a Camera,
    /// The picture on the screen, in points.
    pub rect: Rect,
    /// Pixels of the picture.
    pub size: [u32; 2],
}

impl Screen<'_> {
    fn pixels_per_point(&self) -> f32 {
        self.size[1] as f32 / self.rect.height()
    }

    /// The pixel, as cameras count them, at a point of the screen.
    pub fn pixel(&self, p: Pos2) -> (f64, f64) {
        let p = (p - self.rect.min) * self.pixels_per_point();
        (f64::from(p.x) - 0.5, f64::from(p.y) - 0.5)
    }

    /// Where a point of the world is on the screen; nowhere behind the eye.
    pub fn point(&self, p: DVec3) -> Option<Pos2> {
        let (x, y) = self.camera.project(bregma_field::WorldPoint(p), self.size[0], self.size[1])?;
        Some(self.rect.min + vec2(x as f32 + 0.5, y as f32 + 0.5) / self.pixels_per_point())
    }

    /// A stretch of the world on the screen; what lies behind the eye is left out.
    pub fn line(&self, ends: [DVec3; 2]) -> Option<[Pos2; 2]> {
        // A point on the eye's own plane has no place in the picture.
        const NEAREST_MM: f64 = 1e-3;
        let depth = |p: DVec3| (p - self.camera.eye_mm).dot(self.camera.basis().forward);
        let [a, b] = ends.map(depth);
        let clip = |p: DVec3, d: f64, q: DVec3, e: f64| if d >= NEAREST_MM { p } else { p + (q - p) * ((NEAREST_MM - d) / (e - d)) };
        if a.max(b) <= NEAREST_MM {
            return None;
        }
        Some([self.point(clip(ends[0], a, ends[1], b))?, self.point(clip(ends[1], b, ends[0], a))?])
    }
}

/// Text that stays legible on any background.
pub fn text(painter: &Painter, at: Pos2, anchor: Align2, text: &str, size: f32) {
    let font = FontId::proportional(size);
    for shift in [vec2(1.0, 1.0), vec2(-1.0, 1.0), vec2(1.0, -1.0), vec2(-1.0, -1.0)] {
        painter.text(at + shift, anchor, text, font.clone(), Color32::from_black_alpha(140));
    }
    painter.text(at, anchor, text, font, Color32::from_gray(235));
}

/// The name of a view, and where it lies, in its upper left corner.
pub fn title(painter: &Painter, screen: &Screen<'_>, name: &str) {
    text(painter, screen.rect.left_top() + vec2(8.0, 6.0), Align2::LEFT_TOP, name, 13.0);
}

/// Half the length of the arms of the cross in the picture, in points.
const ARM: f64 = 14.0;

/// The point that all slices go through, with an arm along each of their axes.
pub fn cross(painter: &Painter, screen: &Screen<'_>, slices: &Slices) {
    let arm_mm = ARM * mm_per_pixel(screen.camera, f64::from(screen.rect.height()));
    for axis in [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| arm_mm * (slices.turn * axis)) {
        if let Some(ends) = screen.line([slices.at_mm - axis, slices.at_mm + axis]) {
            line(painter, ends, 1.0, CROSS);
        }
    }
}

/// The lines on which a slice meets the other two, but for a gap around their point.
pub fn crosshair(painter: &Painter, screen: &Screen<'_>, at_mm: DVec3) {
    const GAP: f32 = 9.0;
    let Some(at) = screen.point(at_mm) else { return };
    let (rect, stroke) = (screen.rect, Stroke::new(1.0, CROSS.gamma_multiply(0.6)));
    for ends in [
        [Pos2::new(rect.left(), at.y), Pos2::new(at.x - GAP, at.y)],
        [Pos2::new(at.x + GAP, at.y), Pos2::new(rect.right(), at.y)],
        [Pos2::new(at.x, rect.top()), Pos2::new(at.x, at.y - GAP)],
        [Pos2::new(at.x, at.y + GAP), Pos2::new(at.x, rect.bottom())],
    ] {
        painter.line_segment(ends, stroke);
    }
}

/// Where a cut's plane n·x = offset meets a slice; none where they are parallel.
pub fn cut(screen: &Screen<'_>, normal: DVec3, offset_mm: f64) -> Option<[Pos2; 2]> {
    let basis = screen.camera.basis();
    let along = normal.cross(basis.forward).try_normalize()?;
    let across = normal.reject_from_normalized(basis.forward);
    let foot = screen.camera.target_mm + (offset_mm - normal.dot(screen.camera.target_mm)) / across.length_squared() * across;
    // Farther than any view.
    let half_mm = 2.0 * mm_per_pixel(screen.camera, 1.0) * f64::from(screen.rect.width() / screen.rect.height()).max(1.0);
    let middle = foot + (screen.camera.target_mm - foot).dot(along) * along;
    screen.line([middle - half_mm * along, middle + half_mm * along])
}

/// Of what belongs to slices.
const CROSS: Color32 = Color32::from_rgb(150, 220, 150);

/// A line with a dark edge, legible on any background.
pub fn line(painter: &Painter, ends: [Pos2; 2], width: f32, color: Color32) {
    painter.line_segment(ends, Stroke::new(width + 2.0, Color32::from_black_alpha(150)));
    painter.line_segment(ends, Stroke::new(width, color));
}

/// Stands out from bone, from both colours of a comparison, and from dark.
const HIT: Color32 = Color32::from_rgb(255, 215, 80);

/// Letters at the edges: which side of the body lies there.
pub fn directions(painter: &Painter, screen: &Screen<'_>) {
    let basis = screen.camera.basis();
    let r = screen.rect.shrink(8.0);
    for (at, anchor, direction) in [
        (r.left_center(), Align2::LEFT_CENTER, -basis.right),
        (r.right_center(), Align2::RIGHT_CENTER, basis.right),
        (r.center_top(), Align2::CENTER_TOP, basis.up),
        (r.center_bottom(), Align2::CENTER_BOTTOM, -basis.up),
    ] {
        text(painter, at, anchor, &anatomical(direction), 18.0);
    }
}

/// A bar with its length in millimetres.
pub fn scale_bar(ui: &Ui, screen: &Screen<'_>) {
    let mm_per_point = mm_per_pixel(screen.camera, f64::from(screen.rect.height()));
    let length_mm = round_down(mm_per_point * f64::from(screen.rect.width()) / 5.0);
    let points = (length_mm / mm_per_point) as f32;
    let right = screen.rect.right_bottom() - vec2(16.0, 16.0);
    let ends = [right - vec2(points, 0.0), right];
    let painter = ui.painter_at(screen.rect);
    let white = Color32::from_gray(235);
    line(&painter, ends, 2.0, white);
    for end in ends {
        line(&painter, [end - vec2(0.0, 4.0), end + vec2(0.0, 4.0)], 1.0, white);
    }
    text(&painter, right - vec2(points / 2.0, 5.0), Align2::CENTER_BOTTOM, &format!("{length_mm} mm"), 13.0);
    let hover = match screen.camera.projection {
        Projection::Perspective { .. } => "True at the depth of the centre of rotation; nearer things look larger (5: orthographic)",
        Projection::Orthographic { .. } => "True at every depth",
    };
    let area = Rect::from_two_pos(ends[0] - vec2(4.0, 22.0), ends[1] + vec2(4.0, 6.0));
    ui.interact(area, ui.make_persistent_id("scale bar"), Sense::hover()).on_hover_text(hover);
}

/// A ray that is not selected: a thin line in its colour, and its name.
pub fn other_ray(painter: &Painter, screen: &Screen<'_>, found: &Found, named: &NamedRay) {
    let (Some(first), Some(last), Some([enter, _])) = (found.ray.ledger.first(), found.ray.ledger.last(), found.extent_mm()) else {
        return;
    };
    let color = color(named.color);
    if let Some(ends) = screen.line([found.at(first.from_mm).0, found.at(last.to_mm).0]) {
        line(painter, ends, 1.0, color);
    }
    if let Some(hit) = screen.point(found.at(enter).0) {
        dot(painter, hit, 4.0, color);
        text(painter, hit + vec2(8.0, 0.0), Align2::LEFT_CENTER, &named.name, 13.0);
    }
}

/// Where the mouse is along the selected ray, in a bar or the profile.
pub fn hovered(painter: &Painter, screen: &Screen<'_>, found: &Found, t_mm: f64) {
    if let Some(at) = screen.point(found.at(t_mm).0) {
        dot(painter, at, 5.0, Color32::WHITE);
    }
}

/// A landmark.
pub fn landmark(painter: &Painter, screen: &Screen<'_>, landmark: &Landmark) {
    if let Some(at) = landmark.point_mm.and_then(|p| screen.point(p)) {
        painter.circle(at, 4.0, Color32::WHITE, Stroke::new(2.0, Color32::from_rgb(200, 30, 30)));
        text(painter, at + vec2(8.0, -8.0), Align2::LEFT_CENTER, &landmark.name, 13.0);
    }
}

/// The difference ray where it lies in the world: a thin line through the scans, and beside it the bone stretches of each
/// volume with their lengths. Seen from its own eye it is a dot.
pub fn ray(painter: &Painter, screen: &Screen<'_>, found: &Found) {
    let (Some(first), Some(last), Some([enter, _])) = (found.ray.ledger.first(), found.ray.ledger.last(), found.extent_mm()) else {
        return;
    };
    let at = |t: f64| found.at(t).0;
    let whole = screen.line([at(first.from_mm), at(last.to_mm)]);
    if let Some(ends) = whole {
        line(painter, ends, 1.0, Color32::from_gray(225));
    }
    // Where it first meets bone; from where it was cast, nothing else of it can be seen.
    if let Some(hit) = screen.point(at(enter)) {
        painter.circle_stroke(hit, 11.0, Stroke::new(3.5, Color32::from_black_alpha(150)));
        painter.circle_stroke(hit, 11.0, Stroke::new(1.5, HIT));
        if whole.is_some_and(|[a, b]| a.distance(b) < 24.0) {
            dot(painter, hit, 4.0, HIT);
            return;
        }
    }
    let count = found.ray.volumes.len();
    for (n, (volume, color)) in found.volumes().enumerate() {
        for segment in &volume.segments {
            let Some(ends) = screen.line([at(segment.from_mm), at(segment.to_mm)]) else { continue };
            let (along, length) = ((ends[1] - ends[0]).normalized(), ends[0].distance(ends[1]));
            // One track for each volume, side by side across the ray.
            let across = if length > 0.0 { along.rot90() } else { Vec2::ZERO };
            let track = across * ((n as f32 - (count as f32 - 1.0) / 2.0) * 7.0);
            let ends = ends.map(|p| p + track);
            line(painter, ends, 5.0, color);
            dot(painter, ends[0], 3.5, color);
            if length > 20.0 {
                let outward = if 2 * n < count { -across } else { across };
                let place = ends[0].lerp(ends[1], 0.5) + outward * 8.0;
                text(painter, place, anchor(outward), &format!("{:.2} mm", segment.length_mm), 13.0);
            }
        }
    }
}

/// What a scan is turned about by hand.
pub fn pivot(painter: &Painter, screen: &Screen<'_>, middle_mm: DVec3) {
    if let Some(at) = screen.point(middle_mm) {
        for stroke in [Stroke::new(3.5, Color32::from_black_alpha(150)), Stroke::new(1.5, HIT)] {
            painter.circle_stroke(at, 7.0, stroke);
        }
    }
}

/// A filled circle with a dark edge.
pub fn dot(painter: &Painter, at: Pos2, radius: f32, color: Color32) {
    painter.circle(at, radius, color, Stroke::new(1.5, Color32::from_black_alpha(200)));
}

/// The side of a text that faces the line it belongs to.
fn anchor(outward: Vec2) -> Align2 {
    let side = |v: f32| {
        if v > 0.4 {
            egui::Align::Min
        } else if v < -0.4 {
            egui::Align::Max
        } else {
            egui::Align::Center
        }
    };
    Align2([side(outward.x), side(outward.y)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::Bounds;
    use egui::pos2;

    #[test]
    fn a_ray_that_passes_the_eye_is_drawn_from_there_on() {
        let camera = Camera::orbit(&Bounds { centre_mm: DVec3::ZERO, radius_mm: 100.0 }, 0.0, 0.0);
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(400.0, 300.0));
        let screen = Screen { camera: &camera, rect, size: [800, 600] };
        let (behind, target) = (camera.eye_mm * 2.0 + DVec3::X, DVec3::ZERO);
        let [a, b] = screen.line([behind, target]).unwrap();
        assert!(a.is_finite() && (b - rect.center()).length() < 1e-3);
        assert_eq!(screen.line([behind, camera.eye_mm * 1.5]), None);
        let p = screen.point(DVec3::new(20.0, 0.0, 30.0)).unwrap();
        let (x, y) = screen.pixel(p);
        assert!(camera.ray(x, y, 800, 600).direction.cross(DVec3::new(20.0, 0.0, 30.0) - camera.eye_mm).length() < 1e-2);
    }
}
