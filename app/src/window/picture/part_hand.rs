//! Parts made by hand: a brush, an eraser and scissors, which the mouse has while their panel gives them to it.

use super::super::measured::{Work, picked};
use super::super::widgets::color;
use super::marks::{self, Screen};
use super::navigate::mm_per_pixel_at;
use bregma_field::Progress;
use bregma_field::{Surface, Volume, WorldPoint};
use bregma_parts::{Dab, Depth, Labels, Lasso, Part, PartsError, Span};
use bregma_renderer::{Camera, Color, Picture};
use bregma_session::{Labelled, Opened};
use egui::{Color32, Event, Key, Painter, Pos2, Rect, Response, Shape, Stroke, Ui};
use glam::{DAffine3, DVec2, DVec3};
use std::collections::HashMap;
use std::sync::Arc;

/// What the hand holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Means {
    /// Paints bone for a part.
    Brush,
    /// Takes bone from a part.
    Eraser,
    /// Cuts out what is seen within a line.
    Scissors,
}

/// What the hand has done and is to become a step.
#[derive(Clone, Debug)]
pub enum Deed {
    /// A stroke, which the labels have already.
    Stroke,
    /// A line that was drawn around something.
    Cut(Cut),
}

/// A line in a picture.
#[derive(Clone, Debug)]
pub struct Cut {
    corners: Vec<DVec2>,
    camera: Camera,
    size: [u32; 2],
    /// How far it cuts behind what is seen first: mm, and how far along its ray that is for each pixel.
    depth: Option<(f64, Vec<f32>)>,
    inside: bool,
    number: u16,
}

/// A touch of the brush that has been painted: how many there were before it, where, and its radius.
pub type Painted = (u64, DVec3, f64);

/// The hand.
#[derive(Clone, Debug)]
pub struct PartHand {
    scan: Arc<Volume>,
    /// What it holds.
    pub means: Means,
    /// The part that is painted, or taken from.
    pub number: u16,
    /// Radius of the brush.
    pub radius_mm: f64,
    /// How deep scissors cut behind what is seen; through all when absent.
    pub depth_mm: Option<f64>,
    /// Scissors cut what lies within the line, else what lies outside.
    pub inside: bool,
    /// The numbers as the hand has left them; ahead of the work until a stroke has become a step.
    labels: Labels,
    /// What they came from.
    known: Option<Labelled>,
    changed: Option<Span>,
    deed: Option<Deed>,
    /// How often the labels have changed, and what of that were touches of the brush.
    changes: u64,
    touches: Vec<Painted>,
    stroke: Option<Pos2>,
    lasso: Vec<Pos2>,
    /// Where the line began: the view's place, its pixels and its camera.
    begun: Option<(Rect, [u32; 2], Camera)>,
    /// The part that was asked for and that nothing was painted for yet.
    asked: Option<u16>,
    /// A line was drawn that could not cut as deep as it should have: no picture said where bone is seen.
    is_refused: bool,
}

/// Radii of brushes, mm.
const RADII_MM: [f64; 2] = [0.1, 50.0];
/// A brush reaches no farther than so many of the longest steps between samples: a touch of more would hold the window up.
const MOST_STEPS: f64 = 48.0;
/// A smaller brush, and a larger one.
const KEYS: [Key; 2] = [Key::OpenBracket, Key::CloseBracket];
/// What a press of [ or ] changes a radius by.
const FACTOR: f64 = 1.15;
/// Touches lie so far apart along a stroke, in radii.
const SPACING: f64 = 0.3;
/// And no more of them than this between two frames, so that a wide stroke of a small brush holds nothing up.
const MOST_TOUCHES: f64 = 200.0;
/// Touches that are remembered for what is shown of them.
const REMEMBERED: usize = 512;
/// A corner of a line lies at least so far from the one before, in points.
const CORNER: f32 = 3.0;

