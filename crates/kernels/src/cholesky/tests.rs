//! The factor against products with its matrix, on a lattice of springs.

use super::{BlockRows, SparseFactor};
use crate::random::Random;
use lanes::Isa;

const SIDE: usize = 9;

/// A lattice's places, and a matrix over it that is diagonally dominant; with columns beyond its rows, which the factor leaves out.
fn lattice() -> (BlockRows, Vec<[f32; 3]>) {
    let at = |x: usize, y: usize, z: usize| (x * SIDE + y) * SIDE + z;
    let count = SIDE * SIDE * SIDE;
    let (mut matrix, mut points) = (BlockRows::default(), Vec::new());
    matrix.starts.push(0);
    for node in 0..count {
        let [x, y, z] = [node / SIDE / SIDE, node / SIDE % SIDE, node % SIDE];
        points.push([x as f32, y as f32, z as f32]);
        let near = |x: usize| x.saturating_sub(1)..(x + 2).min(SIDE);
        for a in near(x) {
            for b in near(y) {
                for c in near(z) {
                    let other = at(a, b, c);
                    // The same from both sides, and not symmetric itself.
                    let seed = (node.min(other) * count + node.max(other)) as f32;
                    let mut block = std::array::from_fn(|k| (seed + 7.0 * k as f32).sin());
                    if node > other {
                        block = std::array::from_fn(|k| block[3 * (k % 3) + k / 3]);
                    }
                    if node == other {
                        block = std::array::from_fn(|k| if k % 4 == 0 { 60.0 } else { 0.5 });
                    }
                    matrix.columns.push(other as u32);
                    matrix.blocks.push(block);
                }
            }
        }
        matrix.columns.push((count + node) as u32);
        matrix.blocks.push([9.0; 9]);
        matrix.starts.push(matrix.columns.len() as u32);
    }
    (matrix, points)
}

fn product(matrix: &BlockRows, x: &[f32]) -> Vec<f32> {
    let count = matrix.rows();
    let mut out = vec![0.0; 3 * count];
    for row in 0..count {
        let start = matrix.starts[row] as usize;
        for (at, &column) in matrix.row(row).iter().enumerate() {
            if (column as usize) < count {
                let block = &matrix.blocks[start + at];
                for k in 0..9 {
                    out[3 * row + k / 3] += block[k] * x[3 * column as usize + k % 3];
                }
            }
        }
    }
    out
}

#[test]
fn it_solves_what_it_has_factored() {
    let (matrix, points) = lattice();
    let mut random = Random::new(3);
    let x = random.normal(3 * matrix.rows(), 1.0);
    let b = product(&matrix, &x);
    for isa in Isa::available() {
        let mut factor = SparseFactor::default();
        factor.plan(&matrix, &points).unwrap();
        assert!(factor.factor(isa, &matrix));
        let mut solved = b.clone();
        factor.solve(isa, &mut solved);
        for (x, solved) in x.iter().zip(&solved) {
            assert!((x - solved).abs() < 1e-4, "{isa:?}: {solved} for {x}");
        }
    }
}

/// Several right sides give what each gives alone, up to rounding, and the same bits whatever the others are.
#[test]
fn right_sides_go_through_together() {
    let (matrix, points) = lattice();
    let size = 3 * matrix.rows();
    let mut random = Random::new(5);
    let mut sides = vec![0.0; 21 * size];
    for (at, side) in sides.chunks_exact_mut(size).enumerate() {
        match at % 3 {
            0 => side[7 * at] = 1.0,
            _ => side.copy_from_slice(&random.normal(size, 1.0)),
        }
    }
    for isa in Isa::available() {
        let mut factor = SparseFactor::default();
        factor.plan(&matrix, &points).unwrap();
        assert!(factor.factor(isa, &matrix));
        let mut solved = sides.clone();
        factor.solve_many(isa, &mut solved);
        for (solved, side) in solved.chunks_exact(size).zip(sides.chunks_exact(size)) {
            let (mut alone, mut one) = (side.to_vec(), side.to_vec());
            factor.solve_many(isa, &mut alone);
            assert!(alone == solved, "{isa:?}: others change a right side");
            factor.solve(isa, &mut one);
            for (one, solved) in one.iter().zip(solved) {
                assert!((one - solved).abs() < 1e-5, "{isa:?}: {solved} for {one}");
            }
        }
    }
}

#[test]
fn a_matrix_that_is_not_positive_has_no_factor() {
    let (mut matrix, points) = lattice();
    let row = matrix.rows() / 2;
    let at = matrix.position(row, row as u32).unwrap();
    matrix.blocks[at][4] = -60.0;
    let mut factor = SparseFactor::default();
    factor.plan(&matrix, &points).unwrap();
    assert!(!factor.factor(Isa::detect(), &matrix));
    assert!(!factor.is_made());
}
