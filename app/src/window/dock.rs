//! How the window is divided: a side on the left and one on the right of the picture. Each can be folded to a strip; where the window is
//! narrow its contents come as a drawer over the picture, which keeps its size.

use egui::{
    Align2, Area, Color32, Context, CursorIcon, Frame, Id, Margin, Order, Panel, Rect, Role, Sense, Stroke, Ui, UiBuilder, Vec2, WidgetInfo,
};
use egui::{FontId, epaint::TextShape, pos2, vec2};
use std::f32::consts::FRAC_PI_2;

/// A side of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// What there is.
    Left,
    /// What was found.
    Right,
}

/// Below these widths of the window, in points, the side is a drawer.
const NARROW: [f32; 2] = [900.0, 1100.0];
/// What the contents need.
const WIDTH: [f32; 2] = [290.0, 344.0];
const STRIP: f32 = 26.0;

/// Which sides are folded, and which drawers are open.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dock {
    folded: [bool; 2],
    drawn: [bool; 2],
}

impl Side {
    fn is_drawer(self, ctx: &Context) -> bool {
        ctx.content_rect().width() < NARROW[self as usize]
    }

    fn panel(self, id: &'static str) -> Panel {
        match self {
            Self::Left => Panel::left(id),
            Self::Right => Panel::right(id),
        }
    }
}

impl Dock {
    /// Makes the side's contents visible.
    pub fn open(&mut self, side: Side) {
        (self.folded[side as usize], self.drawn[side as usize]) = (false, true);
    }

    /// Folds or unfolds the side.
    pub fn toggle(&mut self, side: Side, ctx: &Context) {
        let of = if side.is_drawer(ctx) { &mut self.drawn } else { &mut self.folded };
        of[side as usize] = !of[side as usize];
    }

    /// The contents are beside the picture.
    fn is_docked(self, side: Side, ctx: &Context) -> bool {
        !side.is_drawer(ctx) && !self.folded[side as usize]
    }

    /// Shows the side beside the picture, or its strip with the title `name`.
    pub fn show(&mut self, ui: &mut Ui, side: Side, name: &str, contents: impl FnOnce(&mut Ui)) {
        let n = side as usize;
        if self.is_docked(side, ui.ctx()) {
            let panel = side.panel(["left", "right"][n]).default_size(WIDTH[n]).size_range(WIDTH[n]..=560.0);
            panel.show(ui, |ui| within(ui, ui.available_size(), contents));
        } else {
            let frame = Frame::NONE.fill(ui.visuals().panel_fill);
            let panel = side.panel(["left strip", "right strip"][n]).exact_size(STRIP).resizable(false).frame(frame);
            if panel.show(ui, |ui| strip(ui, name)).inner {
                self.toggle(side, ui.ctx());
            }
        }
    }

    /// Shows the side over the picture, which is at `place`, where it is a drawer that is open. Escape closes it.
    pub fn show_drawer(&mut self, ctx: &Context, side: Side, place: Rect, contents: impl FnOnce(&mut Ui)) {
        let n = side as usize;
        if !side.is_drawer(ctx) || !self.drawn[n] {
            return;
        }
        let (corner, pivot) =
            if side == Side::Left { (place.left_top(), Align2::LEFT_TOP) } else { (place.right_top(), Align2::RIGHT_TOP) };
        let area = Area::new(Id::unique(("drawer", n))).order(Order::Middle).fixed_pos(corner).pivot(pivot);
        area.constrain(false).show(ctx, |ui| {
            let margin = Margin::same(8);
            let frame = Frame::new().fill(ui.visuals().panel_fill).stroke(ui.visuals().window_stroke).inner_margin(margin);
            frame.show(ui, |ui| {
                within(ui, vec2(WIDTH[n].min(place.width()), place.height()) - margin.sum(), contents);
            });
        });
        self.drawn[n] = !ctx.input(|i| i.key_pressed(egui::Key::Escape));
    }
}

/// Shows `contents` in a place of that size, which they can neither widen nor leave: a side keeps its size, whatever it holds.
fn within(ui: &mut Ui, size: Vec2, contents: impl FnOnce(&mut Ui)) {
    let rect = Rect::from_min_size(ui.cursor().min, size);
    let mut inside = ui.new_child(UiBuilder::new().max_rect(rect));
    inside.shrink_clip_rect(rect);
    contents(&mut inside);
    ui.advance_cursor_after_rect(rect);
}

/// A folded side: its title, turned. True when it is to be opened.
fn strip(ui: &mut Ui, name: &str) -> bool {
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Show {}", name.to_lowercase())));
    let color = if response.hovered() { ui.visuals().strong_text_color() } else { ui.visuals().text_color() };
    let text = ui.painter().layout_no_wrap(name.to_owned(), FontId::proportional(13.5), color);
    // Turned by a quarter to the right, its left end is on top.
    let at = pos2(rect.center().x + text.size().y / 2.0, rect.top() + 12.0);
    ui.painter().add(TextShape::new(at, text, Color32::PLACEHOLDER).with_angle(FRAC_PI_2));
    if response.hovered() {
        ui.painter().rect_stroke(rect.shrink(1.0), 2.0, Stroke::new(1.0, color), egui::StrokeKind::Inside);
    }
    response.on_hover_cursor(CursorIcon::PointingHand).clicked()
}
