//! The report as a table for the terminal.

use super::plot::label;
use super::row::Row;

/// What a column shows of a row.
type Cell = fn(&Row) -> String;

/// Column titles and the cell of a row.
pub const COLUMNS: &[(&str, Cell)] = &[
    ("method", |row| row.family()),
    ("configuration", |row| row.variant()),
    ("MSE mm²", |row| spread(row.mse_mm2, row.mse_std)),
    ("rel. L2", |row| label(row.relative_l2)),
    ("Hausdorff mm", |row| {
        row.hausdorff_mm.map_or_else(
            || "-".into(),
            |mean| spread(mean, row.hausdorff_std.unwrap_or(0.0)),
        )
    }),
    ("max mm", |row| spread(row.max_mm, row.max_std)),
    ("p50 ms", |row| label(row.ms_p50)),
    ("p95", |row| label(row.ms_p95)),
    ("p99", |row| label(row.ms_p99)),
    ("max", |row| label(row.ms_max)),
    ("first ms", |row| label(row.first_step_ms)),
    ("load s", |row| label(row.load_s)),
    ("MB", |row| label(row.memory_mb)),
    ("vs f32 mm", |row| {
        row.deviation.map_or_else(|| "-".into(), label)
    }),
];

fn spread(mean: f64, deviation: f64) -> String {
    format!("{} ± {}", label(mean), label(deviation))
}

/// Aligned columns; the first two to the left, figures to the right.
pub fn text(rows: &[&Row]) -> String {
    let mut lines: Vec<Vec<String>> =
        vec![COLUMNS.iter().map(|column| column.0.to_owned()).collect()];
    lines.extend(
        rows.iter()
            .map(|row| COLUMNS.iter().map(|column| (column.1)(row)).collect()),
    );
    let widths: Vec<usize> = (0..COLUMNS.len())
        .map(|column| {
            lines
                .iter()
                .map(|line| line[column].chars().count())
                .max()
                .unwrap_or(0)
        })
        .collect();
    let mut out = String::new();
    for line in lines {
        let cells: Vec<String> = line
            .iter()
            .enumerate()
            .map(|(column, cell)| {
                let space = " ".repeat(widths[column] - cell.chars().count());
                if column < 2 {
                    format!("{cell}{space}")
                } else {
                    format!("{space}{cell}")
                }
            })
            .collect();
        out.push_str(cells.join("  ").trim_end());
        out.push('\n');
    }
    out
}
