//! Pictures that say what they were drawn of, and are drawn again.

use super::{DEMO, WHITE, drawn, folder, seen, sheet, with_background};
use bregma_renderer::{CpuRenderer, Renderer};
use bregma_session::Machine;
use bregma_session::print::record::{AgainError, Likeness, Record, again, of};
use bregma_session::print::{Bar, Encoding, Panel, Print, write};
use bregma_session::views::View;
use std::path::{Path, PathBuf};

/// A print of the demo with its record, as a file.
fn file(name: &str, views: &[View]) -> PathBuf {
    let bar = Some(Bar { length_mm: Some(50.0), at_target: false });
    let caption = Some("Schädel <A> & \"B\", 50 µm".into());
    let mut print = Print { letters: true, bar, caption, samples: 2, ..sheet([40.0, 44.0], 80.0) };
    let mut panels: Vec<Panel> = views.iter().map(|view| seen(with_background(&DEMO, Some(WHITE)), *view)).collect();
    let canvas = drawn(&mut panels, &mut print).unwrap();
    let encoding = Encoding::default();
    let drawn_by = CpuRenderer::default().name();
    let record = Record::of(&panels, &print, &encoding, &drawn_by, Path::new(".")).unwrap().to_string();
    let file = folder("again").join(name);
    write(&file, &canvas, &encoding, Some(&record)).unwrap();
    assert_eq!(of(&file).as_deref().map(plain), Some(plain(&record)), "{name}");
    file
}

/// JSON whatever its letters are written as.
fn plain(json: &str) -> serde_json::Value {
    serde_json::from_str(json).unwrap()
}

fn redrawn(file: &Path) -> Result<bregma_session::print::record::Again, AgainError> {
    again(file, Machine::Cpu, &Default::default())
}

#[test]
fn every_form_is_drawn_again_byte_for_byte() {
    // Fails if a record loses what decides a pixel, or a file holds something that changes by itself, as the time.
    for name in ["a.png", "a.tif", "a.exr", "a.jpg", "a.pdf", "a.svg"] {
        let found = redrawn(&file(name, &[View::Frontalis])).unwrap();
        assert!(found.likeness == Likeness::Same && found.holds(), "{name}: {found:?}");
    }
    let plate = file("plate.png", &[View::Frontalis, View::Basilaris, View::Oblique]);
    assert_eq!(redrawn(&plate).unwrap().likeness, Likeness::Same);
}

#[test]
fn a_changed_pixel_is_found() {
    // Fails if a picture that was edited passes for what was drawn.
    let file = file("edited.png", &[View::Frontalis]);
    let bytes = std::fs::read(&file).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let info = reader.info().clone();
    pixels[3 * (info.width * info.height / 2 + info.width / 2) as usize] ^= 0x10;
    let edited = file.with_file_name("edited-2.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&edited).unwrap(), info.width, info.height);
    encoder.set_color(png::ColorType::Rgb);
    for text in &info.utf8_text {
        encoder.add_itxt_chunk(text.keyword.clone(), text.get_text().unwrap()).unwrap();
    }
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    let found = redrawn(&edited).unwrap();
    assert!(!found.holds(), "{found:?}");
    let Likeness::Differs { count, most, .. } = found.likeness else { panic!("{found:?}") };
    assert!(count == 1 && (most - 16.0 / 255.0).abs() < 1e-6);
    // The same pixels in another file are the same picture.
    pixels[3 * (info.width * info.height / 2 + info.width / 2) as usize] ^= 0x10;
    let copied = file.with_file_name("copied.png");
    let mut encoder = png::Encoder::new(std::fs::File::create(&copied).unwrap(), info.width, info.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.add_itxt_chunk("bregma".into(), of(&file).unwrap()).unwrap();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    assert_eq!(redrawn(&copied).unwrap().likeness, Likeness::SamePixels);
}

#[test]
fn what_says_nothing_or_nonsense_is_a_sentence() {
    // Fails if a strange record panics, or a picture of elsewhere is taken for one of ours.
    let folder = folder("again");
    let canvas = bregma_session::print::Canvas::filled([4, 4], None, Some(WHITE));
    let silent = folder.join("silent.tif");
    write(&silent, &canvas, &Encoding::default(), None).unwrap();
    assert!(of(&silent).is_none() && matches!(redrawn(&silent), Err(AgainError::Silent(_))));
    let whole = of(&file("whole.png", &[View::Frontalis])).unwrap();
    for (record, part) in [
        ("{}".to_owned(), "not understood"),
        (whole.replace("\"bregma_picture\":1", "\"bregma_picture\":9"), "version is 9"),
        (whole.replace("\"samples\":2", "\"samples\":0"), "not above 0"),
        (whole.replace("\"size_px\":[", "\"size_px\":[999"), "cannot be drawn"),
        (whole.replacen("\"contents\":[\"", "\"contents\":[\"0", 1), "content differs"),
        (whole.replacen("\"contents\":[", "\"contents\":[\"x\",", 1), "were measured"),
        (whole.replacen("\"panels\":[{", "\"panels\":[{\"wears_map\":true,", 1), "map"),
    ] {
        let file = folder.join("odd.svg");
        write(&file, &canvas, &Encoding::default(), Some(&record)).unwrap();
        let said = redrawn(&file).unwrap_err().to_string();
        assert!(said.contains(part), "{part}: {said}");
    }
}
