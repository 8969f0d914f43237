//! Slices beside the picture or instead of it: what the mouse does on them, and their pixels on the screen.

use super::super::measured::{Tool, Work};
use super::super::under;
use super::by_hand::{ByHand, Drag};
use super::cast::Found;
use super::compare_bar::{ask_at_turn, panes};
use super::desk::Painted;
use super::frames;
use super::marks::{self, Screen};
use super::navigate::mm_per_pixel;
use super::painter::Painter;
use super::part_hand::{Means, PartHand};
use super::tint::Tint;
use super::view::View;
use bregma_field::WorldPoint;
use bregma_measure::mesh::onto_surface;
use bregma_renderer::{BodyPlane, Camera, Picture, PixelAffine, Shape, Window};
use bregma_session::Layout;
use bregma_session::coat::Coat;
use egui::emath::GuiRounding;
use egui::{
    Color32, ColorImage, Context, CursorIcon, Key, PointerButton, Pos2, Rect, Response, Role, Sense, TextureHandle, TextureOptions, Ui,
    WidgetInfo,
};
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// Between two views, in points.
const GAP: f32 = 2.0;

/// The place of the picture, where it is seen, and those of the slices.
pub fn divide(layout: Layout, whole: Rect) -> (Option<Rect>, Vec<(BodyPlane, Rect)>) {
    let (middle, half) = (whole.center(), GAP / 2.0);
    let part = |right: bool, low: bool| {
        let x = if right { middle.x + half..=whole.right() } else { whole.left()..=middle.x - half };
        let y = if low { middle.y + half..=whole.bottom() } else { whole.top()..=middle.y - half };
        Rect::from_x_y_ranges(x, y)
    };
    let third = |n: usize| {
        let width = (whole.width() - 2.0 * GAP) / 3.0;
        let left = whole.left() + n as f32 * (width + GAP);
        Rect::from_x_y_ranges(left..=left + width, whole.y_range())
    };
    let planes = layout.planes().iter().copied();
    match layout {
        Layout::Picture => (Some(whole), vec![]),
        Layout::All => {
            let places = [part(true, false), part(false, true), part(true, true)];
            (Some(part(false, false)), planes.zip(places).collect())
        }
        Layout::Slices if whole.width() > 1.8 * whole.height() => (None, planes.zip([0, 1, 2].map(third)).collect()),
        Layout::Slices => {
            let left = Rect::from_x_y_ranges(whole.left()..=middle.x - half, whole.y_range());
            (None, planes.zip([left, part(true, false), part(true, true)]).collect())
        }
        Layout::Axial | Layout::Coronal | Layout::Sagittal => (None, planes.map(|plane| (plane, whole)).collect()),
    }
}

/// What the mouse holds on a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Grip {
    #[default]
    Nothing,
    /// The point that all slices go through.
    Cross,
    /// A landmark, by its number.
    Landmark(usize),
    /// A plane that cuts, by its number.
    Cut(usize),
}

/// The slices on the screen.
#[derive(Default)]
pub struct SliceViews {
    views: [SliceView; 3],
}

/// One of them.
#[derive(Default)]
pub struct SliceView {
    /// Starts with the first look at the slice.
    painter: Option<Painter>,
    texture: Option<TextureHandle>,
    painted: Option<Painted>,
    rect: Option<Rect>,
    grip: Grip,
    /// What is left of the wheel's way to the next slice, in points.
    scrolled: f32,
    moved_at: f64,
    /// The button went down to close a menu or a list.
    closes_popup: bool,
    /// The colours of parts that are made by hand.
    tint: Tint,
    pictures: u64,
}

/// The wheel's way from slice to slice: about a notch.
const NOTCH: f32 = 40.0;
/// A view that has not moved for so long is at rest, seconds.
const REST_S: f64 = 0.2;
/// A hand takes hold of what is so near, in points.
const REACH: f32 = 8.0;
/// How many points of a drag change the window by its own width.
const WINDOW_POINTS: f64 = 250.0;

impl SliceViews {
    /// Takes what the threads brought; sentences for the person.
    pub fn poll(&mut self, ctx: &Context) -> Vec<String> {
        self.views.iter_mut().filter_map(|view| view.poll(ctx)).collect()
    }

    /// All that are seen have all their pixels.
    pub fn are_settled(&self, work: &Work) -> bool {
        let planes = work.opened.slices.layout.planes();
        planes.iter().all(|plane| self.views[*plane as usize].painter.as_ref().is_some_and(Painter::is_settled))
    }

