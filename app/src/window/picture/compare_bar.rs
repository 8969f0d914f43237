//! How two scans are compared: the chooser above the picture, and the line of the swipe in it.

use super::marks;
use bregma_session::Compare;
use egui::{Color32, ComboBox, CursorIcon, DragValue, PointerButton, Rect, Role, Sense, Ui, WidgetInfo, pos2};
use std::mem::discriminant;

/// Each kind as it begins, its name, and what it shows.
const KINDS: [(Compare, &str, &str); 5] = [
    (Compare::Off, "Together", "All scans in one picture"),
    (Compare::SideBySide, "Side by side", "The first scan left, the second right, turned together"),
    (Compare::Swipe { part: 0.5 }, "Swipe", "The first scan left of a line that can be dragged, the second right of it"),
    (Compare::Checkerboard { size_px: 64 }, "Checkerboard", "The scans by turns, as on a chessboard: edges that do not meet are seen"),
    (Compare::Flicker { per_s: 2.0 }, "Flicker", "The scans by turns in time: what differs moves"),
];

/// The chooser.
pub fn show(ui: &mut Ui, compare: &mut Compare) {
    let same = |kind: &Compare| discriminant(kind) == discriminant(compare);
    let name = KINDS.iter().find(|(kind, ..)| same(kind)).map_or("", |(_, name, _)| name);
    let combo = ComboBox::from_id_salt("compare").selected_text(format!("Compare: {name}")).width(150.0).show_ui(ui, |ui| {
        for (kind, name, what) in KINDS {
            let chosen = discriminant(&kind) == discriminant(compare);
            if ui.selectable_label(chosen, name).on_hover_text(what).clicked() && !chosen {
                *compare = kind;
            }
        }
    });
    combo.response.on_hover_text("How the first two visible scans are compared").accessible_name("Compare");
    match compare {
        Compare::Checkerboard { size_px } => {
            ui.add(DragValue::new(size_px).range(4..=1024).suffix(" px")).accessible_name("Size of a square");
        }
        Compare::Flicker { per_s } => {
            let number = DragValue::new(per_s).range(0.2..=10.0).speed(0.02).max_decimals(1).suffix(" per s");
            ui.add(number).accessible_name("Changes per second");
        }
        Compare::Off | Compare::SideBySide | Compare::Swipe { .. } => {}
    }
}

/// The line of the swipe over the picture, which can be dragged.
pub fn line(ui: &Ui, compare: &mut Compare, rect: Rect) {
    let Compare::Swipe { part } = compare else { return };
    let x = rect.left() + *part as f32 * rect.width();
    let grip = Rect::from_x_y_ranges(x - 6.0..=x + 6.0, rect.y_range());
    let response = ui.interact(grip, ui.scope_id().with("swipe"), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Splitter, true, "Swipe line"));
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged_by(PointerButton::Primary)) {
        *part = f64::from(((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0));
    }
    let x = rect.left() + *part as f32 * rect.width();
    marks::line(&ui.painter_at(rect), [pos2(x, rect.top()), pos2(x, rect.bottom())], 1.5, Color32::WHITE);
    response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal).on_hover_text("Drag: left of it is the first scan, right the second");
}
