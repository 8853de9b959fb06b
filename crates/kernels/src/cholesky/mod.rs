//! Sparse Cholesky factors of symmetric matrices of 3x3 blocks, one block row a mesh node: nested dissection by the nodes' places, and the
//! multifrontal method (Duff and Reid, The multifrontal solution of indefinite sparse symmetric linear equations, ACM TOMS 9, 1983) in f32.
//!
//! `A = U^T U` in the order of the dissection. A *front* is a dense matrix over the nodes that one part of the dissection eliminates, its *own*, and
//! those later ones that they are coupled with. Own rows become rows of `U`; what is left of the others is added to the front of the parent.
//!
//! [`SparseFactor::plan`] takes a pattern, [`SparseFactor::factor`] values; both work in the room that they have.

mod dissection;
mod front;
mod many;
mod sides;

use field::error::Result;
use field::memory::{self, HeldBytes};
use lanes::Isa;

use front::{eliminate, solve_back, solve_forward};
use many::ManySides;

/// What there is no memory for, where there is none.
const WHAT: &str = "a sparse factor";
const NONE: u32 = u32::MAX;

/// Block rows of a symmetric matrix: row `i` has `columns[starts[i]..starts[i + 1]]`, ascending, and as many blocks, row-major. Columns beyond the rows
/// are left out by the factor.
#[derive(Default, HeldBytes)]
pub struct BlockRows {
    /// Where each row begins in the other two lists, `[rows + 1]`; the first is 0.
    pub starts: Vec<u32>,
    /// Nodes, `[starts[rows]]`.
    pub columns: Vec<u32>,
    /// Both triangles are stored; the factor reads what its order makes the upper one.
    pub blocks: Vec<[f32; 9]>,
}

/// One front, see the module.
#[derive(HeldBytes)]
struct Front {
    /// Places in the order: its own nodes.
    first: u32,
    own: u32,
    /// Into [`SparseFactor::borders`].
    border: u32,
    border_count: u32,
    /// Into [`SparseFactor::upper`].
    upper: usize,
    /// Fronts that it is the parent of, and those of its whole tree, which come right before it in the order of elimination.
    children: u32,
    tree: u32,
}

/// See the module.
#[derive(Default, HeldBytes)]
pub struct SparseFactor {
    /// Node of each place, place of each node.
    order: Vec<u32>,
    places: Vec<u32>,
    /// In the order of elimination.
    /// Children come before their parent (postorder), so one pass over the list factors.
    fronts: Vec<Front>,
    /// Places beyond each front's own that it is coupled with, ascending.
    borders: Vec<u32>,
    /// Rows of `U`: of each front `3 own` rows of `3 (own + border)`, with the inverse on the diagonal.
    upper: Vec<f32>,
    room: Room,
    /// Whether `upper` is of the matrix that was taken last.
    is_made: bool,
}

/// What factors and solves are made in.
#[derive(Default, HeldBytes)]
struct Room {
    /// The front being eliminated, and what is left of those that wait for their parents.
    /// `front` is `[widest, widest]`, of which a smaller front takes the beginning. `waiting` is a
    /// stack, on top of which the children of a front lie when its turn comes.
    front: Vec<f32>,
    waiting: Vec<f32>,
    /// By place: its index in the front, while it is put together.
    local: Vec<u32>,
    /// Entries of a front's nodes, and a permuted right side.
    gathered: Vec<f32>,
    permuted: Vec<f32>,
    many: ManySides,
}

