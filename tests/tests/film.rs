//! Films: what each frame shows, files that others read, and what a stop leaves.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use bregma_field::Progress;
use bregma_renderer::CpuRenderer;
use bregma_session::Opened;
use bregma_session::film::{Film, FilmError, Key, QUALITY, Reel, frame_yuv, write};
use bregma_session::output::read_figure;
use bregma_session::print::{Panel, Print};
use rusty_h264::{Decoder, YuvFrame};
use std::path::{Path, PathBuf};

const SIZE: [u32; 2] = [160, 120];

fn panel() -> Panel {
    let mut opened = Opened::demo(48, &Progress::default()).unwrap();
    opened.scene.background = Some(bregma_renderer::Color([1.0, 1.0, 1.0]));
    opened.first_look(4.0 / 3.0);
    Panel { opened, aim: None, coat: None }
}

fn print() -> Print {
    Print { size_px: SIZE, ..Print::default() }
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("bregma-film-{}-{name}", std::process::id()));
    drop(std::fs::remove_dir_all(&folder));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn made(film: &Film, panel: &Panel, file: &Path) -> Result<(), FilmError> {
    let print = print();
    let reel = Reel::begin(file, film, panel, &print, "cpu")?;
    write(&reel, panel, QUALITY, &mut CpuRenderer::default(), &Progress::default())
}

fn turntable(seconds: f64, fps: f64) -> Film {
    Film { seconds, fps, turns: Some(1.0), keys: vec![] }
}

/// The content of the box at the end of a way through boxes.
fn boxed<'a>(mut bytes: &'a [u8], way: &[&[u8; 4]]) -> &'a [u8] {
    for kind in way {
        // A sample description has 8 bytes before its boxes, and a sample entry 78 more.
        loop {
            let length = u32::from_be_bytes(bytes[..4].try_into().unwrap()) as usize;
            if bytes[4..8] == **kind {
                let skipped = match &**kind {
                    b"stsd" => 8,
                    b"avc1" => 78,
                    _ => 0,
                };
                bytes = &bytes[8 + skipped..length];
                break;
            }
            bytes = &bytes[length..];
        }
    }
    bytes
}

fn words(bytes: &[u8]) -> Vec<usize> {
    bytes.chunks_exact(4).map(|word| u32::from_be_bytes(word.try_into().unwrap()) as usize).collect()
}

