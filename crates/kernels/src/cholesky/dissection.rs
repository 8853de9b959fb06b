//! Nested dissection (George, Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10, 1973): nodes are parted by the middle of their
//! longest extent, and those of one half that are coupled with the other are eliminated after both.
//!
//! A separator of a mesh of `n` nodes has about `n^(2/3)` of them, and only separators couple what
//! they part. So most fronts are small, the factor has `O(n^(4/3))` numbers, and a right side that
//! is zero on one side of a separator leaves that branch alone. Ties are broken by the number of a
//! node: the order, and with it every bit of the factor, is the same on every machine.

use std::ops::Range;

use super::{BlockRows, Front, NONE, SparseFactor, WHAT};
use field::error::Result;
use field::memory;

/// Nodes that are not parted any more: a leaf has up to 48 rows of its own. Each front costs a
/// gather and a scatter in every solve, which parts of a leaf would not be worth.
const LEAF: usize = 16;

impl SparseFactor {
    /// Orders a range of places, whose nodes are coupled with no others but later ones; its fronts come after all others.
    /// Recursion is as deep as the halving takes, `log2(n / LEAF)`. The places of `range` are
    /// permuted in `order`; `local` is used for marks and left at [`NONE`].
    pub(super) fn dissect(
        &mut self,
        matrix: &BlockRows,
        points: &[[f32; 3]],
        range: Range<usize>,
    ) -> Result<()> {
        if range.len() <= LEAF {
            return self.push_front(range, (0, 1));
        }
        let nodes = &mut self.order[range.clone()];
        let extent = |axis: usize| {
            let values = nodes.iter().map(|node| points[*node as usize][axis]);
            let (low, high) = values.fold((f32::MAX, f32::MIN), |(low, high), x| {
                (low.min(x), high.max(x))
            });
            high - low
        };
        let extents = [0, 1, 2].map(extent);
        // Of equal extents the first axis.
        let axis = (0..3).fold(0, |best, axis| match extents[axis] > extents[best] {
            true => axis,
            false => best,
        });
        let middle = nodes.len() / 2;
        nodes.select_nth_unstable_by(middle, |a, b| {
            let at = |node: &u32| points[*node as usize][axis];
            // Ties by number, so that the order is the same on every machine.
            at(a).total_cmp(&at(b)).then(a.cmp(b))
        });
        // Which half a node is in: 0, 1; 2 for those of the second that touch the first.
        for &node in &nodes[..middle] {
            self.room.local[node as usize] = 0;
        }
        for &node in &nodes[middle..] {
            self.room.local[node as usize] = 1;
        }
        for &node in &nodes[middle..] {
            // Columns beyond the rows have no place, and count as no neighbour.
            let touches = |column: &u32| self.room.local.get(*column as usize) == Some(&0);
            if matrix.row(node as usize).iter().any(touches) {
                self.room.local[node as usize] = 2;
            }
        }
        let local = &mut self.room.local;
        nodes[middle..].sort_unstable_by_key(|node| (local[*node as usize], *node));
        // The order is now: first half, second half without its border, border. The border comes last, so that neither half has entries with the other.
        let parted = nodes[middle..].partition_point(|node| local[*node as usize] == 1);
        for &node in nodes.iter() {
            local[node as usize] = NONE;
        }
        let (start, end) = (range.start, range.end);
        let (middle, parted) = (start + middle, start + middle + parted);
        // Fronts are pushed in postorder: children, then their parent. `factor` needs no stack but that of what waits.
        let before = self.fronts.len();
        let mut children = 1;
        self.dissect(matrix, points, start..middle)?;
        if parted > middle {
            self.dissect(matrix, points, middle..parted)?;
            children += 1;
        }
        // The border is the parent even where it is empty: it keeps the two halves one tree.
        let tree = self.fronts.len() - before + 1;
        self.push_front(parted..end, (children, tree as u32))
    }

    /// A front of these places: `children` wait for it, `tree` fronts end with it. What it is coupled with is found later, from the matrix.
    fn push_front(&mut self, own: Range<usize>, (children, tree): (u32, u32)) -> Result<()> {
        let front = Front {
            first: own.start as u32,
            own: own.len() as u32,
            // Set when the pattern is walked through.
            border: 0,
            border_count: 0,
            upper: 0,
            children,
            tree,
        };
        memory::push(&mut self.fronts, front, WHAT)
    }
}
