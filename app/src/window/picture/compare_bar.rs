//! How two scans are compared: the chooser above the picture, and the line of the swipe in it.

use super::marks;
use bregma_session::{Compare, Opened};
use egui::{
    Align2, Color32, ComboBox, Context, CursorIcon, DragValue, Painter, PointerButton, Pos2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2,
};
use std::mem::discriminant;

/// Each kind as it begins, its name, and what it shows.
const KINDS: [(Compare, &str, &str); 5] = [
    (Compare::Off, "Together", "All scans in one picture"),
    (Compare::SideBySide, "Side by side", "One scan left, the other right, turned together"),
    (Compare::Swipe { part: 0.5 }, "Swipe", "One scan left of a line that can be dragged, the other right of it"),
    (Compare::Checkerboard { size_px: 64 }, "Checkerboard", "Both by turns, as on a chessboard: edges that do not meet are seen"),
    (Compare::Flicker { per_s: 2.0 }, "Flicker", "Both by turns in time: what differs moves"),
];

/// The chooser.
pub fn show(ui: &mut Ui, opened: &mut Opened) {
    if opened.compare != Compare::Off && opened.volumes.len() > 2 {
        pair(ui, opened);
    }
    let compare = &mut opened.compare;
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
    combo
        .response
        .on_hover_text("How two scans are compared: the first two visible ones, or those chosen beside")
        .accessible_name("Compare");
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

/// The choosers of the two scans.
fn pair(ui: &mut Ui, opened: &mut Opened) {
    let Some(now) = opened.compared() else { return };
    // From right to left, as all beside the menus.
    for side in [1, 0] {
        let name = ["First scan compared", "Second scan compared"][side];
        let mut chosen = now[side];
        let combo = ComboBox::from_id_salt(name).selected_text(opened.volumes[chosen].name()).width(90.0).truncate().show_ui(ui, |ui| {
            for (n, volume) in opened.volumes.iter().enumerate() {
                ui.selectable_value(&mut chosen, n, volume.name());
            }
        });
        combo.response.on_hover_text(name).accessible_name(name);
        if chosen != now[side] {
            let mut pair = now;
            // The one that is there already gives its side up.
            if pair[1 - side] == chosen {
                pair[1 - side] = pair[side];
            }
            pair[side] = chosen;
            opened.pair = Some(pair);
        }
    }
}

/// Between a name and the letter beside it, and about the width of its own letters, in points.
const ROOM: f32 = 24.0;
const LETTER: f32 = 7.5;

/// Says in the picture which scan is where: `at_s` is the time of a flicker.
pub fn names(painter: &Painter, opened: &Opened, rect: Rect, at_s: f64) {
    let Some([first, second]) = opened.compared().map(|pair| pair.map(|n| opened.volumes[n].name())) else { return };
    let [left, right] = [rect.left_top() + vec2(8.0, 6.0), rect.right_top() + vec2(-8.0, 6.0)];
    let middle = rect.center_top() + vec2(8.0, 6.0);
    let both: &[(Pos2, Align2, &str)] = match opened.compare {
        Compare::Off => &[],
        Compare::SideBySide => &[(left, Align2::LEFT_TOP, first), (middle, Align2::LEFT_TOP, second)],
        Compare::Swipe { .. } | Compare::Checkerboard { .. } => &[(left, Align2::LEFT_TOP, first), (right, Align2::RIGHT_TOP, second)],
        Compare::Flicker { .. } => &[(left, Align2::LEFT_TOP, if opened.compare.turn(at_s).is_multiple_of(2) { first } else { second })],
    };
    // A name keeps clear of the letter in the middle of its side.
    let views = if opened.compare == Compare::SideBySide { 2.0 } else { 1.0 };
    let most = ((rect.width() / (2.0 * views) - ROOM) / LETTER).max(4.0) as usize;
    for (at, anchor, name) in both {
        let short =
            if name.chars().count() > most { format!("{}…", name.chars().take(most).collect::<String>()) } else { (*name).to_owned() };
        marks::text(painter, *at, *anchor, &short, 13.0);
    }
}

/// The parts of the screen that show the scene, with their pixels: one, or two side by side.
pub fn panes(opened: &Opened, rect: Rect, size: [u32; 2]) -> Vec<(Rect, [u32; 2])> {
    let is_side = opened.compare == Compare::SideBySide;
    let mut left = rect.left();
    let pane = |[width, height]: [u32; 2]| {
        let right = left + width as f32 / size[0] as f32 * rect.width();
        let pane = Rect::from_x_y_ranges(left..=right, rect.y_range());
        left = if is_side { right } else { left };
        (pane, [width, height])
    };
    let mut panes: Vec<_> = opened.compare.sizes(opened.compared(), size).into_iter().map(pane).collect();
    panes.truncate(if is_side { 2 } else { 1 });
    panes
}

/// Has the window drawn again when a flicker shows the other scan.
pub fn ask_at_turn(ctx: &Context, compare: Compare) {
    if let Compare::Flicker { per_s } = compare {
        let at_s = ctx.time();
        ctx.request_repaint_after_secs((((at_s * per_s).floor() + 1.0) / per_s - at_s) as f32);
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
