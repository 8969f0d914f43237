//! What the selected ray found in numbers: how much longer the second scan's stretches of bone are, then each scan's stretches, one table
//! below the other, and who is inside where.

use super::super::picture::cast::Found;
use bregma_measure::export;
use bregma_measure::numbers::{fixed, signed, significant, suffix};
use bregma_measure::{Difference, LedgerEntry, Segment, Uncertainty, VolumeRecord};
use egui::{Align, Color32, Grid, Label, Layout, RichText, Ui};

/// The number that people come for: each pair of stretches that belong together, the second scan's less the first's.
pub fn differences(ui: &mut Ui, found: &Found) {
    for note in &found.ray.notes {
        ui.colored_label(ui.visuals().warn_fg_color, note);
    }
    for pair in &found.ray.pairs {
        ui.add(Label::new(RichText::new(format!("{} − {}", pair.b, pair.a)).strong()).truncate());
        for d in &pair.differences {
            let parts = parts(&d.uncertainty, "");
            ui.horizontal(|ui| {
                ui.label(RichText::new(signed(d.difference_mm, 2)).strong().size(17.0)).on_hover_text(&parts);
                ui.label(RichText::new(format!("± {} mm", mm(d.uncertainty.error_mm))).size(15.0)).on_hover_text(parts);
                ui.add(Label::new(RichText::new(which(d)).weak()).truncate()).on_hover_text(export::difference(d));
            });
        }
        ui.weak(export::of_their_errors(pair));
        for sentence in export::alone(pair) {
            ui.colored_label(ui.visuals().warn_fg_color, sentence);
        }
    }
    if !found.ray.pairs.is_empty() {
        ui.add_space(4.0);
    }
}

/// Which stretches a difference is of, and what must be known about it.
pub fn which(d: &Difference) -> String {
    let bones = |numbers: &[usize]| numbers.iter().map(usize::to_string).collect::<Vec<_>>().join("+");
    let of = if d.a == d.b { format!("bone {}", bones(&d.a)) } else { format!("bone {} and {}", bones(&d.b), bones(&d.a)) };
    let flags = [(d.united, "united"), (d.partial, "in part"), (d.below_resolution, "below resolution")];
    flags.iter().filter(|(set, _)| *set).fold(of, |text, (_, flag)| format!("{text}, {flag}"))
}

/// Each volume's table.
pub fn show(ui: &mut Ui, found: &Found, hovered_mm: &mut Option<f64>) {
    for (n, (volume, color)) in found.volumes().enumerate() {
        ui.push_id(n, |ui| segments(ui, volume, color, hovered_mm));
        ui.add_space(4.0);
    }
}

const COLUMNS: [(&str, &str); 7] = [
    ("bone", ""),
    ("from", "Distance from the ray's first point, mm"),
    ("to", "Distance from the ray's first point, mm"),
    ("length", "mm"),
    (
        "±",
        "95 of 100 true lengths lie within this of the length, mm, where the wall is not below the resolution; point at a number to see its parts",
    ),
    ("half-max", "Length between the places where the value is halfway between bone and what lies beside it, mm"),
    ("oblique", "Angle between the ray and the bone's normal, the larger of both ends"),
];

fn segments(ui: &mut Ui, volume: &VolumeRecord, color: Color32, hovered_mm: &mut Option<f64>) {
    let unit = suffix(volume.unit);
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.weak(format!("isovalue {}{unit}", significant(volume.iso, 6)));
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.add(Label::new(RichText::new(&volume.name).color(color).strong()).truncate());
            });
        });
    });
    if volume.segments.is_empty() {
        ui.label(volume.meets.absence().unwrap_or_default());
        return;
    }
    Grid::new("segments").striped(true).spacing([6.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
        for (head, hint) in COLUMNS {
            let head = ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.weak(head)).inner;
            if !hint.is_empty() {
                head.on_hover_text(hint);
            }
        }
        ui.end_row();
        for (n, s) in volume.segments.iter().enumerate() {
            row(ui, n, s, volume, hovered_mm);
            ui.end_row();
        }
    });
    for (n, s) in volume.segments.iter().enumerate() {
        flags(ui, n, s);
    }
}

