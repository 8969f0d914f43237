//! Boxes, cylinders and spheres moved and sized by hand: dots on them in the picture.

use super::cut_handles::{self, COLOR};
use super::marks::{self, Screen};
use super::navigate::{mm_per_pixel, mm_per_pixel_at};
use bregma_renderer::{Scene, Shape};
use egui::{CursorIcon, PointerButton, Pos2, Rect, Role, Sense, Ui, Vec2, WidgetInfo, vec2};
use glam::DVec3;

/// The least size and the least radius of a cut, mm: less than a sample.
pub const LEAST_MM: f64 = 0.1;

/// A dot takes hold of the mouse within so many points.
const REACH: f32 = 8.0;

/// What a dot moves.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    /// The whole.
    Centre,
    /// The face of a box on the high or the low side of an axis.
    Face { axis: usize, is_high: bool },
    /// How far the surface lies from the centre.
    Radius,
}

/// A dot: what it moves, its name, where it is, and which way it goes: any way in the view where there is none.
struct Dot {
    part: Part,
    name: &'static str,
    at_mm: DVec3,
    along: Option<DVec3>,
}

/// The faces of a box, the low and the high one of each axis.
const FACES: [[&str; 2]; 3] = [["Right face", "Left face"], ["Anterior face", "Posterior face"], ["Inferior face", "Superior face"]];

/// Shows the dots of the enabled cuts that are no planes: a drag of the centre moves one, of a face or the radius sizes it. Gives where a dot was
/// clicked: that is meant for what lies under it.
pub fn show(ui: &Ui, scene: &mut Scene, rect: Rect, size: [u32; 2]) -> Option<Pos2> {
    let mut clicked = None;
    let camera = scene.camera;
    let screen = Screen { camera: &camera, rect, size };
    let painter = ui.painter_at(rect);
    for (n, clip) in scene.clips.iter_mut().enumerate().filter(|(_, clip)| clip.enabled) {
        for dot in dots(&clip.shape, &screen) {
            let Some(at) = screen.point(dot.at_mm).filter(|at| rect.contains(*at)) else { continue };
            let grip = Rect::from_center_size(at, vec2(2.0 * REACH, 2.0 * REACH));
            let response = ui.interact(grip.intersect(rect), ui.scope_id().with(("solid", n, dot.name)), Sense::click_and_drag());
            let name = format!("{} dot of cut {}", dot.name, n + 1);
            response.widget_info(|| WidgetInfo::labeled(Role::Button, true, name.clone()));
            if response.dragged_by(PointerButton::Primary) {
                drag(&mut clip.shape, &dot, &screen, response.drag_delta());
            }
            if response.clicked_by(PointerButton::Primary) {
                clicked = response.interact_pointer_pos();
            }
            let strong = response.hovered() || response.dragged();
            marks::dot(&painter, at, if strong { 6.0 } else { 4.5 }, COLOR);
            let does = if dot.part == Part::Centre { "move" } else { "size" };
            response.on_hover_and_drag_cursor(CursorIcon::Grab).on_hover_text(format!("{} of cut {}: drag to {does} it", dot.name, n + 1));
        }
    }
    clicked
}

fn dots(shape: &Shape, screen: &Screen<'_>) -> Vec<Dot> {
    let dot = |part, name, at_mm, along| Dot { part, name, at_mm, along };
    match *shape {
        Shape::Plane { .. } => vec![],
        Shape::Box { low_mm, high_mm } => {
            let centre_mm = 0.5 * (low_mm + high_mm);
            let face = |n: usize| {
                let (axis, is_high) = (n / 2, n % 2 == 1);
                let mut at_mm = centre_mm;
                at_mm[axis] = if is_high { high_mm[axis] } else { low_mm[axis] };
                dot(Part::Face { axis, is_high }, FACES[axis][n % 2], at_mm, Some(DVec3::AXES[axis]))
            };
            (0..6).map(face).chain([dot(Part::Centre, "Centre", centre_mm, None)]).collect()
        }
        Shape::Cylinder { centre_mm, axis, radius_mm } => {
            let along = sideways(screen, centre_mm, radius_mm, |way| way.reject_from_normalized(axis).try_normalize());
            let along = along.unwrap_or(axis.any_orthonormal_vector());
            vec![dot(Part::Radius, "Radius", centre_mm + radius_mm * along, Some(along)), dot(Part::Centre, "Centre", centre_mm, None)]
        }
        Shape::Sphere { centre_mm, radius_mm } => {
            let along = sideways(screen, centre_mm, radius_mm, Some).unwrap_or(screen.camera.basis().right);
            vec![dot(Part::Radius, "Radius", centre_mm + radius_mm * along, Some(along)), dot(Part::Centre, "Centre", centre_mm, None)]
        }
    }
}

