//! The picture of a fit: measured points, and the law's curve through them.

use super::curve::{Curve, Mode, Response, nominal_stress};
use super::hold::{Hold, Terms};
use picture::plot::{Axes, Scale, colour};

/// Points of a drawn curve.
const STEPS: usize = 120;

/// Strain or amount of shear of a stretch.
fn strain(mode: Mode, x: f64) -> f64 {
    if mode.is_shear() { x } else { x - 1.0 }
}

/// An SVG file: stress in kPa over strain or shear, discs measured, lines of each law, the first one solid.
pub fn draw(curves: &[Curve], laws: &[(&str, &impl Response)]) -> String {
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold([0.0f64, 0.0], |[low, high], v| [low.min(v), high.max(v)])
    };
    let all = || {
        curves
            .iter()
            .flat_map(|c| c.points.iter().map(move |p| (c.mode, p)))
    };
    let [left, right] = range(&mut all().map(|(mode, [x, _])| strain(mode, *x)));
    let [low, high] = range(&mut all().map(|(_, [_, y])| 1e-3 * y));
    let mut axes = Axes::new(
        760.0,
        440.0,
        Scale::linear(left, right),
        Scale::linear(low, high),
        "strain, or amount of shear",
        "nominal stress, kPa",
    );
    let mut keys = Vec::new();
    for (at, curve) in curves.iter().enumerate() {
        let xs = curve.points.iter().map(|[x, _]| *x);
        let (from, to) = xs.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        for (which, (_, law)) in laws.iter().enumerate() {
            let line: Vec<(f64, f64)> = (0..=STEPS)
                .map(|k| from + (to - from) * k as f64 / STEPS as f64)
                .map(|x| {
                    (
                        strain(curve.mode, x),
                        1e-3 * nominal_stress(*law, curve.mode, x),
                    )
                })
                .filter(|(_, y)| (low..=high).contains(y))
                .collect();
            if line.len() > 1 {
                axes.line(
                    &line,
                    colour(at),
                    if which == 0 { 2.0 } else { 1.2 },
                    which > 0,
                );
            }
        }
        for [x, y] in &curve.points {
            let tip = format!("{} {x}: {y:.1} Pa", curve.mode.as_str());
            axes.disc(
                strain(curve.mode, *x),
                1e-3 * y,
                3.0,
                colour(at),
                true,
                &tip,
            );
        }
        keys.push((curve.mode.as_str(), colour(at)));
    }
    axes.standalone(&keys)
}

/// An SVG file of a strain that is held: force or stress over time on a logarithmic axis, discs measured, a line fitted.
pub fn draw_hold(hold: &Hold, terms: &Terms) -> String {
    let times = || hold.points.iter().map(|[t, _]| *t).filter(|t| *t > 0.0);
    let values = hold.points.iter().map(|[_, y]| *y).chain([terms.at_once]);
    let [low, high] = values.fold([0.0f64, 0.0], |[low, high], y| [low.min(y), high.max(y)]);
    let (first, last) = times().fold((f64::MAX, 0.0f64), |(a, b), t| (a.min(t), b.max(t)));
    let mut axes = Axes::new(
        760.0,
        440.0,
        Scale::log(times()),
        Scale::linear(low, high),
        "time since the strain began, s",
        hold.unit,
    );
    let line: Vec<(f64, f64)> = (0..=STEPS)
        .map(|k| first * (last / first).powf(k as f64 / STEPS as f64))
        .map(|t| (t, hold.at(terms, t)))
        .collect();
    axes.line(&line, colour(1), 2.0, false);
    for [t, y] in hold.points.iter().filter(|[t, _]| *t > 0.0) {
        axes.disc(*t, *y, 3.0, colour(0), true, &format!("{t} s: {y}"));
    }
    axes.standalone(&[("measured", colour(0)), ("fitted", colour(1))])
}

/// An SVG file of a press: force in mN by displacement in mm, discs measured, a line fitted.
pub fn draw_press(points: &[[f64; 2]], force: impl Fn(f64) -> f64) -> String {
    let most = points.iter().fold(0.0f64, |most, [x, _]| most.max(*x));
    let line: Vec<(f64, f64)> = (0..=STEPS)
        .map(|k| most * k as f64 / STEPS as f64)
        .map(|x| (x, force(x)))
        .collect();
    let values = points.iter().map(|[_, y]| *y);
    let values = values.chain(line.iter().map(|(_, y)| *y));
    let [low, high] = values.fold([0.0f64, 0.0], |[low, high], y| [low.min(y), high.max(y)]);
    let mut axes = Axes::new(
        760.0,
        440.0,
        Scale::linear(0.0, most),
        Scale::linear(low, high),
        "displacement, mm",
        "force, mN",
    );
    axes.line(&line, colour(1), 2.0, false);
    for [x, y] in points {
        axes.disc(*x, *y, 3.0, colour(0), true, &format!("{x} mm: {y:.1} mN"));
    }
    axes.standalone(&[("measured", colour(0)), ("fitted", colour(1))])
}
