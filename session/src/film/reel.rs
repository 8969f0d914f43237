//! The frames of a film, in a folder beside it until it is whole: stopped at any moment, the same film goes on where it was, and is the same to the
//! last byte as one that was never stopped.

use super::coded::{Coder, frame_yuv};
use super::{Film, FilmError, animation, mp4};
use crate::measurement::Origin;
use crate::output::{make_folder, read_figure, write_whole};
use crate::print::{Canvas, Panel, Print, draw};
use bregma_field::Progress;
use bregma_renderer::Renderer;
use rayon::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};

/// What a film's file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// H.264 in MP4.
    Mp4,
    /// Animated PNG.
    Apng,
    /// GIF.
    Gif,
    /// The frames, as PNG.
    Folder,
}

impl Form {
    /// By the ending of the film's name; a name without one is a folder.
    pub fn of(file: &Path) -> Result<Self, FilmError> {
        match file.extension().map(|ending| ending.to_string_lossy().to_lowercase()).as_deref() {
            Some("mp4") => Ok(Self::Mp4),
            Some("apng") => Ok(Self::Apng),
            Some("gif") => Ok(Self::Gif),
            None => Ok(Self::Folder),
            Some(_) => Err(FilmError::Ending(file.to_owned())),
        }
    }
}

/// Frames that are read at once.
const BATCH: u32 = 16;

/// A film on its way.
#[derive(Debug)]
pub struct Reel<'a> {
    film: &'a Film,
    print: &'a Print,
    form: Form,
    file: PathBuf,
    /// Where its frames are.
    pub folder: PathBuf,
}

/// What of the folder says of which film its frames are.
const RECORD: &str = "film.json";

impl<'a> Reel<'a> {
    /// Begins a film of what a panel shows, or goes on with it.
    pub fn begin(file: &Path, film: &'a Film, panel: &Panel, print: &'a Print, drawn_by: &str) -> Result<Self, FilmError> {
        film.check(&panel.opened)?;
        let form = Form::of(file)?;
        let [width, height] = print.size_px;
        if form == Form::Mp4 && (width % 2 + height % 2 > 0 || width.max(height) > 4096) {
            return Err(FilmError::Size { width, height });
        }
        let folder = if form == Form::Folder { file.to_owned() } else { file.with_added_extension("frames") };
        let reel = Self { film, print, form, file: file.to_owned(), folder };
        let record = format!("{:#}\n", reel.record(panel, drawn_by));
        let there = reel.folder.join(RECORD);
        match std::fs::read_to_string(&there) {
            Ok(text) if text == record => {}
            Ok(_) => return Err(FilmError::OtherFrames(reel.folder)),
            // A folder of something else is not written into; what a kill left of the record is nothing else.
            Err(_) if std::fs::read_dir(&reel.folder).is_ok_and(|list| list.flatten().any(|entry| !is_left(&entry))) => {
                return Err(FilmError::OtherFrames(reel.folder));
            }
            Err(_) => {
                make_folder(&reel.folder).map_err(|e| FilmError::Encode(e.to_string()))?;
                write_whole(&there, record.as_bytes())?;
            }
        }
        Ok(reel)
    }

    /// All that the frames depend on.
    fn record(&self, panel: &Panel, drawn_by: &str) -> serde_json::Value {
        let opened = &panel.opened;
        let scans: Vec<_> = opened.volumes.iter().map(|volume| json!({"name": volume.name(), "content": volume.content()})).collect();
        let program = Origin::of(opened).map(|origin| origin.program);
        json!({
            "film": self.film, "print": self.print, "scene": opened.scene, "compare": format!("{:?}", opened.compare),
            "scans": scans, "program": program, "drawn_by": drawn_by,
        })
    }

    fn frame_file(&self, n: u32) -> PathBuf {
        self.folder.join(format!("{n:05}.png"))
    }

