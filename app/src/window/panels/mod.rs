//! The panels. A new one is a file beside this one, a row of [`PANELS`], and a field of [`Panels`] if it keeps something between frames.

mod along;
mod ball;
mod chart;
mod cuts;
mod differences;
mod film;
mod frame_rate;
mod hand;
mod histogram;
mod kiosk;
mod landmarks;
mod light;
mod look;
mod looks;
mod maps;
mod part_tools;
mod parts;
mod picture;
mod poses;
mod preferences;
mod ray_form;
mod rays;
mod regions;
mod register;
mod registered;
mod saving;
mod scan;
mod scans;
mod section;
mod shells;
mod slices;
mod stretches;
mod studio;
mod thickness;
mod transfer_editor;
mod two_poses;
mod upright;
mod volumes;

use super::bench::{BRING_TOGETHER, Bench};
use super::dock::{Dock, Side};
use super::help::Help;
use super::measured::{Tool, Work};
use super::menu::{self, Menu};
use super::palette::Palette;
use bregma_renderer::{Scene, Solver};
use bregma_session::coat::Coat;
use bregma_session::register::apart;
use chart::ChartPanel;
use differences::DifferencesPanel;
use egui::{Key, Modifiers, Rect, ScrollArea, Ui};
use film::FilmPanel;
use frame_rate::FrameRatePanel;
use looks::LooksPanel;
use parts::PartsPanel;
use picture::PicturePanel;
use ray_form::RayForm;
use register::RegisterPanel;
use scan::ScanPanel;
use section::SectionPanel;
use std::sync::Arc;
use thickness::ThicknessPanel;
use upright::UprightPanel;
use volumes::VolumesPanel;

/// What panels keep from frame to frame.
#[derive(Default)]
pub struct Panels {
    /// Which sides of the window are folded.
    pub dock: Dock,
    /// Every command by its name.
    pub palette: Palette,
    /// The guide, and all keys.
    pub help: Help,
    /// Which of the panels on the right is seen.
    tab: Tab,
    rays: RayForm,
    /// Speed and accuracy of the solvers.
    pub chart: ChartPanel,
    /// The map of thickness.
    pub thickness: ThicknessPanel,
    /// The map of differences.
    pub differences: DifferencesPanel,
    volumes: VolumesPanel,
    parts: PartsPanel,
    /// Thickness along a curve.
    pub section: SectionPanel,
    register: RegisterPanel,
    /// How one scan is held.
    upright: UprightPanel,
    /// What is known of one scan.
    scan: ScanPanel,
    /// Looks that are kept by name.
    looks: LooksPanel,
    /// The film as a file.
    pub film: FilmPanel,
    /// The picture as a file.
    pub picture: PicturePanel,
    frame_rate: FrameRatePanel,
    asks_for_kiosk: bool,
    prefers: bool,
}

/// The panels on the right: one is seen at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Tab {
    #[default]
    Rays,
    Landmarks,
    Section,
    Parts,
    Thickness,
    Differences,
    Volumes,
    Register,
}

/// A command of the window.
pub type Command = menu::Command<Panels>;

/// Points that a scroll bar takes.
const SCROLL_BAR: f32 = 10.0;

/// A scene to draw, and the colours that are painted on its surface.
pub type Painting = (Scene, Arc<dyn Coat>);

/// Where a panel stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// Left of the picture: what there is. What it changes is measured anew before the others are shown.
    Left,
    /// Right of the picture: what was found; under the tab of that name.
    Right(Tab, &'static str),
    /// A window of its own over the picture.
    Over,
}

/// A panel: all that the frame around it has to know.
struct Panel {
    place: Place,
    /// Its entries of the menus; in each menu they follow those of the panels before it.
    commands: &'static [Command],
    /// Takes what its thread brought. `Err` is a sentence for the person.
    poll: fn(&mut Panels, &mut Bench) -> Result<(), String>,
    /// Shows it, where it is open.
    show: fn(&mut Panels, &mut Bench, &mut Ui),
    /// How many things it lists.
    count: fn(&Bench) -> usize,
    /// What it paints.
    painting: fn(&Panels, &Work) -> Option<Painting>,
}

