//! PDF: a page as large as the sheet, the picture on it and the marks over it as paths.

use super::canvas::Canvas;
use super::encoding::Failure;
use super::shapes::{At, Shape, Step};
use super::svg::{between, escaped, unescaped};
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use std::io::{Read, Write};

/// Points in a millimetre.
const POINTS: f64 = 72.0 / 25.4;
/// Before and behind what was drawn.
const RECORD: [&str; 2] = ["<bregma:picture>", "</bregma:picture>"];

/// A sheet, its marks as paths.
pub fn encode(canvas: &Canvas, record: Option<&str>) -> Result<Vec<u8>, Failure> {
    let [catalog, pages, page, content, image, mask, profile, about, info] = [1, 2, 3, 4, 5, 6, 7, 8, 9].map(Ref::new);
    let [width, height] = canvas.size_mm().map(|mm| mm * POINTS);
    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(pages);
    if record.is_some() {
        root.metadata(about);
    }
    root.finish();
    pdf.pages(pages).kids([page]).count(1);
    let mut sheet = pdf.page(page);
    sheet.media_box(Rect::new(0.0, 0.0, width as f32, height as f32)).parent(pages).contents(content);
    sheet.resources().x_objects().pair(Name(b"Picture"), image);
    sheet.finish();
    let bytes = canvas.bytes(&canvas.light);
    let channels = canvas.channel_count();
    let colors = bytes.chunks_exact(channels).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect::<Vec<_>>();
    picture(&mut pdf, canvas, image, &deflated(&colors)?, (canvas.is_clear.then_some(mask), profile));
    if canvas.is_clear {
        let opacity = deflated(&bytes.chunks_exact(channels).map(|pixel| pixel[3]).collect::<Vec<_>>())?;
        let mut mask = pdf.image_xobject(mask, &opacity);
        mask.filter(Filter::FlateDecode);
        mask.width(canvas.size[0] as i32).height(canvas.size[1] as i32);
        mask.color_space().device_gray();
        mask.bits_per_component(8);
    }
    let srgb = deflated(&super::inks::srgb_profile()?)?;
    pdf.icc_profile(profile, &srgb).n(3).filter(Filter::FlateDecode);
    pdf.stream(content, &deflated(&drawn(canvas))?).filter(Filter::FlateDecode);
    pdf.document_info(info).creator(TextStr(concat!("bregma ", env!("CARGO_PKG_VERSION"))));
    if let Some(record) = record {
        pdf.metadata(about, xmp(record).as_bytes());
    }
    Ok(pdf.finish())
}

fn picture(pdf: &mut Pdf, canvas: &Canvas, id: Ref, data: &[u8], (mask, profile): (Option<Ref>, Ref)) {
    let mut image = pdf.image_xobject(id, data);
    image.filter(Filter::FlateDecode);
    image.width(canvas.size[0] as i32).height(canvas.size[1] as i32);
    image.color_space().icc_based(profile);
    image.bits_per_component(8);
    if let Some(mask) = mask {
        image.s_mask(mask);
    }
}

fn deflated(bytes: &[u8]) -> Result<Vec<u8>, Failure> {
    let mut encoder = ZlibEncoder::new(vec![], Compression::default());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}

/// What is drawn on the page; it counts from the lower left corner, up.
fn drawn(canvas: &Canvas) -> Vec<u8> {
    let [width, height] = canvas.size_mm().map(|mm| (mm * POINTS) as f32);
    let mut content = Content::new();
    content.save_state().transform([width, 0.0, 0.0, height, 0.0, 0.0]).x_object(Name(b"Picture")).restore_state();
    content.save_state().transform([POINTS as f32, 0.0, 0.0, -POINTS as f32, 0.0, height]).set_line_join(LineJoinStyle::RoundJoin);
    canvas.marks.iter().flat_map(|mark| &mark.shapes).for_each(|shape| path(&mut content, shape));
    content.restore_state();
    content.finish().into_vec()
}

fn path(content: &mut Content, shape: &Shape) {
    let share = |color: [u8; 3]| color.map(|c| f32::from(c) / 255.0);
    if let Some([r, g, b]) = shape.fill.map(share) {
        content.set_fill_rgb(r, g, b);
    }
    if let Some(stroke) = shape.stroke {
        let [r, g, b] = share(stroke.color);
        content.set_stroke_rgb(r, g, b).set_line_width(stroke.width_mm as f32);
        content.set_line_cap(if stroke.dash_mm.is_some() { LineCapStyle::ButtCap } else { LineCapStyle::RoundCap });
        content.set_dash_pattern(stroke.dash_mm.map(|mm| mm as f32), 0.0);
    }
    let mut last: At = [0.0; 2];
    for step in &shape.steps {
        let f = |p: At| p.map(|mm| mm as f32);
        match *step {
            Step::Move(p) => {
                content.move_to(f(p)[0], f(p)[1]);
            }
            Step::Line(p) => {
                content.line_to(f(p)[0], f(p)[1]);
            }
            // PDF has cubic curves alone: the same curve has its handles two thirds of the way to the quadratic's control.
            Step::Quad(control, p) => {
                let handle = |end: At| [0, 1].map(|n| end[n] + 2.0 / 3.0 * (control[n] - end[n]));
                cubic(content, [handle(last), handle(p), p].map(f));
            }
            Step::Cubic(a, b, p) => cubic(content, [a, b, p].map(f)),
            Step::Close => {
                content.close_path();
            }
        }
        if let Step::Move(p) | Step::Line(p) | Step::Quad(_, p) | Step::Cubic(_, _, p) = *step {
            last = p;
        }
    }
    match (shape.fill, shape.stroke) {
        (Some(_), Some(_)) => content.fill_nonzero_and_stroke(),
        (Some(_), None) => content.fill_nonzero(),
        (None, Some(_)) => content.stroke(),
        (None, None) => content.end_path(),
    };
}

fn cubic(content: &mut Content, [a, b, p]: [[f32; 2]; 3]) {
    content.cubic_to(a[0], a[1], b[0], b[1], p[0], p[1]);
}

/// What was drawn, as XMP holds it.
fn xmp(record: &str) -> String {
    format!(
        "<?xpacket begin=\"\u{feff}\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" xmlns:bregma=\"urn:bregma\">{}{}{}</rdf:Description></rdf:RDF></x:xmpmeta>\n<?xpacket end=\"r\"?>",
        RECORD[0],
        escaped(record),
        RECORD[1]
    )
}

/// The text that says what was drawn.
pub fn record(bytes: &[u8]) -> Option<String> {
    // Beside texts there are compressed bytes.
    between(&String::from_utf8_lossy(bytes), RECORD).map(unescaped)
}

/// The colours of the picture inside, each from 0 to 1.
pub fn channels(bytes: &[u8]) -> Option<Vec<f32>> {
    let find = |from: usize, what: &[u8]| Some(from + bytes.get(from..)?.windows(what.len()).position(|part| part == what)?);
    // The first picture holds the colours.
    let picture = find(0, b"/Subtype /Image")?;
    let data = find(picture, b"stream\n")? + b"stream\n".len();
    let mut colors = vec![];
    ZlibDecoder::new(&bytes[data..]).read_to_end(&mut colors).ok()?;
    Some(colors.iter().map(|b| f32::from(*b) / 255.0).collect())
}
