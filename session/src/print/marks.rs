//! Marks of a picture that follow from its camera: the bar of scale, the letters of the sides, and beside them labels and captions.

use super::PrintError;
use super::shapes::{Mark, Shape};
use super::sheet::{BAR_MM, Bar, MARGIN_MM, Print};
use super::text::{CAPITAL, LEADING, Type, text};
use crate::views::{anatomical, round_down};
use bregma_renderer::{Camera, Color, Projection};
use glam::Vec3;

/// A picture on the sheet, mm: its upper left corner and its size.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Its upper left corner.
    pub at: [f64; 2],
    /// Across and down.
    pub size: [f64; 2],
}

/// The colours of marks: what stands out from a ground, and the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tint {
    /// Of marks.
    pub ink: [u8; 3],
    /// Around marks that lie on bone.
    pub halo: [u8; 3],
}

impl Tint {
    /// On a ground; what is clear lies on paper.
    pub fn on(ground: Option<Color>) -> Self {
        // Shares of light in brightness (Rec. 709); 0.18 looks half as bright as white.
        let brightness = |color: Color| color.linear().dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let (black, white) = ([0; 3], [255; 3]);
        if ground.is_some_and(|color| brightness(color) < 0.18) {
            Self { ink: white, halo: black }
        } else {
            Self { ink: black, halo: white }
        }
    }

    /// Type of such a size.
    pub fn letters(self, size_mm: f64) -> Type {
        Type { size_mm, color: self.ink, halo: None, is_bold: false }
    }

    /// The same over bone.
    pub fn over(self, size_mm: f64) -> Type {
        Type { halo: Some(self.halo), ..self.letters(size_mm) }
    }
}

/// Millimetres of the world on a millimetre of paper: everywhere along parallel rays, or at the distance of the target.
pub fn mm_per_mm(camera: &Camera, place: Place) -> f64 {
    match camera.parallel().projection {
        Projection::Orthographic { height_mm } => height_mm / place.size[1],
        Projection::Perspective { .. } => f64::INFINITY,
    }
}

/// The bar of scale in the lower left corner: its first shape is the bar itself.
pub fn bar(bar: Bar, camera: &Camera, place: Place, print: &Print, tint: Tint) -> Result<Vec<Mark>, PrintError> {
    let is_perspective = matches!(camera.projection, Projection::Perspective { .. });
    if is_perspective && !bar.at_target {
        return Err(PrintError::BarInPerspective);
    }
    let per_paper_mm = mm_per_mm(camera, place);
    let room_mm = place.size[0] - 2.0 * MARGIN_MM;
    // About a quarter of the picture reads well.
    let length_mm = bar.length_mm.unwrap_or_else(|| round_down(0.35 * room_mm * per_paper_mm));
    let paper_mm = length_mm / per_paper_mm;
    if paper_mm > room_mm {
        return Err(PrintError::LongBar { length_mm, room_mm: room_mm * per_paper_mm });
    }
    let at = [place.at[0] + MARGIN_MM, place.at[1] + place.size[1] - MARGIN_MM - BAR_MM];
    let where_it_holds = if is_perspective { " at the distance of the target" } else { "" };
    let words = format!("{length_mm} mm{where_it_holds}");
    let shape = Shape::rectangle(at, [paper_mm, BAR_MM], tint.ink);
    let number = text([at[0], at[1] - 0.8], [0.0, 1.0], &words, tint.letters(print.type_mm()));
    Ok(vec![Mark { words: format!("bar of scale, {words}"), shapes: vec![shape] }, number])
}

/// Letters of the sides at the middles of the edges: right, left, top and bottom.
pub fn letters(camera: &Camera, place: Place, print: &Print, tint: Tint) -> Vec<Mark> {
    let basis = camera.basis();
    let ([x, y], [width, height]) = (place.at, place.size);
    let edges = [
        ([x + MARGIN_MM, y + 0.5 * height], [0.0, 0.5], -basis.right),
        ([x + width - MARGIN_MM, y + 0.5 * height], [1.0, 0.5], basis.right),
        ([x + 0.5 * width, y + MARGIN_MM], [0.5, 0.0], basis.up),
        ([x + 0.5 * width, y + height - MARGIN_MM], [0.5, 1.0], -basis.up),
    ];
    edges.into_iter().map(|(at, anchor, toward)| text(at, anchor, &anatomical(toward), tint.letters(print.type_mm()))).collect()
}

/// The letter of a figure in its upper left corner.
pub fn label(words: &str, place: Place, print: &Print, tint: Tint) -> Mark {
    let style = Type { is_bold: true, ..tint.letters(1.5 * print.type_mm()) };
    text(place.at.map(|mm| mm + MARGIN_MM), [0.0, 0.0], words, style)
}

/// The label that follows another by `n`: letters count on, all else is numbered.
pub fn following(label: &str, n: usize) -> String {
    let mut letters = label.chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) if letter.is_ascii_alphabetic() => {
            let last = if letter.is_ascii_uppercase() { b'Z' } else { b'z' };
            let next = letter as usize + n;
            if next <= usize::from(last) { char::from(next as u8).to_string() } else { format!("{letter}{}", n + 1) }
        }
        _ if n == 0 => label.to_owned(),
        _ => format!("{label}{}", n + 1),
    }
}

/// The lines of a caption, the upper edge of the first at `top_mm`.
pub fn caption(top_mm: f64, print: &Print, tint: Tint) -> Vec<Mark> {
    let (size, lines) = (print.type_mm(), print.caption_lines());
    let base = |n: usize| top_mm + 0.5 * MARGIN_MM + (n as f64 * LEADING + CAPITAL) * size;
    lines.iter().enumerate().map(|(n, line)| text([MARGIN_MM, base(n)], [0.0, 1.0], line, tint.letters(size))).collect()
}
