//! From prepared pictures to a sheet.

use super::PrintError;
use super::canvas::Canvas;
use super::marks::{self, Place, Tint};
use super::measured;
use super::prepare::{Panel, legend, legend_mm};
use super::shapes::Mark;
use super::sheet::{Layout, Print};
use crate::compare::Compare;
use crate::studio::{self, Drawn, Exposure, Order, Stop, Told, part_of};
use bregma_field::Progress;
use bregma_renderer::{Picture, Renderer, Still, point_in_pixel};
use glam::Vec4;
use std::path::Path;
use std::time::{Duration, Instant};

/// What is done while a picture under studio light is exposed.
pub struct Watch<'a> {
    /// The file that is made, beside which what is drawn so far is kept, and how often.
    pub out: Option<(&'a Path, Duration)>,
    /// Told how far the picture is.
    pub told: &'a mut dyn FnMut(&Told),
    /// Told what came of each.
    pub drawn: &'a mut dyn FnMut(&Drawn),
}

/// Draws a sheet of pictures that are [`prepare`](super::prepare())d for it.
pub fn draw(panels: &[Panel], print: &Print, renderer: &mut dyn Renderer, progress: &Progress) -> Result<Canvas, PrintError> {
    draw_watched(panels, print, renderer, progress, Watch { out: None, told: &mut |_| {}, drawn: &mut |_| {} })
}

/// The same, watched.
pub fn draw_watched(
    panels: &[Panel],
    print: &Print,
    renderer: &mut dyn Renderer,
    progress: &Progress,
    mut watch: Watch<'_>,
) -> Result<Canvas, PrintError> {
    let layout = Layout::new(print, panels.len(), legend_mm(panels, print)?)?;
    let ground = panels.first().and_then(|panel| panel.opened.scene.background);
    let tint = Tint::on(ground);
    progress.begin(panels.len() as u64 * u64::from(print.samples));
    let mut canvas = Canvas::default();
    let mut marks = vec![];
    for (n, (panel, (at, size))) in panels.iter().zip(&layout.cells).enumerate() {
        let (light, middles) = match panel.opened.scene.studio {
            Some(_) => exposed(panel, n, *size, (print, renderer), progress, &mut watch)?,
            None => still(panel, *size, print.samples, renderer, progress)?.into_light(),
        };
        marks.extend(over(panel, n, &middles, print, (tint, &layout))?);
        if *size == print.size_px {
            canvas = Canvas::whole(light, middles, print.dpi, ground);
        } else {
            if n == 0 {
                canvas = Canvas::filled(print.size_px, print.dpi, ground);
            }
            canvas.lay(*at, &light, &middles);
        }
    }
    canvas.marks = marks;
    if let Some(panel) = panels.first().filter(|_| print.legend) {
        canvas.marks.extend(legend(panel)?.marks(layout.legend_mm, print, tint));
    }
    canvas.marks.extend(marks::caption(layout.caption_mm, print, tint));
    Ok(canvas)
}

/// Picture number `n` under studio light.
fn exposed(
    panel: &Panel,
    n: usize,
    size: [u32; 2],
    (print, renderer): (&Print, &mut dyn Renderer),
    progress: &Progress,
    watch: &mut Watch<'_>,
) -> Result<(Vec<Vec4>, Picture), PrintError> {
    let exposure = print
        .exposure
        .unwrap_or_else(|| Exposure { stop: Stop { samples: Some(print.samples), ..Stop::default() }, ..Exposure::default() });
    let opened = &panel.opened;
    let part = watch.out.map(|(out, _)| part_of(out, n));
    let keep_every = watch.out.map_or(Duration::MAX, |(_, every)| every);
    let order = Order { volumes: &opened.volumes, scene: &opened.scene, size, exposure, part: part.as_deref(), keep_every };
    // Noise or a clock may end it, so that samples do not tell how far it is: its time does.
    let (begun, mut reached) = (Instant::now(), 0);
    let told = |told: Told| {
        (watch.told)(&told);
        let spent = begun.elapsed().as_secs_f64();
        let share = told.left.map_or(0.0, |left| spent / (spent + left.as_secs_f64()));
        let more = ((share * f64::from(print.samples)) as u64).saturating_sub(reached);
        reached += more;
        // Whoever cancels it cancels the next round, too.
        let _ = progress.advance(more);
    };
    let drawn = studio::draw(&order, renderer, progress, told)?;
    (watch.drawn)(&drawn);
    progress.advance(u64::from(print.samples).saturating_sub(reached))?;
    Ok((studio::on_ground(drawn.light, opened.scene.background), drawn.middles))
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
fn over(panel: &Panel, n: usize, picture: &Picture, print: &Print, (tint, layout): (Tint, &Layout)) -> Result<Vec<Mark>, PrintError> {
    let (opened, camera) = (&panel.opened, panel.opened.scene.viewed_from());
    let mm = |px: u32| f64::from(px) / print.px_per_mm();
    let ([left, top], size) = layout.cells[n];
    let place = Place { at: [mm(left), mm(top)], size: size.map(mm) };
    // Two pictures beside each other are two views; other comparisons are one.
    let views = if opened.compare == Compare::SideBySide { opened.compare.sizes(opened.compared(), size) } else { vec![size] };
    let mut places = vec![];
    let mut beside = 0;
    for view in views {
        places.push((beside, Place { at: [place.at[0] + mm(beside), place.at[1]], size: view.map(mm) }));
        beside += view[0];
    }
    let mut over = vec![];
    // Of several pictures the first of the last row has the bar.
    let with_bar = (layout.cells.len() - 1) / layout.columns * layout.columns;
    if let Some(bar) = print.bar.filter(|_| n == with_bar) {
        over.extend(marks::bar(bar, &camera, places[0].1, print, tint)?);
    }
    let bar_mm = over.iter().map(|mark| mark.bounds()[1][0]).fold(0.0, f64::max);
    if print.letters {
        over.extend(places.iter().flat_map(|(_, place)| marks::letters(&camera, *place, bar_mm, print, tint)));
    }
    if let Some(label) = &print.label {
        over.push(marks::label(&marks::following(label, n), place, print, tint));
    }
    if print.marks {
        // They are drawn below, and their words keep clear of the others.
        let taken: Vec<_> = over.iter().map(Mark::bounds).collect();
        let measured = places.iter().flat_map(|(from, place)| measured::marks(opened, (picture, *from), *place, &taken, (print, tint)));
        over = measured.collect::<Vec<_>>().into_iter().chain(over).collect();
    }
    Ok(over)
}
