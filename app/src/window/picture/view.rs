//! The picture: what the mouse does on it, and its pixels on the screen.

use super::super::measured::{Measured, Tool, Work, landmark_at, normal_ray, picked};
use super::by_hand::{ByHand, Drag};
use super::cast::{Found, cast, out_of_bone};
use super::compare_bar::{self, ask_at_turn, panes};
use super::cut_handles::{self, Held};
use super::desk::{Painted, image};
use super::exposer::Round;
use super::frames;
use super::legend;
use super::marks::{self, Screen};
use super::mouse::Mouse;
use super::navigate;
use super::part_hand::{Means, PartHand, under};
use super::section_curve::SectionCurve;
use super::solid_handles;
use super::tint::Tint;
use bregma_renderer::{PixelAffine, Ray};
use bregma_session::views::View as Norma;
use bregma_session::{Compare, Layout};
use egui::emath::GuiRounding;
use egui::{
    Color32, ColorImage, CursorIcon, PointerButton, Pos2, Rect, Response, Role, Sense, TextureHandle, TextureOptions, Ui, WidgetInfo,
};
use glam::DVec3;
use std::sync::Arc;

/// The picture on the screen.
#[derive(Default)]
pub struct View {
    texture: Option<TextureHandle>,
    /// The newest picture; kept for saving.
    pub painted: Option<Painted>,
    /// Its place on the screen, in points.
    pub rect: Option<Rect>,
    /// What a click does.
    tool: Tool,
    /// The scan that drags move, instead of the view, in the picture and in slices.
    pub hand: Option<ByHand>,
    /// What makes parts by hand: drags are its, in the picture and in slices.
    pub part_hand: Option<PartHand>,
    tint: Tint,
    /// Pictures that have come so far.
    pictures: u64,
    /// The curve of a section.
    pub section: Option<SectionCurve>,
    /// The first of two clicked points.
    first_point: Option<bregma_field::WorldPoint>,
    /// The cut that the mouse holds.
    held: Held,
    /// The landmark that the mouse holds.
    held_landmark: Option<usize>,
    /// The button went down to close a menu or a list: the click that ends so does nothing else.
    closes_popup: bool,
    /// When the mouse last moved the view or a layer changed, in the window's seconds.
    moved_at: f64,
}

/// A view that has not moved for so long is at rest: longer than the pause between two clicks of a wheel.
const REST_S: f64 = 0.2;

impl View {
    /// What a click does.
    pub fn tool(&self) -> Tool {
        self.tool
    }

    /// Chooses what a click does.
    pub fn take_tool(&mut self, tool: Tool) {
        self.tool = tool;
        self.forget_first_point();
    }

    /// Leaves what was begun where Escape is pressed. The hand has no scan that is not open.
    pub fn let_go(&mut self, ctx: &egui::Context, work: &Work) {
        if ctx.input(|i| i.key_pressed(egui::Key::Escape)) {
            self.forget_first_point();
            self.hand = None;
            // What is half done becomes a step first.
            self.part_hand.take_if(|hand| !hand.is_busy());
        }
        self.hand.take_if(|hand| hand.number(&work.opened).is_none());
        self.part_hand.take_if(|hand| hand.scan(&work.opened).is_none());
    }

    /// The next of two clicks is the first again.
    pub fn forget_first_point(&mut self) {
        self.first_point = None;
    }

    /// Width of the picture in heights; before it is first shown, about what it is on a usual window.
    pub fn aspect(&self) -> f64 {
        self.rect.map_or(0.85, |rect| f64::from(rect.width() / rect.height().max(1.0)))
    }