    /// The newest picture of a slice and its place.
    pub fn seen(&self, plane: BodyPlane) -> Option<(&Picture, Rect)> {
        let view = &self.views[plane as usize];
        Some((&view.painted.as_ref()?.picture, view.rect?))
    }

    /// The view onto a plane.
    pub fn of(&mut self, plane: BodyPlane) -> &mut SliceView {
        &mut self.views[plane as usize]
    }
}

/// What a plane is called in the window.
pub fn name(plane: BodyPlane) -> &'static str {
    match plane {
        BodyPlane::Axial => "Axial",
        BodyPlane::Coronal => "Coronal",
        BodyPlane::Sagittal => "Sagittal",
    }
}

impl SliceView {
    fn poll(&mut self, ctx: &Context) -> Option<String> {
        let painter = self.painter.as_mut()?;
        match painter.poll()? {
            Ok(mut painted) => {
                let (image, reduction) = (std::mem::take(&mut painted.image), painted.reduction);
                self.pictures += 1;
                self.painted.replace(painted).into_iter().for_each(|old| painter.give_back(old));
                self.put(ctx, image, reduction);
                None
            }
            Err(text) => Some(text),
        }
    }

    fn put(&mut self, ctx: &Context, image: ColorImage, reduction: u32) {
        let options = if reduction == 1 { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
        match &mut self.texture {
            Some(texture) => texture.set(image, options),
            none => *none = Some(ctx.load_texture("slice", image, options)),
        }
    }

    /// Shows the slice and lets the mouse work on it. Gives the point under the mouse; `Err` is a sentence for the person.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        (plane, rect): (BodyPlane, Rect),
        work: &mut Work,
        picture: &mut View,
        found: &[Found],
        coat: Option<(usize, Arc<dyn Coat>)>,
    ) -> Result<Option<DVec3>, String> {
        let pixels_per_point = ui.pixels_per_point();
        let rect = rect.round_to_pixels(pixels_per_point);
        let size = [rect.width(), rect.height()].map(|n| (n * pixels_per_point).round().max(1.0) as u32);
        self.rect = Some(rect);
        let rim = ui.style().interaction.resize_grab_radius_side;
        let response = ui.interact(rect.shrink(rim), ui.scope_id().with(("slice", plane.axis())), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("{} slice", name(plane))));
        if ui.input(|i| i.pointer.any_pressed()) {
            self.closes_popup = ui.ctx().any_popup_open();
        }
        let grids = picture.hand.as_ref().map_or_else(|| work.opened.grids(), |hand| hand.grids(&work.opened));
        let panes = panes(&work.opened, rect, size);
        let aspect = f64::from(panes[0].0.width() / rect.height().max(1.0));
        // The mouse stays in the half that it went down in.
        let at = ui.input(|i| i.pointer.press_origin()).or_else(|| response.interact_pointer_pos()).or_else(|| response.hover_pos());
        let (own, own_size) = panes.iter().find(|(pane, _)| at.is_some_and(|at| pane.contains(at))).copied().unwrap_or(panes[0]);
        let camera = work.opened.slices.camera(plane, &grids, aspect);
        let before = (work.opened.slices, work.opened.scene.clips.clone());
        let step_mm = work.opened.slices.step_mm(plane, &grids);
        let hand = Hand { plane, screen: Screen { camera: &camera, rect: own, size: own_size }, step_mm };
        let makes_parts = hand.make_parts(ui, &response, work, picture);
        let told = if makes_parts { Ok(()) } else { hand.click(&response, self.closes_popup, work, picture) };
        hand.drag(ui, &response, &mut self.grip, work, (picture.hand.as_ref(), makes_parts));
        hand.wheel(ui, &response, &mut self.scrolled, work);
        if before != (work.opened.slices, work.opened.scene.clips.clone()) {
            self.moved_at = ui.ctx().time();
        }

