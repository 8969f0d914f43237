//! What a click on bone does: a strip of tools beside the picture.

use super::super::measured::Tool;
use egui::{Color32, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, vec2};

/// Side of a tool's square, in points.
const SIDE: f32 = 30.0;

/// Shows the tools; `keys` says a tool's key. Gives the tool that is chosen.
pub fn show(ui: &mut Ui, chosen: Tool, keys: impl Fn(Tool) -> String) -> Option<Tool> {
    let mut taken = None;
    ui.add_space(6.0);
    for tool in Tool::ALL {
        let [name, what] = tool.text();
        let (rect, response) = ui.allocate_exact_size(vec2(SIDE, SIDE), Sense::click());
        response.widget_info(|| WidgetInfo::selected(Role::RadioButton, true, tool == chosen, name));
        let visuals = ui.style().interact_selectable(&response, tool == chosen);
        if tool == chosen || response.hovered() {
            ui.painter().rect_filled(rect, 4.0, visuals.bg_fill);
        }
        sign(ui.painter(), tool, rect.shrink(6.0), visuals.fg_stroke.color);
        let key = keys(tool);
        let key = if key.is_empty() { key } else { format!("  ({key})") };
        if response.on_hover_text(format!("{name}{key}\n{what}")).clicked() {
            taken = Some(tool);
        }
    }
    taken
}

/// A small drawing of what the tool does: the surface as an arc, what is measured as a line or a dot.
fn sign(painter: &Painter, tool: Tool, rect: Rect, color: Color32) {
    let at = |x: f32, y: f32| rect.lerp_inside(vec2(x, y));
    let (thin, thick) = (Stroke::new(1.2, color), Stroke::new(2.0, color));
    let arc: Vec<Pos2> = (0..=12).map(|n| n as f32 / 12.0).map(|x| at(x, 0.45 - 1.2 * x * (1.0 - x) + 0.35)).collect();
    if tool != Tool::Points {
        painter.add(Shape::line(arc, thin));
    }
    match tool {
        Tool::View => painter.arrow(at(0.05, 0.05), at(0.75, 0.75) - at(0.05, 0.05), thick),
        Tool::Normal => painter.arrow(at(0.5, 0.0), at(0.5, 0.9) - at(0.5, 0.0), thick),
        Tool::Points => {
            painter.line_segment([at(0.1, 0.85), at(0.9, 0.15)], thick);
            for end in [at(0.1, 0.85), at(0.9, 0.15)] {
                painter.circle_filled(end, 3.0, color);
            }
        }
        Tool::Landmark => {
            painter.circle_filled(at(0.5, 0.5), 3.5, color);
        }
    }
}
