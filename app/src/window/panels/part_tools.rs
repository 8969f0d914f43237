//! The tools that make parts by hand: which of them the mouse has, for which part, and how large they are.

use super::super::bench::Bench;
use super::super::picture::part_hand::{Means, PartHand};
use egui::{Button, Color32, ComboBox, DragValue, Rect, Sense, Slider, Ui, vec2};

/// The tools, with what they do.
const TOOLS: [(Means, &str, &str); 3] = [
    (
        Means::Brush,
        "Brush",
        "Drag over the bone, in the picture or in slices: what lies in the ball becomes the part's, never through a gap",
    ),
    (Means::Eraser, "Eraser", "Drag over the bone: what lies in the ball is taken from the part"),
    (Means::Scissors, "Scissors", "Draw a line in the picture: the bone that is seen within it becomes the part's"),
];

/// Shows the tools for scan number `n`, and what can be chosen of the one that the mouse has.
pub fn show(ui: &mut Ui, bench: &mut Bench, n: usize) {
    if bench.view.part_hand.as_ref().is_some_and(|hand| hand.scan(&bench.work.opened) != Some(n)) {
        bench.view.part_hand = None;
    }
    ui.horizontal(|ui| {
        for (means, name, hint) in TOOLS {
            let has = bench.view.part_hand.as_ref().is_some_and(|hand| hand.means == means);
            if ui.add(Button::new(name).selected(has)).on_hover_text(hint).clicked() {
                take(bench, n, (!has).then_some(means));
            }
        }
    });
    let Some(hand) = &mut bench.view.part_hand else { return };
    part(ui, hand);
    match hand.means {
        Means::Brush | Means::Eraser => {
            ui.spacing_mut().slider_width = (ui.available_width() - 130.0).max(60.0);
            let radii_mm = hand.radii_mm();
            let radius = Slider::new(&mut hand.radius_mm, radii_mm).logarithmic(true).max_decimals(2).suffix(" mm").text("radius");
            ui.add(radius).on_hover_text("The keys [ and ] make it smaller and larger").accessible_name("Radius of the brush");
        }
        Means::Scissors => scissors(ui, hand),
    }
}

/// Gives a tool to the mouse, or takes it.
fn take(bench: &mut Bench, n: usize, means: Option<Means>) {
    // The mouse has one thing at a time.
    bench.view.hand = None;
    match (means, &mut bench.view.part_hand) {
        // What is half done becomes a step first.
        (None, hand) => drop(hand.take_if(|hand| !hand.is_busy())),
        (Some(means), Some(hand)) => hand.means = means,
        (Some(means), none) => *none = Some(PartHand::take(&bench.work.opened, n, means)),
    }
}

/// Which part it is for.
fn part(ui: &mut Ui, hand: &mut PartHand) {
    let parts = hand.parts();
    let verb = if hand.means == Means::Eraser { "from" } else { "for" };
    ui.horizontal(|ui| {
        ui.weak(verb);
        let (name, color) = parts.iter().find(|part| part.0 == hand.number).map_or(("", Color32::GRAY), |part| (&part.1, part.2));
        square(ui, color);
        let combo = ComboBox::from_id_salt("part by hand").selected_text(name).width(ui.available_width() - 90.0).truncate();
        let combo = combo.show_ui(ui, |ui| {
            // The largest islands come first, and what was painted last.
            let few = parts.iter().enumerate().filter(|(n, _)| *n < MOST || n + MOST >= parts.len());
            for (_, (number, name, _)) in few {
                ui.selectable_value(&mut hand.number, *number, name);
            }
        });
        combo.response.on_hover_text("The part that is painted, cut out or erased").accessible_name("Part by hand");
        if ui.button("New part").on_hover_text("Paint for a part of its own").clicked() {
            hand.new_part();
        }
    });
}

/// So many from either end: a list of more is none to choose from.
const MOST: usize = 20;

/// The colour of a part.
pub fn square(ui: &mut Ui, color: Color32) -> Rect {
    let (rect, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
    ui.painter().rect_filled(rect, 2.0, color);
    rect
}

fn scissors(ui: &mut Ui, hand: &mut PartHand) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut hand.inside, true, "Within the line");
        ui.selectable_value(&mut hand.inside, false, "Outside");
    });
    ui.horizontal(|ui| {
        let mut is_limited = hand.depth_mm.is_some();
        let hint = "Else the scissors cut through all that lies behind what is seen";
        if ui.checkbox(&mut is_limited, "Only to a depth of").on_hover_text(hint).changed() {
            hand.depth_mm = is_limited.then_some(hand.radius_mm);
        }
        if let Some(mm) = &mut hand.depth_mm {
            let number = DragValue::new(mm).range(0.01..=1000.0).speed(0.05).max_decimals(2).suffix(" mm");
            ui.add(number.update_while_editing(false)).accessible_name("Depth of the scissors");
        }
    });
}
