//! The difference ray drawn: a bar for each volume, bone filled, and the density below, on one scale of millimetres.

use super::super::picture::cast::Found;
use bregma_measure::numbers::{fixed, suffix};
use bregma_session::views::round_down;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rangef, Rect, Role, Sense, Shape, Stroke, TextWrapMode, Ui, WidgetInfo, WidgetText};
use egui::{TextStyle, pos2, vec2};

const BAR: f32 = 18.0;
const GAP: f32 = 4.0;
const PROFILE: f32 = 110.0;
const AXIS: f32 = 18.0;
/// Room for the profile's numbers, and for short names.
const LEFT: f32 = 46.0;

/// The stretch of the ray that is drawn, and where.
struct Scale {
    from_mm: f64,
    to_mm: f64,
    x: Rangef,
}

impl Scale {
    fn x_of(&self, t_mm: f64) -> f32 {
        self.x.min + ((t_mm - self.from_mm) / (self.to_mm - self.from_mm)) as f32 * self.x.span()
    }

    fn mm_at(&self, x: f32) -> f64 {
        self.from_mm + f64::from((x - self.x.min) / self.x.span()) * (self.to_mm - self.from_mm)
    }
}

/// Shows bars and profile over the width that is there, with a line where the mouse is along the ray, here or elsewhere.
pub fn show(ui: &mut Ui, found: &Found, hovered_mm: &mut Option<f64>) {
    let Some([from_mm, to_mm]) = found.shown_mm() else { return };
    let bars = found.ray.volumes.len() as f32 * (BAR + GAP);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), bars + PROFILE + AXIS), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Bone and density along the ray"));
    let scale = Scale { from_mm, to_mm, x: Rangef::new(rect.left() + LEFT, rect.right() - 10.0) };
    for (n, (volume, color)) in found.volumes().enumerate() {
        let top = rect.top() + n as f32 * (BAR + GAP);
        let row = Rangef::new(top, top + BAR);
        let name = WidgetText::from(&volume.name).into_galley(ui, Some(TextWrapMode::Truncate), LEFT - 6.0, TextStyle::Small);
        ui.painter().galley(pos2(rect.left(), row.center() - name.size().y / 2.0), name, ui.visuals().text_color());
        ui.painter().rect_filled(Rect::from_x_y_ranges(scale.x, row), 2.0, ui.visuals().extreme_bg_color);
        let bones: Vec<[f64; 2]> = volume.segments.iter().map(|s| [s.from_mm, s.to_mm]).collect();
        let lengths: Vec<String> = volume.segments.iter().map(|s| fixed(s.length_mm, 2)).collect();
        bones_in(ui.painter(), &scale, row, &bones, &lengths, color);
    }
    let plot = Rect::from_x_y_ranges(scale.x, rect.top() + bars..=rect.top() + bars + PROFILE);
    profile(ui, found, &scale, plot);
    axis(ui, &scale, plot.bottom());
    if let Some(at) = response.hover_pos().filter(|p| scale.x.contains(p.x)) {
        let t_mm = scale.mm_at(at.x);
        *hovered_mm = Some(t_mm);
        response.on_hover_text_at_pointer(values(found, t_mm));
    }
    if let Some(t_mm) = hovered_mm.filter(|t| (from_mm..=to_mm).contains(t)) {
        let line = Stroke::new(1.0, ui.visuals().strong_text_color());
        ui.painter().vline(scale.x_of(t_mm), rect.top()..=plot.bottom(), line);
    }
}

/// The stretches of bone of one volume; a length stands in its stretch, else beside it where its neighbours leave room.
fn bones_in(painter: &Painter, scale: &Scale, row: Rangef, bones: &[[f64; 2]], lengths: &[String], color: Color32) {
    for (k, ([from, to], length)) in bones.iter().zip(lengths).enumerate() {
        let left = scale.x_of(*from);
        let bone = Rect::from_x_y_ranges(left..=scale.x_of(*to).max(left + 1.0), row);
        painter.rect_filled(bone, 1.0, color);
        let room_right = bones.get(k + 1).map_or(scale.x.max, |next| scale.x_of(next[0])) - bone.right();
        let room_left = bone.left() - k.checked_sub(1).map_or(scale.x.min, |before| scale.x_of(bones[before][1]));
        let text = painter.layout_no_wrap(length.clone(), FontId::proportional(12.5), Color32::PLACEHOLDER);
        let y = bone.center().y - text.size().y / 2.0;
        let width = text.size().x;
        if width + 6.0 < bone.width() {
            painter.galley(pos2(bone.center().x - width / 2.0, y), text, Color32::BLACK);
        } else if width + 10.0 < room_right {
            painter.galley(pos2(bone.right() + 5.0, y), text, color);
        } else if 2.0 * width + 20.0 < room_left {
            painter.galley(pos2(bone.left() - 5.0 - width, y), text, color);
        }
    }
}