/// A panel without commands, thread, list and colours.
const PLAIN: Panel =
    Panel { place: Place::Over, commands: &[], poll: |_, _| Ok(()), show: |_, _, _| {}, count: |_| 0, painting: |_, _| None };

const NONE: Modifiers = Modifiers::NONE;

const PANELS: [Panel; 22] = [
    Panel {
        place: Place::Left,
        show: |p, bench, ui| {
            if let Some(n) = scans::show(ui, bench) {
                p.scan.open(&bench.work.opened, n);
            }
        },
        ..PLAIN
    },
    Panel {
        commands: &[Command::new(Menu::Edit, "Name, spacing, turn of a scan…", &[], |p, b, _| p.scan.open(&b.work.opened, 0))],
        show: |p, bench, ui| p.scan.show(ui.ctx(), bench),
        ..PLAIN
    },
    Panel { place: Place::Left, show: |_, bench, ui| look::show(ui, bench), ..PLAIN },
    Panel { place: Place::Left, commands: slices::COMMANDS, show: |_, bench, ui| slices::show(ui, bench), ..PLAIN },
    Panel { place: Place::Left, show: |_, bench, ui| cuts::show(ui, &mut bench.work), ..PLAIN },
    Panel {
        place: Place::Right(Tab::Rays, "Rays"),
        commands: &[
            Command::new(Menu::Edit, "Delete the selected ray", &[(NONE, Key::Delete)], |_, b, _| b.work.measured.remove_ray())
                .when(|_, b| if b.work.measured.rays.is_empty() { Err("No ray was cast") } else { Ok(()) }),
            Command::new(Menu::Measure, "Ray along the view", &[(NONE, Key::R)], |p, b, _| p.take(b, Tool::View)),
            Command::new(Menu::Measure, "Ray along the normal", &[(NONE, Key::N)], |p, b, _| p.take(b, Tool::Normal)),
            Command::new(Menu::Measure, "Ray through two points", &[(NONE, Key::T)], |p, b, _| p.take(b, Tool::Points)),
            Command::new(Menu::Measure, "Ray by numbers…", &[], |p, b, _| {
                p.open(Tab::Rays);
                p.rays.begin(b.work.measured.ray(), &b.work.opened.scene.camera);
            }),
        ],
        show: |p, bench, ui| rays::show(ui, bench, &mut p.rays),
        count: |bench| bench.work.measured.rays.len(),
        ..PLAIN
    },
    Panel {
        place: Place::Right(Tab::Landmarks, "Landmarks"),
        commands: &[Command::new(Menu::Measure, "Landmark", &[(NONE, Key::L)], |p, b, _| p.take(b, Tool::Landmark))],
        show: |_, bench, ui| landmarks::show(ui, bench),
        count: |bench| bench.work.measured.landmarks.len(),
        ..PLAIN
    },
    Panel {
        place: Place::Right(Tab::Section, "Section"),
        commands: &[Command::new(Menu::Measure, "Section…", &[], |p, _, _| p.open(Tab::Section))],
        poll: |p, bench| p.section.poll(bench, p.tab == Tab::Section),
        show: |p, bench, ui| p.section.show(ui, bench),
        ..PLAIN
    },
    Panel {
        place: Place::Right(Tab::Parts, "Parts"),
        commands: &[Command::new(Menu::Measure, "Parts…", &[], |p, _, _| p.open(Tab::Parts))],
        poll: |p, bench| p.parts.poll(bench),
        show: |p, bench, ui| p.parts.show(ui, bench),
        ..PLAIN
    },
    Panel { show: |p, bench, ui| p.parts.follow_hand(ui.ctx(), bench), ..PLAIN },
    Panel {
        place: Place::Right(Tab::Thickness, "Thickness"),
        commands: &[Command::new(Menu::Measure, "Thickness map…", &[], |p, _, _| p.open(Tab::Thickness))],
        poll: |p, _| p.thickness.poll(),
        show: |p, bench, ui| p.thickness.show(ui, bench),
        painting: |p, work| p.thickness.painting(work),
        ..PLAIN
    },
    Panel {
        place: Place::Right(Tab::Differences, "Differences"),
        commands: &[Command::new(Menu::Measure, "Differences…", &[], |p, _, _| p.open(Tab::Differences))],
        poll: |p, bench| p.differences.poll(bench),
        show: |p, bench, ui| p.differences.show(ui, bench),
        painting: |p, work| p.differences.painting(work),
        ..PLAIN
    },
    Panel {
        place: Place::Right(Tab::Volumes, "Volumes"),
        commands: &[Command::new(Menu::Measure, "Volumes…", &[], |p, _, _| p.open(Tab::Volumes))],
        poll: |p, bench| p.volumes.poll(bench),
        show: |p, bench, ui| p.volumes.show(ui, bench),
        ..PLAIN
    },
    Panel {
        place: Place::Right(Tab::Register, "Register"),
        commands: &[
            Command::new(Menu::Measure, "Register scans…", &[], |p, _, _| p.open(Tab::Register)).when(has_two),
            Command::new(Menu::Measure, BRING_TOGETHER, &[], |p, b, ctx| {
                p.open(Tab::Register);
                p.register.bring_together(b, ctx);
            })
            .when(|_, b| if apart(&b.work.opened).is_some() { Ok(()) } else { Err("No scans lie apart from each other") }),
            Command::new(Menu::Measure, "Move a scan by hand", &[(NONE, Key::M)], |p, b, _| {
                p.open(Tab::Register);
                p.register.toggle_hand(b);
            })
            .when(has_two),
        ],
        poll: |p, bench| p.register.poll(bench),
        show: |p, bench, ui| p.register.show(ui, bench),
        ..PLAIN
    },
    Panel {
        commands: &[Command::new(Menu::Measure, "Hold upright…", &[], |p, _, _| p.upright.open())],
        poll: |p, _| p.upright.poll(),
        show: |p, bench, ui| p.upright.show(ui.ctx(), bench),
        ..PLAIN
    },
    Panel {
        commands: &[Command::new(Menu::Edit, "Preferences…", &[(Modifiers::COMMAND, Key::Comma)], |p, _, _| p.prefers = !p.prefers)
            .when(|_, _| Ok(()))
            .apart()],
        show: |p, bench, ui| p.prefers = p.prefers && preferences::show(ui.ctx(), bench),
        ..PLAIN
    },
    Panel {
        commands: &[Command::new(Menu::View, "Looks…", &[], |p, b, _| p.looks.toggle(b))],
        show: |p, bench, ui| p.looks.show(ui.ctx(), bench),
        ..PLAIN
    },
    Panel {
        poll: |p, bench| p.film.poll(bench),
        show: |p, bench, ui| {
            let painting = p.painting(&bench.work);
            p.film.show(ui.ctx(), bench, painting);
        },
        ..PLAIN
    },
    Panel {
        poll: |p, bench| p.picture.poll(bench),
        show: |p, bench, ui| {
            let painting = p.painting(&bench.work);
            p.picture.show(ui.ctx(), bench, painting);
        },
        ..PLAIN
    },
    Panel {
        commands: &[
            Command::new(Menu::View, "Speed and accuracy…", &[], |p, _, _| p.chart.open = !p.chart.open),
            Command::new(Menu::View, "Draw by the exact solver", &[], |_, b, _| b.work.opened.scene.solver = Solver::Exact)
                .when(|_, b| if b.work.opened.scene.solver == Solver::Exact { Err("It draws already") } else { Ok(()) }),
        ],
        poll: |p, bench| p.chart.poll(&bench.work.opened.volumes),
        show: |p, bench, ui| p.chart.show(ui.ctx(), bench),
        ..PLAIN
    },
    Panel {
        commands: &[Command::new(Menu::View, "Frame rate…", &[], |p, _, _| p.frame_rate.is_open = !p.frame_rate.is_open)],
        poll: |p, _| p.frame_rate.poll(),
        show: |p, bench, ui| {
            let painting = p.painting(&bench.work);
            p.frame_rate.show(ui.ctx(), bench, painting);
        },
        ..PLAIN
    },
    Panel {
        commands: &[
            Command::new(Menu::View, "Full screen", &[(NONE, Key::F11)], |_, b, ctx| {
                if b.stage.is_full() {
                    b.stage.leave(ctx);
                } else {
                    b.stage.fill(ctx, None);
                    b.messages.note("Escape or F11 leads back to the window");
                }
            })
            .apart(),
            Command::new(Menu::View, "Kiosk…", &[], |p, _, _| p.asks_for_kiosk = true),
        ],
        show: |p, bench, ui| p.asks_for_kiosk = p.asks_for_kiosk && kiosk::show(ui.ctx(), bench),
        ..PLAIN
    },
];