fn row(ui: &mut Ui, n: usize, s: &Segment, volume: &VolumeRecord, hovered_mm: &mut Option<f64>) {
    let is_pointed_at = hovered_mm.is_some_and(|t| (s.from_mm..=s.to_mm).contains(&t));
    let number = RichText::new(format!("{}", n + 1));
    right(ui, if is_pointed_at { number.strong().background_color(ui.visuals().selection.bg_fill) } else { number });
    right(ui, RichText::new(mm(s.from_mm)));
    right(ui, RichText::new(mm(s.to_mm)));
    let length = ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(RichText::new(mm(s.length_mm)).strong()));
    if length.inner.hovered() {
        *hovered_mm = Some(0.5 * (s.from_mm + s.to_mm));
    }
    let tolerance = format!(" ± {}{}", fixed(volume.iso_tolerance, 1), suffix(volume.unit));
    let parts = parts(&s.uncertainty, &tolerance);
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(mm(s.uncertainty.error_mm)).on_hover_text(parts));
    right(ui, RichText::new(s.half_maximum_mm.map_or("–".to_owned(), mm)));
    right(ui, RichText::new(format!("{:.0}°", s.obliquity_deg[0].max(s.obliquity_deg[1]))));
}

/// What a reader must know about a stretch before using its length.
fn flags(ui: &mut Ui, n: usize, s: &Segment) {
    let flags = [
        (s.from_origin, "begins inside", "The ray begins in this bone: it is longer than this"),
        (s.cut, "cut", "It begins or ends at a cut: the bone goes on"),
        (s.clipped && !s.cut, "cut by the scan's edge", "It begins or ends at a face of the scan: the bone may go on"),
        (s.below_resolution, "below resolution", "Thinner than the scan resolves: a threshold cannot measure it"),
    ];
    for (_, flag, why) in flags.iter().filter(|(set, ..)| *set) {
        ui.colored_label(ui.visuals().warn_fg_color, format!("bone {}: {flag}", n + 1)).on_hover_text(*why);
    }
}

/// What an uncertainty consists of; `tolerance` is by how much the isovalue may be wrong.
fn parts(u: &Uncertainty, tolerance: &str) -> String {
    format!(
        "isovalue{tolerance}: {} mm\nnoise: {} mm\nbetween samples: {} mm\nslices: {} mm\nregistration: {}\nroots: {:.1e} mm\n(as squares) and blur: {} mm\ntogether: {} mm",
        fixed(u.threshold_error_mm, 3),
        fixed(u.noise_error_mm, 3),
        fixed(u.sampling_error_mm, 3),
        fixed(u.slice_error_mm, 3),
        u.registration_error_mm.map_or("not known".to_owned(), |mm| format!("{} mm", fixed(mm, 3))),
        u.root_error_mm,
        fixed(u.blur_error_mm, 3),
        fixed(u.error_mm, 3)
    )
}

/// Who is inside where.
pub fn ledger(ui: &mut Ui, found: &Found) {
    Grid::new("ledger").striped(true).spacing([6.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
        for head in ["from", "to", "length"] {
            right(ui, RichText::new(head).weak());
        }
        ui.weak("inside");
        ui.end_row();
        for LedgerEntry { from_mm, to_mm, length_mm, inside } in &found.ray.ledger {
            for number in [from_mm, to_mm, length_mm] {
                right(ui, RichText::new(mm(*number)));
            }
            let inside = if inside.is_empty() { RichText::new("gap").weak() } else { RichText::new(inside.join(" + ")) };
            ui.add(Label::new(inside).truncate());
            ui.end_row();
        }
    });
}

/// Hundredths of a millimetre, which no scan of a skull resolves; never a negative zero.
pub fn mm(value: f64) -> String {
    fixed(value, 2)
}

/// Numbers stand under each other, units under units.
fn right(ui: &mut Ui, text: RichText) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| ui.label(text));
}
