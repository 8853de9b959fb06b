//! `report.json`: the rows of every provider and of PyTorch, the bars, the floor, and what was not measured.

use std::path::Path;

use serde_json::{Value, json};

/// A row of docs/results/performance.md, "Graphics cards": name, bundle, K from and to, bar and goal in ms.
type Bar = (&'static str, &'static str, [u64; 2], f64, f64);
const MID: [u64; 2] = [20_000, 24_000];
const FINE: [u64; 2] = [140_000, 160_000];
const BARS: [Bar; 4] = [
    ("paper, K = 21,670, all nodes", "paper", MID, 3.0, 1.0),
    ("fast, K = 21,670, all nodes", "brain-fast", MID, 1.0, 0.4),
    ("paper, K = 151,201", "paper-fine", FINE, 8.0, 3.0),
    (
        "reduced, K = 21,670, all nodes",
        "brain-reduced",
        MID,
        0.3,
        0.1,
    ),
];
/// Bar and goal against PyTorch eager, times.
const AGAINST_PYTORCH: (f64, f64) = (3.0, 8.0);
/// The machine's line of `rows-torch.json`.
const RATES: &str = "card";

pub fn write(folder: &Path) -> Result<(), String> {
    let (mut rows, mut missing, mut rates) = (Vec::new(), Vec::new(), Value::Null);
    let text = |path: &Path| {
        std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
    };
    let listing = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<_> = listing.flatten().map(|entry| entry.path()).collect();
    files.sort();
    for path in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if !name.starts_with("rows-") || !name.ends_with(".json") {
            continue;
        }
        let part: Value = serde_json::from_str(&text(&path)?)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        rows.extend(part["rows"].as_array().cloned().unwrap_or_default());
        missing.extend(part["not_measured"].as_array().cloned().unwrap_or_default());
        if !part[RATES].is_null() {
            rates = part[RATES].clone();
        }
    }
    if rows.is_empty() && missing.is_empty() {
        return Err(format!("{}: no rows-*.json", folder.display()));
    }
    // Written by run.sh where a process ended badly or was not started: `what: why`, a line each.
    for line in text(&folder.join("missing")).unwrap_or_default().lines() {
        let (what, why) = line.split_once(": ").unwrap_or((line, ""));
        missing.push(json!({"what": what, "why": why}));
    }
    missing.push(json!({"what": "TLED step on the card", "why": "there is no CUDA port of the reference solver"}));
    for row in &mut rows {
        if let Some(floor) = floor(row, &rates) {
            row["floor_ms"] = json!(floor);
        }
    }
    let report = json!({
        "card": rates,
        "bars": bars(&rows),
        "rows": rows,
        "not_measured": missing,
    });
    let out = folder.join("report.json");
    let pretty = format!("{report:#}\n");
    std::fs::write(&out, pretty).map_err(|error| format!("{}: {error}", out.display()))
}

/// FLOP over the card's rate or bytes over its bandwidth, the longer, ms; for rows of a card only.
fn floor(row: &Value, rates: &Value) -> Option<f64> {
    let on_card = row["provider"].as_str().is_some_and(|name| name != "cpu");
    let (flops, bytes) = (row["flops"].as_f64()?, row["bytes"].as_f64()?);
    let (gemm, copy) = (rates["gflops"].as_f64()?, rates["gb_s"].as_f64()?);
    on_card.then(|| (1e-6 * flops / gemm).max(1e-6 * bytes / copy))
}

/// The fastest float32 row of a card, all nodes, one scene.
fn best<'a>(rows: &'a [Value], bundle: &str, nodes: [u64; 2], rival: bool) -> Option<&'a Value> {
    let fits = |row: &&Value| {
        let k = row["node_count"].as_u64().unwrap_or(0);
        let is_rival = row["variant"].as_str() == Some("PyTorch eager");
        let of_ours = row["step_path"].is_string()
            && row["precision"] == "f32"
            && row["variant"] != "as chosen, TF32";
        row["bundle"] == bundle
            && (nodes[0]..nodes[1]).contains(&k)
            && row["provider"] != "cpu"
            && row["nodes"] == "all"
            && row["scenes"] == 1
            && if rival { is_rival } else { of_ours }
    };
    let p50 = |row: &Value| row["p50_ms"].as_f64().unwrap_or(f64::INFINITY);
    rows.iter()
        .filter(fits)
        .min_by(|a, b| p50(a).total_cmp(&p50(b)))
}

/// The table's rows; `measured` is null where nothing ran on a card.
fn bars(rows: &[Value]) -> Vec<Value> {
    let reached = |good: bool, best: bool| match (best, good) {
        (true, _) => "goal",
        (false, true) => "bar",
        _ => "missed",
    };
    let mut table: Vec<Value> = BARS
        .iter()
        .map(|&(name, bundle, nodes, bar, goal)| {
            let ms = best(rows, bundle, nodes, false).and_then(|row| row["p50_ms"].as_f64());
            json!({
                "row": name, "unit": "ms", "bar": bar, "goal": goal, "measured": ms,
                "reached": ms.map(|ms| reached(ms <= bar, ms <= goal)),
            })
        })
        .collect();
    let (bar, goal) = AGAINST_PYTORCH;
    let times = best(rows, "paper", MID, true)
        .and_then(|rival| rival["p50_ms"].as_f64())
        .zip(best(rows, "paper", MID, false).and_then(|ours| ours["p50_ms"].as_f64()))
        .map(|(rival, ours)| rival / ours);
    table.push(json!({
        "row": "against PyTorch eager on the same card", "unit": "times", "bar": bar, "goal": goal,
        "measured": times, "reached": times.map(|x| reached(x >= bar, x >= goal)),
    }));
    table
}