fn has_two(_: &Panels, bench: &Bench) -> menu::Allowed {
    if bench.work.opened.volumes.len() < 2 { Err("Two scans are needed") } else { Ok(()) }
}

impl Panels {
    /// The commands of all panels.
    pub fn commands() -> impl Iterator<Item = &'static Command> {
        PANELS.iter().flat_map(|panel| panel.commands)
    }

    /// Takes what the panels' threads brought.
    pub fn poll(&mut self, bench: &mut Bench) {
        for panel in &PANELS {
            if let Err(text) = (panel.poll)(self, bench) {
                bench.messages.error(text);
            }
        }
    }

    /// Takes a tool, and opens the panel that shows what it finds.
    fn take(&mut self, bench: &mut Bench, tool: Tool) {
        bench.view.take_tool(tool);
        self.tab = if tool == Tool::Landmark { Tab::Landmarks } else { Tab::Rays };
    }

    fn open(&mut self, tab: Tab) {
        self.tab = tab;
        self.dock.open(Side::Right);
    }

    /// Shows what there is, beside the picture.
    pub fn show_left(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let mut dock = self.dock;
        dock.show(ui, Side::Left, "Scans", |ui| self.left(ui, bench));
        self.dock = dock;
    }

    /// Shows what was found, beside the picture.
    pub fn show_right(&mut self, ui: &mut Ui, bench: &mut Bench) {
        let mut dock = self.dock;
        let count: usize = PANELS.iter().map(|panel| (panel.count)(bench)).sum();
        let name = if count == 0 { "Results".to_owned() } else { format!("Results ({count})") };
        dock.show(ui, Side::Right, &name, |ui| self.right(ui, bench));
        self.dock = dock;
    }

    /// Shows what lies over the picture, which is at `place`.
    pub fn show_over(&mut self, ui: &mut Ui, bench: &mut Bench, place: Rect) {
        let (mut dock, ctx) = (self.dock, ui.ctx().clone());
        dock.show_drawer(&ctx, Side::Left, place, |ui| self.left(ui, bench));
        dock.show_drawer(&ctx, Side::Right, place, |ui| self.right(ui, bench));
        self.dock = dock;
        PANELS.iter().filter(|panel| panel.place == Place::Over).for_each(|panel| (panel.show)(self, bench, ui));
    }

    fn left(&mut self, ui: &mut Ui, bench: &mut Bench) {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            // The scroll bar has room of its own.
            ui.set_max_width(ui.available_width() - SCROLL_BAR);
            PANELS.iter().filter(|panel| panel.place == Place::Left).for_each(|panel| (panel.show)(self, bench, ui));
        });
    }

    fn right(&mut self, ui: &mut Ui, bench: &mut Bench) {
        ui.horizontal_wrapped(|ui| {
            for panel in &PANELS {
                let Place::Right(tab, title) = panel.place else { continue };
                // A row of its own for what is worked out, so that no number of rays moves it.
                if tab == Tab::Thickness {
                    ui.end_row();
                }
                let count = (panel.count)(bench);
                let text = if count == 0 { title.to_owned() } else { format!("{title} ({count})") };
                if ui.selectable_label(self.tab == tab, text).clicked() {
                    self.tab = tab;
                }
            }
        });
        ui.separator();
        for panel in &PANELS {
            if matches!(panel.place, Place::Right(tab, _) if tab == self.tab) {
                (panel.show)(self, bench, ui);
            }
        }
    }

    /// What one of them paints.
    pub fn painting(&self, work: &Work) -> Option<Painting> {
        PANELS.iter().find_map(|panel| (panel.painting)(self, work))
    }
}
