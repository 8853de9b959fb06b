//! The rows as a table: for the terminal, and for a document.

use super::row::Row;
use crate::table::{Column, Table, or_dash};
use picture::plot::label;

/// Column titles and the cell of a row.
pub const COLUMNS: &[Column<Row>] = &[
    ("method", |row| row.family()),
    ("configuration", |row| row.variant()),
    ("MSE mm²", |row| spread(row.mse_mm2, row.mse_std)),
    ("rel. L2", |row| label(row.relative_l2)),
    ("Hausdorff mm", |row| {
        or_dash(row.hausdorff_mm, |mean| {
            spread(mean, row.hausdorff_std.unwrap_or(0.0))
        })
    }),
    ("max mm", |row| spread(row.max_mm, row.max_std)),
    ("p50 ms", |row| label(row.ms_p50)),
    ("p95", |row| label(row.ms_p95)),
    ("p99", |row| label(row.ms_p99)),
    ("max", |row| label(row.ms_max)),
    ("first ms", |row| label(row.first_step_ms)),
    ("load s", |row| label(row.load_s)),
    ("MB", |row| label(row.memory_mb)),
    ("vs f32 mm", |row| or_dash(row.deviation, label)),
];

fn spread(mean: f64, deviation: f64) -> String {
    format!("{} ± {}", label(mean), label(deviation))
}

/// The rows for the terminal, names to the left, figures to the right.
pub fn text(rows: &[&Row]) -> String {
    Table::of(&[0, 1], COLUMNS, rows.iter().copied()).text()
}

const DOCUMENT: [Column<Row>; 6] = [
    ("method", in_words),
    ("threads", |row| row.threads.to_string()),
    ("MSE, mm²", |row| error(row, row.mse_mm2, row.mse_std)),
    ("largest error, mm", |row| {
        error(row, row.max_mm, row.max_std)
    }),
    ("ms a step (median)", |row| figure(row.ms_p50)),
    ("p99", |row| figure(row.ms_p99)),
];

/// Mean and deviation over the cases; the reference has none.
fn error(row: &Row, mean: f64, deviation: f64) -> String {
    match row.method.as_str() {
        "TLED" => "0".to_owned(),
        _ => format!("{} ± {}", figure(mean), figure(deviation)),
    }
}

/// A table of Markdown, rows by ascending time.
pub fn markdown(rows: &[&Row]) -> String {
    let mut rows = rows.to_vec();
    rows.sort_by(|a, b| a.ms_p50.total_cmp(&b.ms_p50));
    Table::of(&[0], &DOCUMENT, rows).markdown()
}

/// A row's method and configuration, as a document names them.
fn in_words(row: &Row) -> String {
    match (row.method.as_str(), row.bundle.as_str()) {
        ("surrogate", bundle) => {
            let nodes = match row.region.as_str() {
                "all" => "all nodes".to_owned(),
                region => format!("{region} only"),
            };
            let precision = match row.precision.as_str() {
                "f32" => String::new(),
                other => format!(", {other}"),
            };
            let corrections = match row.corrections.most {
                0 => String::new(),
                _ => format!(", k = {}", row.corrections),
            };
            format!("**libupt, `{bundle}`**, {nodes}{precision}{corrections}")
        }
        ("TLED", _) => "reference solver (TLED)".into(),
        (method, "") => method.to_owned(),
        (method, bundle) => format!("`{bundle}`, {method}"),
    }
}

/// Three significant digits.
fn figure(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        value if value.is_finite() => {
            let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.digits$}")
        }
        _ => "-".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_has_rows_by_time_and_three_digits() {
        let row = |method: &str, ms: f64| Row {
            method: method.into(),
            ms_p50: ms,
            ms_p99: f64::NAN,
            mse_mm2: 0.012345,
            max_mm: 245.3,
            threads: 2,
            ..Row::default()
        };
        let text = markdown(&[&row("TLED", 200.0), &row("predict zero", 0.5)]);
        let rows: Vec<&str> = text.lines().skip(2).collect();
        assert_eq!(
            rows,
            [
                "| predict zero | 2 | 0.0123 ± 0 | 245 ± 0 | 0.500 | - |",
                "| reference solver (TLED) | 2 | 0 | 0 | 200 | - |"
            ]
        );
    }
}
