//! From prepared pictures to a sheet.

use super::PrintError;
use super::canvas::Canvas;
use super::marks::{self, Place, Tint};
use super::measured;
use super::prepare::{Panel, legend, legend_mm};
use super::sheet::{Layout, Print};
use bregma_field::Progress;
use bregma_renderer::{Picture, Renderer, Still, point_in_pixel};

/// Draws a sheet of pictures that are [`prepare`](super::prepare())d for it.
pub fn draw(panels: &[Panel], print: &Print, renderer: &mut dyn Renderer, progress: &Progress) -> Result<Canvas, PrintError> {
    let layout = Layout::new(print, panels.len(), legend_mm(panels, print)?)?;
    let ground = panels.first().and_then(|panel| panel.opened.scene.background);
    let mut canvas = Canvas::filled(print.size_px, print.dpi, ground);
    let tint = Tint::on(ground);
    progress.begin(panels.len() as u64 * u64::from(print.samples));
    // Below it stands the bar: in the last row the first.
    let with_bar = (panels.len() - 1) / layout.columns * layout.columns;
    for (n, (panel, (at, size))) in panels.iter().zip(&layout.cells).enumerate() {
        let mm = |px: u32| f64::from(px) / print.px_per_mm();
        let place = Place { at: at.map(mm), size: size.map(mm) };
        let still = still(panel, *size, print.samples, renderer, progress)?;
        canvas.lay(*at, &still.light(), still.middles());
        canvas.marks.extend(over(panel, n, still.middles(), place, print, tint));
        if let Some(bar) = print.bar.filter(|_| n == with_bar) {
            canvas.marks.extend(marks::bar(bar, &panel.opened.scene.viewed_from(), place, print, tint)?);
        }
    }
    if let Some(panel) = panels.first().filter(|_| print.legend) {
        canvas.marks.extend(legend(panel)?.marks(layout.legend_mm, print, tint));
    }
    canvas.marks.extend(marks::caption(layout.caption_mm, print, tint));
    Ok(canvas)
}

/// A picture through many points of each pixel.
fn still(panel: &Panel, size: [u32; 2], samples: u32, renderer: &mut dyn Renderer, progress: &Progress) -> Result<Still, PrintError> {
    let opened = &panel.opened;
    let mut sample = |n: u32| -> Result<Picture, PrintError> {
        let mut picture = opened.compare.sample(renderer, &opened.volumes, &opened.scene, opened.compared(), size, n)?;
        if let Some(coat) = &panel.coat {
            coat.paint(&mut picture, &opened.scene, point_in_pixel(n));
        }
        progress.advance(1)?;
        Ok(picture)
    };
    let mut still = Still::of(sample(0)?);
    // A slice has values at its nodes alone.
    while still.samples() < samples && !opened.scene.is_slice() {
        still.add(&sample(still.samples())?);
    }
    Ok(still)
}

/// What is drawn over picture number `n`.
fn over(panel: &Panel, n: usize, picture: &Picture, place: Place, print: &Print, tint: Tint) -> Vec<super::shapes::Mark> {
    let mut over = vec![];
    if print.marks {
        over.extend(measured::marks(&panel.opened, picture, place, print, tint));
    }
    if print.letters {
        over.extend(marks::letters(&panel.opened.scene.viewed_from(), place, print, tint));
    }
    if let Some(label) = &print.label {
        over.push(marks::label(&marks::following(label, n), place, print, tint));
    }
    over
}
