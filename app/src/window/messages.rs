//! What the person should know: lines over the picture's lower left corner, which stay as long as they take to read and never take a click
//! but where one has a button that helps.
//! Those that have gone are kept in a list.

use super::words::in_the_window;
use egui::{
    Align2, Area, Button, Color32, Context, Frame, Id, Label, Margin, Order, Rect, RichText, ScrollArea, Sense, Ui, Vec2, Window, vec2,
};

#[derive(Clone, Debug, PartialEq)]
struct Message {
    text: String,
    is_error: bool,
    /// The name of a command that helps.
    help: Option<&'static str>,
    /// When it came onto the screen, in the window's seconds.
    since_s: Option<f64>,
}

/// Every message of this run of the program, the oldest first.
#[derive(Debug, Default)]
pub struct Messages {
    all: Vec<Message>,
    /// The list of all is on the screen.
    pub open: bool,
}

/// What it takes to notice that something is there, and a slow reader's pace for each letter, in seconds. An error is read twice, and so is what asks for a deed.
const NOTICE_S: f64 = 3.0;
const LETTER_S: f64 = 0.06;
/// More than this many hide the picture: the oldest go first.
const MOST: usize = 4;
/// Size of the button that helps, in points.
const BUTTON: Vec2 = vec2(190.0, 26.0);

impl Message {
    fn stays_s(&self) -> f64 {
        (NOTICE_S + LETTER_S * self.text.chars().count() as f64) * if self.is_error || self.help.is_some() { 2.0 } else { 1.0 }
    }

    /// How long it is still to be read.
    fn left_s(&self, now_s: f64) -> f64 {
        self.since_s.unwrap_or(now_s) + self.stays_s() - now_s
    }

    fn label(&self, ui: &Ui) -> Label {
        let color = if self.is_error { ui.visuals().error_fg_color } else { ui.visuals().text_color() };
        Label::new(RichText::new(&self.text).color(color)).wrap()
    }
}

impl Messages {
    /// Something went wrong or was lost.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(text.into(), true, None);
    }

    /// Something is done or needs a hint.
    pub fn note(&mut self, text: impl Into<String>) {
        self.add(text.into(), false, None);
    }

    /// Something needs a deed, which the command of that name does.
    pub fn offer(&mut self, text: impl Into<String>, command: &'static str) {
        self.add(text.into(), false, Some(command));
    }

    fn add(&mut self, sentence: String, is_error: bool, help: Option<&'static str>) {
        let text = in_the_window(&sentence);
        // The same sentence twice helps nobody: it is new again.
        self.all.retain(|message| message.text != text);
        self.all.push(Message { text, is_error, help, since_s: None });
    }

    /// Nothing was said yet.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Shows those that are still to be read over the lower left of `place`, and the list of all where it is open. Gives the name of the command
    /// whose button is pressed.
    pub fn show(&mut self, ctx: &Context, place: Rect) -> Option<&'static str> {
        let mut pressed = None;
        let now_s = ctx.input(|i| i.time);
        let mut buttons = vec![];
        let mut shown: Vec<&mut Message> = self.all.iter_mut().rev().filter(|m| m.left_s(now_s) > 0.0).take(MOST).collect();
        shown.reverse();
        if let Some(left_s) = shown.iter().map(|message| message.left_s(now_s)).reduce(f64::min) {
            ctx.request_repaint_after_secs(left_s as f32);
            let area = Area::new(Id::unique("messages")).order(Order::Foreground).interactable(false).pivot(Align2::LEFT_BOTTOM);
            area.fixed_pos(place.left_bottom() + vec2(10.0, -10.0)).show(ctx, |ui| {
                ui.set_max_width((place.width() - 20.0).clamp(120.0, 460.0));
                for message in shown {
                    message.since_s.get_or_insert(now_s);
                    let alarming = if ui.visuals().dark_mode { Color32::from_rgb(66, 32, 30) } else { Color32::from_rgb(252, 226, 222) };
                    let fill = if message.is_error { alarming } else { ui.visuals().faint_bg_color };
                    let frame = Frame::new().fill(fill).corner_radius(4).inner_margin(Margin::symmetric(10, 6));
                    let button = frame.show(ui, |ui| {
                        ui.add(message.label(ui).selectable(false));
                        // The place of its button, which is in an area of its own: this one takes no clicks.
                        message.help.map(|help| (ui.allocate_exact_size(BUTTON, Sense::hover()).0, help))
                    });
                    buttons.extend(button.inner);
                }
            });
        }
        for (rect, help) in buttons {
            let area = Area::new(Id::unique(("help", help))).order(Order::Foreground).fixed_pos(rect.min).constrain(false);
            let button = area.show(ctx, |ui| ui.add(Button::new(help).min_size(rect.size())));
            if button.inner.clicked() {
                pressed = Some(help);
                self.all
                    .iter_mut()
                    .filter(|message| message.help == Some(help))
                    .for_each(|message| message.since_s = Some(f64::NEG_INFINITY));
            }
        }
        let mut open = self.open;
        Window::new("Messages").open(&mut open).default_size([460.0, 260.0]).show(ctx, |ui| {
            ScrollArea::vertical().auto_shrink([false, false]).stick_to_bottom(true).show(ui, |ui| {
                for message in &self.all {
                    ui.add(message.label(ui));
                }
            });
        });
        self.open = open;
        pressed
    }
}
