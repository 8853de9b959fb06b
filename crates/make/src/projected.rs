//! Fields in the bases of blocks of nodes.

/// Rows of block coordinates, gathered block by block.
pub struct Projected {
    /// For each block, `[count, rank]`.
    blocks: Vec<Vec<f32>>,
    count: usize,
    /// `Q`.
    pub width: usize,
}

impl Projected {
    pub fn new(count: usize) -> Self {
        Self {
            blocks: Vec::new(),
            count,
            width: 0,
        }
    }

    /// Adds the next block: `fields [count, dofs]` times `basis [dofs, rank]`.
    pub fn push(&mut self, fields: impl Iterator<Item = Vec<f32>>, basis: &[f32], rank: usize) {
        let mut block = Vec::with_capacity(self.count * rank);
        for field in fields {
            let start = block.len();
            block.resize(start + rank, 0.0f32);
            for (&u, row) in field.iter().zip(basis.chunks_exact(rank)) {
                if u != 0.0 {
                    for (q, phi) in block[start..].iter_mut().zip(row) {
                        *q += u * phi;
                    }
                }
            }
        }
        self.width += rank;
        self.blocks.push(block);
    }

    /// `[count, Q]`.
    pub fn rows(&self) -> Vec<f32> {
        let mut rows = Vec::with_capacity(self.count * self.width);
        for row in 0..self.count {
            for block in &self.blocks {
                let rank = block.len() / self.count;
                rows.extend_from_slice(&block[row * rank..(row + 1) * rank]);
            }
        }
        rows
    }
}
