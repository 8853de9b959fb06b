//! `report`: a contact from simulation to page, and finished rows that are kept.

use std::path::Path;

use crate::{MESH, json, simulate, study};

/// Simulates a contact on the fixture's mesh, and writes a report twice.
#[test]
fn a_contact_goes_from_simulation_to_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let trajectory = simulate(folder.path(), MESH, &["--scheme", "1", "--seed", "3"]);
    let bundle = "tests/fixtures/tiny-upt";
    let rollout = json(&["rollout", bundle, &trajectory, "--json"]);
    let mse = rollout["overall"]["mse_mm2"].as_f64().unwrap();
    let out = path("report");
    let arguments = [
        "report",
        "--trajectory",
        &trajectory,
        "--bundle",
        bundle,
        "--out",
        &out,
        "--plain",
        "zero,linear,tled",
        "--threads",
        "1",
        "--json",
    ];
    let report = json(&arguments);
    let rows = report["rows"].as_array().unwrap();
    let row = |method: &str, region: &str| {
        rows.iter()
            .find(|row| row["method"] == method && row["region"] == region)
            .unwrap_or_else(|| panic!("no row {method}: {report}"))
    };
    // The same rollout by another command, and the region's rows are judged on all nodes.
    assert!((row("surrogate", "all")["mse_mm2"].as_f64().unwrap() - mse).abs() <= 1e-9 * mse);
    assert!((row("surrogate", "surface")["mse_mm2"].as_f64().unwrap() - mse).abs() <= 1e-6 * mse);
    assert_eq!(
        row("surrogate", "surface")["deviation"],
        0.0,
        "a region equals the full decode to the bit"
    );
    // The reference solver reproduces its own trajectory.
    assert_eq!(row("TLED", "all")["mse_mm2"], 0.0);
    let zero = row("predict zero", "all")["mse_mm2"].as_f64().unwrap();
    assert!(row("linear elastic", "all")["mse_mm2"].as_f64().unwrap() < zero);

    let page = std::fs::read_to_string(Path::new(&out).join("report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("data:image/png;base64,"));
    assert!(
        !page.contains("src=\"http") && !page.contains("href=\"http"),
        "the page must hold everything itself"
    );

    let stored = |folder: &str| -> Vec<std::time::SystemTime> {
        std::fs::read_dir(Path::new(folder).join("rows"))
            .unwrap()
            .map(|entry| entry.unwrap().metadata().unwrap().modified().unwrap())
            .collect()
    };
    let before = stored(&out);
    assert_eq!(
        json(&arguments)["rows"],
        report["rows"],
        "finished rows are kept"
    );
    assert_eq!(stored(&out), before);
}

#[test]
fn an_unknown_method_is_wrong_usage() {
    let output = study(&["report", "--plain", "nonsense"]);
    assert_eq!(output.status.code(), Some(2));
}