/// Of right, left, up and down in the picture, each as `allowed` of it, the first in which the surface is seen; else the first.
fn sideways(screen: &Screen<'_>, centre_mm: DVec3, radius_mm: f64, allowed: impl Fn(DVec3) -> Option<DVec3>) -> Option<DVec3> {
    let basis = screen.camera.basis();
    let mut ways = [basis.right, -basis.right, basis.up, -basis.up].into_iter().filter_map(&allowed);
    let is_seen = |way: &DVec3| screen.point(centre_mm + radius_mm * *way).is_some_and(|at| screen.rect.shrink(REACH).contains(at));
    ways.clone().find(is_seen).or_else(|| ways.next())
}

/// What becomes of a shape when the mouse takes a dot of it along.
fn drag(shape: &mut Shape, dot: &Dot, screen: &Screen<'_>, delta: Vec2) {
    let (camera, height) = (screen.camera, f64::from(screen.rect.height()));
    let basis = camera.basis();
    let Some(along) = dot.along else {
        let by = delta * mm_per_pixel_at(camera, dot.at_mm, height) as f32;
        move_by(shape, f64::from(by.x) * basis.right - f64::from(by.y) * basis.up);
        return;
    };
    let mm_per_point = mm_per_pixel(camera, height);
    let Some(arrow) = cut_handles::arrow(screen, dot.at_mm, along, mm_per_point) else { return };
    size_by(shape, dot.part, cut_handles::along(delta, arrow, along.dot(basis.forward), mm_per_point));
}

fn move_by(shape: &mut Shape, shift_mm: DVec3) {
    match shape {
        Shape::Plane { .. } => {}
        Shape::Box { low_mm, high_mm } => (*low_mm, *high_mm) = (*low_mm + shift_mm, *high_mm + shift_mm),
        Shape::Cylinder { centre_mm, .. } | Shape::Sphere { centre_mm, .. } => *centre_mm += shift_mm,
    }
}

fn size_by(shape: &mut Shape, part: Part, by_mm: f64) {
    match (shape, part) {
        (Shape::Box { low_mm, high_mm }, Part::Face { axis, is_high: true }) => {
            high_mm[axis] = (high_mm[axis] + by_mm).max(low_mm[axis] + LEAST_MM);
        }
        (Shape::Box { low_mm, high_mm }, Part::Face { axis, is_high: false }) => {
            low_mm[axis] = (low_mm[axis] + by_mm).min(high_mm[axis] - LEAST_MM);
        }
        (Shape::Cylinder { radius_mm, .. } | Shape::Sphere { radius_mm, .. }, Part::Radius) => {
            *radius_mm = (*radius_mm + by_mm).max(LEAST_MM);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_renderer::{Bounds, Camera};
    use egui::pos2;

    #[test]
    fn dots_follow_the_mouse_and_nothing_is_turned_inside_out() {
        // Fails if a dot is left behind by the mouse, a drag moves what it should size, or a face passes the one across.
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(800.0, 600.0));
        let camera = Camera::orbit(&Bounds { centre_mm: DVec3::ZERO, radius_mm: 100.0 }, 30.0, 20.0);
        let screen = Screen { camera: &camera, rect, size: [800, 600] };
        let shapes = [
            Shape::Box { low_mm: DVec3::splat(-30.0), high_mm: DVec3::new(20.0, 30.0, 40.0) },
            Shape::Cylinder { centre_mm: DVec3::new(3.0, 4.0, 5.0), axis: DVec3::Z, radius_mm: 30.0 },
            Shape::Sphere { centre_mm: DVec3::new(3.0, 4.0, 5.0), radius_mm: 30.0 },
        ];
        for shape in shapes {
            for (n, dot) in dots(&shape, &screen).iter().enumerate() {
                let before = screen.point(dot.at_mm).unwrap();
                // Along its own way, and a little across, which changes nothing.
                let way = dot.along.map_or(vec2(12.0, -9.0), |along| {
                    let arrow = screen.point(dot.at_mm + along).unwrap() - before;
                    12.0 * arrow.normalized()
                });
                let mut moved = shape;
                drag(&mut moved, dot, &screen, way);
                let after = screen.point(dots(&moved, &screen)[n].at_mm).unwrap();
                // In perspective a way into the depth is not the same at both ends.
                assert!((after - before - way).length() < 2.0, "{shape:?} {}: {before} {after} by {way}", dot.name);
                let mut far = shape;
                drag(&mut far, dot, &screen, -1e4 * way);
                drag(&mut far, dot, &screen, 1e3 * way);
                assert!(bregma_renderer::Clip::all(far).is_sound(), "{far:?}");
            }
        }
    }
}