/// The frames of an MP4, decoded from where its tables say that they are.
fn decoded(film: &[u8]) -> Vec<YuvFrame> {
    let table = |kind: &[u8; 4]| words(boxed(film, &[b"moov", b"trak", b"mdia", b"minf", b"stbl", kind]));
    let sizes = &table(b"stsz")[3..];
    let mut at = table(b"stco")[2];
    let avc = boxed(film, &[b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd", b"avc1", b"avcC"]);
    let set = |from: usize| {
        let length = usize::from(u16::from_be_bytes([avc[from], avc[from + 1]]));
        (&avc[from + 2..from + 2 + length], from + 2 + length)
    };
    let (sps, after) = set(6);
    let (pps, _) = set(after + 1);
    let mut stream = [&[0, 0, 0, 1], sps, &[0, 0, 0, 1], pps].concat();
    for size in sizes {
        let (mut sample, end) = (at, at + size);
        while sample < end {
            let length = u32::from_be_bytes(film[sample..sample + 4].try_into().unwrap()) as usize;
            stream.extend([0, 0, 0, 1]);
            stream.extend(&film[sample + 4..sample + 4 + length]);
            sample += 4 + length;
        }
        at = end;
    }
    Decoder::new().decode_stream(&stream).unwrap()
}

/// sRGB of a pixel of video, by BT.709's narrow range.
fn rgb(frame: &YuvFrame, x: usize, y: usize) -> [f64; 3] {
    let luma = (f64::from(frame.y[y * frame.width + x]) - 16.0) / 219.0;
    let at = y / 2 * (frame.width / 2) + x / 2;
    let [blue, red] = [&frame.u, &frame.v].map(|plane| (f64::from(plane[at]) - 128.0) / 224.0);
    let (r, b) = (luma + 1.5748 * red, luma + 1.8556 * blue);
    [r, (luma - 0.2126 * r - 0.0722 * b) / 0.7152, b].map(|c| c * 255.0)
}

#[test]
fn a_turntable_is_an_mp4_that_decodes_to_its_frames() {
    // Fails if tables point beside frames, frames are out of order, colours are another standard's, or the film is coarse.
    let d = folder("mp4");
    let (panel, film) = (panel(), turntable(1.0, 12.0));
    made(&film, &panel, &d.join("frames")).unwrap();
    made(&film, &panel, &d.join("t.mp4")).unwrap();
    assert!(!d.join("t.mp4.frames").exists(), "a whole film leaves no frames");
    let bytes = std::fs::read(d.join("t.mp4")).unwrap();
    let frames = decoded(&bytes);
    assert_eq!(frames.len(), 12);
    let mut worst = f64::INFINITY;
    for (n, frame) in frames.iter().enumerate() {
        let (pixels, width, height) = read_figure(&d.join(format!("frames/{n:05}.png"))).unwrap();
        assert_eq!([width, height], SIZE);
        let truth = frame_yuv(&pixels, SIZE.map(|n| n as usize));
        let square: f64 = truth.y.iter().zip(&frame.y).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>() / truth.y.len() as f64;
        worst = worst.min(10.0 * (255.0_f64.powi(2) / square.max(1e-9)).log10());
        // The white ground, far from bone.
        let white = rgb(frame, 4, 4);
        assert!(white.iter().all(|c| (c - 255.0).abs() <= 2.0), "{white:?}");
    }
    println!("{} bytes, worst frame {worst:.1} dB", bytes.len());
    assert!(worst >= 45.0, "wanted 45 dB");
    let colors = boxed(&bytes, &[b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd", b"avc1", b"colr"]);
    assert_eq!(colors, b"nclx\0\x01\0\x01\0\x01\0");
    // The tables stand before the frames.
    let place = |kind: &[u8]| bytes.windows(4).position(|four| four == kind).unwrap();
    assert!(place(b"moov") < place(b"mdat"));
}

#[test]
fn colours_are_those_of_bt_709() {
    // Fails if red is told by another standard's weights: each saturated colour comes back.
    for color in [[255, 0, 0], [0, 255, 0], [0, 0, 255], [200, 120, 40], [0, 0, 0], [255, 255, 255]] {
        let frame = frame_yuv(&color.repeat(16), [4, 4]);
        let back = rgb(&frame, 1, 1);
        assert!(color.iter().zip(back).all(|(a, b)| (f64::from(*a) - b).abs() <= 2.0), "{color:?}: {back:?}");
    }
}

#[test]
fn a_turntable_goes_once_around_and_keys_are_gone_through() {
    // Fails if a turn stops short or shows its first frame twice, or a key's numbers are not those of its frame.
    let panel = panel();
    let film = turntable(2.0, 10.0);
    let forward = |n: u32| film.opened_at(&panel.opened, n).scene.camera.basis().forward;
    let around = |v: glam::DVec3| v.y.atan2(v.x);
    let step = (around(forward(1)) - around(forward(0))).rem_euclid(std::f64::consts::TAU);
    assert!((step - std::f64::consts::TAU / 20.0).abs() < 1e-9);
    let last = (around(forward(0)) - around(forward(19))).rem_euclid(std::f64::consts::TAU);
    assert!((last - step).abs() < 1e-9, "the last frame is one step before the first");
    let iso = panel.opened.scene.layers[0].iso;
    let key = |at_s: f64, orbit: [f64; 2], iso: Option<Vec<f64>>| Key { at_s, orbit: Some(orbit), iso, ..Key::default() };
    let keys =
        vec![key(0.0, [0.0, 0.0], Some(vec![iso, iso])), key(1.0, [90.0, 0.0], None), key(2.0, [90.0, 60.0], Some(vec![iso + 200.0, iso]))];
    let film = Film { seconds: 2.0, fps: 10.0, turns: None, keys };
    let at = |n: u32| film.opened_at(&panel.opened, n).scene;
    assert!((at(0).layers[0].iso - iso).abs() < 1e-9 && (at(20).layers[0].iso - iso - 200.0).abs() < 1e-9);
    assert!(at(10).layers[0].iso > iso && at(10).layers[0].iso < iso + 200.0 && at(10).layers[1].iso == iso);
    let quarter = bregma_renderer::Camera::orbit_with_fov(&panel.opened.bounds(), 90.0, 0.0, 30.0);
    assert!(at(10).camera.basis().forward.distance(quarter.basis().forward) < 1e-9);
    for (bad, why) in [
        (Film { keys: vec![], ..film.clone() }, "nothing moves"),
        (Film { fps: 0.5, ..film.clone() }, "1 to 240"),
        (Film { keys: vec![key(1.0, [0.0; 2], None), key(1.0, [0.0; 2], None)], ..film.clone() }, "key 2"),
        (Film { keys: vec![key(0.0, [0.0; 2], Some(vec![1.0]))], ..film.clone() }, "one for each"),
    ] {
        let error = bad.check(&panel.opened).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn what_stopped_goes_on_and_is_the_same() {
    // Fails if a stop loses frames, leaves a half one in the film, or frames of another film are taken for these.
    let d = folder("stopped");
    let (panel, film, print) = (panel(), turntable(0.5, 12.0), print());
    made(&film, &panel, &d.join("whole.mp4")).unwrap();
    let file = d.join("stopped.mp4");
    let reel = Reel::begin(&file, &film, &panel, &print, "cpu").unwrap();
    reel.draw(&panel, &mut CpuRenderer::default(), &Progress::default()).unwrap();
    for n in [2, 3, 5] {
        std::fs::remove_file(reel.folder.join(format!("{n:05}.png"))).unwrap();
    }
    // What was under way when it was stopped.
    std::fs::write(reel.folder.join(".bregma-1-0.part"), b"half").unwrap();
    let kept = std::fs::metadata(reel.folder.join("00000.png")).unwrap().modified().unwrap();
    let again = Reel::begin(&file, &film, &panel, &print, "cpu").unwrap();
    again.draw(&panel, &mut CpuRenderer::default(), &Progress::default()).unwrap();
    assert_eq!(std::fs::metadata(reel.folder.join("00000.png")).unwrap().modified().unwrap(), kept, "what is drawn stays");
    write(&again, &panel, QUALITY, &mut CpuRenderer::default(), &Progress::default()).unwrap();
    assert!(std::fs::read(&file).unwrap() == std::fs::read(d.join("whole.mp4")).unwrap());
    // Another film is not made of these frames.
    let other = turntable(0.5, 10.0);
    Reel::begin(&d.join("other"), &film, &panel, &print, "cpu").unwrap();
    assert!(matches!(Reel::begin(&d.join("other"), &other, &panel, &print, "cpu"), Err(FilmError::OtherFrames(_))));
    std::fs::create_dir_all(d.join("full")).unwrap();
    std::fs::write(d.join("full/letter.txt"), b"mine").unwrap();
    assert!(matches!(Reel::begin(&d.join("full"), &film, &panel, &print, "cpu"), Err(FilmError::OtherFrames(_))));
    assert!(matches!(Reel::begin(&d.join("a.avi"), &film, &panel, &print, "cpu"), Err(FilmError::Ending(_))));
    let odd = Print { size_px: [161, 120], ..Print::default() };
    assert!(matches!(Reel::begin(&d.join("odd.mp4"), &film, &panel, &odd, "cpu"), Err(FilmError::Size { .. })));
}

#[test]
fn animated_pictures_have_all_frames_at_their_pace() {
    // Fails if a frame is lost, a pace is another, or APNG loses a colour.
    let d = folder("animated");
    let (panel, film) = (panel(), turntable(0.5, 15.0));
    for name in ["frames", "t.apng", "t.gif"] {
        made(&film, &panel, &d.join(name)).unwrap();
    }
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(d.join("t.apng")).unwrap())).read_info().unwrap();
    assert_eq!(reader.info().animation_control.unwrap().num_frames, 8);
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    for n in 0..8 {
        reader.next_frame(&mut pixels).unwrap();
        assert!(pixels == read_figure(&d.join(format!("frames/{n:05}.png"))).unwrap().0, "frame {n}");
        assert_eq!(reader.info().frame_control.unwrap().delay_num, 67);
    }
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(std::fs::File::open(d.join("t.gif")).unwrap()).unwrap();
    let mut delays = vec![];
    while let Some(frame) = reader.read_next_frame().unwrap() {
        assert_eq!((frame.width, frame.height), (160, 120));
        delays.push(frame.delay);
    }
    assert_eq!((delays.len(), delays.iter().sum::<u16>()), (8, 53), "{delays:?}");
}