        let camera = work.opened.slices.camera(plane, &grids, aspect);
        self.want(ui.ctx(), work, camera, size, coat);
        if let Some(texture) = &self.texture {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter_at(rect).image(texture.id(), rect, whole, Color32::WHITE);
        }
        if let ([(rect, size)], Some(part_hand)) = (&panes[..], &picture.part_hand) {
            let hand = Hand { plane, screen: Screen { camera: &camera, rect: *rect, size: *size }, step_mm };
            hand.tinted(ui, &response, work, part_hand, (&mut self.tint, self.pictures));
        }
        let mut under = None;
        for (rect, size) in panes {
            let hand = Hand { plane, screen: Screen { camera: &camera, rect, size }, step_mm };
            hand.marks(ui, work, found);
            let near = |point_mm: DVec3| hand.is_near(work, point_mm);
            picture.section.iter().for_each(|curve| curve.on_slice(&ui.painter_at(rect), &hand.screen, near));
            under = under.or_else(|| response.hover_pos().filter(|at| rect.contains(*at)).map(|at| hand.point(at)));
        }
        told.map(|()| under)
    }

    /// Asks for the slice as it is to be seen now.
    fn want(&mut self, ctx: &Context, work: &Work, camera: Camera, size: [u32; 2], coat: Option<(usize, Arc<dyn Coat>)>) {
        let left = self.moved_at + REST_S - ctx.time();
        if left > 0.0 {
            ctx.request_repaint_after_secs(left as f32);
        }
        let resting = left <= 0.0 && !ctx.input(|i| i.pointer.any_down());
        let opened = &work.opened;
        let scene = opened.slices.scene(&opened.scene, camera);
        let compare = opened.compare;
        let painter = self.painter.get_or_insert_with(|| Painter::of_slices(ctx));
        painter.want(&opened.volumes, &scene, size, (compare, opened.compared()), coat, resting);
        if self.painted.as_ref().is_some_and(|painted| painted.parts.len() == 2) {
            ask_at_turn(ctx, compare);
        }
        // The line of a swipe moves without a new picture, squares come in its place, and a flicker turns.
        if let Some(painted) = &mut self.painted
            && let Some(image) = painted.join(compare, ctx.time())
        {
            let reduction = painted.reduction;
            self.put(ctx, image, reduction);
        }
    }
}

/// What is done on a slice, where it lies on the screen.
struct Hand<'a> {
    plane: BodyPlane,
    screen: Screen<'a>,
    /// From sample to sample through the plane.
    step_mm: f64,
}

