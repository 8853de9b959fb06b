//! The rows as a table: for the terminal, for a page and for a document.

use super::row::{ALL, Row};
use crate::table::{Column, Table, or_dash};
use picture::plot::label;

/// Column titles and cells; the first three name the row.
pub const COLUMNS: &[Column<Row>] = &[
    ("method", |row| match row.bundle.as_str() {
        "" => row.drive.to_owned(),
        bundle => format!("{bundle}, {}", row.drive),
    }),
    ("k", |row| match row.bundle.as_str() {
        "" => "-".into(),
        _ => row.corrections.to_string(),
    }),
    ("programme", |row| row.programme.clone()),
    ("cases", |row| row.cases.to_string()),
    ("MSE mean, mm²", |row| label(row.mse_mean_mm2)),
    ("median", |row| label(row.mse_median_mm2)),
    ("slip-offs", |row| row.slips.to_string()),
    ("largest error, mm", |row| label(row.max_error_mm)),
    ("det F", |row| format!("{:.2}", row.min_det)),
    ("inverted", |row| percent(row.inverted)),
    ("silent", |row| percent(row.inverted_silent)),
    ("penetration, mm", |row| label(row.penetration_mm)),
    ("jump", |row| format!("{:.2}", row.jump_median)),
    ("force", |row| or_dash(row.force_error, percent)),
    ("torque", |row| or_dash(row.torque_error, percent)),
    ("friction", |row| {
        or_dash(row.friction_excess, |excess| match excess {
            excess if excess > 9.99 => "above 10".into(),
            excess => format!("{excess:+.2}"),
        })
    }),
    ("still, mm", |row| or_dash(row.still_beyond_mm, label)),
    ("found again", |row| row.found_again.to_string()),
    ("ms", |row| or_dash(row.ms_median, label)),
    ("contact ms", |row| or_dash(row.contact_ms_median, label)),
];

/// What the columns mean, for a page.
pub const MEANING: &str = "All methods get the poses of the tools and nothing else, each step from their own last state. \
MSE: mean over steps and nodes of the squared distance to the reference solver, mean and median over the cases, without the steps around \
a slip-off (the tissue of the truth leaves a tool that touches it faster than the tool moves, or a grasp tears off). det F: the smallest of any element in any step. \
Inverted: steps with an element inside out; silent: those of them without a flag. Penetration: the deepest of points 1 mm apart. Jump: the \
largest motion of a node in a step over the truth's largest (median of the cases). Force and torque: relative L2 error over the steps, \
median of the tools. Friction: the largest sum of tangential over normal force of a tool, less its coefficient. Still: the largest motion \
of a node in a step after the tools have not moved for 1 s, beyond the truth's where the truth was held as long. Found again: contacts that begin after one was lost and that the truth has not. \
ms: median of the steps in which a tool touches.";

fn percent(share: f64) -> String {
    match share {
        0.0 => "0".into(),
        share if share < 0.001 => format!("{:.2} %", 100.0 * share),
        share if share < 0.1 => format!("{:.1} %", 100.0 * share),
        share => format!("{:.0} %", 100.0 * share),
    }
}

/// Rows of one programme together, each in the order of the methods.
pub fn by_programme(rows: &[Row]) -> Vec<&Row> {
    let mut programmes: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| row.programme != ALL) {
        if !programmes.contains(&row.programme.as_str()) {
            programmes.push(&row.programme);
        }
    }
    let own = |programme| rows.iter().filter(move |row| row.programme == programme);
    programmes.into_iter().flat_map(own).collect()
}

/// The columns that a terminal has room for; the page has all.
const TERMINAL: [&str; 8] = [
    "method",
    "k",
    "programme",
    "MSE mean, mm²",
    "largest error, mm",
    "penetration, mm",
    "force",
    "ms",
];

/// The rows for the terminal, names to the left, figures to the right.
pub fn text(rows: &[Row]) -> String {
    let shown = COLUMNS.iter().filter(|column| TERMINAL.contains(&column.0));
    let shown: Vec<Column<Row>> = shown.copied().collect();
    Table::of(&[0, 2], &shown, rows).text()
}

/// The columns of a table that has to be narrow.
pub const FEW: &[Column<Row>] = &[
    ("method", |row| match row.bundle.as_str() {
        "" => row.drive.to_owned(),
        bundle => format!("`{bundle}`, {}", row.drive),
    }),
    ("k", |row| match row.bundle.as_str() {
        "" => "-".into(),
        _ => row.corrections.to_string(),
    }),
    ("MSE, mm² (median)", |row| label(row.mse_median_mm2)),
    ("worst programme", |row| label(row.mse_worst_programme_mm2)),
    ("force error", |row| or_dash(row.force_error, percent)),
    ("steps with an inverted element", |row| {
        percent(row.inverted)
    }),
    ("deepest in a tool, mm", |row| label(row.penetration_mm)),
    ("ms a step", |row| or_dash(row.ms_median, label)),
];