impl PartHand {
    /// Takes scan number `n`, whose first part it works on, or a new one where there are none.
    pub fn take(opened: &Opened, n: usize, means: Means) -> Self {
        let scan = Arc::clone(&opened.volumes[n]);
        let labels = Labels::none(scan.grid().clone());
        let radius_mm = scan.grid().spacing_mm().max_element() * 5.0;
        let mut hand = Self {
            scan,
            means,
            number: 0,
            radius_mm,
            depth_mm: None,
            inside: true,
            labels,
            known: None,
            changed: None,
            deed: None,
            changes: 0,
            touches: vec![],
            stroke: None,
            lasso: vec![],
            begun: None,
            asked: None,
            is_refused: false,
        };
        hand.look(opened);
        if hand.number == 0 {
            hand.begin_part();
        }
        hand
    }

    /// The number of the scan, if it is open.
    pub fn scan(&self, opened: &Opened) -> Option<usize> {
        opened.volumes.iter().position(|volume| Arc::ptr_eq(volume, &self.scan))
    }

    /// Takes the labels of the work where others than those that it knows are there: after undo, or once parts were found.
    pub fn look(&mut self, opened: &Opened) {
        let Some(now) = self.scan(opened).map(|n| &opened.sources[n].labels) else { return };
        let is_known = match (now, &self.known) {
            (Some(now), Some(known)) => now.is_same_map(known),
            (None, None) => true,
            _ => false,
        };
        if is_known && self.changes > 0 {
            self.known.clone_from(now);
            return;
        }
        // It is in no map yet.
        let is_new = self.asked == Some(self.number);
        self.known.clone_from(now);
        self.labels = now.as_ref().map_or_else(|| Labels::none(self.scan.grid().clone()), |now| now.labels().as_ref().clone());
        (self.changed, self.deed, self.stroke) = (None, None, None);
        self.changed_all();
        let has = |labels: &Labels, number| labels.parts().iter().any(|part| part.number == number);
        if is_new || !has(&self.labels, self.number) {
            let first = self.labels.parts().first().map(|part| part.number);
            match first.filter(|_| !is_new) {
                Some(first) => self.number = first,
                None => self.begin_part(),
            }
            self.asked = is_new.then_some(self.number);
        }
    }

    /// Takes what its deed became; where it has painted on since, that stays to be done.
    pub fn became(&mut self, labelled: &Labelled) {
        self.known = Some(labelled.clone());
        if self.changed.is_none() && self.stroke.is_none() {
            self.labels = labelled.labels().as_ref().clone();
            self.changed_all();
            if !self.labels.parts().iter().any(|part| part.number == self.number) {
                self.begin_part();
            }
        }
    }

    /// Begins again from the labels of the work: what it did has become nothing.
    pub fn fall_back(&mut self, opened: &Opened) {
        (self.known, self.changes) = (None, 0);
        self.look(opened);
    }

    fn changed_all(&mut self) {
        self.changes += 1;
        self.touches.clear();
    }

    /// Paints for a new part from now on. Where there are more than there are numbers, it stays as it is.
    pub fn new_part(&mut self) {
        self.begin_part();
        self.asked = Some(self.number);
    }

    fn begin_part(&mut self) {
        let name = format!("Part {}", self.labels.parts().len() + 1);
        if let Ok((labels, number)) = self.labels.clone().with_part(&name) {
            (self.labels, self.number) = (labels, number);
        }
    }

    /// The parts that it may paint, by the names that they have now, with their colours.
    pub fn parts(&self) -> Vec<(u16, String, Color32)> {
        let known = self.known.iter().flat_map(|known| known.parts());
        let names: HashMap<u16, &str> = known.map(|part| (part.number, part.name.as_str())).collect();
        let name = |part: &Part| names.get(&part.number).map_or_else(|| part.name.clone(), |name| (*name).to_owned());
        self.labels.parts().iter().map(|part| (part.number, name(part), color(Color(part.color)))).collect()
    }

    /// What is to become a step: it, the labels, what they came from, and where they may differ.
    pub fn deed(&mut self) -> Option<(Deed, Labels, Option<Labelled>, Option<Span>)> {
        let deed = self.deed.take()?;
        Some((deed, self.labels.clone(), self.known.clone(), self.changed.take()))
    }