    /// Draws the frames that are not there yet. `progress` counts frames.
    pub fn draw(&self, panel: &Panel, renderer: &mut dyn Renderer, progress: &Progress) -> Result<(), FilmError> {
        let count = self.film.frames();
        progress.begin(u64::from(count));
        for n in 0..count {
            progress.advance(1)?;
            let file = self.frame_file(n);
            if file.exists() {
                continue;
            }
            let shown = Panel { opened: self.film.opened_at(&panel.opened, n), aim: None, coat: panel.coat.clone() };
            let canvas = draw(std::slice::from_ref(&shown), self.print, renderer, &Progress::default())?;
            let png = crate::print::figure_png(&figure(&canvas)).map_err(|e| FilmError::Encode(e.to_string()))?;
            write_whole(&file, &png)?;
        }
        Ok(())
    }

    /// RGB pixels of a frame.
    fn frame(&self, n: u32) -> Result<Vec<u8>, FilmError> {
        let file = self.frame_file(n);
        let fail = |reason: String| FilmError::Frame { file: file.clone(), reason };
        let (rgb, width, height) = read_figure(&file).map_err(|e| fail(e.to_string()))?;
        if [width, height] == self.print.size_px { Ok(rgb) } else { Err(fail("it is of another size".into())) }
    }

    /// The film as bytes; nothing of a folder. `progress` counts frames.
    fn encoded(&self, quantiser: u8, progress: &Progress) -> Result<Option<Vec<u8>>, FilmError> {
        let (size, fps, count) = (self.print.size_px, self.film.fps, self.film.frames());
        progress.begin(u64::from(count));
        let next = |n: u32| {
            progress.advance(1)?;
            self.frame(n)
        };
        match self.form {
            Form::Folder => Ok(None),
            Form::Apng => animation::apng(size, fps, count, next).map(Some),
            Form::Gif => animation::gif(size, fps, count, next).map(Some),
            Form::Mp4 => {
                let mut coder = Coder::new(size, fps, quantiser)?;
                let mut frames = vec![];
                let yuv = |n: u32| Ok(frame_yuv(&next(n)?, size.map(|px| px as usize)));
                let batch = |from: u32| (from..count.min(from + BATCH)).into_par_iter().map(yuv).collect::<Result<Vec<_>, FilmError>>();
                // The next frames are read while these are encoded.
                let mut ready = batch(0)?;
                for from in (0..count).step_by(BATCH as usize) {
                    let encode = || ready.iter().map(|frame| coder.encode(frame)).collect::<Result<Vec<_>, _>>();
                    let (coded, following) = rayon::join(encode, || batch(from + BATCH));
                    frames.extend(coded?);
                    ready = following?;
                }
                Ok(Some(mp4::written(mp4::Shape { size, fps }, &frames)))
            }
        }
    }
}

/// Whether it is what a kill leaves of a file that was being written.
fn is_left(entry: &std::fs::DirEntry) -> bool {
    let name = entry.file_name();
    let name = name.to_string_lossy();
    name.starts_with(".bregma-") && name.ends_with(".part")
}

/// Draws what of a film is not drawn, writes it, and takes its frames away.
pub fn write(reel: &Reel<'_>, panel: &Panel, quantiser: u8, renderer: &mut dyn Renderer, progress: &Progress) -> Result<(), FilmError> {
    reel.draw(panel, renderer, progress)?;
    if let Some(bytes) = reel.encoded(quantiser, progress)? {
        write_whole(&reel.file, &bytes)?;
        // The film is whole; frames that stay in the way are no failure of it. The record goes last: until then it says what the others are.
        let all = std::fs::read_dir(&reel.folder).into_iter().flatten().flatten().filter(|entry| entry.file_name() != RECORD);
        all.for_each(|entry| drop(std::fs::remove_file(entry.path())));
        drop(std::fs::remove_dir_all(&reel.folder));
    }
    Ok(())
}

/// A sheet over black as RGB pixels: films have no clear ground.
fn figure(canvas: &Canvas) -> (Vec<u8>, u32, u32) {
    let light = canvas.painted();
    let opaque = Canvas { size: canvas.size, ..Canvas::default() };
    (opaque.bytes(&light.iter().map(|pixel| pixel.truncate().extend(1.0)).collect::<Vec<_>>()), canvas.size[0], canvas.size[1])
}