impl Hand<'_> {
    /// The point of the plane at a point of the screen.
    fn point(&self, at: Pos2) -> DVec3 {
        let (x, y) = self.screen.pixel(at);
        let ray = self.screen.camera.ray(x, y, self.screen.size[0], self.screen.size[1]);
        let depth_mm = (self.screen.camera.target_mm - ray.origin.0).dot(ray.direction);
        ray.at(depth_mm).0
    }

    fn mm_per_point(&self) -> f64 {
        mm_per_pixel(self.screen.camera, f64::from(self.screen.rect.height()))
    }

    /// A point brought onto the surface that lies under the hand, if one does, with the name of its scan.
    fn on_surface(&self, work: &Work, point_mm: DVec3) -> (DVec3, Option<String>) {
        let reach_mm = f64::from(REACH) * self.mm_per_point();
        let surfaces = work.opened.scene.surfaces(&work.opened.volumes).unwrap_or_default();
        let near = surfaces.iter().filter_map(|(_, surface)| {
            let landed = surface.grid.world(onto_surface(surface, WorldPoint(point_mm), reach_mm)?.point).0;
            Some((landed.distance(point_mm), landed, surface.volume.name().to_owned()))
        });
        let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map_or((point_mm, None), |(_, landed, scan)| (landed, Some(scan)))
    }

    /// Lets the mouse paint parts. Whether it does; scissors cut in the picture alone.
    fn make_parts(&self, ui: &Ui, response: &Response, work: &Work, picture: &mut View) -> bool {
        let Some(part_hand) = picture.part_hand.as_mut().filter(|part_hand| part_hand.means != Means::Scissors) else { return false };
        if response.hovered() || response.is_pointer_button_down_on() || response.drag_stopped() {
            part_hand.look(&work.opened);
            part_hand.follow(ui, response, work, |at| Some(WorldPoint(self.point(at))), |_| self.mm_per_point());
        }
        true
    }

    /// Shows the colours of parts, and the brush.
    fn tinted(&self, ui: &Ui, response: &Response, work: &Work, part_hand: &PartHand, (tint, pictures): (&mut Tint, u64)) {
        let (painter, size) = (ui.painter_at(self.screen.rect), self.screen.size.map(|n| n as usize));
        if let Some(color) = part_hand.colors(work, false) {
            let camera = self.screen.camera;
            let rays = camera.pixel_rays(self.screen.size[0], self.screen.size[1]);
            let under = |x: usize, y: usize| {
                let at = |a: &PixelAffine| a.base + x as f64 * a.per_x + y as f64 * a.per_y;
                let (origin, direction) = (at(&rays.origin), at(&rays.direction).normalize());
                Some(origin + (camera.target_mm - origin).dot(direction) * direction)
            };
            tint.show((ui.ctx(), &painter), &self.screen, (pictures, size), part_hand, color, &under);
        }
        if part_hand.means != Means::Scissors {
            let hovered = response.hover_pos().map(|at| (at, Some(WorldPoint(self.point(at)))));
            part_hand.show(&painter, &self.screen, hovered);
        }
    }

    /// A click of the tools that take points; of the others it moves the cross, as a drag does.
    fn click(&self, response: &Response, closes_popup: bool, work: &mut Work, picture: &mut View) -> Result<(), String> {
        if response.double_clicked() {
            work.opened.slices.frames[self.plane as usize] = None;
            return Ok(());
        }
        let clicked = response.clicked_by(PointerButton::Primary) && !closes_popup;
        let Some(at) = response.interact_pointer_pos().filter(|_| clicked) else { return Ok(()) };
        let point_mm = self.point(at);
        match picture.tool() {
            Tool::Points => picture.take_point(work, WorldPoint(point_mm))?,
            Tool::Landmark => {
                let (point_mm, scan) = self.on_surface(work, point_mm);
                let scan = scan.or_else(|| work.opened.held_at(point_mm).first().map(|held| held.scan.clone()));
                work.measured.set_landmark(point_mm, &scan.ok_or("There is no scan: click on one.")?);
            }
            Tool::View | Tool::Normal => work.opened.slices.at_mm = point_mm,
        }
        Ok(())
    }

    /// What a drag takes hold of: a landmark, a cut, or the cross.
    fn grip(&self, at: Pos2, work: &Work) -> Grip {
        let landmark = work.measured.landmarks.iter().enumerate().find(|(_, landmark)| {
            let near = |p: DVec3| self.is_near(work, p) && self.screen.point(p).is_some_and(|p| p.distance(at) <= REACH);
            landmark.point_mm.is_some_and(near)
        });
        let cut = work.opened.scene.clips.iter().enumerate().filter(|(_, clip)| clip.enabled).find(|(_, clip)| match clip.shape {
            Shape::Plane { normal, offset_mm } => marks::cut(&self.screen, normal, offset_mm).is_some_and(|ends| away(ends, at) <= REACH),
            Shape::Box { .. } | Shape::Cylinder { .. } | Shape::Sphere { .. } => false,
        });
        match (landmark, cut) {
            (Some((n, _)), _) => Grip::Landmark(n),
            (_, Some((n, _))) => Grip::Cut(n),
            _ => Grip::Cross,
        }
    }

    fn drag(&self, ui: &Ui, response: &Response, grip: &mut Grip, work: &mut Work, (by_hand, makes_parts): (Option<&ByHand>, bool)) {
        if let Some(by_hand) = by_hand
            && let Some(drag) = Drag::of(ui, response)
        {
            by_hand.follow(work, &self.screen, drag, Some(work.opened.slices.at_mm));
            return;
        }
        let modifiers = ui.input(|i| i.modifiers);
        // With Shift the view is moved, whoever has the button.
        let left = response.dragged_by(PointerButton::Primary) && (!makes_parts || modifiers.shift);
        let delta = response.drag_delta();
        if response.drag_started_by(PointerButton::Primary) && !modifiers.any() && !makes_parts {
            *grip = ui.input(|i| i.pointer.press_origin()).map_or(Grip::Nothing, |at| self.grip(at, work));
        }
        if let Some(at) = response.hover_pos().filter(|_| *grip == Grip::Nothing)
            && self.grip(at, work) != Grip::Cross
        {
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        }
        let slices = &mut work.opened.slices;
        if response.dragged_by(PointerButton::Middle) || left && modifiers.shift {
            let basis = self.screen.camera.basis();
            let moved = (f64::from(delta.y) * basis.up - f64::from(delta.x) * basis.right) * self.mm_per_point();
            slices.pan(self.plane, self.screen.camera, moved);
        } else if left && modifiers.command {
            if let (Some(to), Some(foot)) = (response.interact_pointer_pos(), self.screen.point(slices.at_mm)) {
                let angle = (to - delta - foot).angle() - (to - foot).angle();
                slices.turn = (DQuat::from_axis_angle(self.screen.camera.basis().forward, f64::from(angle)) * slices.turn).normalize();
            }
        } else if response.dragged_by(PointerButton::Secondary) {
            let first = work.opened.scene.layers.iter().zip(&work.opened.volumes).find(|(layer, _)| layer.visible);
            let window = slices.look.window.or_else(|| first.map(|(_, volume)| Window::of(volume)));
            let Some(Window { width, level }) = window else { return };
            let by = |points: f32| f64::from(points) * width.max(1e-6) / WINDOW_POINTS;
            slices.look.window = Some(Window { width: (width + by(delta.x)).max(0.0), level: level + by(delta.y) });
        } else if let Some(at) = response.interact_pointer_pos().filter(|_| left) {
            let point_mm = self.point(at);
            match *grip {
                Grip::Cross => slices.at_mm = point_mm,
                Grip::Landmark(n) => {
                    let (landed, _) = self.on_surface(work, point_mm);
                    if let Some(landmark) = work.measured.landmarks.get_mut(n) {
                        landmark.point_mm = Some(landed);
                    }
                }
                Grip::Cut(n) => {
                    if let Some(Shape::Plane { normal, offset_mm }) = work.opened.scene.clips.get_mut(n).map(|clip| &mut clip.shape) {
                        *offset_mm = normal.dot(point_mm);
                    }
                }
                Grip::Nothing => {}
            }
        }
        if !left {
            *grip = Grip::Nothing;
        }
    }

    /// From slice to slice by the wheel and the keys; nearer and farther with Ctrl or by two fingers.
    fn wheel(&self, ui: &Ui, response: &Response, scrolled: &mut f32, work: &mut Work) {
        let Some(at) = response.hover_pos() else { return };
        let slices = &mut work.opened.slices;
        let (wheel, pinch, shift) = ui.input(|i| (i.smooth_scroll_delta(), i.zoom_delta(), i.modifiers.shift));
        if pinch != 1.0 {
            slices.zoom(self.plane, self.screen.camera, self.point(at), f64::from(pinch));
        }
        *scrolled += wheel.x + wheel.y;
        let notches = (*scrolled / NOTCH).trunc();
        *scrolled -= notches * NOTCH;
        let is_free = ui.ctx().memory(|memory| memory.focused().is_none());
        let pressed = |key| ui.input(|i| i.num_presses(key)) as f32;
        let keys =
            if is_free { pressed(Key::PageUp) + pressed(Key::ArrowUp) - pressed(Key::PageDown) - pressed(Key::ArrowDown) } else { 0.0 };
        // Up is toward the head, the face and the left.
        let [forward, _] = slices.axes(self.plane);
        let upward = if self.plane == BodyPlane::Axial { forward } else { -forward };
        let steps = f64::from(notches + keys) * if shift { 10.0 } else { 1.0 };
        slices.at_mm += steps * self.step_mm * upward;
    }

    /// A point lies in the slice, or in the voxels beside it.
    fn is_near(&self, work: &Work, point_mm: DVec3) -> bool {
        let slices = &work.opened.slices;
        let away_mm = (point_mm - slices.at_mm).dot(self.screen.camera.basis().forward).abs();
        away_mm <= (slices.look.thickness_mm / 2.0).max(self.step_mm)
    }

    /// What is drawn over a slice.
    fn marks(&self, ui: &Ui, work: &Work, found: &[Found]) {
        let (painter, screen) = (&ui.painter_at(self.screen.rect), &self.screen);
        let slices = &work.opened.slices;
        frames::on_slice(painter, screen, &work.opened, slices.at_mm);
        marks::crosshair(painter, screen, slices.at_mm);
        let measured = &work.measured;
        for (n, (named, found)) in measured.rays.iter().zip(found).enumerate() {
            if n == measured.selected {
                marks::ray(painter, screen, found);
            } else {
                marks::other_ray(painter, screen, found, named);
            }
        }
        for landmark in &measured.landmarks {
            if landmark.point_mm.is_some_and(|p| self.is_near(work, p)) {
                marks::landmark(painter, screen, landmark);
            }
        }
        marks::directions(painter, screen);
        marks::scale_bar(ui, screen);
        marks::title(painter, screen, &self.title(work));
    }

    fn title(&self, work: &Work) -> String {
        let slices = &work.opened.slices;
        let place = if slices.turn == DQuat::IDENTITY {
            let sides: Vec<String> = under::place(slices.at_mm).split(' ').map(str::to_owned).collect();
            let axis = self.plane.axis();
            format!("{} {} mm", sides[2 * axis], sides[2 * axis + 1])
        } else {
            "turned".to_owned()
        };
        let slab = if slices.look.thickness_mm > 0.0 {
            format!(", {} of {} mm", bregma_renderer::Named::name(slices.look.slab), slices.look.thickness_mm)
        } else {
            String::new()
        };
        format!("{}  {place}{slab}", name(self.plane))
    }
}

/// How far a point lies from the line through two others.
fn away([a, b]: [Pos2; 2], at: Pos2) -> f32 {
    (at - a).dot((b - a).normalized().rot90()).abs()
}
