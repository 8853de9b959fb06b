//! `cargo xtask readme`: the measured table of docs/results/README.md and the still picture of the documents, out of
//! `upt report` and `upt rollout`, and such tables on other pages.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::workspace::Workspace;
use crate::{ort, stages};

#[derive(Args)]
pub struct Options {
    /// report.json files of `upt report`, in the order in which they should appear.
    #[arg(long = "report", value_name = "FILE")]
    reports: Vec<PathBuf>,
    /// The page that takes their table, between its markers; from the repository's root.
    #[arg(long, value_name = "FILE", default_value = "docs/results/README.md")]
    page: PathBuf,
    /// Render docs/images/pushed-brain.png with this bundle ...
    #[arg(long, requires = "trajectory")]
    bundle: Option<PathBuf>,
    /// ... and this trajectory.
    #[arg(long)]
    trajectory: Option<PathBuf>,
}

const BEGIN: &str = "<!-- cargo xtask readme: begin -->";
const END: &str = "<!-- cargo xtask readme: end -->";

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    if !options.reports.is_empty() {
        let mut body = String::new();
        for path in &options.reports {
            body.push_str(&section(path)?);
        }
        let path = workspace.path(&options.page.to_string_lossy());
        let text = std::fs::read_to_string(&path)?;
        let (Some(start), Some(end)) = (text.find(BEGIN), text.find(END)) else {
            bail!(
                "{}: the markers `{BEGIN}` and `{END}` are missing",
                path.display()
            );
        };
        std::fs::write(
            &path,
            format!("{}{BEGIN}\n{body}{}", &text[..start], &text[end..]),
        )?;
        println!("{} written", path.display());
    }
    if let (Some(bundle), Some(trajectory)) = (&options.bundle, &options.trajectory) {
        let library = ort::host_library(workspace)?;
        stages::build(workspace)?;
        let picture = workspace.path("docs/images/pushed-brain.png");
        std::fs::create_dir_all(workspace.path("docs/images"))?;
        let mut command = Command::new(workspace.upt());
        command
            .arg("rollout")
            .arg(bundle)
            .arg(trajectory)
            .arg("--png")
            .arg(&picture);
        ort::set_environment(&mut command, &library);
        if !command.status()?.success() {
            bail!("upt rollout failed");
        }
        println!("{} written", picture.display());
    }
    Ok(true)
}

/// Corrections a step of a row: `5`, or `10@0.02` for at most 10, fewer where the estimated error is below 0.02 mm.
pub fn effort(row: &serde_json::Value) -> String {
    let most = row["corrections"].as_u64().unwrap_or(0);
    match row["corrections_target_mm"].as_f64() {
        // It was a float32.
        Some(target) => format!("{most}@{}", target as f32),
        None => most.to_string(),
    }
}

/// One report as a paragraph and a table, rows by ascending time.
fn section(path: &Path) -> Result<String> {
    let report: serde_json::Value = serde_json::from_slice(
        &std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?,
    )?;
    let text = |value: &serde_json::Value| value.as_str().unwrap_or("?").to_owned();
    let rows = report["rows"]
        .as_array()
        .context("report.json has no rows")?;
    let number = |row: &serde_json::Value, field: &str| row[field].as_f64().unwrap_or(f64::NAN);
    let cases = report["cases"].as_array().map_or(0, Vec::len);
    let mut out = format!(
        "{} held-out contacts of 8 s on {} nodes, boundary condition `{}`, replayed autoregressively; {}, {} cores, {}.\n\n",
        cases,
        report["mesh"]["nodes"],
        text(&report["mesh"]["boundary"]),
        text(&report["machine"]["cpu"]),
        report["machine"]["cores"],
        text(&report["date"])
    );
    out.push_str("| method | threads | MSE, mm² | largest error, mm | ms a step (median) | p99 |\n|---|---:|---:|---:|---:|---:|\n");
    let mut order: Vec<&serde_json::Value> = rows.iter().collect();
    order.sort_by(|a, b| number(a, "ms_p50").total_cmp(&number(b, "ms_p50")));
    for row in order {
        let bundle = text(&row["bundle"]);
        let method = match (text(&row["method"]).as_str(), bundle.as_str()) {
            ("surrogate", bundle) => {
                let nodes = if row["region"] == "all" {
                    "all nodes".to_owned()
                } else {
                    format!("{} only", text(&row["region"]))
                };
                let precision = if row["precision"] == "f32" {
                    String::new()
                } else {
                    format!(", {}", text(&row["precision"]))
                };
                let corrections = match effort(row).as_str() {
                    "0" => String::new(),
                    k => format!(", k = {k}"),
                };
                format!("**libupt, `{bundle}`**, {nodes}{precision}{corrections}")
            }
            ("TLED", _) => "reference solver (TLED)".into(),
            (method, "") => method.to_owned(),
            (method, bundle) => format!("`{bundle}`, {method}"),
        };
        let error = |field: &str| {
            if row["method"] == "TLED" {
                "0".into()
            } else {
                format!(
                    "{} ± {}",
                    figure(number(row, field)),
                    figure(number(
                        row,
                        &field.replace("_mm2", "_std").replace("max_mm", "max_std")
                    ))
                )
            }
        };
        let _ = writeln!(
            out,
            "| {method} | {} | {} | {} | {} | {} |",
            row["threads"],
            error("mse_mm2"),
            error("max_mm"),
            figure(number(row, "ms_p50")),
            figure(number(row, "ms_p99"))
        );
    }
    for note in report["left_out"].as_array().into_iter().flatten() {
        let _ = writeln!(out, "\nLeft out: {}", text(note));
    }
    out.push('\n');
    Ok(out)
}

/// Three significant digits.
fn figure(value: f64) -> String {
    if !value.is_finite() {
        return "-".into();
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_keep_three_digits() {
        assert_eq!(figure(0.012345), "0.0123");
        assert_eq!(figure(245.3), "245");
        assert_eq!(figure(f64::NAN), "-");
    }
}
