//! A vertex that lies far off, as a digit too many or a damaged byte puts it there: filling such a body would take for ever.

use super::error::{Fault, fault};

/// How many times farther than half of the others a vertex may lie from their middle.
const MOST: f64 = 1000.0;
/// Coordinates beyond this are of no body, in whatever unit.
const FARTHEST: f64 = 1e12;

/// Refuses the vertex that lies farthest off, of those that `used` names. Coordinates that are no numbers are left out.
pub fn check(positions: &[[f64; 3]], used: impl Iterator<Item = u32>) -> Result<(), Fault> {
    let mut is_used = vec![false; positions.len()];
    for node in used {
        if let Some(is_used) = is_used.get_mut(node as usize) {
            *is_used = true;
        }
    }
    let is_place = |node: &usize| positions[*node].iter().all(|x| x.is_finite());
    let used: Vec<usize> = (0..positions.len())
        .filter(|&at| is_used[at])
        .filter(is_place)
        .collect();
    if used.is_empty() {
        return Ok(());
    }
    let is_beyond = |node: &&usize| positions[**node].iter().any(|x| x.abs() > FARTHEST);
    if let Some(&node) = used.iter().find(is_beyond) {
        return fault(format!(
            "{}, which is no place of a body; correct or drop it",
            place(positions, node)
        ));
    }
    let middle: [f64; 3] =
        std::array::from_fn(|k| median(used.iter().map(|&node| positions[node][k]).collect()));
    let distance = |node: usize| {
        (0..3)
            .map(|k| (positions[node][k] - middle[k]).abs())
            .fold(0.0, f64::max)
    };
    let usual = median(used.iter().map(|&node| distance(node)).collect());
    let farthest = used
        .into_iter()
        .max_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0);
    if usual > 0.0 && distance(farthest) > MOST * usual {
        return fault(format!(
            "{}, {:.0} times as far from the middle as half of all vertices; correct or drop it",
            place(positions, farthest),
            distance(farthest) / usual
        ));
    }
    Ok(())
}

/// Refuses a vertex with a coordinate that is no number, of those that `used` names.
pub fn check_finite(positions: &[[f64; 3]], used: impl Iterator<Item = u32>) -> Result<(), Fault> {
    for node in used.map(|node| node as usize) {
        if positions[node].iter().any(|x| !x.is_finite()) {
            return fault(format!(
                "{}, which is no place; correct or drop it",
                place(positions, node)
            ));
        }
    }
    Ok(())
}

fn place(positions: &[[f64; 3]], node: usize) -> String {
    let [x, y, z] = positions[node];
    format!(
        "vertex {} of the file (index {node}) lies at ({x}, {y}, {z})",
        node + 1
    )
}

fn median(mut values: Vec<f64>) -> f64 {
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}