impl Room {
    /// For a matrix of `rows`, whose widest front has `widest`, of whose fronts `most_waiting` values wait at once.
    fn fit(&mut self, rows: usize, widest: usize, most_waiting: usize) -> Result<()> {
        // Everything is reserved here, at the deepest that the stack will ever be: `factor` and
        // `solve` run within a step, where nothing may be allocated.
        self.waiting.clear();
        memory::fit(&mut self.waiting, most_waiting, WHAT)?;
        self.front.clear();
        memory::fit(&mut self.front, widest * widest, WHAT)?;
        self.front.resize(widest * widest, 0.0);
        self.gathered.clear();
        memory::fit(&mut self.gathered, widest, WHAT)?;
        self.gathered.resize(widest, 0.0);
        self.permuted.clear();
        memory::fit(&mut self.permuted, rows, WHAT)?;
        self.many.fit(rows, widest, WHAT)
    }
}

impl BlockRows {
    pub fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Columns of a row.
    pub fn row(&self, row: usize) -> &[u32] {
        &self.columns[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// The position of an entry, where it has one.
    pub fn position(&self, row: usize, column: u32) -> Option<usize> {
        let found = self.row(row).binary_search(&column).ok()?;
        Some(self.starts[row] as usize + found)
    }
}

impl SparseFactor {
    /// Whether there is a factor.
    pub fn is_made(&self) -> bool {
        self.is_made
    }

    /// There is none any more.
    pub fn forget(&mut self) {
        self.is_made = false;
    }

    /// Takes the pattern of a matrix whose rows are nodes at `points`, one a row.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn plan(&mut self, matrix: &BlockRows, points: &[[f32; 3]]) -> Result<()> {
        self.is_made = false;
        let count = matrix.rows();
        refill(&mut self.order, 0..count as u32)?;
        refill(&mut self.places, std::iter::repeat_n(NONE, count))?;
        refill(&mut self.room.local, std::iter::repeat_n(NONE, count))?;
        self.fronts.clear();
        self.borders.clear();
        self.dissect(matrix, points, 0..count)?;
        for (place, &node) in self.order.iter().enumerate() {
            self.places[node as usize] = place as u32;
        }
        self.find_borders(matrix)?;
        let (mut size, mut widest) = (0, 0);
        for front in &mut self.fronts {
            front.upper = size;
            let width = 3 * (front.own + front.border_count) as usize;
            size += 3 * front.own as usize * width;
            widest = widest.max(width);
        }
        refill(&mut self.upper, std::iter::repeat_n(0.0, size))?;
        self.room.fit(3 * count, widest, self.most_waiting())
    }

    /// How many values wait for their parents at once, at most.
    fn most_waiting(&self) -> usize {
        let left = |front: &Front| 9 * (front.border_count as usize).pow(2);
        let (mut waiting, mut most) = (0, 0);
        for (at, front) in self.fronts.iter().enumerate() {
            let mut child = at;
            for _ in 0..front.children {
                child = self.child_before(child, at);
                waiting -= left(&self.fronts[child]);
            }
            waiting += left(front);
            most = most.max(waiting);
        }
        most
    }

    /// The border of each front: what its own nodes and its children's borders are coupled with.
    /// When a child's nodes are gone, their later neighbours are all coupled with each other, so
    /// the parent takes over its border. `local` marks by the front's number which places are
    /// listed.
    fn find_borders(&mut self, matrix: &BlockRows) -> Result<()> {
        for at in 0..self.fronts.len() {
            let front = &self.fronts[at];
            let end = front.first + front.own;
            let start = self.borders.len();
            for place in front.first..end {
                let node = self.order[place as usize];
                for &column in matrix.row(node as usize) {
                    if let Some(&other) = self.places.get(column as usize)
                        && other >= end
                        && self.room.local[other as usize] != at as u32
                    {
                        self.room.local[other as usize] = at as u32;
                        memory::push(&mut self.borders, other, WHAT)?;
                    }
                }
            }
            let mut child = at;
            for _ in 0..front.children {
                child = self.child_before(child, at);
                let border = self.fronts[child].border as usize;
                for place in border..border + self.fronts[child].border_count as usize {
                    let other = self.borders[place];
                    if other >= end && self.room.local[other as usize] != at as u32 {
                        self.room.local[other as usize] = at as u32;
                        memory::push(&mut self.borders, other, WHAT)?;
                    }
                }
            }
            self.borders[start..].sort_unstable();
            let front = &mut self.fronts[at];
            front.border = start as u32;
            front.border_count = (self.borders.len() - start) as u32;
        }
        self.room.local.fill(NONE);
        Ok(())
    }

    /// The child of `parent` before `child`, or its last where `child` is the parent itself.
    fn child_before(&self, child: usize, parent: usize) -> usize {
        match child == parent {
            true => parent - 1,
            false => child - self.fronts[child].tree as usize,
        }
    }

    /// Takes the values of a matrix with the planned pattern; returns whether it is positive definite. There is no factor
    /// where it is not.
    pub fn factor(&mut self, isa: Isa, matrix: &BlockRows) -> bool {
        self.is_made = false;
        self.room.waiting.clear();
        for at in 0..self.fronts.len() {
            if !self.eliminate(isa, matrix, at) {
                return false;
            }
        }
        self.is_made = true;
        true
    }

    /// Its rows of the matrix and what its children have left are added up, its own nodes are
    /// eliminated, and what is left of its border goes onto the stack for the parent.
    fn eliminate(&mut self, isa: Isa, matrix: &BlockRows, at: usize) -> bool {
        let front = &self.fronts[at];
        let (own, border) = (front.own as usize, front.border as usize);
        let rest = front.border_count as usize;
        let (first, width) = (front.first as usize, 3 * (own + rest));
        let border = &self.borders[border..border + rest];
        for (index, place) in (first..first + own).enumerate() {
            self.room.local[place] = index as u32;
        }
        for (index, &place) in border.iter().enumerate() {
            self.room.local[place as usize] = (own + index) as u32;
        }
        if width == 0 {
            return true;
        }
        let dense = &mut self.room.front[..width * width];
        dense.fill(0.0);
        for (index, place) in (first..first + own).enumerate() {
            let node = self.order[place] as usize;
            let start = matrix.starts[node] as usize;
            for (at, &column) in matrix.row(node).iter().enumerate() {
                let Some(&other) = self.places.get(column as usize) else {
                    continue;
                };
                if (other as usize) < place {
                    continue;
                }
                let to = 3 * self.room.local[other as usize] as usize;
                let block = &matrix.blocks[start + at];
                for (row, values) in block.as_chunks::<3>().0.iter().enumerate() {
                    dense[(3 * index + row) * width + to..][..3].copy_from_slice(values);
                }
            }
        }
        // What is left of the children, the last of which lies on top.
        let mut child = at;
        for _ in 0..front.children {
            child = self.child_before(child, at);
            let of = &self.fronts[child];
            let count = of.border_count as usize;
            let places = &self.borders[of.border as usize..][..count];
            let base = self.room.waiting.len() - 9 * count * count;
            let left = &self.room.waiting[base..];
            let dense = &mut self.room.front[..width * width];
            // Extend-add: the child's border is part of this front, in the same ascending order, so
            // its upper triangle falls into this front's.
            for (i, &place) in places.iter().enumerate() {
                let row = 3 * self.room.local[place as usize] as usize;
                for axis in 0..3 {
                    let from = &left[(3 * i + axis) * 3 * count..][..3 * count];
                    let to = &mut dense[(row + axis) * width..][..width];
                    for (j, &other) in places.iter().enumerate().skip(i) {
                        let column = 3 * self.room.local[other as usize] as usize;
                        for k in 0..3 {
                            to[column + k] += from[3 * j + k];
                        }
                    }
                }
            }
            self.room.waiting.truncate(base);
        }
        let dense = &mut self.room.front[..width * width];
        let mut is_positive = true;
        eliminate(isa, dense, width, 3 * own, &mut is_positive);
        let upper = &mut self.upper[front.upper..][..3 * own * width];
        upper.copy_from_slice(&dense[..3 * own * width]);
        // A square block of the border alone; what is below its diagonal is not read.
        for row in dense[3 * own * width..].chunks_exact(width) {
            self.room.waiting.extend_from_slice(&row[3 * own..]);
        }
        is_positive
    }

    /// `x = A^-1 b` in place, `[3 rows]`.
    ///
    /// # Panics
    /// If there is no factor or the length is another.
    pub fn solve(&mut self, isa: Isa, x: &mut [f32]) {
        assert!(self.is_made, "there is no factor");
        assert_eq!(x.len(), 3 * self.order.len(), "length of a right side");
        self.room.permuted.clear();
        for &node in &self.order {
            let from = 3 * node as usize;
            self.room.permuted.extend_from_slice(&x[from..from + 3]);
        }
        let (borders, values) = (self.borders.as_slice(), &mut self.room.gathered);
        for front in &self.fronts {
            // Right sides of a contact are zero but at a few nodes: whole branches of the dissection are skipped.
            if front.is_zero(&self.room.permuted) {
                continue;
            }
            let width = front.gather(borders, &self.room.permuted, values);
            let upper = &self.upper[front.upper..][..3 * front.own as usize * width];
            solve_forward(isa, upper, width, &mut values[..width]);
            front.scatter(values, &mut self.room.permuted);
            front.scatter_border(borders, values, &mut self.room.permuted);
        }
        for front in self.fronts.iter().rev().filter(|front| front.own > 0) {
            let width = front.gather(borders, &self.room.permuted, values);
            let upper = &self.upper[front.upper..][..3 * front.own as usize * width];
            solve_back(isa, upper, width, &mut values[..width]);
            front.scatter(values, &mut self.room.permuted);
        }
        for (&node, values) in self.order.iter().zip(self.room.permuted.as_chunks::<3>().0) {
            x[3 * node as usize..][..3].copy_from_slice(values);
        }
    }
}

impl Front {
    /// Its nodes' entries of a permuted field, or of several; gives how many they are.
    fn gather<T: Copy>(&self, borders: &[u32], from: &[T], to: &mut [T]) -> usize {
        let own = 3 * self.own as usize;
        to[..own].copy_from_slice(&from[3 * self.first as usize..][..own]);
        let border = self.border_in(borders);
        for (to, &place) in to[own..].as_chunks_mut::<3>().0.iter_mut().zip(border) {
            to.copy_from_slice(&from[3 * place as usize..][..3]);
        }
        own + 3 * border.len()
    }

