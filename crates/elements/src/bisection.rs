//! Recursive coordinate bisection of elements into compact parts.
//!
//! Along the longest extent of a part, at the element that splits it in proportion to the leaves on
//! either side (Berger and Bokhari, A partitioning strategy for nonuniform problems on
//! multiprocessors, IEEE Trans. Comput. C-36, 1987). Ties are broken by number: the order is the
//! same on every machine.

/// Splits `order` into `count` spatially compact leaves of nearly equal size, one after another; `sizes` has room for theirs.
pub fn bisect(order: &mut [u32], centroids: &[[f32; 3]], count: usize, sizes: &mut Vec<usize>) {
    if count <= 1 {
        sizes.push(order.len());
        return;
    }
    let extent = |axis: usize| {
        let values = order.iter().map(|e| centroids[*e as usize][axis]);
        values.clone().fold(f32::MIN, f32::max) - values.fold(f32::MAX, f32::min)
    };
    let spans = [0, 1, 2].map(extent);
    let axis = (0..3)
        .max_by(|a, b| spans[*a].total_cmp(&spans[*b]))
        .unwrap_or(0);
    order.sort_unstable_by(|a, b| {
        centroids[*a as usize][axis]
            .total_cmp(&centroids[*b as usize][axis])
            .then(a.cmp(b))
    });
    let half = count / 2;
    let (left, right) = order.split_at_mut(order.len() * half / count);
    bisect(left, centroids, half, sizes);
    bisect(right, centroids, count - half, sizes);
}
