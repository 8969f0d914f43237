//! Which neighbouring nodes of a slice lie on two sides of its contour.

use crate::lanes::LANES;

/// Finds neighbours on two sides of the contour: by a bit for each node, sixteen at a time.
pub(super) struct Sides {
    width: usize,
    /// Of the row before and of the row at hand, for each group of nodes which have a value and which of these are inside.
    rows: [Vec<[u64; 2]>; 2],
    row: usize,
    /// Nodes whose right and whose lower neighbour is on the other side.
    pub ways: [Vec<usize>; 2],
}

impl Sides {
    pub fn new(width: usize) -> Self {
        // One group more, without nodes.
        let row = vec![[0; 2]; width.div_ceil(LANES) + 1];
        Self { width, rows: [row.clone(), row], row: 0, ways: [vec![], vec![]] }
    }

    pub fn put(&mut self, group: usize, there: u64, inside: u64) {
        self.rows[1][group] = [there, inside & there];
    }

    pub fn end_row(&mut self) {
        let [before, now] = &self.rows;
        let add = |ways: &mut Vec<usize>, row: usize, group: usize, mut bits: u64| {
            while bits != 0 {
                ways.push(row * self.width + group * LANES + bits.trailing_zeros() as usize);
                bits &= bits - 1;
            }
        };
        for (group, pair) in now.windows(2).enumerate() {
            let [[there, inside], [next_there, next_inside]] = [pair[0], pair[1]];
            let [right_there, right_inside] = [there >> 1 | next_there << (LANES - 1), inside >> 1 | next_inside << (LANES - 1)];
            let all = (1 << LANES) - 1;
            add(&mut self.ways[0], self.row, group, there & right_there & (inside ^ right_inside) & all);
            if self.row > 0 {
                let [above_there, above_inside] = before[group];
                add(&mut self.ways[1], self.row - 1, group, there & above_there & (inside ^ above_inside));
            }
        }
        self.rows.swap(0, 1);
        self.row += 1;
    }
}
