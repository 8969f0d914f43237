//! What all figures share: their letters, and how large they are as pixels.

use plotters::style::{FontStyle, register_font};
use std::sync::Once;

/// Pixels of the PNG for each unit: 300 dots an inch at 25 cm.
pub const PNG_SCALE: u32 = 2;

/// Pictures have no fonts of their own: they borrow the window's.
pub fn fonts() {
    static ONCE: Once = Once::new();
    // Fails only for bytes that are no font.
    ONCE.call_once(|| drop(register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)));
}

/// The name of the letters.
pub const FONT: &str = "sans-serif";
