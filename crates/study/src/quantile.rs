//! Quantiles of measured values.

/// The value below which the share `q` of the sorted `values` lies (nearest rank).
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    if sorted.is_empty() {
        return f64::NAN;
    }
    let rank = (q * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

/// The value below which half of the values lie; NaN of none.
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(
            (
                quantile(&values, 0.5),
                quantile(&values, 0.95),
                quantile(&values, 1.0)
            ),
            (50.0, 95.0, 100.0)
        );
        assert_eq!(quantile(&[3.0], 0.99), 3.0);
        assert_eq!(median([9.0, 1.0, 5.0]), 5.0);
        assert!(median([]).is_nan());
    }
}
