//! The frontier: error against run time, both logarithmic, with the Pareto front drawn.

use host::Effort;
use picture::plot::{Axes, Scale, label, legend};

/// Below this an error is round-off of the reference itself, mm².
const EXACT: f64 = 1e-7;
use picture::plot::colour;

/// One row of the report in the plane of time and error.
pub struct Point {
    /// Groups rows by colour: the bundle or the plain method.
    pub family: String,
    /// What distinguishes it within its family, besides its corrections.
    pub label: String,
    /// Corrections a step in contact: points of one family and label with several of them are one curve.
    pub corrections: Effort,
    pub milliseconds: f64,
    /// mm²; zero (the reference itself) is drawn at the bottom edge.
    pub mse: f64,
    /// A plain method, drawn hollow.
    pub plain: bool,
}

/// Indices of the points that no other point beats in both time and error, by ascending time.
pub fn pareto_front(points: &[Point]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&points[*a], &points[*b]);
        a.milliseconds
            .total_cmp(&b.milliseconds)
            .then(a.mse.total_cmp(&b.mse))
    });
    let mut best = f64::INFINITY;
    order.retain(|index| {
        let better = points[*index].mse < best;
        best = best.min(points[*index].mse);
        better
    });
    order
}

/// The family, and the corrections where there are any.
fn named(point: &Point) -> String {
    match point.corrections {
        Effort { most: 0, .. } => point.family.clone(),
        count => format!("{}, k = {count}", point.family),
    }
}

/// Indices of the points that differ by their corrections alone, by ascending corrections; sets of two or more.
fn curves(points: &[Point]) -> Vec<Vec<usize>> {
    let mut curves: Vec<Vec<usize>> = Vec::new();
    // A point whose corrections go by a target lies off the curve of counts.
    let counted = |point: &&Point| point.corrections.target_mm == 0.0;
    for (index, point) in points.iter().enumerate().filter(|(_, p)| counted(p)) {
        let same = |other: &&mut Vec<usize>| {
            let first = &points[other[0]];
            first.family == point.family && first.label == point.label
        };
        match curves.iter_mut().find(same) {
            Some(curve) => curve.push(index),
            None => curves.push(vec![index]),
        }
    }
    curves.retain(|curve| curve.len() > 1);
    for curve in &mut curves {
        curve.sort_by_key(|&index| points[index].corrections.most);
    }
    curves
}

pub fn frontier(points: &[Point]) -> String {
    let x = Scale::log(points.iter().map(|point| point.milliseconds));
    let y = Scale::log(
        points
            .iter()
            .map(|point| point.mse)
            .filter(|mse| *mse > EXACT),
    );
    // Room below the smallest error for the methods whose error is zero.
    let y = if points.iter().any(|point| point.mse <= EXACT) {
        Scale::log([y.low() / 4.0, y.high()].into_iter())
    } else {
        y
    };
    let mut axes = Axes::new(
        860.0,
        470.0,
        x,
        y,
        "ms a step of 50 ms of tissue (median)",
        "MSE, mm²",
    );
    let drawn = |mse: f64| if mse > EXACT { mse } else { y.low() };

    let front = pareto_front(points);
    let mut stairs: Vec<(f64, f64)> = Vec::new();
    for index in &front {
        let point = &points[*index];
        if let Some((_, last)) = stairs.last().copied() {
            stairs.push((point.milliseconds, last));
        }
        stairs.push((point.milliseconds, drawn(point.mse)));
    }
    if let Some((_, last)) = stairs.last().copied() {
        stairs.push((x.high(), last));
        axes.line(&stairs, "#9aa5b1", 2.0, true);
    }

    let mut families: Vec<&str> = Vec::new();
    for point in points {
        if !families.contains(&point.family.as_str()) {
            families.push(&point.family);
        }
    }
    for curve in curves(points) {
        let line: Vec<(f64, f64)> = (curve.iter())
            .map(|&index| (points[index].milliseconds, drawn(points[index].mse)))
            .collect();
        let family = &points[curve[0]].family;
        let at = families.iter().position(|one| one == family).unwrap_or(0);
        axes.line(&line, colour(at), 1.6, false);
    }
    for point in points {
        let index = families
            .iter()
            .position(|family| *family == point.family)
            .unwrap_or(0);
        let error = if point.mse > EXACT {
            label(point.mse)
        } else {
            "0 (the reference)".into()
        };
        let tip = format!(
            "{} {}: {} ms, MSE {error} mm²",
            named(point),
            point.label,
            label(point.milliseconds)
        );
        axes.disc(
            point.milliseconds,
            drawn(point.mse),
            5.5,
            colour(index),
            point.plain,
            &tip,
        );
    }
    // Names at the points of the front, alternating above and below so that neighbours do not collide.
    let mut taken: Vec<(f64, f64, f64)> = Vec::new();
    for index in &front {
        let point = &points[*index];
        let (px, py) = (axes.px(point.milliseconds), axes.py(drawn(point.mse)));
        let text = named(point);
        let half = 3.4 * text.len() as f64;
        let (cx, cy) = [(0.0, -11.0), (0.0, 20.0), (0.0, -25.0), (0.0, 34.0)]
            .iter()
            .map(|(dx, dy)| {
                (
                    (px + dx).clamp(78.0 + half, 842.0 - half),
                    (py + dy).clamp(14.0, 420.0),
                )
            })
            .find(|(cx, cy)| {
                taken
                    .iter()
                    .all(|(tx, ty, th)| (cx - tx).abs() > half + th || (cy - ty).abs() > 13.0)
            })
            .unwrap_or((px, py - 11.0));
        taken.push((cx, cy, half));
        axes.text(cx, cy, "middle", "mark", &text);
    }
    let entries: Vec<(String, &str)> = families
        .iter()
        .enumerate()
        .map(|(index, family)| ((*family).to_owned(), colour(index)))
        .collect();
    legend(&entries) + &axes.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(milliseconds: f64, mse: f64) -> Point {
        Point {
            family: "a".into(),
            label: String::new(),
            corrections: Effort::NONE,
            milliseconds,
            mse,
            plain: false,
        }
    }

    #[test]
    fn a_curve_joins_points_that_differ_by_their_corrections_alone() {
        let of = |family: &str, label: &str, corrections| Point {
            family: family.into(),
            label: label.into(),
            corrections: Effort::fixed(corrections),
            ..point(1.0, 1.0)
        };
        let points = [
            of("a", "2 threads", 5),
            of("a", "1 thread", 0),
            of("b", "2 threads", 3),
            of("a", "2 threads", 0),
        ];
        assert_eq!(curves(&points), [vec![3, 0]]);
    }

    #[test]
    fn the_front_holds_what_nothing_beats_in_both() {
        let points = [
            point(10.0, 0.01),
            point(1.0, 5.0),
            point(2.0, 0.02),
            point(3.0, 0.05),
            point(500.0, 0.0),
            point(20.0, 0.01),
        ];
        assert_eq!(pareto_front(&points), [1, 2, 0, 4]);
    }
}