    /// A sentence on what the mouse does.
    pub fn hint(&self) -> &'static str {
        match self.means {
            Means::Brush => "Drag paints bone  ·  [ and ]: smaller, larger  ·  Alt + drag turns  ·  Escape ends",
            Means::Eraser => "Drag erases  ·  [ and ]: smaller, larger  ·  Alt + drag turns  ·  Escape ends",
            Means::Scissors => "Draw a line around what is to be cut  ·  Alt + drag turns  ·  Escape ends",
        }
    }

    /// What may be given another number: what is shown. Bone of nobody is shown where all is.
    fn is_shown(known: Option<&Labelled>, number: u16) -> bool {
        known.is_none_or(|known| if number == 0 { known.left_out().is_empty() } else { !known.left_out().contains(&number) })
    }

    /// How large its brush may be, mm.
    pub fn radii_mm(&self) -> std::ops::RangeInclusive<f64> {
        let [least, most] = RADII_MM;
        let most = most.min(MOST_STEPS * self.scan.grid().spacing_mm().max_element());
        least.min(most)..=most
    }

    /// Whether it is in the middle of something that is to become a step.
    pub fn is_busy(&self) -> bool {
        self.stroke.is_some() || self.changed.is_some() || self.deed.is_some()
    }

    /// Whether a line was refused since this was last asked.
    pub fn was_refused(&mut self) -> bool {
        std::mem::take(&mut self.is_refused)
    }

    /// Where the line that is being drawn began.
    pub fn begun(&self) -> Option<(Rect, [u32; 2], Camera)> {
        self.begun
    }

    /// Paints at a point of the world.
    fn touch(&mut self, bone: &Surface, point: WorldPoint) {
        let at = bone.grid.index(point);
        let (known, own, erases) = (self.known.clone(), self.number, self.means == Means::Eraser);
        let dab = Dab { at, radius_mm: self.radius_mm, number: if erases { 0 } else { own } };
        let taken = |number: u16| if erases { number == own } else { Self::is_shown(known.as_ref(), number) };
        let Some(span) = self.labels.paint(bone, dab, taken) else { return };
        self.changed = Some(self.changed.map_or(span, |changed| changed.with(span)));
        self.asked = None;
        self.touches.push((self.changes, point.0, self.radius_mm));
        self.changes += 1;
        if self.touches.len() > REMEMBERED {
            self.touches.drain(..REMEMBERED / 2);
        }
    }

    /// The touches since so many changes; none where more than touches were among these.
    pub fn touches_since(&self, changes: u64) -> Option<&[Painted]> {
        let first = self.touches.iter().position(|touch| touch.0 == changes)?;
        (self.touches.len() - first == (self.changes - changes) as usize).then(|| &self.touches[first..])
    }

    /// How often the labels have changed.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Lets the mouse paint or cut: `point` is where the bone lies under a point of the screen, if some does. `mm_per_point` is at that.
    pub fn follow(
        &mut self,
        ui: &Ui,
        response: &Response,
        work: &Work,
        point: impl Fn(Pos2) -> Option<WorldPoint>,
        mm_per_point: impl Fn(DVec3) -> f64,
    ) {
        self.keys(ui);
        let (down, free) = ui.input(|i| (i.pointer.primary_down(), !i.modifiers.shift && !i.modifiers.alt));
        let at = response.interact_pointer_pos().filter(|_| free && (down && response.is_pointer_button_down_on() || response.clicked()));
        let (Some(at), Some(bone)) = (at, self.bone(work)) else {
            if !down && self.stroke.take().is_some() && self.changed.is_some() {
                self.deed = Some(Deed::Stroke);
            }
            return;
        };
        let from = self.stroke.unwrap_or(at);
        let step = point(at).map_or(4.0, |p| SPACING * self.radius_mm / mm_per_point(p.0).max(1e-9)).max(1.0);
        let count = (f64::from(from.distance(at)) / step).ceil().clamp(1.0, MOST_TOUCHES);
        for n in 1..=count as usize {
            if let Some(point) = point(from.lerp(at, n as f32 / count as f32)) {
                self.touch(&bone, point);
            }
        }
        self.stroke = Some(at);
        ui.ctx().request_repaint();
    }

    /// Lets the mouse draw a line of the scissors; `picture` has what is seen.
    pub fn cut(&mut self, ui: &Ui, response: &Response, screen: &Screen<'_>, picture: Option<&Picture>) {
        let (down, free) = ui.input(|i| (i.pointer.primary_down(), !i.modifiers.shift && !i.modifiers.alt));
        if down && free && response.is_pointer_button_down_on() {
            // All places that the mouse has passed since the last frame, which may take its time.
            let moved = |event: &Event| if let Event::PointerMoved(at) = event { Some(*at) } else { None };
            self.begun.get_or_insert((screen.rect, screen.size, *screen.camera));
            let passed: Vec<Pos2> = ui.input(|i| i.events.iter().filter_map(moved).chain(i.pointer.interact_pos()).collect());
            for at in passed {
                if self.lasso.last().is_none_or(|last| last.distance(at) >= CORNER) {
                    self.lasso.push(at);
                }
            }
            ui.ctx().request_repaint();
            return;
        }
        let lasso = std::mem::take(&mut self.lasso);
        self.begun = None;
        if down || lasso.len() < 3 {
            return;
        }
        let depth = self.depth_mm.zip(picture).filter(|(_, picture)| [picture.width, picture.height] == screen.size);
        if self.depth_mm.is_some() && depth.is_none() {
            self.is_refused = true;
            return;
        }
        self.asked = None;
        self.deed = Some(Deed::Cut(Cut {
            corners: lasso.into_iter().map(|at| DVec2::from(screen.pixel(at))).collect(),
            camera: *screen.camera,
            size: screen.size,
            depth: depth.map(|(mm, picture)| (mm, picture.depth_mm.clone())),
            inside: self.inside,
            number: self.number,
        }));
    }

    /// The bone that is painted: where it is looked at, at the isovalue that it has now.
    fn bone(&self, work: &Work) -> Option<Surface> {
        let layer = &work.opened.scene.layers[self.scan(&work.opened)?];
        Surface::new(&self.scan, layer.iso, layer.transform).ok()
    }

    /// Whether a key is its own.
    pub fn takes(&self, key: Key) -> bool {
        self.means != Means::Scissors && KEYS.contains(&key)
    }

    fn keys(&mut self, ui: &Ui) {
        if ui.ctx().text_edit_focused() {
            return;
        }
        let [smaller, larger] = KEYS.map(|key| ui.input(|i| i.num_presses(key)) as i32);
        self.radius_mm = (self.radius_mm * FACTOR.powi(larger - smaller)).clamp(*self.radii_mm().start(), *self.radii_mm().end());
    }

    /// The scan that it has.
    pub fn its_scan(&self) -> &Arc<Volume> {
        &self.scan
    }

    /// Draws the brush where the mouse is, or the line that is being drawn.
    pub fn show(&self, painter: &Painter, screen: &Screen<'_>, hovered: Option<(Pos2, Option<WorldPoint>)>) {
        if self.means == Means::Scissors {
            let line = Stroke::new(1.5, Color32::WHITE);
            painter.add(Shape::line(self.lasso.clone(), Stroke::new(3.5, Color32::from_black_alpha(150))));
            painter.add(Shape::line(self.lasso.clone(), line));
            if let [first, .., last] = self.lasso[..] {
                painter.extend(Shape::dashed_line(&[last, first], line, 4.0, 4.0));
            }
            return;
        }
        let Some((at, point)) = hovered else { return };
        let (strength, depth) = point.map_or((0.35, screen.camera.target_mm), |p| (1.0, p.0));
        let radius = self.radius_mm / mm_per_pixel_at(screen.camera, depth, f64::from(screen.rect.height()));
        let own = self.parts().into_iter().find(|(number, ..)| *number == self.number).map_or(Color32::WHITE, |(.., color)| color);
        let own = if self.means == Means::Eraser { Color32::WHITE } else { own };
        painter.circle_stroke(at, radius as f32, Stroke::new(3.5, Color32::from_black_alpha(150).gamma_multiply(strength)));
        painter.circle_stroke(at, radius as f32, Stroke::new(1.5, own.gamma_multiply(strength)));
        if self.means == Means::Eraser {
            let arm = (radius as f32 * 0.5).min(5.0);
            marks::line(painter, [at - egui::vec2(arm, 0.0), at + egui::vec2(arm, 0.0)], 1.5, own);
        }
    }

    /// What colours are seen: of the sample that is nearest to a point of the world, of bone alone where the point lies on its surface.
    pub fn colors<'a>(&'a self, work: &Work, on_surface: bool) -> Option<impl Fn(DVec3) -> Option<Color32> + Sync + 'a> {
        let bone = self.bone(work)?;
        let mut colors = vec![None; 1 << 16];
        self.parts().into_iter().for_each(|(number, _, color)| colors[usize::from(number)] = Some(color.gamma_multiply(TINT)));
        let hidden = self.known.as_ref().map(|known| known.left_out().clone()).unwrap_or_default();
        let last = DVec3::from(self.labels.grid().dims().map(|n| n as f64 - 1.0));
        Some(move |point: DVec3| {
            let at = bone.grid.index(WorldPoint(point)).0;
            if !(at.cmpge(DVec3::splat(-0.5)).all() && at.cmple(last + 0.5).all()) {
                return None;
            }
            let number = |at: DVec3| self.labels.number(at.to_array().map(|n| n as usize));
            if !on_surface {
                return colors[usize::from(number(at.round().clamp(DVec3::ZERO, last)))];
            }
            let cell = at.floor().clamp(DVec3::ZERO, last);
            let corners = (0..8).map(|c| (cell + DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2))).min(last));
            let bony = corners.filter(|corner| bone.holds(corner.to_array().map(|n| n as usize)));
            // On a face of what is kept the sample behind it may be nearer.
            let nearest = bony
                .filter(|corner| !hidden.contains(&number(*corner)))
                .min_by(|a, b| a.distance_squared(at).total_cmp(&b.distance_squared(at)))?;
            colors[usize::from(number(nearest))]
        })
    }
}

