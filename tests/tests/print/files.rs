//! Files as other programs read them: sizes on paper, bits, opacity, profiles and paths.

use super::{DEMO, WHITE, drawn, seen, sheet, with_background};
use bregma_renderer::{Color, Mode};
use bregma_session::print::journals::Journal;
use bregma_session::print::{Bar, Canvas, Encoding, Form, Print, write};
use bregma_session::views::View;
use std::io::{Cursor, Read};
use std::path::Path;
use tiff::decoder::DecodingResult;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

/// A small print of the demo.
fn print(ground: Option<Color>, dpi: f64) -> Canvas {
    let bar = Some(Bar { length_mm: Some(50.0), at_target: false });
    let mut print = Print { letters: true, bar, label: Some("A".into()), samples: 16, ..sheet([30.0, 34.0], dpi) };
    drawn(&mut [seen(with_background(&DEMO, ground), View::Frontalis)], &mut print).unwrap()
}

fn encoded(canvas: &Canvas, form: Form, is_deep: bool) -> Vec<u8> {
    form.encode(canvas, &Encoding { is_deep, icc: None }, None).unwrap()
}

/// The pixels of a PNG, each channel a number of its own depth, and its header.
fn png(bytes: &[u8]) -> (Vec<u16>, png::Info<'static>) {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    let info = reader.info().clone();
    let pixels = &pixels[..frame.buffer_size()];
    match frame.bit_depth {
        png::BitDepth::Sixteen => (pixels.chunks(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect(), info),
        _ => (pixels.iter().map(|b| u16::from(*b)).collect(), info),
    }
}

fn tiff(bytes: &[u8]) -> tiff::decoder::Decoder<Cursor<&[u8]>> {
    tiff::decoder::Decoder::new(Cursor::new(bytes)).unwrap()
}

#[test]
fn every_form_knows_its_size_on_paper() {
    // Fails if a file opens at another size than was asked for.
    for dpi in [300.0, 600.0] {
        let canvas = print(Some(WHITE), dpi);
        let (_, info) = png(&encoded(&canvas, Form::Png, false));
        let dims = info.pixel_dims.unwrap();
        assert!((f64::from(dims.xppu) * 0.0254 - dpi).abs() < 0.02 && dims.unit == png::Unit::Meter && info.srgb.is_some());
        let bytes = encoded(&canvas, Form::Tiff, false);
        let mut decoder = tiff(&bytes);
        let ratio = |value: Value| match value {
            Value::Rational(n, d) => f64::from(n) / f64::from(d),
            other => panic!("{other:?}"),
        };
        assert_eq!(ratio(decoder.get_tag(Tag::XResolution).unwrap()), dpi);
        assert_eq!(decoder.get_tag_u32(Tag::ResolutionUnit).unwrap(), 2);
        let bytes = encoded(&canvas, Form::Jpeg, false);
        // APP0: JFIF, units of inches, both densities.
        assert!(bytes[2..4] == [0xff, 0xe0] && &bytes[6..11] == b"JFIF\0" && bytes[13] == 1);
        assert_eq!([14, 16].map(|n| f64::from(u16::from_be_bytes([bytes[n], bytes[n + 1]]))), [dpi; 2]);
        let bytes = encoded(&canvas, Form::Exr, false);
        let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes), false).unwrap();
        assert_eq!(meta.headers[0].own_attributes.horizontal_density, Some(dpi as f32));
    }
}

#[test]
fn tiff_is_flat_compressed_and_has_a_profile_and_opacity_only_where_it_is_clear() {
    // Fails if a journal's checker would find an alpha channel, no LZW or no profile.
    let bytes = encoded(&print(Some(WHITE), 100.0), Form::Tiff, false);
    let mut decoder = tiff(&bytes);
    assert_eq!(decoder.colortype().unwrap(), tiff::ColorType::RGB(8));
    assert_eq!(decoder.get_tag_u32(Tag::Compression).unwrap(), 5);
    let profile = decoder.get_tag_u8_vec(Tag::IccProfile).unwrap();
    assert!(&profile[36..40] == b"acsp" && &profile[16..20] == b"RGB ");
    let clear = print(None, 100.0);
    for is_deep in [false, true] {
        let bytes = encoded(&clear, Form::Tiff, is_deep);
        let mut decoder = tiff(&bytes);
        assert_eq!(decoder.colortype().unwrap(), tiff::ColorType::RGBA(if is_deep { 16 } else { 8 }));
        // Straight, not premultiplied.
        assert_eq!(decoder.get_tag_u16_vec(Tag::ExtraSamples).unwrap(), [2]);
    }
}