    /// What the mouse does now, for the status line.
    pub fn hint(&self) -> &'static str {
        if let Some(hand) = &self.part_hand {
            return hand.hint();
        }
        if self.hand.is_some() {
            return "Drag moves the scan  ·  Ctrl + drag turns it  ·  Escape ends";
        }
        match (self.held_landmark, self.first_point, self.tool) {
            (Some(_), ..) => "Let go where the landmark belongs",
            (_, Some(_), _) => "Click on the second point  ·  Escape: begin anew",
            (_, _, Tool::Points) => "Click on the first point  ·  drag turns",
            (_, _, Tool::Landmark) => "Click sets a landmark  ·  drag turns, or moves a landmark",
            _ => "Click measures  ·  drag turns  ·  wheel zooms",
        }
    }

    /// Takes a new picture to the screen; gives the one that was there before.
    pub fn take(&mut self, ctx: &egui::Context, mut painted: Painted) -> Option<Painted> {
        let image = std::mem::take(&mut painted.image);
        self.put(ctx, image, painted.reduction);
        self.pictures += 1;
        self.painted.replace(painted)
    }

    /// Takes the picture on the screen into studio light; what lies under its pixels stays.
    pub fn light(&mut self, ctx: &egui::Context, round: Round) {
        let is_its = |painted: &&mut Painted| painted.reduction == 1 && painted.picture.rgba.len() == round.rgba.len();
        let Some(painted) = self.painted.as_mut().filter(is_its) else { return };
        (painted.picture.rgba, painted.exposed) = (round.rgba, Some((round.told, round.is_filtered)));
        let image = image(&painted.picture);
        self.put(ctx, image, 1);
    }

    fn put(&mut self, ctx: &egui::Context, image: ColorImage, reduction: u32) {
        // Exact pixels stand one to one on the screen; a preview is smoothed.
        let options = if reduction == 1 { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
        match &mut self.texture {
            Some(texture) => texture.set(image, options),
            none => *none = Some(ctx.load_texture("picture", image, options)),
        }
    }

    /// Puts the compared pictures together anew where the line or the time has moved on.
    fn join(&mut self, compare: Compare, ctx: &egui::Context) {
        let Some(painted) = &mut self.painted else { return };
        let at_s = ctx.time();
        if painted.parts.len() == 2 {
            ask_at_turn(ctx, compare);
        }
        if let Some(image) = painted.join(compare, at_s) {
            let reduction = painted.reduction;
            self.put(ctx, image, reduction);
        }
    }

    /// Shows the picture and lets the mouse work on it, which turns it freely or as a turntable. Gives its size in pixels; `Err` is a sentence for
    /// the person.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        work: &mut Work,
        found: &[Found],
        hovered_mm: Option<f64>,
        turns_freely: bool,
    ) -> Result<[u32; 2], String> {
        let pixels_per_point = ui.pixels_per_point();
        let rect = ui.available_rect_before_wrap().round_to_pixels(pixels_per_point);
        let size = [rect.width(), rect.height()].map(|n| (n * pixels_per_point).round().max(1.0) as u32);
        self.rect = Some(rect);
        let place = ui.allocate_rect(rect, Sense::hover());
        // At its rim, the mouse takes hold of the neighbouring panels' edges instead.
        let rim = ui.style().interaction.resize_grab_radius_side;
        let response = ui.interact(rect.shrink(rim), place.id.with("mouse"), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Picture"));
        let mut told = Ok(size);
        if ui.input(|i| i.pointer.any_pressed()) {
            self.closes_popup = ui.ctx().any_popup_open();
        }
        let has_parts = self.make_parts(ui, &response, work, rect, size);
        if response.clicked_by(PointerButton::Primary)
            && !has_parts
            && !self.closes_popup
            && let Some(at) = response.interact_pointer_pos()
            && let Some((pane, pixels)) = panes(&work.opened, rect, size).into_iter().find(|(pane, _)| pane.contains(at))
        {
            let resets = response.double_clicked() && self.is_ground(ui, work, pane, pixels, at);
            if resets {
                navigate::look_at(&mut work.opened, Norma::Oblique, self.aspect());
            } else {
                told = self.click(work, pane, pixels, at).map(|()| size);
            }
        }
        if !has_parts
            && !self.move_by_hand(ui, &response, work, rect, size)
            && let Some((pane, pixels)) = panes(&work.opened, rect, size).first().copied()
        {
            self.hold_landmark(ui, &response, work, pane, pixels);
        }
        if self.held_landmark.is_none() && !self.has_cut(ui, &response, work) {
            let panes = panes(&work.opened, rect, size);
            self.navigate(ui, &response, work, &panes, turns_freely);
        }

        let on_dot = self.draw(ui, work, found, hovered_mm, rect, size);
        if let Some((pane, pixels, at)) = on_dot.filter(|_| !self.closes_popup) {
            told = self.click(work, pane, pixels, at).map(|()| size);
        }
        told
    }

    /// Draws the picture, and over it what is marked and held. Gives where a dot of a cut was clicked, and in which picture of how many pixels.
    fn draw(
        &mut self,
        ui: &mut Ui,
        work: &mut Work,
        found: &[Found],
        hovered_mm: Option<f64>,
        rect: Rect,
        size: [u32; 2],
    ) -> Option<(Rect, [u32; 2], Pos2)> {
        self.join(work.opened.compare, ui.ctx());
        let panes = panes(&work.opened, rect, size);
        let painter = ui.painter_at(rect);
        if let Some(texture) = &self.texture {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            painter.image(texture.id(), rect, whole, Color32::WHITE);
        }
        self.tinted(ui, work, &panes);
        compare_bar::line(ui, &mut work.opened.compare, rect);
        let bounds = work.opened.bounds();
        let mut on_dot = None;
        if let Some((pane, pixels)) = panes.first().copied() {
            cut_handles::show(ui, &mut work.opened.scene, &bounds, pane, pixels, &mut self.held);
            on_dot = solid_handles::show(ui, &mut work.opened.scene, pane, pixels).map(|at| (pane, pixels, at));
        }
        for (rect, size) in panes.iter().copied() {
            let screen = Screen { camera: &work.opened.scene.camera, rect, size };
            frames::show(&ui.painter_at(rect), &screen, &work.opened, self.held.active(&work.opened.scene.clips));
            marks(&ui.painter_at(rect), &screen, &work.measured, found, hovered_mm);
            self.section.iter().for_each(|curve| curve.show(&ui.painter_at(rect), &screen));
            let pivot_mm = self.hand.as_ref().and_then(|hand| hand.middle_mm(&work.opened));
            pivot_mm.into_iter().for_each(|p| marks::pivot(&ui.painter_at(rect), &screen, p));
            if !work.opened.slices.layout.planes().is_empty() {
                marks::cross(&ui.painter_at(rect), &screen, &work.opened.slices);
            }
        }
        if let Some((rect, size)) = panes.last().copied() {
            legend::show(&painter, rect, &work.opened);
            compare_bar::names(&painter, &work.opened, self.rect.unwrap_or(rect), ui.ctx().time());
            marks::scale_bar(ui, &Screen { camera: &work.opened.scene.camera, rect, size });
        }
        on_dot
    }

    /// The view moved by itself, at this time of the window, seconds.
    pub fn moved(&mut self, at_s: f64) {
        self.moved_at = at_s;
    }

    /// A hand is about something that is one step when it lets go.
    pub fn is_held(&self, ctx: &egui::Context) -> bool {
        ctx.input(|i| i.pointer.any_down()) || self.held.is_wheeled(ctx.time())
    }

    /// Nothing moved lately and no button is held. Asks for another look when that time comes.
    pub fn is_resting(&self, ctx: &egui::Context) -> bool {
        let left = self.moved_at + REST_S - ctx.time();
        if left > 0.0 {
            ctx.request_repaint_after_secs(left as f32);
        }
        left <= 0.0 && !ctx.input(|i| i.pointer.any_down())
    }

    /// Lets the mouse have the active cut. Whether it has.
    fn has_cut(&mut self, ui: &Ui, response: &Response, work: &mut Work) -> bool {
        if work.opened.scene.clips.is_empty() {
            return false;
        }
        let (grids, height) = (work.opened.grids(), f64::from(response.rect.height()));
        let has = self.hand.is_none()
            && self.part_hand.is_none()
            && cut_handles::by_mouse(ui, response, &mut work.opened.scene, &grids, height, &mut self.held);
        if has {
            self.moved_at = ui.ctx().time();
        }
        has
    }

    /// Lets the mouse and the keys move the view.
    fn navigate(&mut self, ui: &Ui, response: &Response, work: &mut Work, panes: &[(Rect, [u32; 2])], turns_freely: bool) {
        let at = response.hover_pos();
        let Some(pane) = panes.iter().find(|(pane, _)| at.is_some_and(|at| pane.contains(at))).or(panes.first()) else { return };
        let mouse =
            Mouse { turns_freely, is_taken: self.hand.is_some() || self.part_hand.is_some(), pane: *pane, under_mm: self.under(ui, work) };
        let camera = &mut work.opened.scene.camera;
        let before = *camera;
        mouse.navigate(ui, response, camera);
        // Over a slice the keys are its.
        if response.hovered() || work.opened.slices.layout == Layout::Picture {
            mouse.keys(ui, camera);
        }
        if *camera != before {
            self.moved_at = ui.ctx().time();
        }
    }

    /// Lets the mouse make parts. Whether it does.
    fn make_parts(&mut self, ui: &Ui, response: &Response, work: &Work, rect: Rect, size: [u32; 2]) -> bool {
        let Some(mut hand) = self.part_hand.take() else { return false };
        hand.look(&work.opened);
        let panes = panes(&work.opened, rect, size);
        let at = ui.input(|i| i.pointer.press_origin()).or(response.hover_pos());
        let pane = panes.iter().find(|(pane, _)| at.is_some_and(|at| pane.contains(at))).copied();
        // A line stays in the view that it began in, wherever the button goes up.
        if let Some((rect, size, camera)) = hand.begun().or(pane.map(|(rect, size)| (rect, size, work.opened.scene.camera))) {
            let screen = Screen { camera: &camera, rect, size };
            if hand.means == Means::Scissors {
                hand.cut(ui, response, &screen, self.painted.as_ref().map(|painted| &painted.picture));
            } else {
                let (scan, height) = (Arc::clone(hand.its_scan()), f64::from(rect.height()));
                hand.follow(ui, response, work, |at| under(&scan, work, &screen, at), |p| navigate::mm_per_pixel_at(&camera, p, height));
            }
        }
        self.part_hand = Some(hand);
        true
    }

    /// Shows the colours of parts, and the brush.
    fn tinted(&mut self, ui: &Ui, work: &Work, panes: &[(Rect, [u32; 2])]) {
        let (Some(hand), Some(painted), [(rect, size)]) = (&self.part_hand, &self.painted, panes) else {
            self.tint = Tint::default();
            return;
        };
        let (picture, camera) = (&painted.picture, &work.opened.scene.camera);
        let screen = Screen { camera, rect: *rect, size: *size };
        if let Some(color) = hand.colors(work, true) {
            let [width, height] = [picture.width, picture.height];
            let rays = camera.pixel_rays(width, height);
            let under = |x: usize, y: usize| {
                let depth_mm = picture.depth_mm[y * width as usize + x];
                let at = |a: &PixelAffine| a.base + x as f64 * a.per_x + y as f64 * a.per_y;
                let direction = at(&rays.direction).normalize();
                depth_mm.is_finite().then(|| at(&rays.origin) + f64::from(depth_mm) * direction)
            };
            let size = [width as usize, height as usize];
            self.tint.show((ui.ctx(), &ui.painter_at(*rect)), &screen, (self.pictures, size), hand, color, &under);
        }
        let hovered = ui.ctx().pointer_hover_pos().filter(|at| rect.contains(*at));
        hand.show(&ui.painter_at(*rect), &screen, hovered.map(|at| (at, under(hand.its_scan(), work, &screen, at))));
    }

    /// Lets the scan that the hand has follow the mouse. Whether the hand has one.
    fn move_by_hand(&self, ui: &Ui, response: &Response, work: &mut Work, rect: Rect, size: [u32; 2]) -> bool {
        let Some(hand) = &self.hand else { return false };
        if response.hovered() {
            ui.ctx().set_cursor_icon(CursorIcon::Move);
        }
        // Of two pictures beside each other it follows in the one that the drag began on.
        let panes = panes(&work.opened, rect, size);
        let begun = ui.input(|i| i.pointer.press_origin());
        let pane = panes.iter().find(|(pane, _)| begun.is_some_and(|at| pane.contains(at)));
        if let (Some(drag), Some((rect, size))) = (Drag::of(ui, response), pane.copied()) {
            let camera = work.opened.scene.camera;
            hand.follow(work, &Screen { camera: &camera, rect, size }, drag, None);
        }
        true
    }

    /// Takes a landmark along that a drag began on, over the surface that lies under the mouse.
    fn hold_landmark(&mut self, ui: &Ui, response: &Response, work: &mut Work, rect: Rect, size: [u32; 2]) {
        let screen = Screen { camera: &work.opened.scene.camera, rect, size };
        let near = |at: Pos2| {
            let away = |l: &bregma_session::Landmark| l.point_mm.and_then(|p| screen.point(p)).map_or(f32::INFINITY, |p| p.distance(at));
            let nearest = work.measured.landmarks.iter().map(away).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            nearest.filter(|(_, away)| *away <= LANDMARK_REACH).map(|(n, _)| n)
        };
        if response.drag_started_by(PointerButton::Primary) {
            self.held_landmark = ui.input(|i| i.pointer.press_origin()).and_then(near);
        }
        let hovers = response.hover_pos().and_then(near).is_some();
        if hovers || self.held_landmark.is_some() {
            ui.ctx().set_cursor_icon(if self.held_landmark.is_some() { CursorIcon::Grabbing } else { CursorIcon::Grab });
        }
        let Some((n, at)) = self.held_landmark.zip(response.interact_pointer_pos()) else { return };
        let (x, y) = screen.pixel(at);
        let ray = work.opened.scene.camera.ray(x, y, size[0], size[1]);
        // Beside the bone it stays where it was.
        if let Ok(Some((surface, point))) = picked(work, None, &ray)
            && let Some(landmark) = work.measured.landmarks.get_mut(n)
        {
            landmark.point_mm = Some(landmark_at(&surface, point));
        }
        if response.drag_stopped() {
            self.held_landmark = None;
        }
    }

    /// The only volume that can be seen at a point of the screen, while scans are compared.
    fn shown_at(&self, rect: Rect, size: [u32; 2], at: Pos2) -> Option<usize> {
        let painted = self.painted.as_ref().filter(|p| p.parts.len() == 2)?;
        let whole = self.rect.unwrap_or(rect);
        let scale = size[1] as f32 / rect.height() / painted.reduction as f32;
        let [x, y] = [(at.x - whole.left()) * scale, (at.y - whole.top()) * scale].map(|v| v.max(0.0) as usize);
        let id = painted.picture.volume_id.get(y * painted.picture.width as usize + x)?;
        usize::from(*id).checked_sub(1)
    }

    /// Nothing lies at a point of the screen that the mouse is on: no surface, and nothing that another mode draws.
    fn is_ground(&self, ui: &Ui, work: &Work, rect: Rect, size: [u32; 2], at: Pos2) -> bool {
        let (x, y) = Screen { camera: &work.opened.scene.camera, rect, size }.pixel(at);
        let ray = work.opened.scene.camera.ray(x, y, size[0], size[1]);
        self.under(ui, work).is_none() && matches!(picked(work, self.shown_at(rect, size, at), &ray), Ok(None))
    }

    /// What the tool does at a point of the screen.
    fn click(&mut self, work: &mut Work, rect: Rect, size: [u32; 2], at: Pos2) -> Result<(), String> {
        let (x, y) = Screen { camera: &work.opened.scene.camera, rect, size }.pixel(at);
        // A missed click costs no measurement.
        let missed = || "No bone there: click on a surface.".to_owned();
        if self.tool == Tool::View {
            let ray = cast(work, x, y, size)?.ok_or("No bone there: click on a surface to cast the difference ray through it.")?;
            work.measured.add_ray(ray);
            return Ok(());
        }
        let shown = self.shown_at(rect, size, at);
        let (surface, point) = picked(work, shown, &work.opened.scene.camera.ray(x, y, size[0], size[1]))?.ok_or_else(missed)?;
        match self.tool {
            Tool::Normal => {
                let ray = normal_ray(&surface, point).ok_or("The surface has no direction there: click beside it.")?;
                work.measured.add_ray(out_of_bone(work, ray)?);
            }
            Tool::Landmark => work.measured.set_landmark(landmark_at(&surface, point), surface.volume.name()),
            _ => self.take_point(work, point)?,
        }
        Ok(())
    }

    /// Takes the first of two points, or casts a ray through both.
    pub fn take_point(&mut self, work: &mut Work, point: bregma_field::WorldPoint) -> Result<(), String> {
        let Some(first) = self.first_point.take() else {
            self.first_point = Some(point);
            return Ok(());
        };
        let ray = Ray::new(first, point.0 - first.0).ok_or("The two points are one: click on another.")?;
        // From a little before the first point, so that the surface there is seen.
        work.measured.add_ray(out_of_bone(work, Ray { origin: ray.at(-POINTS_BEFORE_MM), ..ray })?);
        Ok(())
    }

    /// The point of what is drawn that lies under the mouse.
    pub fn under(&self, ui: &Ui, work: &Work) -> Option<DVec3> {
        let (rect, painted) = (self.rect?, self.painted.as_ref()?);
        // What lies over the picture is not of it.
        let is_free = |at: &Pos2| ui.ctx().layer_id_at(*at).is_none_or(|layer| layer == ui.layer_id());
        let at = ui.ctx().pointer_hover_pos().filter(|at| rect.contains(*at) && is_free(at))?;
        let size = [painted.picture.width, painted.picture.height];
        let scale = size[1] as f32 / rect.height();
        let [x, y] = [(at.x - rect.left()) * scale, (at.y - rect.top()) * scale].map(|v| v.max(0.0) as u32);
        let depth_mm = *painted.picture.depth_mm.get((y * size[0] + x) as usize).filter(|_| x < size[0])?;
        // Of two pictures beside each other each has its own width.
        let widths: Vec<u32> = if work.opened.compare == Compare::SideBySide && painted.parts.len() == 2 {
            painted.parts.iter().map(|part| part.width).collect()
        } else {
            vec![size[0]]
        };
        let (x, width) = if x < widths[0] { (x, widths[0]) } else { (x - widths[0], *widths.get(1)?) };
        let ray = work.opened.scene.camera.ray(f64::from(x), f64::from(y), width, size[1]);
        depth_mm.is_finite().then(|| ray.at(f64::from(depth_mm)).0)
    }
}

/// What is drawn over a picture.
fn marks(painter: &egui::Painter, screen: &Screen<'_>, measured: &Measured, found: &[Found], hovered_mm: Option<f64>) {
    for (_, (named, found)) in measured.rays.iter().zip(found).enumerate().filter(|(n, _)| *n != measured.selected) {
        marks::other_ray(painter, screen, found, named);
    }
    if let Some(found) = found.get(measured.selected) {
        marks::ray(painter, screen, found);
        if let Some(t_mm) = hovered_mm {
            marks::hovered(painter, screen, found, t_mm);
        }
    }
    measured.landmarks.iter().for_each(|landmark| marks::landmark(painter, screen, landmark));
    marks::directions(painter, screen);
}

/// A hand takes hold of a landmark within so many points of its middle.
const LANDMARK_REACH: f32 = 10.0;

/// See [`View::click`].
const POINTS_BEFORE_MM: f64 = 2.0;