/// The point of a scan's bone, as it is seen, under a point of the screen.
pub fn under(scan: &Arc<Volume>, work: &Work, screen: &Screen<'_>, at: Pos2) -> Option<WorldPoint> {
    let (x, y) = screen.pixel(at);
    let (surface, point) = picked(work, None, &screen.camera.ray(x, y, screen.size[0], screen.size[1])).ok()??;
    Arc::ptr_eq(&surface.volume, scan).then_some(point)
}

/// How strong the colours of parts lie over bone.
const TINT: f32 = 0.5;

impl Cut {
    /// Cuts; gives where the labels may differ.
    pub fn apply(
        &self,
        labels: &mut Labels,
        known: Option<&Labelled>,
        (scan, iso, transform): (&Arc<Volume>, f64, DAffine3),
        progress: &Progress,
    ) -> Result<Option<Span>, PartsError> {
        let no_bone = |_| PartsError::NoBone { scan: scan.name().to_owned() };
        let bone = Surface::new(scan, iso, transform).map_err(no_bone)?;
        let [width, height] = self.size;
        let seen = |p: WorldPoint| {
            let (x, y) = self.camera.project(p, width, height)?;
            let ray = self.camera.ray(x, y, width, height);
            Some((DVec2::new(x, y), (p.0 - ray.origin.0).dot(ray.direction)))
        };
        let first_mm = |p: DVec2| {
            let (x, y) = (p.x.round(), p.y.round());
            let is_there = x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height);
            let (_, depths) = self.depth.as_ref().filter(|_| is_there)?;
            Some(f64::from(depths[y as usize * width as usize + x as usize])).filter(|mm| mm.is_finite())
        };
        let depth = self.depth.as_ref().map(|(mm, _)| Depth { mm: *mm, first_mm: &first_mm });
        let is_cut = |number| PartHand::is_shown(known, number);
        let lasso = Lasso { corners: &self.corners, inside: self.inside, seen: &seen, depth, is_cut: &is_cut };
        Ok(labels.cut(&bone, &lasso, self.number, progress)?)
    }
}
