//! A volume's histogram with its isovalue as a line that can be dragged.

use bregma_field::Volume;
use egui::{Color32, CursorIcon, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

const HEIGHT: f32 = 64.0;

/// Shows the histogram of `volume` on a logarithmic scale; a click or drag moves `iso`. What counts as bone has `color`.
pub fn show(ui: &mut Ui, volume: &Volume, iso: &mut f64, color: Color32) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Histogram of {}", volume.name())));
    let [low, high] = volume.range();
    let width = if high > low { high - low } else { 1.0 };
    if let Some(at) = response.interact_pointer_pos() {
        *iso = low + f64::from(((at.x - rect.left()) / rect.width()).clamp(0.0, 1.0)) * width;
        // A pixel is the finest that a hand can mean.
        *iso = round_to(*iso, width / f64::from(rect.width()));
    }
    let x_of = |value: f64| rect.left() + ((value - low) / width) as f32 * rect.width();
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, ui.visuals().extreme_bg_color);
    let columns = columns(volume, rect.width() as usize);
    let top = columns.iter().fold(1.0_f32, |a, &b| a.max(b));
    let iso_x = x_of(*iso);
    for (n, count) in columns.iter().enumerate() {
        let x = rect.left() + n as f32;
        let fill = if x + 0.5 < iso_x { Color32::from_gray(85) } else { color };
        let bar = Rect::from_min_max(pos2(x, rect.bottom() - count / top * (rect.height() - 4.0)), pos2(x + 1.0, rect.bottom()));
        painter.rect_filled(bar, 0.0, fill);
    }
    if rect.x_range().contains(iso_x) {
        painter.vline(iso_x, rect.y_range(), Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.vline(iso_x, rect.y_range(), Stroke::new(1.5, Color32::WHITE));
    }
    let hint = "How many samples have each value (logarithmic). Drag the line: what lies right of it is bone.";
    response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal).on_hover_text(hint);
}

/// The logarithm of the largest count under each of `width` columns, values rising to the right.
pub fn columns(volume: &Volume, width: usize) -> Vec<f32> {
    let (counts, [low, high]) = (&volume.histogram().counts, volume.histogram().range);
    let (bins, width) = (counts.len(), width.max(1));
    // Between whole numbers lie bins that nothing can fall into: a column shows the numbers nearest to its ends.
    let steps = if volume.has_whole_samples() { high - low } else { 0.0 };
    let bin = |share: f64| {
        let share = if 0.0 < steps && steps < bins as f64 { (share * steps).round() / steps } else { share };
        ((share * bins as f64) as usize).min(bins - 1)
    };
    let column = |n: usize| {
        let [from, to] = [n, n + 1].map(|n| bin(n as f64 / width as f64));
        counts[from..to.max(from + 1)].iter().fold(0.0_f32, |largest, &count| largest.max((count as f32).ln_1p()))
    };
    let mut columns: Vec<f32> = (0..width).map(column).collect();
    if volume.slope() < 0.0 {
        columns.reverse();
    }
    columns
}

/// `x` with no more digits than `step` can tell.
pub fn round_to(x: f64, step: f64) -> f64 {
    let decade = 10_f64.powf(step.log10().floor());
    // Dividing by a whole number keeps decimal fractions as people write them.
    if decade >= 1.0 { (x / decade).round() * decade } else { (x * decade.recip().round()).round() / decade.recip().round() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::{Grid, Raster, Samples, Unit};
    use glam::{DMat3, DVec3};

    #[test]
    fn few_whole_numbers_leave_no_gaps_and_a_falling_scale_is_turned() {
        let volume = |slope: f64| {
            let grid = Grid::new([2, 2, 2], DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY).unwrap();
            let samples = Samples::U8(vec![0, 0, 0, 0, 1, 1, 2, 3]);
            let raster = Raster { grid, samples, slope, intercept: 0.0, unit: Unit::Value, warnings: vec![] };
            Volume::new("few".into(), "test", raster).unwrap()
        };
        let rising = columns(&volume(1.0), 200);
        assert!(rising.iter().all(|&c| c > 0.0) && rising[0] == 5_f32.ln() && rising[199] == 2_f32.ln());
        assert_eq!(columns(&volume(-1.0), 200), rising.iter().rev().copied().collect::<Vec<_>>());
    }

    #[test]
    fn dragged_values_are_as_round_as_a_pixel() {
        assert_eq!(round_to(226.4567, 12.0), 230.0);
        assert_eq!(round_to(226.4567, 3.0), 226.0);
        assert_eq!(round_to(0.123456, 0.004), 0.123);
    }
}
