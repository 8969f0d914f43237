//! Words beside points: near them, over no other words and no other point, with a line to the point where they had to go farther.

use super::marks::{Place, Tint};
use super::shapes::{At, Mark, Shape, Stroke};
use super::text::{CAPITAL, LEADING, text, width_mm};

/// Words that belong to a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// The point, mm.
    pub at: At,
    /// One above the other.
    pub lines: Vec<String>,
}

/// From a point to the words beside it, mm: first near, then farther away.
const AWAY_MM: [f64; 5] = [1.2, 2.5, 4.5, 7.0, 10.0];
/// Room around words and points, mm.
const ROOM_MM: f64 = 0.35;
/// Half of what a point takes, mm.
const POINT_MM: f64 = 0.7;

/// The upper left and the lower right corner of a box.
type Box2 = [At; 2];

/// The words of all labels of a picture, each where it covers least.
pub fn beside(labels: &[Label], place: Place, size: f64, tint: Tint) -> Vec<Mark> {
    let point = |label: &Label| [label.at.map(|mm| mm - POINT_MM), label.at.map(|mm| mm + POINT_MM)];
    let points: Vec<Box2> = labels.iter().map(point).collect();
    let mut taken: Vec<Box2> = vec![];
    let mut marks = vec![];
    for (n, label) in labels.iter().enumerate() {
        let width = label.lines.iter().map(|line| width_mm(line, size)).fold(0.0, f64::max);
        let height = ((label.lines.len() as f64 - 1.0) * LEADING + CAPITAL) * size;
        let others = || taken.iter().chain(points.iter().enumerate().filter(|(m, _)| *m != n).map(|(_, p)| p));
        let cost = |low: &At| {
            let own = [[low[0] - ROOM_MM, low[1] - ROOM_MM], [low[0] + width + ROOM_MM, low[1] + height + ROOM_MM]];
            let inside = [place.at, [place.at[0] + place.size[0], place.at[1] + place.size[1]]];
            others().map(|other| shared(&own, other)).sum::<f64>() + 10.0 * (area(&own) - shared(&own, &inside))
        };
        let places = candidates(label.at, [width, height]);
        let free = places.iter().position(|(low, _)| cost(low) < 1e-9);
        let least = || (0..places.len()).min_by(|a, b| cost(&places[*a].0).total_cmp(&cost(&places[*b].0)));
        // There are always candidates.
        let Some((low, away)) = free.or_else(least).map(|k| places[k]) else { continue };
        taken.push([low, [low[0] + width, low[1] + height]]);
        if away > AWAY_MM[0] {
            let to = [label.at[0].clamp(low[0], low[0] + width), label.at[1].clamp(low[1], low[1] + height)];
            let line = [(tint.halo, 0.4), (tint.ink, 0.12)].map(|(color, width)| Shape::line(&[label.at, to], Stroke::new(color, width)));
            marks.push(Mark { words: format!("line to {}", label.lines.join(" ")), shapes: line.into() });
        }
        let lines = label.lines.iter().enumerate();
        marks.extend(lines.map(|(k, line)| text([low[0], low[1] + k as f64 * LEADING * size], [0.0, 0.0], line, tint.over(size))));
    }
    marks
}

/// Where words of such a size may stand, the better places first: their upper left corners, and how far from the point.
fn candidates([x, y]: At, [width, height]: [f64; 2]) -> Vec<(At, f64)> {
    // Right, left, the corners, above and below: the share of the words that lies left of the point and above it, and the way there.
    let sides = [
        (0.0, 0.5, 1.0, 0.0),
        (1.0, 0.5, -1.0, 0.0),
        (0.0, 1.0, 0.7, -0.7),
        (0.0, 0.0, 0.7, 0.7),
        (1.0, 1.0, -0.7, -0.7),
        (1.0, 0.0, -0.7, 0.7),
        (0.5, 1.0, 0.0, -1.0),
        (0.5, 0.0, 0.0, 1.0),
    ];
    let at = |away: f64| sides.map(|(left, above, dx, dy)| ([x + away * dx - left * width, y + away * dy - above * height], away));
    AWAY_MM.into_iter().flat_map(at).collect()
}

/// The area that two boxes share, mm².
fn shared([a, b]: &Box2, [c, d]: &Box2) -> f64 {
    (0..2).map(|n| (b[n].min(d[n]) - a[n].max(c[n])).max(0.0)).product()
}

fn area([low, high]: &Box2) -> f64 {
    (high[0] - low[0]) * (high[1] - low[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_keep_clear_of_each_other_and_of_points() {
        // Fails if two names are written over each other though there is room, a name covers another's point, or leaves the picture.
        let place = Place { at: [10.0, 5.0], size: [60.0, 60.0] };
        let at = |n: i32| [12.0 + f64::from(n % 5) * 12.0, 20.0 + f64::from(n / 5) * 6.0];
        let labels: Vec<Label> = (0..15).map(|n| Label { at: at(n), lines: vec![format!("point {n}")] }).collect();
        let tint = Tint { ink: [0; 3], halo: [255; 3] };
        let marks = beside(&labels, place, 2.5, tint);
        let boxes: Vec<Box2> = marks.iter().filter(|mark| mark.words.starts_with("point")).map(Mark::bounds).collect();
        assert_eq!(boxes.len(), 15);
        for (n, a) in boxes.iter().enumerate() {
            assert!(a[0][0] >= 10.0 && a[1][0] <= 70.0 && a[0][1] >= 5.0 && a[1][1] <= 65.0, "{a:?}");
            assert!(boxes[..n].iter().all(|b| shared(a, b) == 0.0), "{n}");
            assert!(labels.iter().all(|l| shared(a, &[l.at, [l.at[0] + 1e-3, l.at[1] + 1e-3]]) == 0.0), "{n}");
        }
    }
}