#[test]
fn deep_pictures_hold_more_than_bytes_and_all_forms_the_same_colours() {
    // Fails if 16 bits are bytes written twice, channels are exchanged, or a form has another tone.
    let canvas = print(Some(WHITE), 100.0);
    let (bytes, _) = png(&encoded(&canvas, Form::Png, false));
    let (words, _) = png(&encoded(&canvas, Form::Png, true));
    assert!(words.iter().filter(|word| *word % 257 != 0).count() > words.len() / 50);
    // Bytes are rounded within 0.55 of a step.
    assert!(words.iter().zip(&bytes).all(|(word, byte)| (f64::from(*word) / 257.0 - f64::from(*byte)).abs() < 0.56));
    let DecodingResult::U16(tiff) = tiff(&encoded(&canvas, Form::Tiff, true)).read_image().unwrap() else { panic!("16 bits") };
    assert_eq!(tiff, words);
    let exr = exr_channels(&encoded(&canvas, Form::Exr, false));
    let names: Vec<&str> = exr.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["A", "B", "G", "R", "depth.Z", "volume.id"]);
    for (n, pixel) in words.chunks(3).enumerate() {
        let [b, g, r] = [1, 2, 3].map(|channel| exr[channel].1[n]);
        let encoded = Color::of_light(glam::Vec3::new(r, g, b)).0.map(|c| (c * 65535.0).round() as u16);
        assert!((0..3).all(|c| encoded[c].abs_diff(pixel[c]) <= 1), "{encoded:?} {pixel:?}");
    }
    let middles = canvas.middles.as_ref().unwrap();
    let same = |a: f32, b: f32| a == b || a.is_nan() && b.is_nan();
    assert!(exr[4].1.iter().zip(&middles.depth_mm).all(|(a, b)| same(*a, *b)));
    assert!(exr[5].1.iter().zip(&middles.volume_id).all(|(a, b)| *a == f32::from(*b)) && middles.volume_id.contains(&1));
}

fn exr_channels(bytes: &[u8]) -> Vec<(String, Vec<f32>)> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(Cursor::new(bytes)).unwrap();
    image.layer_data.channel_data.list.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

#[test]
fn what_is_clear_lies_on_any_ground_as_if_it_were_drawn_there() {
    // Fails if edges carry the colour of a ground that is not there, or opacity is wrong where surfaces let light through.
    let mut opened = DEMO.clone();
    opened.scene.mode = Mode::Overlay;
    let picture = |ground: Option<Color>| {
        let mut print = Print { samples: 16, ..sheet([30.0, 30.0], 100.0) };
        drawn(&mut [seen(with_background(&opened, ground), View::Oblique)], &mut print).unwrap()
    };
    let clear = picture(None);
    for ground in [Color([1.0, 0.0, 0.0]), WHITE, Color([0.2, 0.5, 0.3])] {
        let on_it = picture(Some(ground));
        let wanted = on_it.bytes(&on_it.light);
        for is_deep in [false, true] {
            let (channels, info) = png(&encoded(&clear, Form::Png, is_deep));
            assert_eq!(info.color_type, png::ColorType::Rgba);
            let most = if is_deep { 65535.0 } else { 255.0 };
            let partly = channels.chunks(4).filter(|pixel| pixel[3] > 0 && f32::from(pixel[3]) < most).count();
            assert!(partly > 100, "{partly}");
            for (pixel, wanted) in channels.chunks(4).zip(wanted.chunks(3)) {
                let share = [0, 1, 2, 3].map(|n| f32::from(pixel[n]) / most);
                let light = Color([share[0], share[1], share[2]]).linear() * share[3] + ground.linear() * (1.0 - share[3]);
                let bytes = Color::of_light(light).0.map(|c| (255.0 * c).round() as u8);
                assert!((0..3).all(|n| bytes[n].abs_diff(wanted[n]) <= 1), "{ground:?}, deep {is_deep}: {bytes:?} {wanted:?}");
            }
        }
    }
}

