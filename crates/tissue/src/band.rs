//! Symmetric matrices whose entries lie near the diagonal, and their factors `L D L^T`.

/// The lower half, row by row: `width` entries before the diagonal, and the diagonal.
pub(crate) struct Band {
    width: usize,
    rows: Vec<f64>,
}

impl Band {
    pub fn new(count: usize, width: usize) -> Self {
        Self {
            width,
            rows: vec![0.0; count * (width + 1)],
        }
    }

    pub fn clear(&mut self) {
        self.rows.fill(0.0);
    }

    fn at(&self, row: usize, column: usize) -> usize {
        row * (self.width + 1) + self.width + column - row
    }

    /// Adds to an entry; those above the diagonal are the others' mirror and are left out.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            let at = self.at(row, column);
            self.rows[at] += value;
        }
    }

    /// Makes an unknown equal to a value: its row and column become the identity's, and `right` takes what they had.
    pub fn fix(&mut self, row: usize, value: f64, right: &mut [f64]) {
        for column in row.saturating_sub(self.width)..row {
            let at = self.at(row, column);
            right[column] -= self.rows[at] * value;
            self.rows[at] = 0.0;
        }
        for below in row + 1..right.len().min(row + self.width + 1) {
            let at = self.at(below, row);
            right[below] -= self.rows[at] * value;
            self.rows[at] = 0.0;
        }
        let at = self.at(row, row);
        self.rows[at] = 1.0;
        right[row] = value;
    }

    /// Factors in place; false where the matrix is not positive definite.
    pub fn factor(&mut self) -> bool {
        let (width, whole) = (self.width, self.width + 1);
        for row in 0..self.rows.len() / whole {
            let first = row.saturating_sub(width);
            let (before, own) = self.rows.split_at_mut(row * whole);
            // `L D` first, then `L` and the pivot.
            for column in first..row {
                let start = first.max(column.saturating_sub(width));
                let other = &before[column * whole + width + start - column..][..column - start];
                let mine = &own[width + start - row..][..column - start];
                let sum = product(mine, other);
                own[width + column - row] -= sum;
            }
            let mut pivot = own[width];
            for column in first..row {
                let entry = &mut own[width + column - row];
                let scaled = *entry / before[column * whole + width];
                pivot -= scaled * *entry;
                *entry = scaled;
            }
            if pivot.is_nan() || pivot <= 0.0 {
                return false;
            }
            own[width] = pivot;
        }
        true
    }

    /// Solves by the factors, in place.
    pub fn solve(&self, x: &mut [f64]) {
        let (width, whole) = (self.width, self.width + 1);
        let own = |row: usize| {
            let first = row.saturating_sub(width);
            &self.rows[row * whole + width + first - row..][..row - first]
        };
        for row in 0..x.len() {
            let factors = own(row);
            let known = &x[row - factors.len()..row];
            let sum: f64 = factors.iter().zip(known).map(|(l, x)| l * x).sum();
            x[row] -= sum;
        }
        for row in 0..x.len() {
            x[row] /= self.rows[row * whole + width];
        }
        for row in (0..x.len()).rev() {
            let factors = own(row);
            let (before, from) = x.split_at_mut(row);
            let at = row - factors.len();
            for (x, l) in before[at..].iter_mut().zip(factors) {
                *x -= l * from[0];
            }
        }
    }
}

/// The sum of products, in eight parts that vector registers hold.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| a * b);
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::Band;

    #[test]
    fn factors_solve_with_an_unknown_that_is_given() {
        let (count, width) = (9, 3);
        let entry = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 8.0 + i as f64,
            apart if apart <= width => 1.0 / (1 + i + j) as f64 - 0.5,
            _ => 0.0,
        };
        let mut band = Band::new(count, width);
        for i in 0..count {
            for j in i.saturating_sub(width)..count.min(i + width + 1) {
                band.add(i, j, entry(i, j));
            }
        }
        let wanted: Vec<f64> = (0..count).map(|i| (i as f64).sin()).collect();
        let mut x: Vec<f64> = (0..count)
            .map(|i| (0..count).map(|j| entry(i, j) * wanted[j]).sum())
            .collect();
        band.fix(4, wanted[4], &mut x);
        assert!(band.factor());
        band.solve(&mut x);
        for (x, wanted) in x.iter().zip(&wanted) {
            assert!((x - wanted).abs() < 1e-12, "{x} {wanted}");
        }
        let mut band = Band::new(2, 1);
        band.add(0, 0, 1.0);
        band.add(1, 0, 2.0);
        band.add(1, 1, 1.0);
        assert!(!band.factor());
    }
}
