//! Medians and quantiles. Python's tables take NumPy's median, which is the same.

use std::borrow::Borrow;

/// Measured values from the least to the largest.
pub struct Sorted(Vec<f64>);

impl Sorted {
    pub fn of<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> Self {
        let mut values: Vec<f64> = values.into_iter().map(|value| *value.borrow()).collect();
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The value in the middle, of an even number the mean of the two there; NaN of none.
    pub fn median(&self) -> f64 {
        let middle = self.0.len() / 2;
        match (self.0.get(middle), self.0.len() % 2) {
            (Some(upper), 0) => 0.5 * (self.0[middle - 1] + upper),
            (Some(value), _) => *value,
            (None, _) => f64::NAN,
        }
    }

    /// The smallest value that a share `q` of all does not exceed (nearest rank); NaN of none.
    pub fn quantile(&self, q: f64) -> f64 {
        let rank = (q * self.0.len() as f64).ceil() as usize;
        let place = rank.max(1).min(self.0.len());
        place.checked_sub(1).map_or(f64::NAN, |at| self.0[at])
    }

    /// NaN of none.
    pub fn largest(&self) -> f64 {
        self.quantile(1.0)
    }
}

/// [`Sorted::median`] of values in any order.
pub fn median<V: Borrow<f64>>(values: impl IntoIterator<Item = V>) -> f64 {
    Sorted::of(values).median()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_sample_and_a_median_is_the_middle() {
        let values = Sorted::of((1..=100).rev().map(f64::from));
        assert_eq!(
            [0.0, 0.5, 0.95, 1.0].map(|q| values.quantile(q)),
            [1.0, 50.0, 95.0, 100.0]
        );
        assert_eq!((values.median(), values.largest()), (50.5, 100.0));
        assert_eq!(Sorted::of([3.0]).quantile(0.99), 3.0);
        assert_eq!(median([9.0, 1.0, 5.0]), 5.0);
        let none = Sorted::of([0.0; 0]);
        assert!(
            [none.median(), none.quantile(0.5), none.largest()]
                .iter()
                .all(|v| v.is_nan())
        );
    }
}
