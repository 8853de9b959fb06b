//! Samples of a surface that has changed: those at the same points of the tissue.

use crate::sample::Sample;
use crate::samples::Samples;
use std::collections::{HashMap, TryReserveError};

/// Weights that differ by less are the same.
const SAME: f32 = 1e-4;

/// Of rows of `before`, ascending: the rows of `after` at the same points of the same nodes, where there is one. A point between nodes that have come apart
/// has none.
///
/// # Errors
/// No memory.
pub fn followed(
    before: &Samples,
    after: &Samples,
    rows: &[u32],
) -> Result<Vec<Option<u32>>, TryReserveError> {
    let mut found = Vec::new();
    found.try_reserve_exact(rows.len())?;
    found.resize(rows.len(), None);
    let mut wanted: HashMap<[u32; 4], Vec<usize>> = HashMap::new();
    wanted.try_reserve(rows.len())?;
    for (at, row) in rows.iter().enumerate() {
        let (nodes, _) = sorted(&before.at(*row));
        wanted.entry(nodes).or_default().push(at);
    }
    for (row, sample) in after.rows().iter().enumerate() {
        let (nodes, weights) = sorted(sample);
        for &at in wanted.get(&nodes).into_iter().flatten() {
            let (_, own) = sorted(&before.at(rows[at]));
            if weights.iter().zip(own).all(|(a, b)| (a - b).abs() < SAME) {
                found[at].get_or_insert(row as u32);
            }
        }
    }
    Ok(found)
}

/// Nodes, ascending, with their weights; what is not needed is no node.
fn sorted(sample: &Sample) -> ([u32; 4], [f32; 4]) {
    let mut parts = [(u32::MAX, 0.0); 4];
    for (part, entry) in parts.iter_mut().zip(sample.entries()) {
        *part = entry;
    }
    parts.sort_unstable_by_key(|part| part.0);
    (parts.map(|part| part.0), parts.map(|part| part.1))
}
