//! What colours mean, on a strip below the pictures.

use super::PrintError;
use super::marks::Tint;
use super::shapes::{Mark, Shape, Stroke};
use super::sheet::{MARGIN_MM, Print};
use super::text::{CAPITAL, LEADING, text, width_mm, wrapped};
use crate::opened::Opened;
use bregma_measure::numbers::significant;
use bregma_renderer::{Color, CutFace};

/// What colours mean.
#[derive(Clone, Debug)]
pub enum Legend {
    /// Numbers along a bar.
    Bar {
        /// What they are of.
        title: String,
        /// Colours from the first number to the last.
        colors: Vec<[u8; 3]>,
        /// Numbers, evenly apart.
        numbers: Vec<String>,
    },
    /// A colour for each scan.
    Scans(Vec<([u8; 3], String)>),
}

/// Pieces of a bar of colours: more than are told apart.
const PIECES: usize = 128;
/// Height of a bar, mm.
const BAR_MM: f64 = 2.5;

impl Legend {
    /// Of what is drawn; `Err` where its colours have no numbers.
    pub fn of(opened: &Opened) -> Result<Self, PrintError> {
        let scene = &opened.scene;
        if scene.tells_depths() {
            let range_mm = scene.depth_range_mm(&opened.volumes);
            let names = opened.compared().map(|pair| pair.map(|n| opened.volumes[n].name().to_owned()));
            let title = match names {
                Some([first, second]) => format!("How far {second} lies before {first} along the view, mm"),
                None => "Depth, mm".into(),
            };
            return Ok(Self::between(title, [-range_mm, range_mm], |mm| Color::diverging((mm / range_mm) as f32).bytes()));
        }
        let is_grey_slice = scene.is_slice() && scene.cut_face == CutFace::Density;
        if scene.gives_values() && (is_grey_slice || !scene.is_slice()) {
            let window = if scene.is_slice() { scene.slice.window.or(scene.window) } else { scene.window };
            let window = window.ok_or(PrintError::NoWindow)?;
            let title = if scene.of_gradient { "Gradient, per mm" } else { "Value" };
            let ends = [-0.5, 0.5].map(|share| window.level + share * window.width);
            return Ok(Self::between(title.into(), ends, |value| Color([window.brightness(value) as f32; 3]).bytes()));
        }
        let seen = opened.volumes.iter().zip(&scene.layers).filter(|(_, layer)| layer.visible);
        let mut scans: Vec<_> = seen.map(|(volume, layer)| (layer.color.bytes(), volume.name().to_owned())).collect();
        if scene.tells_agreement() && scans.len() > 1 {
            let within_mm = significant(scene.agreement_mm(&opened.volumes), 2);
            scans.push((Color::diverging(0.0).bytes(), format!("both, within {within_mm} mm")));
        }
        Ok(Self::Scans(scans))
    }

    /// Of numbers from one to another, evenly apart, in the colours that they have.
    pub fn between(title: String, [low, high]: [f64; 2], color: impl Fn(f64) -> [u8; 3]) -> Self {
        let at = |part: f64| low + part * (high - low);
        let colors = (0..PIECES).map(|n| color(at(n as f64 / (PIECES - 1) as f64))).collect();
        Self::Bar { title, colors, numbers: [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| number(at(part))).into() }
    }

    /// Height of its strip, mm.
    pub fn height_mm(&self, print: &Print) -> f64 {
        let line = LEADING * print.type_mm();
        match self {
            Self::Bar { title, .. } => MARGIN_MM + (title_lines(title, print).len() + 1) as f64 * line + BAR_MM + 1.0,
            Self::Scans(scans) => MARGIN_MM + self.rows(scans, print).len() as f64 * line,
        }
    }

    /// Which scans stand in each row, and how far from the left, mm.
    fn rows(&self, scans: &[([u8; 3], String)], print: &Print) -> Vec<Vec<(f64, usize)>> {
        let room = print.size_mm()[0] - MARGIN_MM;
        let (mut rows, mut x) = (vec![vec![]], MARGIN_MM);
        for (n, (_, name)) in scans.iter().enumerate() {
            let long = 1.6 * print.type_mm() + width_mm(name, print.type_mm()) + 3.0;
            if x + long > room && x > MARGIN_MM {
                rows.push(vec![]);
                x = MARGIN_MM;
            }
            if let Some(row) = rows.last_mut() {
                row.push((x, n));
            }
            x += long;
        }
        rows
    }

    /// Its marks, the upper edge of its strip at `top_mm`.
    pub fn marks(&self, top_mm: f64, print: &Print, tint: Tint) -> Vec<Mark> {
        let (size, top) = (print.type_mm(), top_mm + 0.5 * MARGIN_MM);
        match self {
            Self::Bar { title, colors, numbers } => bar(top, print, tint, (title, colors, numbers)),
            Self::Scans(scans) => {
                let of = |(row, (x, n)): (usize, (f64, usize))| {
                    let (color, name) = &scans[n];
                    let y = top + row as f64 * LEADING * size;
                    let edge = Some(Stroke::new(tint.ink, 0.1));
                    let patch = Shape { stroke: edge, ..Shape::rectangle([x, y], [1.2 * size, CAPITAL * size], *color) };
                    [
                        Mark { words: format!("colour of {name}"), shapes: vec![patch] },
                        text([x + 1.6 * size, y], [0.0, 0.0], name, tint.letters(size)),
                    ]
                };
                let rows = self.rows(scans, print).into_iter().enumerate();
                rows.flat_map(|(row, scans)| scans.into_iter().map(move |scan| (row, scan))).flat_map(of).collect()
            }
        }
    }
}

fn title_lines(title: &str, print: &Print) -> Vec<String> {
    wrapped(title, print.type_mm(), print.size_mm()[0] - 2.0 * MARGIN_MM)
}

/// A bar of colours under its title, over its numbers.
fn bar(top: f64, print: &Print, tint: Tint, (title, colors, numbers): (&str, &[[u8; 3]], &[String])) -> Vec<Mark> {
    let size = print.type_mm();
    // The outermost numbers stand over their ends.
    let inset = MARGIN_MM + numbers.iter().map(|n| width_mm(n, size)).fold(0.0, f64::max) / 2.0;
    let (left, right) = (inset, print.size_mm()[0] - inset);
    let lines = title_lines(title, print);
    let y = top + lines.len() as f64 * LEADING * size;
    let piece = (right - left) / colors.len() as f64;
    // Each reaches under the next ones, so that no seam shows between them.
    let strip = |(n, color): (usize, &[u8; 3])| {
        let x = left + n as f64 * piece;
        Shape::rectangle([x, y], [right - x, BAR_MM], *color)
    };
    let line = |(n, line): (usize, &String)| text([MARGIN_MM, top + n as f64 * LEADING * size], [0.0, 0.0], line, tint.letters(size));
    let mut marks: Vec<Mark> = lines.iter().enumerate().map(line).collect();
    marks.push(Mark { words: "colours".into(), shapes: colors.iter().enumerate().map(strip).collect() });
    for (n, number) in numbers.iter().enumerate() {
        let x = left + (right - left) * n as f64 / (numbers.len() - 1).max(1) as f64;
        let tick = Shape::line(&[[x, y + BAR_MM], [x, y + BAR_MM + 0.7]], Stroke::new(tint.ink, 0.15));
        marks.push(Mark { words: "tick".into(), shapes: vec![tick] });
        marks.push(text([x, y + BAR_MM + 1.2], [0.5, 0.0], number, tint.letters(size)));
    }
    marks
}

/// A number with a true minus.
fn number(value: f64) -> String {
    significant(value, 3).replace('-', "−")
}
