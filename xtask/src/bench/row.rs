//! A measured figure: read from a bench's output, judged against its bar, written as a table.

use std::fmt::Write;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

/// A measured figure. `ratio` is how many times faster than `against`, in the same run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    pub name: String,
    pub value: Option<f64>,
    pub unit: Option<String>,
    pub against: Option<String>,
    pub ratio: Option<f64>,
    pub error: Option<f64>,
    pub bar: Option<f64>,
    pub goal: Option<f64>,
}

/// The rows among a bench's output.
pub fn rows(text: &str) -> Result<Vec<Row>> {
    text.lines()
        .filter_map(|line| line.trim().strip_prefix("ROW "))
        .map(|json| serde_json::from_str(json).with_context(|| format!("not a row: {json}")))
        .collect()
}

/// What a bench says that it did not measure, and why.
pub fn left_out(text: &str) -> Vec<&str> {
    text.lines()
        .filter_map(|line| line.trim().split_once("left out: "))
        .map(|(_, reason)| reason)
        .collect()
}

fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "-".into();
    };
    match value.abs() {
        0.0 => format!("{value:.3}"),
        size if !(1e-3..1e6).contains(&size) => format!("{value:.1e}"),
        size if size < 1.0 => format!("{value:.3}"),
        size if size < 10.0 => format!("{value:.2}"),
        size if size < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// Whether the bar is met, where the row has one. A bar on a ratio ("x") is a lower limit, all others are upper limits.
fn verdict(row: &Row) -> &'static str {
    let (Some(value), Some(bar)) = (row.value, row.bar) else {
        return "";
    };
    let within = |limit: f64| match row.unit.as_deref() {
        Some("x" | "times") => value >= limit,
        _ => value <= limit,
    };
    match (within(bar), row.goal.is_some_and(within)) {
        (_, true) => "goal",
        (true, false) => "bar",
        (false, false) => "missed",
    }
}

pub fn table(rows: &[Row]) -> String {
    let mut out = String::from(
        "| | value | against | times faster | error | bar | goal | reached |\n|---|---:|---|---:|---:|---:|---:|---|\n",
    );
    for row in rows {
        let text = |text: &Option<String>| text.clone().unwrap_or_default();
        let value = format!("{} {}", number(row.value), text(&row.unit));
        let numbers = [row.ratio, row.error, row.bar, row.goal]
            .map(number)
            .join(" | ");
        let (name, value, against) = (&row.name, value.trim(), text(&row.against));
        let _ = writeln!(
            out,
            "| {name} | {value} | {against} | {numbers} | {} |",
            verdict(row)
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_among_other_output_and_judged() {
        let text = "warming up\nROW {\"name\":\"step\",\"value\":7.9,\"unit\":\"ms\",\"against\":null,\"ratio\":null,\"error\":1e-7,\"bar\":10,\"goal\":5}\nROW {\"name\":\"gain\",\"value\":3.2,\"unit\":\"x\",\"bar\":1.6,\"goal\":3}\n";
        let rows = rows(text).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!((verdict(&rows[0]), verdict(&rows[1])), ("bar", "goal"));
        assert!(table(&rows).contains("| step | 7.90 ms |"));
        assert!(super::rows("ROW {\"nam\":1}").is_err());
        assert_eq!(
            left_out("fast: left out: the floor\nleft over"),
            ["the floor"]
        );
    }
}
