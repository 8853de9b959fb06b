//! Errors of a predicted displacement field against the true one, as the paper defines them.
//!
//! All fields are `[K,3]`, mm. An autoregressive average excludes the first step; that is the caller's part.

/// Mean over the nodes of the squared distance, mm²: `1/K sum_i |a_i - b_i|²`.
pub fn mse_mm2(truth: &[[f32; 3]], predicted: &[[f32; 3]]) -> f64 {
    squared_difference(truth, predicted) / truth.len().max(1) as f64
}

/// `|a - b| / |a|` over all nodes; 0 where both are zero, infinite where only the truth is.
pub fn relative_l2(truth: &[[f32; 3]], predicted: &[[f32; 3]]) -> f64 {
    let difference = squared_difference(truth, predicted);
    let norm: f64 = truth
        .as_flattened()
        .iter()
        .map(|v| f64::from(*v).powi(2))
        .sum();
    if difference == 0.0 {
        0.0
    } else {
        (difference / norm).sqrt()
    }
}

/// Largest absolute difference over nodes and axes, mm. NaN anywhere gives NaN.
pub fn max_error_mm(truth: &[[f32; 3]], predicted: &[[f32; 3]]) -> f64 {
    let differences = truth
        .as_flattened()
        .iter()
        .zip(predicted.as_flattened())
        .map(|(a, b)| f64::from(a - b).abs());
    differences.fold(0.0, |largest, value| {
        if value > largest || value.is_nan() {
            value
        } else {
            largest
        }
    })
}

/// Hausdorff distance of the node positions `rest + truth` and `rest + predicted`, mm, over the nodes
/// that lie within `radius_mm` of `site` at rest. 0 when there are none.
pub fn hausdorff_mm(
    rest: &[[f32; 3]],
    truth: &[[f32; 3]],
    predicted: &[[f32; 3]],
    site: [f64; 3],
    radius_mm: f64,
) -> f64 {
    let near: Vec<usize> = (0..rest.len())
        .filter(|node| {
            (0..3)
                .map(|k| (f64::from(rest[*node][k]) - site[k]).powi(2))
                .sum::<f64>()
                <= radius_mm * radius_mm
        })
        .collect();
    let moved = |field: &[[f32; 3]]| -> Vec<[f64; 3]> {
        near.iter()
            .map(|node| [0, 1, 2].map(|k| f64::from(rest[*node][k]) + f64::from(field[*node][k])))
            .collect()
    };
    let (a, b) = (moved(truth), moved(predicted));
    directed(&a, &b).max(directed(&b, &a)).sqrt()
}

fn squared_difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    a.as_flattened()
        .iter()
        .zip(b.as_flattened())
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2))
        .sum()
}

fn distance2(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// `max_i min_j |a_i - b_j|²`. Node `i`'s own partner bounds its minimum from above, so only nodes whose
/// bound exceeds the largest minimum found so far need a search.
fn directed(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let bounds: Vec<f64> = a.iter().zip(b).map(|(a, b)| distance2(*a, *b)).collect();
    let mut order: Vec<usize> = (0..a.len()).collect();
    order.sort_unstable_by(|i, j| bounds[*j].total_cmp(&bounds[*i]));
    let mut largest = 0.0;
    for i in order {
        if bounds[i] <= largest {
            break;
        }
        let nearest = b
            .iter()
            .map(|other| distance2(a[i], *other))
            .fold(f64::INFINITY, f64::min);
        largest = nearest.max(largest);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_of_one_millimetre_has_known_errors() {
        let truth = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let predicted = [[1.0, 0.0, 1.0], [0.0, 2.0, 0.0]];
        assert_eq!(mse_mm2(&truth, &predicted), 0.5);
        assert_eq!(max_error_mm(&truth, &predicted), 1.0);
        assert!((relative_l2(&truth, &predicted) - (1.0f64 / 5.0).sqrt()).abs() < 1e-12);
        assert_eq!(relative_l2(&[[0.0; 3]], &[[0.0; 3]]), 0.0);
        assert!(max_error_mm(&truth, &[[f32::NAN; 3], [0.0; 3]]).is_nan());
    }

    /// Against the definition, both directions searched in full, on pseudo-random points.
    #[test]
    fn the_hausdorff_distance_equals_its_definition_within_the_radius() {
        let mut seed = 7u64;
        let mut next = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut field = |scale: f32| -> Vec<[f32; 3]> {
            (0..200)
                .map(|_| [next(), next(), next()].map(|v| (v - 0.5) * scale))
                .collect()
        };
        let (rest, truth, predicted) = (field(100.0), field(6.0), field(6.0));
        let site = [5.0, -3.0, 2.0];
        let near: Vec<usize> = (0..200)
            .filter(|i| {
                (0..3)
                    .map(|k| (f64::from(rest[*i][k]) - site[k]).powi(2))
                    .sum::<f64>()
                    <= 40.0f64.powi(2)
            })
            .collect();
        let point = |field: &[[f32; 3]], i: usize| {
            [0, 1, 2].map(|k| f64::from(rest[i][k]) + f64::from(field[i][k]))
        };
        let one_way = |a: &[[f32; 3]], b: &[[f32; 3]]| {
            near.iter()
                .map(|i| {
                    near.iter()
                        .map(|j| distance2(point(a, *i), point(b, *j)))
                        .fold(f64::INFINITY, f64::min)
                })
                .fold(0.0, f64::max)
        };
        let expected = one_way(&truth, &predicted)
            .max(one_way(&predicted, &truth))
            .sqrt();
        assert!(near.len() > 20 && expected > 0.5);
        assert_eq!(
            hausdorff_mm(&rest, &truth, &predicted, site, 40.0),
            expected
        );
        assert_eq!(
            hausdorff_mm(&rest, &truth, &predicted, [1e4, 0.0, 0.0], 40.0),
            0.0
        );
    }
}
