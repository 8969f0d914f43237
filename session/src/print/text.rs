//! Words as outlines, so that they look alike everywhere and no reader needs the font.

use super::shapes::{At, Mark, Shape, Step, Stroke};
use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve, Point};
use std::sync::LazyLock;

/// The letters of the window. Fails only for bytes that are no font.
static FONT: LazyLock<Option<FontRef<'static>>> = LazyLock::new(|| FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok());

/// A point of type, mm.
pub const POINT_MM: f64 = 25.4 / 72.0;
/// From line to line, in sizes of type.
pub const LEADING: f64 = 1.25;
/// Of a capital, in sizes of type: Ubuntu's own.
pub const CAPITAL: f64 = 0.693;

/// How words are drawn.
#[derive(Clone, Copy, Debug)]
pub struct Type {
    /// Size of the type, mm.
    pub size_mm: f64,
    /// sRGB.
    pub color: [u8; 3],
    /// Around the letters, so that they stand out from what lies under them.
    pub halo: Option<[u8; 3]>,
    /// Drawn heavier.
    pub is_bold: bool,
}

/// What the light letters are drawn along by, in sizes of type, so that they print as a regular and as a bold face.
const REGULAR: f64 = 0.03;
const BOLD: f64 = 0.075;
/// Width of a halo, in sizes of type.
const HALO: f64 = 0.16;

/// How long words are, mm.
pub fn width_mm(words: &str, size_mm: f64) -> f64 {
    let Some(font) = FONT.as_ref() else { return 0.0 };
    let unit = size_mm / f64::from(font.units_per_em().unwrap_or(1000.0));
    glyphs(font, words).last().map_or(0.0, |(id, x)| unit * (x + f64::from(font.h_advance_unscaled(id))))
}

/// The glyphs of words, and how far from their beginning each stands, in the font's units.
fn glyphs<'a>(font: &'a FontRef<'_>, words: &'a str) -> impl Iterator<Item = (GlyphId, f64)> + 'a {
    let mut last: Option<GlyphId> = None;
    let mut x = 0.0;
    words.chars().map(move |c| {
        let id = font.glyph_id(c);
        if let Some(before) = last.replace(id) {
            x += f64::from(font.h_advance_unscaled(before) + font.kern_unscaled(before, id));
        }
        (id, x)
    })
}

/// Words whose box has the share `anchor` of its width left of `at` and of a capital's height above it: `[0.5, 0.5]` is centred, `[0.0, 1.0]` stands
/// on the point.
pub fn text(at: At, anchor: [f64; 2], words: &str, style: Type) -> Mark {
    let mut steps = vec![];
    if let Some(font) = FONT.as_ref() {
        let unit = style.size_mm / f64::from(font.units_per_em().unwrap_or(1000.0));
        let left = at[0] - anchor[0] * width_mm(words, style.size_mm);
        let base = at[1] + (1.0 - anchor[1]) * CAPITAL * style.size_mm;
        for (id, x) in glyphs(font, words) {
            let place = |p: &Point| [left + unit * (x + f64::from(p.x)), base - unit * f64::from(p.y)];
            outline(font, id, place, &mut steps);
        }
    }
    let stroke = |color, share: f64| Some(Stroke::new(color, share * style.size_mm));
    let weight = if style.is_bold { BOLD } else { REGULAR };
    let halo = style.halo.map(|color| Shape { steps: steps.clone(), fill: None, stroke: stroke(color, HALO + weight) });
    let letters = Shape { steps, fill: Some(style.color), stroke: stroke(style.color, weight) };
    Mark { words: words.to_owned(), shapes: halo.into_iter().chain([letters]).collect() }
}

/// Adds the outline of a glyph; its curves come one contour after the other.
fn outline(font: &FontRef<'_>, id: GlyphId, place: impl Fn(&Point) -> At, steps: &mut Vec<Step>) {
    let mut end: Option<Point> = None;
    for curve in font.outline(id).into_iter().flat_map(|outline| outline.curves) {
        let (OutlineCurve::Line(from, ..) | OutlineCurve::Quad(from, ..) | OutlineCurve::Cubic(from, ..)) = curve;
        if end != Some(from) {
            steps.extend(end.map(|_| Step::Close));
            steps.push(Step::Move(place(&from)));
        }
        let (step, to) = match curve {
            OutlineCurve::Line(_, to) => (Step::Line(place(&to)), to),
            OutlineCurve::Quad(_, control, to) => (Step::Quad(place(&control), place(&to)), to),
            OutlineCurve::Cubic(_, first, second, to) => (Step::Cubic(place(&first), place(&second), place(&to)), to),
        };
        steps.push(step);
        end = Some(to);
    }
    steps.extend(end.map(|_| Step::Close));
}

/// Words in lines no longer than `width` mm; a word that is longer has a line of its own.
pub fn wrapped(words: &str, size_mm: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = vec![];
    for word in words.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_mm(&format!("{line} {word}"), size_mm) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_as_wide_as_they_say_and_stand_where_they_shall() {
        // Fails if glyphs are mirrored, lie beside their anchor, or a line is longer than its room.
        let style = Type { size_mm: 3.0, color: [0; 3], halo: None, is_bold: false };
        for (anchor, words) in [([0.0, 1.0], "H"), ([0.5, 0.5], "HOH"), ([1.0, 0.0], "H 12,5 mm")] {
            let [low, high] = text([20.0, 10.0], anchor, words, style).bounds();
            let width = width_mm(words, 3.0);
            // Letters have room beside them.
            assert!((low[0] - (20.0 - anchor[0] * width)).abs() < 0.4 && (high[0] - (20.0 + (1.0 - anchor[0]) * width)).abs() < 0.4);
            let capital = CAPITAL * 3.0;
            assert!((low[1] - (10.0 - anchor[1] * capital)).abs() < 0.15, "{low:?}");
        }
        let lines = wrapped("one two three four five six seven", 3.0, 15.0);
        assert!(lines.len() > 2 && lines.iter().all(|line| width_mm(line, 3.0) <= 15.0), "{lines:?}");
        assert_eq!(lines.join(" "), "one two three four five six seven");
    }
}
