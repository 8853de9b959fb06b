//! Fill-reducing order of the nodes: geometric nested dissection.
//!
//! A set of nodes is cut at the median of its longest axis; the nodes of the upper half that touch
//! the lower half are the separator and are numbered last. On the tetrahedral meshes here this fills
//! less than minimum degree on three-dimensional meshes and needs only the coordinates.

/// Nodes in elimination order. `neighbours(i)` are the nodes that share an element with `i`.
///
/// `positions` are those of the nodes that are ordered, `[n,3]`; sets of up to `leaf` nodes are not cut.
pub fn nested_dissection(positions: &[[f32; 3]], neighbours: &[Vec<u32>], leaf: usize) -> Vec<u32> {
    let mut order = vec![0u32; positions.len()];
    let mut side = vec![0u8; positions.len()];
    let mut all: Vec<u32> = (0..positions.len() as u32).collect();
    dissect(
        &mut all,
        &mut order,
        &mut side,
        positions,
        neighbours,
        leaf.max(8),
    );
    order
}

fn longest_axis(nodes: &[u32], positions: &[[f32; 3]]) -> usize {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for &node in nodes {
        for axis in 0..3 {
            low[axis] = low[axis].min(positions[node as usize][axis]);
            high[axis] = high[axis].max(positions[node as usize][axis]);
        }
    }
    (0..3)
        .max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])))
        .unwrap_or(0)
}

/// Orders `nodes` into `order` (equal lengths). `side` is zero for every node outside of the call.
fn dissect(
    nodes: &mut [u32],
    order: &mut [u32],
    side: &mut [u8],
    positions: &[[f32; 3]],
    neighbours: &[Vec<u32>],
    leaf: usize,
) {
    if nodes.len() <= leaf {
        nodes.sort_unstable();
        order.copy_from_slice(nodes);
        return;
    }
    let axis = longest_axis(nodes, positions);
    let half = nodes.len() / 2;
    nodes.select_nth_unstable_by(half, |&a, &b| {
        positions[a as usize][axis]
            .total_cmp(&positions[b as usize][axis])
            .then(a.cmp(&b))
    });
    let (lower, upper) = nodes.split_at(half);
    for &node in lower {
        side[node as usize] = 1;
    }
    let (mut separator, mut upper): (Vec<u32>, Vec<u32>) = upper.iter().partition(|&&node| {
        neighbours[node as usize]
            .iter()
            .any(|&other| side[other as usize] == 1)
    });
    for &node in lower {
        side[node as usize] = 0;
    }
    let mut lower = lower.to_vec();
    separator.sort_unstable();
    let (first, rest) = order.split_at_mut(lower.len());
    let (second, last) = rest.split_at_mut(upper.len());
    last.copy_from_slice(&separator);
    if upper.is_empty() && lower.len() > leaf && separator.len() * 2 > lower.len() {
        // A slab so thin that a cut separates nothing: no order helps.
        lower.sort_unstable();
        first.copy_from_slice(&lower);
        return;
    }
    dissect(&mut lower, first, side, positions, neighbours, leaf);
    dissect(&mut upper, second, side, positions, neighbours, leaf);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_a_permutation_with_the_separator_last() {
        // A chain of 200 nodes along x: the last node separates the two halves.
        let positions: Vec<[f32; 3]> = (0..200).map(|i| [i as f32, 0.0, 0.0]).collect();
        let neighbours: Vec<Vec<u32>> = (0..200u32)
            .map(|i| {
                [i.wrapping_sub(1), i + 1]
                    .into_iter()
                    .filter(|&j| j < 200)
                    .collect()
            })
            .collect();
        let order = nested_dissection(&positions, &neighbours, 8);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..200).collect::<Vec<u32>>());
        assert_eq!(order[199], 100);
    }
}
