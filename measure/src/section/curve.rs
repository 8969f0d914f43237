//! The curves in which a plane meets a surface, from one cell to the next, and places on them by their length.

use super::cells::{Link, Node, links};
use super::plane::InPlane;
use super::trace::{InCell, arc_mm, from_segment};
use bregma_field::{Cancelled, Progress};
use glam::{DVec2, DVec3, USizeVec3};
use std::collections::HashMap;

/// A curve by its ways through cells, of which only the ends are known.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    pub links: Vec<Link>,
    /// It has no ends; else it ends at the scan's box.
    pub is_closed: bool,
}

/// All curves of a plane.
pub(super) fn chains(plane: &InPlane<'_>, progress: &Progress) -> Result<Vec<Chain>, Cancelled> {
    let links = links(plane, progress)?;
    let at: HashMap<Node, usize> = links.iter().enumerate().map(|(n, link)| (link.nodes[0], n)).collect();
    let mut is_first = vec![true; links.len()];
    links.iter().filter_map(|link| at.get(&link.nodes[1])).for_each(|n| is_first[*n] = false);
    let mut is_taken = vec![false; links.len()];
    let mut found = vec![];
    // Those that begin somewhere, then those that are left, which are closed.
    for n in (0..links.len()).filter(|n| is_first[*n]).chain(0..links.len()) {
        let mut chain = Chain { links: vec![], is_closed: !is_first[n] };
        let mut next = Some(n);
        while let Some(n) = next.filter(|n| !std::mem::replace(&mut is_taken[*n], true)) {
            chain.links.push(links[n]);
            next = at.get(&links[n].nodes[1]).copied();
        }
        if !chain.links.is_empty() {
            found.push(chain);
        }
    }
    Ok(found)
}

impl Chain {
    /// Its length, mm, but for how it bends within cells.
    pub fn about_mm(&self) -> f64 {
        self.links.iter().map(|link| link.ends[0].distance(link.ends[1])).sum()
    }

    /// How far a point of the plane is from it, mm. Where it may be nearer than `best_mm`, cells are looked into.
    pub fn distance_mm(&self, plane: &InPlane<'_>, point: DVec2, best_mm: f64) -> f64 {
        let about = |link: &Link| from_segment(point, link.ends).0;
        let nearest = self.links.iter().map(about).fold(f64::INFINITY, f64::min);
        // Within its cell a curve strays from the straight way by no more than the cell is wide in any direction.
        let reach = nearest.min(best_mm) + plane.surface.grid.spacing_mm().element_sum();
        let near = self.links.iter().filter(|link| about(link) < reach);
        let exact = |link: &Link| {
            let way = InCell::of(plane, link.cell).way(link.ends);
            way.windows(2).map(|pair| from_segment(point, [pair[0].0, pair[1].0]).0).fold(f64::INFINITY, f64::min)
        };
        near.map(exact).fold(f64::INFINITY, f64::min)
    }

    /// Whether it goes round a point of the plane.
    pub fn holds(&self, point: DVec2) -> bool {
        let passes = |link: &&Link| {
            let [a, b] = link.ends;
            (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
        };
        self.is_closed && self.links.iter().filter(passes).count() % 2 == 1
    }
}

/// A curve that can be asked for places by their length along it.
#[derive(Clone, Debug)]
pub(super) struct Curve<'a> {
    pub plane: InPlane<'a>,
    pieces: Vec<Piece>,
    pub is_closed: bool,
    pub length_mm: f64,
}

/// A short stretch within a cell.
#[derive(Clone, Copy, Debug)]
struct Piece {
    cell: USizeVec3,
    ends: [DVec2; 2],
    /// Where it begins and ends along the curve.
    along_mm: [f64; 2],
}

impl<'a> Curve<'a> {
    pub fn of(plane: InPlane<'a>, chain: &Chain) -> Self {
        let (mut pieces, mut length_mm) = (vec![], 0.0);
        for link in &chain.links {
            for pair in InCell::of(&plane, link.cell).way(link.ends).windows(2) {
                let end_mm = length_mm + arc_mm([pair[0], pair[1]]);
                pieces.push(Piece { cell: link.cell, ends: [pair[0].0, pair[1].0], along_mm: [length_mm, end_mm] });
                length_mm = end_mm;
            }
        }
        Self { plane, pieces, is_closed: chain.is_closed, length_mm }
    }

    /// The place of the curve that is nearest to a point of the plane: its length along the curve and its distance, mm.
    pub fn nearest(&self, point: DVec2) -> (f64, f64) {
        let of = |piece: &Piece| {
            let (mm, part) = from_segment(point, piece.ends);
            (piece.along_mm[0] + part * (piece.along_mm[1] - piece.along_mm[0]), mm)
        };
        self.pieces.iter().map(of).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, f64::INFINITY))
    }

    /// The point that lies `along_mm` behind the curve's beginning, LPS mm; of a closed curve any length is one.
    pub fn at(&self, along_mm: f64) -> DVec3 {
        let along_mm = if self.is_closed { along_mm.rem_euclid(self.length_mm) } else { along_mm };
        let n = self.pieces.partition_point(|piece| piece.along_mm[1] < along_mm).min(self.pieces.len().saturating_sub(1));
        let Some(Piece { cell, ends, along_mm: [from, to] }) = self.pieces.get(n) else { return self.plane.plane.point_mm };
        let part = ((along_mm - from) / (to - from)).clamp(0.0, 1.0);
        let guess = ends[0].lerp(ends[1], if part.is_nan() { 0.0 } else { part });
        // Where the surface has no normal in the plane, the way between two points of it is all that is known.
        self.plane.world(InCell::of(&self.plane, *cell).settled(guess).unwrap_or(guess))
    }

    /// The straight way between the two points of it that are farthest from each other of those beside each other, mm.
    #[cfg(test)]
    pub fn longest_piece_mm(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.ends[0].distance(piece.ends[1])).fold(0.0, f64::max)
    }

    /// Where it is farthest in a direction of the plane, mm along it.
    pub fn farthest(&self, direction: DVec2) -> f64 {
        let height = |piece: &&Piece| piece.ends[0].dot(direction);
        self.pieces.iter().max_by(|a, b| height(a).total_cmp(&height(b))).map_or(0.0, |piece| piece.along_mm[0])
    }
}
