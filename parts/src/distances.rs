//! How far samples of bone are from the nearest sample that is none: exact Euclidean distances between samples, mm.
//!
//! Squares of distances are those along i, then the least of these with what j adds, then k: lower envelopes of parabolas (Felzenszwalb and
//! Huttenlocher 2012, doi:10.4086/toc.2012.v008a019), each run of bone for itself, since nothing behind the samples that bound it is nearer. Axes
//! are taken to be at right angles; on a scan that was sheared with a gantry tilted by θ, distances are off by at most a factor of √(1 + sin θ).

use crate::envelope::Envelope;
use crate::islands::Islands;
use bregma_field::{Cancelled, Progress};
use glam::DVec3;
use rayon::prelude::*;

/// For each sample the squared distance in mm² from the nearest sample that belongs to none of `islands`; 0 for these, infinite where there is none.
/// What lies beyond the grid is unknown and no outside: bone that the scan's box cuts is not thin there.
pub fn squared_distances(islands: &Islands, spacing_mm: DVec3, progress: &Progress) -> Result<Vec<f32>, Cancelled> {
    let [nx, ny, nz] = islands.dims();
    progress.begin((ny + 2 * nz) as u64);
    let mut squares = vec![0.0_f32; nx * ny * nz];
    squares.par_chunks_mut(nx * ny).enumerate().try_for_each(|(k, slice)| {
        slice.chunks_mut(nx).enumerate().for_each(|(j, row)| along_row(islands, j + ny * k, spacing_mm.x, row));
        let mut rows: Vec<&mut [f32]> = slice.chunks_mut(nx).collect();
        across_rows(&mut rows, spacing_mm.y);
        progress.advance(2)
    })?;
    // Rows of one j lie far from each other: each thread gets those of one j at a time.
    let mut by_j: Vec<Vec<&mut [f32]>> = (0..ny).map(|_| Vec::with_capacity(nz)).collect();
    squares.chunks_mut(nx).enumerate().for_each(|(row, values)| by_j[row % ny].push(values));
    by_j.par_iter_mut().try_for_each(|rows| {
        across_rows(rows, spacing_mm.z);
        progress.advance(1)
    })?;
    Ok(squares)
}

fn along_row(islands: &Islands, row: usize, spacing_mm: f64, out: &mut [f32]) {
    let count = out.len();
    for (run, _) in islands.row(row) {
        let run = run.range();
        for i in run.clone() {
            let before = if run.start > 0 { (i + 1 - run.start) as f64 } else { f64::INFINITY };
            let behind = if run.end < count { (run.end - i) as f64 } else { f64::INFINITY };
            out[i] = (before.min(behind) * spacing_mm).powi(2) as f32;
        }
    }
}

/// Columns that are read together, so that each line of the cache is read once.
const COLUMNS: usize = 16;

/// The same for squares that are known along rows, and rows that lie `spacing_mm` apart.
fn across_rows(rows: &mut [&mut [f32]], spacing_mm: f64) {
    let (count, width) = (rows.len(), rows.first().map_or(0, |row| row.len()));
    let mut columns = vec![0.0_f32; count * COLUMNS];
    let mut envelope = Envelope::default();
    for first in (0..width).step_by(COLUMNS) {
        let wide = COLUMNS.min(width - first);
        for (n, row) in rows.iter().enumerate() {
            (0..wide).for_each(|c| columns[c * count + n] = row[first + c]);
        }
        if columns[..wide * count].iter().all(|&square| square == 0.0) {
            continue;
        }
        columns[..wide * count].chunks_mut(count).for_each(|column| along_column(&mut envelope, column, spacing_mm));
        for (n, row) in rows.iter_mut().enumerate() {
            (0..wide).for_each(|c| row[first + c] = columns[c * count + n]);
        }
    }
}

/// Of a column each run of bone with the samples at both its ends.
fn along_column(envelope: &mut Envelope, column: &mut [f32], spacing_mm: f64) {
    let mut end = 0;
    while let Some(n) = column[end..].iter().position(|&square| square > 0.0) {
        let first = end + n;
        end = column[first..].iter().position(|&square| square == 0.0).map_or(column.len(), |n| first + n);
        let last = (end + 1).min(column.len());
        envelope.lower(&mut column[first.saturating_sub(1)..last], spacing_mm);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::islands::runs_of;
    use bregma_synthetic::Random;

    #[test]
    fn distances_are_the_least_of_all_pairs() {
        // Fails if a pass forgets a neighbour, an axis's spacing is another's, a run's end is missed, or the scan's box counts as outside.
        let mut random = Random(5);
        for (dims, inside) in
            [([9, 7, 6], 0.9), ([17, 3, 5], 0.97), ([1, 8, 9], 0.8), ([20, 1, 1], 0.7), ([5, 5, 5], 1.1), ([4, 4, 4], -0.1)]
        {
            let bone: Vec<bool> = (0..dims.iter().product()).map(|_| random.unit() < inside).collect();
            let row = |row: usize, out: &mut Vec<_>| runs_of(&bone[row * dims[0]..][..dims[0]], |b| b, out);
            let islands = Islands::find(dims, row, &Progress::default()).unwrap();
            let spacing = DVec3::new(0.7, 1.0, 2.3);
            let found = squared_distances(&islands, spacing, &Progress::default()).unwrap();
            let place =
                |n: usize| DVec3::new((n % dims[0]) as f64, (n / dims[0] % dims[1]) as f64, (n / dims[0] / dims[1]) as f64) * spacing;
            for (n, square) in found.iter().enumerate() {
                let outside = (0..bone.len()).filter(|&m| !bone[m]);
                let least = outside.map(|m| place(m).distance_squared(place(n))).fold(f64::INFINITY, f64::min);
                // Squares pass through float32 three times.
                assert!(f64::from(*square) == least || (f64::from(*square) / least - 1.0).abs() < 3e-7, "{dims:?} {n}: {square} {least}");
            }
        }
    }
}
