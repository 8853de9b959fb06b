//! What `upt-study compare` writes, as Markdown.

use std::fmt::Write;

use super::observer::{ForceError, Moment, Series, Share};
use super::rank::spearman;
use super::replay::Group;
use super::{CASE, HELD, Release};
use crate::table::Table;

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0f64), |(sum, count), v| (sum + v, count + 1.0));
    sum / count.max(1.0)
}

fn most(moments: &[Moment], value: impl Fn(&Moment) -> f64) -> f64 {
    moments.iter().map(value).fold(0.0, f64::max)
}

/// Relative L2 error over all steps that have one, percent.
fn percent(shares: impl Iterator<Item = Share>) -> f64 {
    let sum = shares.fold(Share::default(), |sum, share| Share {
        wrong: sum.wrong + share.wrong,
        all: sum.all + share.all,
    });
    100.0 * (sum.wrong / sum.all.max(f64::MIN_POSITIVE)).sqrt()
}

/// The two cells `force: nodes, sum` and `by elements: nodes, sum`.
fn forces(moments: &[Moment]) -> [String; 2] {
    let cell = |error: fn(&Moment) -> Option<ForceError>| {
        let errors = || moments.iter().filter_map(error);
        let nodal = percent(errors().map(|e| e.nodal));
        let sum = percent(errors().map(|e| e.sum));
        format!("{nodal:.0}, {sum:.0} %")
    };
    [cell(|m| m.force), cell(|m| m.element_force)]
}

/// A row a scheme; true when the later half of the cases is no worse than 1.5 times the first.
pub fn schemes(text: &mut String, moments: &[Moment]) -> bool {
    let mut table = Table::new(
        &[0],
        "steps; scheme; MSE, mm²; largest error, mm; largest |u| of the solver, mm; of the bundle, mm; \
         force: nodes, sum; by elements: nodes, sum",
    );
    for (case, block) in moments.chunks(CASE).enumerate() {
        let [force, element_force] = forces(block);
        table.push([
            format!("{} to {}", case * CASE + 1, case * CASE + block.len()),
            (case % 5 + 1).to_string(),
            format!("{:.4}", mean(block.iter().map(|m| m.mse))),
            format!("{:.2}", most(block, |m| m.largest_error)),
            format!("{:.2}", most(block, |m| m.true_size)),
            format!("{:.2}", most(block, |m| m.size)),
            force,
            element_force,
        ]);
    }
    text.push_str(&table.markdown());
    let half = moments.len() / CASE / 2 * CASE;
    let first = mean(moments[..half].iter().map(|m| m.mse));
    let later = mean(moments[half..].iter().map(|m| m.mse));
    let _ = writeln!(
        text,
        "\nMSE over the first {half} steps {first:.4} mm², over the rest {later:.4} mm².\n"
    );
    later <= 1.5 * first
}

pub fn release(text: &mut String, release: &Release) {
    let asleep = match release.asleep {
        Some(step) => {
            let m = &release.moments[step - 1];
            format!(
                "the scene sleeps {} steps after the release, where the solver's largest |u| is {:.4} mm",
                step - HELD,
                m.true_size
            )
        }
        None => format!(
            "the scene does not fall asleep within {} steps",
            release.moments.len() - HELD
        ),
    };
    let _ = writeln!(text, "After a release: {asleep}.\n");
}

/// Cases from disk, a row a scheme.
pub fn cases(text: &mut String, inside: &[Group], outside: &[Group]) {
    let mut table = Table::new(
        &[0],
        "held-out cases; steps; MSE, mm²; largest error, mm; steps with a flag; refused; \
         force: nodes, sum; by elements: nodes, sum",
    );
    for group in inside.iter().chain(outside) {
        let moments = &group.moments;
        let [force, element_force] = forces(moments);
        table.push([
            format!("{} of scheme {}", group.cases, group.scheme),
            moments.len().to_string(),
            format!("{:.4}", mean(moments.iter().map(|m| m.mse))),
            format!("{:.2}", most(moments, |m| m.largest_error)),
            moments.iter().filter(|m| m.flags != 0).count().to_string(),
            moments.iter().filter(|m| m.refused).count().to_string(),
            force,
            element_force,
        ]);
    }
    text.push_str(&table.markdown());
    text.push('\n');
}

/// Spearman's rank correlation of each warning with the true error.
pub fn ranks(text: &mut String, inside: &[Moment], outside: &[Moment]) {
    let warnings: [Series; 4] = [
        ("`indicator` of the statistics (envelope ratio)", |m| {
            m.ratio
        }),
        ("any flag", |m| f64::from(u8::from(m.alarmed()))),
        ("force residual at free nodes, mN (RMS)", |m| m.residual),
        ("residual over the reaction", |m| {
            m.residual / m.reaction.max(1e-3)
        }),
    ];
    let touching = |moments: &[Moment]| -> Vec<Moment> {
        moments.iter().filter(|m| m.touching).cloned().collect()
    };
    let alarms = inside.iter().filter(|m| m.alarmed()).count();
    let steps = inside.len();
    let (inside, outside) = (touching(inside), touching(outside));
    let both: Vec<Moment> = inside.iter().chain(&outside).cloned().collect();
    let _ = writeln!(
        text,
        "False alarms: {alarms} of {steps} steps inside the envelope. Rank correlation (Spearman) of a warning with the largest \
         error of the step, over {} steps in contact inside, {} outside, and both:\n",
        inside.len(),
        outside.len()
    );
    let mut table = Table::new(&[0], "warning; inside; outside; both");
    for (name, warning) in warnings {
        let rank = |set: &[Moment]| {
            let a: Vec<f64> = set.iter().map(warning).collect();
            let b: Vec<f64> = set.iter().map(|m| m.largest_error).collect();
            spearman(&a, &b).map_or_else(|| "constant".into(), |rank| format!("{rank:.2}"))
        };
        table.push([name.into(), rank(&inside), rank(&outside), rank(&both)]);
    }
    text.push_str(&table.markdown());
    let error = |alarmed: bool| {
        let set = both.iter().filter(|m| m.alarmed() == alarmed);
        mean(set.map(|m| m.largest_error))
    };
    let _ = writeln!(
        text,
        "\nMean of the largest error: {:.2} mm over steps without a flag, {:.2} mm over steps with one.\n",
        error(false),
        error(true)
    );
}

/// Attached points against the interpolation of the nodes around them.
pub fn points(text: &mut String, moments: &[Moment]) {
    let rms = |value: fn(&Moment) -> f64| mean(moments.iter().map(value)).sqrt();
    let _ = writeln!(
        text,
        "Attached points (middles of surface edges): as attached they are {:.4} mm (RMS; at most {:.3} mm) from the mean of \
         the edge's nodes; {:.4} mm (RMS) from the solver, the mean {:.4} mm. At a node a point is {:.4} mm (RMS; at most \
         {:.3} mm) from the node.",
        rms(|m| m.points.difference),
        most(moments, |m| m.points.largest_difference),
        rms(|m| m.points.decoded),
        rms(|m| m.points.interpolated),
        rms(|m| m.points.at_nodes),
        most(moments, |m| m.points.largest_at_nodes)
    );
}
