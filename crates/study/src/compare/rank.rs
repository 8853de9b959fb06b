//! Spearman's rank correlation.

/// Ranks from 0; equal values share the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    for tied in order.chunk_by(|&a, &b| values[a] == values[b]) {
        let first = order.partition_point(|&i| values[i].total_cmp(&values[tied[0]]).is_lt());
        for &index in tied {
            ranks[index] = first as f64 + 0.5 * (tied.len() - 1) as f64;
        }
    }
    ranks
}

/// Correlation of the ranks of two lists of equal length; `None` where one of them is constant.
pub fn spearman(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (ranks(a), ranks(b));
    let middle = 0.5 * (a.len() as f64 - 1.0);
    let product = |x: &[f64], y: &[f64]| -> f64 {
        x.iter()
            .zip(y)
            .map(|(x, y)| (x - middle) * (y - middle))
            .sum()
    };
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    (scale > 0.0).then(|| product(&a, &b) / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_alone_counts_and_ties_share_their_rank() {
        assert_eq!(spearman(&[1.0, 2.0, 3.0], &[10.0, 100.0, 1e9]), Some(1.0));
        assert_eq!(spearman(&[1.0, 2.0, 3.0], &[3.0, 2.0, -1.0]), Some(-1.0));
        assert_eq!(spearman(&[1.0, 1.0, 1.0], &[3.0, 2.0, 1.0]), None);
        assert_eq!(ranks(&[5.0, 1.0, 5.0, 9.0]), [1.5, 0.0, 1.5, 3.0]);
        // scipy.stats.spearmanr([0, 0, 1, 1, 1], [1, 3, 2, 4, 5])
        let rank = spearman(&[0.0, 0.0, 1.0, 1.0, 1.0], &[1.0, 3.0, 2.0, 4.0, 5.0]).unwrap();
        assert!((rank - 0.577_350_269).abs() < 1e-8, "{rank}");
    }
}
