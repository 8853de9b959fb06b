//! The demo's tables, from the rows of a report.

use std::path::Path;

use anyhow::{Context, Result};

use crate::readme::effort;

/// Error, penetration, force and time from the rows of a report by tools.
pub fn print_tool_table(path: &Path) -> Result<()> {
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(path)?)?;
    let rows = report["rows"]
        .as_array()
        .context("tools.json has no rows")?;
    println!();
    println!(
        "{:<58} {:>7} {:>10} {:>8} {:>8} {:>10} {:>10}",
        "from the tool's pose alone", "k", "MSE mm²", "max mm", "deep mm", "force", "ms touched"
    );
    for row in rows {
        let text = |field: &str| row[field].as_str().unwrap_or("");
        let number = |field: &str| row[field].as_f64();
        let method = match (text("bundle"), text("drive")) {
            ("", _) => "reference solver".to_owned(),
            (bundle, drive) => format!("{bundle}, {drive}"),
        };
        let told = |field: &str, digits: usize| {
            number(field).map_or("-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let force = number("force_error").map_or("-".to_owned(), |error| {
            format!("{:.1} % off", 100.0 * error)
        });
        println!(
            "{method:<58} {:>7} {:>10} {:>8} {:>8} {force:>10} {:>10}",
            effort(row),
            told("mse_mean_mm2", 5),
            told("max_error_mm", 2),
            told("penetration_mm", 2),
            told("ms_median", 2),
        );
    }
    for note in report["left_out"].as_array().into_iter().flatten() {
        println!("left out: {}", note.as_str().unwrap_or("?"));
    }
    println!();
    Ok(())
}

/// Error, time and speed-up over the reference solver, from the rows of a report.
pub fn print_table(path: &Path) -> Result<()> {
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(path)?)?;
    let rows = report["rows"]
        .as_array()
        .context("report.json has no rows")?;
    let number = |row: &serde_json::Value, field: &str| row[field].as_f64().unwrap_or(f64::NAN);
    let reference = rows
        .iter()
        .filter(|row| row["method"] == "TLED")
        .map(|row| number(row, "ms_p50"))
        .fold(f64::INFINITY, f64::min);
    println!();
    println!(
        "{:<38} {:<26} {:>10} {:>8} {:>10} {:>12}",
        "method", "configuration", "MSE mm²", "max mm", "ms a step", "x reference"
    );
    for row in rows {
        let text = |field: &str| row[field].as_str().unwrap_or("?");
        let method = match (text("method"), text("bundle")) {
            ("surrogate", bundle) => match effort(row).as_str() {
                "0" => bundle.to_owned(),
                k => format!("{bundle}, k = {k}"),
            },
            (method, "") => method.to_owned(),
            (method, bundle) => format!("{bundle}, {method}"),
        };
        let configuration = format!(
            "{} {}, {} thread(s)",
            row["precision"].as_str().unwrap_or(""),
            row["region"].as_str().unwrap_or(""),
            row["threads"]
        );
        let speed = reference / number(row, "ms_p50");
        let speed = if speed.is_finite() && speed < 1e6 {
            format!("{speed:.1}")
        } else {
            "-".into()
        };
        println!(
            "{method:<38} {configuration:<26} {:>10.4} {:>8.2} {:>10.3} {speed:>12}",
            number(row, "mse_mm2"),
            number(row, "max_mm"),
            number(row, "ms_p50")
        );
    }
    for note in report["left_out"].as_array().into_iter().flatten() {
        println!("left out: {}", note.as_str().unwrap_or("?"));
    }
    println!();
    Ok(())
}
