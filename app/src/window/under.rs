//! What lies under the mouse, in any view: a line of the status.

use super::bench::Bench;
use bregma_field::{Unit, WorldPoint};
use bregma_session::Held;
use bregma_session::coat::Coat;
use egui::{Label, RichText, Ui};
use glam::DVec3;

/// Shows it, cut off where there is no room, with the samples' numbers where the mouse rests on it.
pub fn show(ui: &mut Ui, bench: &Bench, map: Option<&dyn Coat>) {
    let text = text(bench, map);
    if !text.is_empty() {
        ui.add(Label::new(RichText::new(text)).truncate());
        ui.weak("·");
    }
}

/// The number of the map that is shown, each scan's value and where among its samples that is, and the place; nothing beside the scans.
pub fn text(bench: &Bench, map: Option<&dyn Coat>) -> String {
    let Some(point_mm) = bench.under_mm else { return String::new() };
    let held: Vec<String> = bench.work.opened.held_at(point_mm).iter().map(of_scan).collect();
    let told = map.and_then(|map| map.told_at(WorldPoint(point_mm)));
    [told.into_iter().collect(), held, vec![place(point_mm)]].concat().join("  ·  ")
}

fn of_scan(Held { scan, value, unit, index }: &Held) -> String {
    let name: String =
        if scan.chars().count() > MOST_LETTERS { scan.chars().take(MOST_LETTERS - 1).chain(['…']).collect() } else { scan.clone() };
    let [i, j, k] = index.0.to_array();
    let value = match unit {
        Unit::Hounsfield => format!("{value:.0} HU"),
        _ => bregma_measure::numbers::significant(*value, 5),
    };
    format!("{name} {value} ({i:.1}, {j:.1}, {k:.1})")
}

/// A longer name is cut off: what counts are the numbers.
const MOST_LETTERS: usize = 14;

/// A place in the body: how far to which side of the scanner's origin.
pub fn place(point_mm: DVec3) -> String {
    let along = |mm: f64, names: [&str; 2]| format!("{} {:.1}", names[usize::from(mm >= 0.0)], mm.abs());
    let [x, y, z] = point_mm.to_array();
    format!("{} {} {} mm", along(x, ["R", "L"]), along(y, ["A", "P"]), along(z, ["I", "S"]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_named_by_their_side() {
        // Fails if a side is the other one, or a minus stands beside a letter.
        assert_eq!(place(DVec3::new(-12.44, 3.0, -0.26)), "R 12.4 P 3.0 I 0.3 mm");
    }
}
