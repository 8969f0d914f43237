//! How the window looks: dark, so that the eye stays with the picture, or light for bright rooms and for print; both with enough contrast to be read.

use super::preferences::ThemeChoice;
use egui::{Color32, Context, FontId, IconData, Stroke, TextStyle, Theme, ThemePreference, Visuals};

/// Behind panels.
const PANEL: Color32 = Color32::from_rgb(30, 33, 38);
/// What is selected or asks to be.
const ACCENT: Color32 = Color32::from_rgb(46, 125, 160);

/// Sets the style of the whole window, in both themes.
pub fn apply(ctx: &Context) {
    ctx.set_visuals_of(Theme::Dark, dark());
    ctx.set_visuals_of(Theme::Light, light());
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(8.0, 5.0);
        style.text_styles.insert(TextStyle::Body, FontId::proportional(13.5));
        style.text_styles.insert(TextStyle::Button, FontId::proportional(13.5));
        style.text_styles.insert(TextStyle::Heading, FontId::proportional(16.0));
    });
    // A hand trembles less than this between press and release of a click; beyond it, it drags.
    ctx.options_mut(|o| o.input_options.max_click_dist = 4.0);
}

/// Takes this theme, if it is not taken already.
pub fn choose(ctx: &Context, theme: ThemeChoice) {
    ctx.set_theme(match theme {
        ThemeChoice::Dark => ThemePreference::Dark,
        ThemeChoice::Light => ThemePreference::Light,
        ThemeChoice::System => ThemePreference::System,
    });
}

fn dark() -> Visuals {
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
    visuals
}

/// Dark text on white, with the same accents, dark enough to be read on it; it prints without large dark areas but the picture's own.
fn light() -> Visuals {
    let mut visuals = Visuals::light();
    visuals.panel_fill = Color32::from_gray(250);
    visuals.window_fill = Color32::from_gray(250);
    visuals.extreme_bg_color = Color32::WHITE;
    visuals.faint_bg_color = Color32::from_gray(240);
    visuals.widgets.noninteractive.fg_stroke = Stroke::new(1.0, Color32::from_gray(30));
    visuals.widgets.noninteractive.bg_stroke = Stroke::new(1.0, Color32::from_gray(200));
    visuals.weak_text_color = Some(Color32::from_gray(90));
    visuals.warn_fg_color = Color32::from_rgb(150, 84, 0);
    visuals.error_fg_color = Color32::from_rgb(176, 32, 20);
    visuals.selection.bg_fill = Color32::from_rgb(160, 208, 230);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_rgb(0, 60, 90));
    visuals.widgets.inactive.bg_fill = Color32::from_gray(196);
    visuals.widgets.inactive.weak_bg_fill = Color32::from_gray(226);
    visuals.slider_trailing_fill = true;
    visuals
}

/// The program's sign: a skull seen from above, its halves in the colours of a comparison. Made from the SVG beside it.
pub fn icon() -> IconData {
    eframe::icon_data::from_png_bytes(include_bytes!("../../assets/bregma.png")).expect("the icon is a PNG")
}
