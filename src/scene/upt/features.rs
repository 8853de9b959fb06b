//! The encoder's node features of kind `upt`, normalised as the bundle says: `[encode_nodes, f]`.
//!
//! A feature `x` becomes `(x - mean) / std` by axis, with the mean and deviation of the training
//! set; the flag of contact stays 0 or 1. Rows are by place in `encode_nodes`, and columns follow
//! the manifest's list of features: three for a vector, one for the flag. Every number is written
//! in each step, those of nodes without contact as well, since the rows are an input that stays
//! bound.

use std::hint::black_box;

use super::record::UptRecord;
use crate::bundle::Feature;
use crate::model::{UptModel, UptTables};
use crate::scene::inputs::Inputs;

/// Writes every row. `next` and `last` hold the linear response of this step and of the one before.
pub(super) fn fill_features(
    rows: &mut [f32],
    kind: &UptModel,
    tables: &UptTables,
    input: &Inputs<'_>,
    next: &UptRecord,
    last: &UptRecord,
) {
    let width = kind.entry.feature_width();
    let normalisation = &kind.entry.normalisation;
    let (mean, inverse) = (normalisation.mean, inverse(normalisation.std));
    let mut column = 0;
    for &feature in &kind.entry.features {
        let field = match feature {
            Feature::Displacement => Some(input.displacement),
            Feature::PreviousDisplacement => Some(input.previous),
            Feature::Prior => Some(next.prior_field.as_slice()),
            Feature::PreviousPrior => Some(last.prior_field.as_slice()),
            Feature::Collision | Feature::Contact => None,
        };
        let all = rows.chunks_exact_mut(width);
        match field {
            Some(field) => {
                for (row, &node) in all.zip(&tables.encode_nodes) {
                    for axis in 0..3 {
                        let x = field[3 * node as usize + axis];
                        row[column + axis] = (x - mean[axis]) * inverse[axis];
                    }
                }
            }
            None if feature == Feature::Collision => {
                // No contact is a push of zero, which the normalisation moves.
                let zero = [0, 1, 2].map(|axis| (0.0 - mean[axis]) * inverse[axis]);
                all.for_each(|row| row[column..column + 3].copy_from_slice(&zero));
            }
            None => all.for_each(|row| row[column] = 0.0),
        }
        if field.is_none() {
            let contact = input.contact;
            for (&node, c) in contact.nodes.iter().zip(contact.vectors.chunks_exact(3)) {
                let row = tables.row_of_node[node as usize];
                // A contact node beyond the graph: no supernode hears of it.
                if row == u32::MAX {
                    continue;
                }
                let row = &mut rows[row as usize * width..(row as usize + 1) * width];
                if feature == Feature::Contact {
                    row[column] = 1.0;
                } else {
                    for axis in 0..3 {
                        row[column + axis] = (c[axis] - mean[axis]) * inverse[axis];
                    }
                }
            }
        }
        column += feature.width();
    }
}

/// One number after another: a quotient of three numbers in registers of four is 0/0 in the fourth, an invalid operation.
fn inverse(std: [f32; 3]) -> [f32; 3] {
    std.map(|x| black_box(1.0 / black_box(x)))
}
