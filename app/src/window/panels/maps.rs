//! What the panels of maps share: where a map is measured, and its colours with how much of the surface has each.

use bregma_session::Landmark;
use egui::{Align2, Color32, CursorIcon, DragValue, FontId, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

/// Asks whether a map is of the whole surface, or of how many mm around the last landmark.
pub fn place(ui: &mut Ui, patch_mm: &mut Option<f64>, last: Option<&Landmark>) {
    ui.horizontal(|ui| {
        let mut everywhere = patch_mm.is_none() || last.is_none();
        ui.radio_value(&mut everywhere, true, "Whole surface").on_hover_text("Whatever is cut to look at it");
        ui.add_enabled_ui(last.is_some(), |ui| {
            let hint = "A landmark says where (Measure › Landmark): the last one counts";
            ui.radio_value(&mut everywhere, false, "Around a landmark").on_hover_text(hint).on_disabled_hover_text(hint);
        });
        *patch_mm = if everywhere { None } else { Some(patch_mm.unwrap_or(20.0)) };
    });
    if let (Some(patch_mm), Some(last)) = (patch_mm, last) {
        ui.horizontal(|ui| {
            ui.weak("within");
            ui.add(DragValue::new(patch_mm).range(0.5..=1000.0).speed(0.2).max_decimals(1).suffix(" mm"))
                .accessible_name("Radius of the patch");
            ui.weak(format!("of {}", last.name));
        });
    }
}

/// The colours of a map.
pub struct Legend<'a> {
    /// What it is called.
    pub name: &'static str,
    /// What is said of it.
    pub hint: &'static str,
    /// Values of the first and the last colour, mm.
    pub ends_mm: [f64; 2],
    /// The colour of a value; sRGB.
    pub color: &'a dyn Fn(f64) -> [u8; 3],
    /// How much of the surface has a value, of that which most of it has.
    pub share: &'a dyn Fn(f64) -> Option<f64>,
    /// How a value is written.
    pub text: &'a dyn Fn(f64) -> String,
    /// Values that are written, evenly from end to end.
    pub texts: usize,
}

impl Legend<'_> {
    /// The colours with their millimetres, and above them how much of the surface has each. Gives the ends that a hand has drawn them to: the nearer
    /// end goes with the hand.
    pub fn show(&self, ui: &mut Ui) -> Option<[f64; 2]> {
        let (rect, response) = ui.allocate_exact_size(vec2(280.0, 78.0), Sense::drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, self.name));
        let ([low, high], painter) = (self.ends_mm, ui.painter_at(rect));
        let bar = Rect::from_min_max(rect.min + vec2(20.0, 44.0), rect.max - vec2(32.0, 20.0));
        for n in 0..bar.width() as usize {
            let mm = low + (high - low) * (n as f64 + 0.5) / f64::from(bar.width());
            let [r, g, b] = (self.color)(mm);
            let x = bar.left() + n as f32;
            let column = |top: f32, bottom: f32| Rect::from_min_max(pos2(x, top), pos2(x + 1.0, bottom));
            painter.rect_filled(column(bar.top(), bar.bottom()), 0.0, Color32::from_rgb(r, g, b));
            if let Some(share) = (self.share)(mm) {
                let height = share as f32 * 40.0;
                painter.rect_filled(column(bar.top() - 2.0 - height, bar.top() - 2.0), 0.0, Color32::from_gray(150));
            }
        }
        let last = self.texts - 1;
        for n in 0..=last {
            let part = n as f32 / last as f32;
            let text = (self.text)(low + (high - low) * f64::from(part));
            let at = pos2(bar.left() + part * bar.width(), bar.bottom() + 3.0);
            let text = if n == last { text + " mm" } else { text };
            painter.text(at, Align2::CENTER_TOP, text, FontId::proportional(12.0), ui.visuals().text_color());
        }
        let from = ui.input(|i| i.pointer.press_origin());
        let drawn = response.dragged().then_some(from).flatten().map(|from| {
            // What a point of the bar is worth stays while it is held, so that the end lies under the hand.
            let by = f64::from(response.drag_delta().x / bar.width()) * (high - low);
            // Outward makes the range wider.
            if from.x < bar.center().x { [low + by, high] } else { [low, high + by] }
        });
        response.on_hover_cursor(CursorIcon::ResizeHorizontal).on_hover_text(self.hint);
        drawn.filter(|[low, high]| low < high)
    }
}
