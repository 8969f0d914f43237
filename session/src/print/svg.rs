//! SVG: the picture as a PNG inside, the marks over it as paths, each with its words.

use super::canvas::Canvas;
use super::encoding::Failure;
use super::png_file;
use super::shapes::{At, Shape, Step};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use png::BitDepth;
use std::fmt::Write;

/// Before and behind what was drawn.
const RECORD: [&str; 2] = ["<metadata id=\"bregma\">", "</metadata>"];
/// Before and behind the picture.
const PICTURE: [&str; 2] = ["href=\"data:image/png;base64,", "\""];

/// A sheet, its marks as paths.
pub fn encode(canvas: &Canvas, record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let [width, height] = canvas.size_mm();
    let picture = png_file::encode_bytes(canvas, BitDepth::Eight, &canvas.bytes(&canvas.light), None)?;
    let mut svg =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n");
    if let Some(record) = record {
        writeln!(svg, "{}{}{}", RECORD[0], escaped(record), RECORD[1])?;
    }
    writeln!(svg, "<image width=\"{width}\" height=\"{height}\" {}{}{}/>", PICTURE[0], STANDARD.encode(picture), PICTURE[1])?;
    for mark in &canvas.marks {
        let words = escaped(&mark.words);
        writeln!(svg, "<g role=\"img\" aria-label=\"{words}\"><title>{words}</title>")?;
        mark.shapes.iter().try_for_each(|shape| path(&mut svg, shape))?;
        svg.push_str("</g>\n");
    }
    svg.push_str("</svg>\n");
    Ok(svg.into_bytes())
}

fn path(svg: &mut String, shape: &Shape) -> std::fmt::Result {
    let color = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    // A micrometre is finer than any printer's dot.
    let at = |[x, y]: At| format!("{} {}", short(x), short(y));
    svg.push_str("<path d=\"");
    for step in &shape.steps {
        match *step {
            Step::Move(p) => write!(svg, "M{}", at(p))?,
            Step::Line(p) => write!(svg, "L{}", at(p))?,
            Step::Quad(a, p) => write!(svg, "Q{} {}", at(a), at(p))?,
            Step::Cubic(a, b, p) => write!(svg, "C{} {} {}", at(a), at(b), at(p))?,
            Step::Close => svg.push('Z'),
        }
    }
    write!(svg, "\" fill=\"{}\"", shape.fill.map_or("none".into(), color))?;
    if let Some(stroke) = shape.stroke {
        write!(svg, " stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"", color(stroke.color), short(stroke.width_mm))?;
        match stroke.dash_mm {
            Some(dash) => write!(svg, " stroke-dasharray=\"{}\"", short(dash))?,
            None => svg.push_str(" stroke-linecap=\"round\""),
        }
    }
    svg.push_str("/>\n");
    Ok(())
}

fn short(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0
}

/// Text as XML holds it.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// What XML holds as text.
pub fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

/// What stands between two texts.
pub fn between<'a>(text: &'a str, [before, behind]: [&str; 2]) -> Option<&'a str> {
    text.split_once(before)?.1.split_once(behind).map(|(inner, _)| inner)
}

/// The text that says what was drawn.
pub fn record(bytes: &[u8]) -> Option<String> {
    between(std::str::from_utf8(bytes).ok()?, RECORD).map(unescaped)
}

/// The channels of the picture inside, each from 0 to 1.
pub fn channels(bytes: &[u8]) -> Option<Vec<f32>> {
    let picture = between(std::str::from_utf8(bytes).ok()?, PICTURE)?;
    png_file::channels(&STANDARD.decode(picture).ok()?)
}