/// The density along the ray in each volume, with its isovalue.
fn profile(ui: &Ui, found: &Found, scale: &Scale, plot: Rect) {
    let values = found.profiles.iter().flatten().map(|p| p[1]).chain(found.volumes().map(|(v, _)| v.iso));
    let Some([low, high]) = values.map(|v| [v; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else { return };
    let span = if high > low { 1.1 * (high - low) } else { 1.0 };
    let lowest = 0.5 * (low + high - span);
    let y_of = |value: f64| plot.bottom() - ((value - lowest) / span) as f32 * plot.height();
    let painter = ui.painter();
    painter.rect_filled(plot, 2.0, ui.visuals().extreme_bg_color);
    let weak = ui.visuals().weak_text_color();
    for (value, text) in ticks(lowest, lowest + span, plot.height() / 28.0) {
        let y = y_of(value);
        painter.hline(scale.x, y, Stroke::new(0.5, weak.gamma_multiply(0.5)));
        painter.text(pos2(plot.left() - 4.0, y), Align2::RIGHT_CENTER, text, FontId::proportional(10.5), weak);
    }
    let inside = painter.with_clip_rect(plot.intersect(ui.clip_rect()));
    for ((volume, color), points) in found.volumes().zip(&found.profiles) {
        let y = y_of(volume.iso);
        let level = [pos2(plot.left(), y), pos2(plot.right(), y)];
        inside.extend(Shape::dashed_line(&level, Stroke::new(1.0, color.gamma_multiply(0.6)), 4.0, 4.0));
        let curve: Vec<Pos2> = points.iter().map(|[t, value]| pos2(scale.x_of(*t), y_of(*value))).collect();
        inside.add(Shape::line(curve, Stroke::new(1.5, color)));
    }
}

/// What the volumes have at `t_mm`.
fn values(found: &Found, t_mm: f64) -> String {
    let mut text = format!("{} mm along the ray", fixed(t_mm, 2));
    for ((volume, _), points) in found.volumes().zip(&found.profiles) {
        let after = points.partition_point(|[t, _]| *t < t_mm);
        if let Some([_, value]) = points.get(after).filter(|_| after > 0) {
            text += &format!("\n{}: {}{}", volume.name, fixed(*value, 0), suffix(volume.unit));
        }
    }
    text
}

/// Millimetres below a plot.
fn axis(ui: &Ui, scale: &Scale, top: f32) {
    let color = ui.visuals().weak_text_color();
    // Numbers need about 60 points each.
    let ticks = ticks(scale.from_mm, scale.to_mm, scale.x.span() / 60.0);
    let last = ticks.len().saturating_sub(1);
    for (n, (t_mm, text)) in ticks.into_iter().enumerate() {
        let x = scale.x_of(t_mm);
        ui.painter().vline(x, top..=top + 3.0, Stroke::new(1.0, color));
        let text = if n == last { text + " mm" } else { text };
        // The last may not lead out of the plot.
        let anchor = if x + 24.0 > scale.x.max { Align2::RIGHT_TOP } else { Align2::CENTER_TOP };
        let x = if x + 24.0 > scale.x.max { x + 10.0 } else { x };
        ui.painter().text(pos2(x, top + 4.0), anchor, text, FontId::proportional(11.0), color);
    }
}

/// Round values from `low` to `high`, at most about `count` of them but at least two, with as many digits as tell them apart.
fn ticks(low: f64, high: f64, count: f32) -> Vec<(f64, String)> {
    // Of 1, 2, 5 and their decades the next larger, whose reciprocals are of them too, unless that leaves no two numbers.
    let step = (1.0 / round_down(f64::from(count.max(1.0)) / (high - low))).min(round_down(0.5 * (high - low)));
    if !(step > 0.0 && step.is_finite()) {
        return vec![];
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step).ceil() as i64;
    let number = |n: i64| (n as f64 * step, format!("{:.decimals$}", n as f64 * step + 0.0));
    (first..).map(number).take_while(|(value, _)| *value <= high).collect()
}

#[cfg(test)]
mod tests {
    use super::ticks;

    #[test]
    fn an_axis_has_at_least_two_different_numbers_and_no_negative_zero() {
        // Fails if an axis shows only "0", or "-0", at any extent of a ray.
        for (low, high) in [(-0.3, 12.0), (-1e-4, 2e-3), (100.02, 100.07), (-950.0, 2400.0), (-1e-9, 1e-9)] {
            for count in [1.0, 2.5, 5.0, 9.0] {
                let found = ticks(low, high, count);
                assert!(found.len() >= 2, "{low} to {high}, {count}: {found:?}");
                assert!(found.windows(2).all(|pair| pair[0].1 != pair[1].1), "{found:?}");
                assert!(found.iter().all(|(_, text)| !text.starts_with("-0.0") || text.contains(['1', '2', '5'])), "{found:?}");
                assert!(found.iter().all(|(_, text)| text != "-0"));
            }
        }
    }
}
