//! The panels. A new one is a file beside this one, a row of [`PANELS`], and a field of [`Panels`] if it keeps something between frames.

mod bars;
mod chart;
mod cuts;
mod histogram;
mod layers;
mod modes;
mod ray_form;
mod rays;
mod shells;
mod thickness;
mod transfer_editor;

use super::bench::Bench;
use super::measured::{Tool, Work};
use super::menu::{self, Menu};
use bregma_renderer::{Scene, Solver};
use bregma_session::thickness::Coat;
use chart::ChartPanel;
use egui::{Key, Modifiers, Ui};
use ray_form::RayForm;
use std::sync::Arc;
use thickness::ThicknessPanel;

/// What panels keep from frame to frame.
#[derive(Default)]
pub struct Panels {
    rays: RayForm,
    /// Speed and accuracy of the solvers.
    pub chart: ChartPanel,
    /// The map of thickness.
    pub thickness: ThicknessPanel,
}

/// A command of the window.
pub type Command = menu::Command<Panels>;

/// A scene to draw, and the colours that are painted on its surface.
pub type Painting = (Scene, Arc<Coat>);

/// Where a panel stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Left of the picture: what there is. What it changes is measured anew before the others are shown.
    Left,
    /// Below the picture.
    Bottom,
    /// A window of its own over the picture.
    Over,
}

/// A panel: all that the frame around it has to know.
struct Panel {
    place: Place,
    /// Its entries of the menus; in each menu they follow those of the panels before it.
    commands: &'static [Command],
    /// Takes what its thread brought. `Err` is a sentence for the person.
    poll: fn(&mut Panels, &Bench) -> Result<(), String>,
    /// Shows it, where it is open.
    show: fn(&mut Panels, &mut Bench, &mut Ui),
    /// What it paints.
    painting: fn(&Panels, &Work) -> Option<Painting>,
}

/// A panel without commands, thread and colours.
const PLAIN: Panel = Panel { place: Place::Over, commands: &[], poll: |_, _| Ok(()), show: |_, _, _| {}, painting: |_, _| None };

const NONE: Modifiers = Modifiers::NONE;

const PANELS: [Panel; 4] = [
    Panel { place: Place::Left, show: |_, bench, ui| layers::show(ui, bench), ..PLAIN },
    Panel {
        place: Place::Bottom,
        commands: &[
            Command::new(Menu::Edit, "Delete the difference ray", &[(NONE, Key::Delete)], |_, b, _| b.work.measured.remove_ray())
                .when(|_, b| !b.work.measured.rays.is_empty()),
            Command::new(Menu::Measure, "Ray along the view", &[(NONE, Key::R)], |_, b, _| b.view.take_tool(Tool::View)),
            Command::new(Menu::Measure, "Ray along the normal", &[(NONE, Key::N)], |_, b, _| b.view.take_tool(Tool::Normal)),
            Command::new(Menu::Measure, "Ray through two points", &[(NONE, Key::T)], |_, b, _| b.view.take_tool(Tool::Points)),
            Command::new(Menu::Measure, "Ray by numbers…", &[], |p, b, _| {
                p.rays.begin(b.work.measured.ray(), &b.work.opened.scene.camera);
            }),
            Command::new(Menu::Measure, "Landmark", &[(NONE, Key::L)], |_, b, _| b.view.take_tool(Tool::Landmark)),
        ],
        show: |p, bench, ui| rays::show(ui, bench, &mut p.rays),
        ..PLAIN
    },
    Panel {
        commands: &[
            Command::new(Menu::View, "Speed and accuracy…", &[], |p, _, _| p.chart.open = !p.chart.open),
            Command::new(Menu::View, "Draw by the exact solver", &[], |_, b, _| b.work.opened.scene.solver = Solver::Exact)
                .when(|_, b| b.work.opened.scene.solver != Solver::Exact),
        ],
        poll: |p, bench| p.chart.poll(&bench.work.opened.volumes),
        show: |p, bench, ui| p.chart.show(ui.ctx(), bench),
        ..PLAIN
    },
    Panel {
        commands: &[Command::new(Menu::Measure, "Thickness map…", &[], |p, _, _| p.thickness.open = !p.thickness.open)],
        poll: |p, _| p.thickness.poll(),
        show: |p, bench, ui| p.thickness.show(ui.ctx(), bench),
        painting: |p, work| p.thickness.painting(work),
        ..PLAIN
    },
];

impl Panels {
    /// The commands of all panels.
    pub fn commands() -> impl Iterator<Item = &'static Command> {
        PANELS.iter().flat_map(|panel| panel.commands)
    }

    /// Takes what the panels' threads brought.
    pub fn poll(&mut self, bench: &mut Bench) {
        for panel in &PANELS {
            if let Err(text) = (panel.poll)(self, bench) {
                bench.notices.error(text);
            }
        }
    }

    /// Shows the panels that stand there.
    pub fn show(&mut self, ui: &mut Ui, bench: &mut Bench, place: Place) {
        PANELS.iter().filter(|panel| panel.place == place).for_each(|panel| (panel.show)(self, bench, ui));
    }

    /// What one of them paints.
    pub fn painting(&self, work: &Work) -> Option<Painting> {
        PANELS.iter().find_map(|panel| (panel.painting)(self, work))
    }
}
