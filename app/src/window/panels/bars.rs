//! The difference ray as bars: one for each volume, bone filled, on one scale of millimetres.

use super::super::picture::cast::Found;
use super::super::picture::marks::round_down;
use egui::{Align2, Color32, FontId, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

const BAR: f32 = 18.0;
const GAP: f32 = 4.0;
const AXIS: f32 = 18.0;

/// Shows the bars over the width that is there, with a line where the mouse is along the ray, here or elsewhere.
pub fn show(ui: &mut Ui, found: &Found, hovered_mm: &mut Option<f64>) {
    let Some([from, to]) = found.shown_mm() else { return };
    let count = found.ray.volumes.len() as f32;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), count * (BAR + GAP) + AXIS), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Bone along the ray"));
    let painter = ui.painter_at(rect);
    let font = FontId::proportional(13.0);
    let names: Vec<_> =
        found.volumes().map(|(v, _)| painter.layout_no_wrap(v.name.clone(), font.clone(), ui.visuals().text_color())).collect();
    let widest = names.iter().fold(0.0_f32, |w, g| w.max(g.size().x)).min(rect.width() / 4.0);
    let plot = Rect::from_min_max(pos2(rect.left() + widest + 10.0, rect.top()), rect.max - vec2(12.0, AXIS));
    let width = to - from;
    let x_of = |t: f64| plot.left() + ((t - from) / width) as f32 * plot.width();

    for (n, ((volume, color), name)) in found.volumes().zip(names).enumerate() {
        let top = plot.top() + n as f32 * (BAR + GAP);
        let row = Rect::from_min_max(pos2(plot.left(), top), pos2(plot.right(), top + BAR));
        let label = Rect::from_min_max(pos2(rect.left(), top), pos2(rect.left() + widest, top + BAR));
        let name_at = pos2(label.left(), label.center().y - name.size().y / 2.0);
        painter.with_clip_rect(label).galley(name_at, name, ui.visuals().text_color());
        painter.rect_filled(row, 2.0, ui.visuals().extreme_bg_color);
        for (k, s) in volume.segments.iter().enumerate() {
            let bone = Rect::from_x_y_ranges(x_of(s.from_mm)..=x_of(s.to_mm).max(x_of(s.from_mm) + 1.0), row.y_range());
            painter.rect_filled(bone, 1.0, color);
            // The length stands in the bar, else beside it where its neighbours leave room.
            let room_right = volume.segments.get(k + 1).map_or(plot.right(), |next| x_of(next.from_mm)) - bone.right();
            let room_left = bone.left() - k.checked_sub(1).map_or(plot.left(), |before| x_of(volume.segments[before].to_mm));
            let text = painter.layout_no_wrap(format!("{:.2}", s.length_mm), font.clone(), Color32::PLACEHOLDER);
            let y = bone.center().y - text.size().y / 2.0;
            if text.size().x + 6.0 < bone.width() {
                painter.galley(pos2(bone.center().x - text.size().x / 2.0, y), text, Color32::BLACK);
            } else if text.size().x + 10.0 < room_right {
                painter.galley(pos2(bone.right() + 5.0, y), text, color);
            } else if 2.0 * text.size().x + 20.0 < room_left {
                painter.galley(pos2(bone.left() - 5.0 - text.size().x, y), text, color);
            }
        }
    }
    axis(ui, plot, from, width);
    if let Some(at) = response.hover_pos().filter(|p| plot.x_range().contains(p.x)) {
        let t = from + f64::from((at.x - plot.left()) / plot.width()) * width;
        *hovered_mm = Some(t);
        response.on_hover_text_at_pointer(format!("{t:.2} mm along the ray"));
    }
    if let Some(t) = hovered_mm.filter(|t| (from..=to).contains(t)) {
        painter.vline(x_of(t), plot.y_range(), Stroke::new(1.0, ui.visuals().strong_text_color()));
    }
}

fn axis(ui: &Ui, plot: Rect, from: f64, width: f64) {
    let color = ui.visuals().weak_text_color();
    // Numbers need about 70 points each.
    let step = round_down(width * 140.0 / f64::from(plot.width()).max(140.0));
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let mut tick = (from / step).ceil();
    while tick * step <= from + width {
        let x = plot.left() + ((tick * step - from) / width) as f32 * plot.width();
        ui.painter().vline(x, plot.bottom()..=plot.bottom() + 3.0, Stroke::new(1.0, color));
        let text = format!("{:.decimals$} mm", tick * step);
        ui.painter().text(pos2(x, plot.bottom() + 4.0), Align2::CENTER_TOP, text, FontId::proportional(11.0), color);
        tick += 1.0;
    }
}