#[test]
fn pages_hold_the_marks_as_paths() {
    // Fails if marks are pixels in SVG or PDF, a page has another size, or a mark loses its words.
    let canvas = print(None, 200.0);
    let shapes: usize = canvas.marks.iter().map(|mark| mark.shapes.len()).sum();
    let svg = String::from_utf8(encoded(&canvas, Form::Svg, false)).unwrap();
    let [width, height] = canvas.size_mm();
    assert!(svg.contains(&format!("width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\"")), "{}", &svg[..200]);
    assert_eq!(svg.matches("<path ").count(), shapes);
    for words in ["50 mm", "bar of scale, 50 mm", "A", "S"] {
        assert!(svg.contains(&format!("aria-label=\"{words}\"><title>{words}</title>")), "{words}");
    }
    let pdf = encoded(&canvas, Form::Pdf, false);
    let text = String::from_utf8_lossy(&pdf);
    let page: Vec<f64> =
        text.split("/MediaBox [").nth(1).unwrap().split(']').next().unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
    assert!((page[2] / 72.0 * 25.4 - width).abs() < 1e-3 && (page[3] / 72.0 * 25.4 - height).abs() < 1e-3, "{page:?}");
    // Streams begin behind a line that says so; the one with operators has the picture drawn first.
    let starts = pdf.windows(7).enumerate().filter(|(_, w)| *w == b"stream\n").map(|(n, _)| n + 7);
    let inflated = starts.filter_map(|start| {
        let mut bytes = vec![];
        flate2::read::ZlibDecoder::new(&pdf[start..]).read_to_end(&mut bytes).ok()?;
        String::from_utf8(bytes).ok()
    });
    let drawn = inflated.into_iter().find(|text| text.contains("/Picture Do")).unwrap();
    let painted = drawn.lines().filter(|line| ["B", "f", "S"].contains(&line.trim())).count();
    assert_eq!(painted, shapes);
    assert!(text.contains("/SMask") && text.contains("/ICCBased"));
}

#[test]
fn a_name_without_a_form_and_what_a_form_cannot_hold_are_refused() {
    // Fails if a picture is written in a form that its name does not say, or something is left out of it without a word.
    let canvas = Canvas::filled([4, 4], None, Some(WHITE));
    let folder = super::folder("forms");
    for name in ["a.doc", "a", "a.gif", "a.png.txt", "a.bmp"] {
        let refused = write(&folder.join(name), &canvas, &Encoding::default(), None).unwrap_err().to_string();
        assert!(refused.contains(".tif, .exr, .jpg, .pdf or .svg"), "{refused}");
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    let deep = Encoding { is_deep: true, icc: None };
    let inked = Encoding { is_deep: false, icc: Some("p.icc".into()) };
    for (name, encoding, is_clear) in [
        ("a.jpg", &deep, false),
        ("a.exr", &deep, false),
        ("a.png", &inked, false),
        ("a.tif", &inked, true),
        ("a.jpeg", &Encoding::default(), true),
    ] {
        let file = Path::new(name);
        assert!(Form::of(file).unwrap().check(file, encoding, is_clear).is_err(), "{name}");
    }
    for (name, form) in [("A.TIFF", Form::Tiff), ("b.JPEG", Form::Jpeg), ("c.Png", Form::Png)] {
        assert_eq!(Form::of(Path::new(name)).unwrap(), form);
    }
}

#[test]
fn what_a_publisher_would_send_back_is_said_with_what_to_do() {
    // Fails if a figure that a journal does not take passes, or a good one does not.
    let of = |journal: Journal, print: &Print, form| journal.faults(print, form, &Encoding::default(), false);
    let good = Print { letters: true, ..sheet([85.0, 100.0], 300.0) };
    assert_eq!(of(Journal::Plos, &good, Form::Tiff), Vec::<String>::new());
    let bad = Print { type_pt: 5.0, ..Print { letters: true, ..sheet([250.0, 240.0], 100.0) } };
    let faults = of(Journal::Plos, &bad, Form::Png);
    for (fault, parts) in faults.iter().zip([
        ["249.9 mm wide", "--print"],
        ["240.0 mm high", "--print"],
        ["100 dots", "--dpi 300"],
        ["5 points", "--type-size 8"],
        ["form", ".tif"],
    ]) {
        assert!(parts.iter().all(|part| fault.contains(part)), "{fault}");
    }
    assert_eq!(faults.len(), 5);
    assert_eq!(Journal::Plos.faults(&good, Form::Tiff, &Encoding { is_deep: true, icc: None }, true).len(), 2);
    let nature = Print { type_pt: 6.0, letters: true, ..sheet([89.0, 80.0], 300.0) };
    assert_eq!(of(Journal::Nature, &nature, Form::Pdf), Vec::<String>::new());
    assert!(of(Journal::Nature, &good, Form::Pdf).iter().any(|fault| fault.contains("89 or 183")));
    // With marks on it, it is a combination, which wants more dots.
    assert!(of(Journal::Elsevier, &good, Form::Tiff)[0].contains("--dpi 500"));
    assert!(of(Journal::Elsevier, &sheet([85.0, 100.0], 300.0), Form::Tiff).is_empty());
    assert!(Journal::Plos.too_large(11_000_000).unwrap().contains("11.0 MB") && Journal::Plos.too_large(9_000_000).is_none());
}
