//! `certificate.html`: the numbers as tables, and the organ coloured by its error, with the first held-out contact playing.

use std::path::Path;

use anyhow::Result;
use serde_json::Value;
use tissue::mesh::Mesh;

use page::Content;

/// Writes the page.
pub fn write(
    path: &Path,
    certificate: &Value,
    mesh: &Mesh,
    node_errors: &[f32],
    film: &Value,
    facts: &[(String, String)],
) -> Result<()> {
    let number = |value: &Value| match value.as_f64() {
        Some(x) if x != 0.0 && (x.abs() < 1e-2 || x.abs() >= 1e4) => format!("{x:.2e}"),
        Some(x) => format!("{x:.3}"),
        None => "-".to_owned(),
    };
    let verdict = certificate["verdict"]["text"].as_str().unwrap_or_default();
    let mut rows = vec![("verdict".to_owned(), verdict.to_owned())];
    rows.extend_from_slice(facts);
    let mut add = |name: &str, value: String| rows.push((name.to_owned(), value));
    for (name, part) in [
        ("in contact", &certificate["contact"]),
        ("after release", &certificate["free"]),
    ] {
        add(&format!("error {name}, mm²"), number(&part["mse_mm2"]));
        add(
            &format!("linear elasticity {name}, mm²"),
            number(&part["linear_mse_mm2"]),
        );
        add(&format!("largest {name}, mm"), number(&part["max_mm"]));
    }
    add(
        "worst region over the mean",
        number(&certificate["worst_region_over_mean"]),
    );
    add("error of the force", number(&certificate["force_error"]));
    add(
        "ms a step, median and p99",
        format!(
            "{}, {}",
            number(&certificate["speed"]["ms_median"]),
            number(&certificate["speed"]["ms_p99"])
        ),
    );
    if let Some(factor) = certificate["tool_sizes"]["factor"].as_f64() {
        add("tools, of the table's sizes", factor.to_string());
    }
    for row in certificate["tools"].as_array().into_iter().flatten() {
        add(
            &format!(
                "tool {}, mm²",
                row["programme"].as_str().unwrap_or_default()
            ),
            number(&row["mse_mm2"]),
        );
    }
    add("held-out cases", certificate["tested"]["cases"].to_string());
    add(
        "deepest push, mm",
        number(&certificate["envelope"]["max_push_mm"]),
    );
    for (at, region) in certificate["regions"]
        .as_array()
        .into_iter()
        .flatten()
        .enumerate()
    {
        if region["steps"].as_u64().unwrap_or(0) > 0 {
            add(
                &format!("region {}, mm² (steps)", at + 1),
                format!("{} ({})", number(&region["mse_mm2"]), region["steps"]),
            );
        }
    }
    page::write(
        path,
        &Content {
            mesh,
            node_errors: Some(node_errors),
            facts: &rows,
            film,
            pick: false,
        },
    )
}