    /// Whether its own entries are zero: then they change no others.
    fn is_zero(&self, field: &[f32]) -> bool {
        let own = &field[3 * self.first as usize..][..3 * self.own as usize];
        own.iter().all(|value| *value == 0.0)
    }

    /// Puts its own back.
    fn scatter<T: Copy>(&self, from: &[T], to: &mut [T]) {
        let own = 3 * self.own as usize;
        to[3 * self.first as usize..][..own].copy_from_slice(&from[..own]);
    }

    /// Puts those of its border back.
    fn scatter_border<T: Copy>(&self, borders: &[u32], from: &[T], to: &mut [T]) {
        let from = from[3 * self.own as usize..].as_chunks::<3>().0;
        for (from, &place) in from.iter().zip(self.border_in(borders)) {
            to[3 * place as usize..][..3].copy_from_slice(from);
        }
    }

    fn border_in<'a>(&self, borders: &'a [u32]) -> &'a [u32] {
        &borders[self.border as usize..][..self.border_count as usize]
    }
}

/// Other values in the room of a list, and more where there is none.
fn refill<T>(list: &mut Vec<T>, values: impl ExactSizeIterator<Item = T>) -> Result<()> {
    list.clear();
    memory::fit(list, values.len(), WHAT)?;
    list.extend(values);
    Ok(())
}

#[cfg(test)]
mod tests;
