//! How the window looks: dark, so that the eye stays with the picture, and with enough contrast to be read.

use egui::{Color32, Context, FontId, IconData, Stroke, TextStyle, Theme, Visuals};

/// Behind panels.
const PANEL: Color32 = Color32::from_rgb(30, 33, 38);
/// What is selected or asks to be.
const ACCENT: Color32 = Color32::from_rgb(46, 125, 160);

/// Sets the style of the whole window.
pub fn apply(ctx: &Context) {
    ctx.set_theme(Theme::Dark);
    let mut visuals = Visuals::dark();
    visuals.panel_fill = PANEL;
    visuals.window_fill = PANEL;
    visuals.extreme_bg_color = Color32::from_rgb(17, 19, 22);
    visuals.faint_bg_color = Color32::from_rgb(37, 41, 47);
    visuals.widgets.noninteractive.fg_stroke = Stroke::new(1.0, Color32::from_gray(208));
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_rgb(56, 61, 69));
    visuals.weak_text_color = Some(Color32::from_gray(158));
    visuals.warn_fg_color = Color32::from_rgb(255, 178, 71);
    visuals.error_fg_color = Color32::from_rgb(255, 122, 110);
    visuals.selection.bg_fill = ACCENT;
    // Boxes and buttons must show where they are before the mouse finds them.
    visuals.widgets.inactive.bg_fill = Color32::from_rgb(78, 84, 94);
    visuals.widgets.inactive.weak_bg_fill = Color32::from_rgb(58, 63, 71);
    visuals.slider_trailing_fill = true;
    ctx.set_visuals_of(Theme::Dark, visuals);
    ctx.style_mut_of(Theme::Dark, |style| {
        style.spacing.item_spacing = egui::vec2(8.0, 5.0);
        style.text_styles.insert(TextStyle::Body, FontId::proportional(13.5));
        style.text_styles.insert(TextStyle::Button, FontId::proportional(13.5));
        style.text_styles.insert(TextStyle::Heading, FontId::proportional(16.0));
    });
    // A hand trembles less than this between press and release of a click; beyond it, it drags.
    ctx.options_mut(|o| o.input_options.max_click_dist = 4.0);
}

/// The program's sign: a skull seen from above, its halves in the colours of a comparison. Made from the SVG beside it.
pub fn icon() -> IconData {
    eframe::icon_data::from_png_bytes(include_bytes!("../../assets/bregma.png")).expect("the icon is a PNG")
}
