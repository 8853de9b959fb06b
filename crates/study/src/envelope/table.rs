//! What was measured, as a document's table: the limits, and errors by size, depth, speed and number of the tools.

use tissue::programmes::ToolProgramme;

use super::limits::{Limits, Tried};
use crate::table::{Table, or_dash};
use gauge::{Sorted, median};
use host::Effort;
use picture::plot::label;
use upt_cli::counted::counted;

/// A range of one quantity.
type Part = (&'static str, fn(&Tried) -> bool);

const PARTS: &[Part] = &[
    ("tools up to 3 mm", |case| case.size_mm[0] <= 3.0),
    ("3 to 6 mm", |case| {
        case.size_mm[0] > 3.0 && case.size_mm[0] <= 6.0
    }),
    ("above 6 mm", |case| case.size_mm[0] > 6.0),
    ("up to 5 mm deep", |case| case.depth_mm <= 5.0),
    ("5 to 10 mm deep", |case| {
        case.depth_mm > 5.0 && case.depth_mm <= 10.0
    }),
    ("deeper", |case| case.depth_mm > 10.0),
    ("up to 25 mm/s", |case| case.speed_mm_s <= 25.0),
    ("25 to 75 mm/s", |case| {
        case.speed_mm_s > 25.0 && case.speed_mm_s <= 75.0
    }),
    ("faster", |case| case.speed_mm_s > 75.0),
    ("one tool", |case| case.count == 1),
    ("more tools at once", |case| case.count > 1),
];

/// The tables of one bundle.
pub fn markdown(
    bundle: &str,
    corrections: Effort,
    limit_mm2: f64,
    cases: &[Tried],
    limits: &Limits,
) -> String {
    let [inside, bad] = limits.count(cases);
    let [low, high] = limits.size_mm;
    let mut out = format!(
        "`{bundle}` with k = {corrections} is good for {} of half the smallest extent (the radius of a rod) {low:.1} to {high:.1} mm that \
         push the tissue up to {:.1} mm and move at up to {:.0} mm/s: {} of {inside} such cases stay below {} mm² without an inverted element \
         ({} measured).\n\n",
        match limits.count {
            1 => "one tool".to_owned(),
            count => format!("up to {count} tools"),
        },
        limits.depth_mm,
        limits.speed_mm_s,
        inside - bad,
        label(limit_mm2),
        counted(cases.len(), "case")
    );
    let titles = "cases; number; MSE median, mm²; worst; force, median; good";
    let mut table = Table::new(&[0], titles);
    let mut add = |name: &str, own: Vec<&Tried>| {
        if own.is_empty() {
            return;
        }
        let mse = Sorted::of(own.iter().map(|case| case.mse_mm2));
        let force = median(own.iter().filter_map(|case| case.force_error));
        let force = (!force.is_nan()).then_some(100.0 * force);
        let good = own.iter().filter(|case| case.good).count();
        table.push([
            name.into(),
            own.len().to_string(),
            label(mse.median()),
            label(mse.largest()),
            or_dash(force, |force| format!("{force:.1} %")),
            good.to_string(),
        ]);
    };
    add(
        "inside the limits",
        cases.iter().filter(|case| limits.holds(case)).collect(),
    );
    add(
        "outside",
        cases.iter().filter(|case| !limits.holds(case)).collect(),
    );
    for (name, is) in PARTS {
        add(name, cases.iter().filter(|case| is(case)).collect());
    }
    // What a hand does by mistake, and points finer than the mesh: whether the limits hold it is said by name.
    let mut unknown = Vec::new();
    for programme in ToolProgramme::every().filter(|one| one.specification().extreme) {
        let name = programme.name();
        let own: Vec<&Tried> = cases.iter().filter(|case| case.programme == name).collect();
        if own.is_empty() {
            unknown.push(name);
        }
        let inside = own.iter().filter(|case| limits.holds(case)).count();
        let row = format!(
            "programme `{name}`, {inside} of {} inside the limits",
            own.len()
        );
        add(&row, own);
    }
    out += &table.markdown();
    if !unknown.is_empty() {
        out += &format!(
            "\nNot measured: {}; `upt dataset --tools {}` makes cases.\n",
            unknown.join(", "),
            unknown.join(",")
        );
    }
    out
}
