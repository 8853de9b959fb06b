//! `report --tools`: from simulated tools to rows and a page, and what is refused.

use crate::{MESH, json, simulate, study, told};

const BUNDLE: &str = "tests/fixtures/tiny-corrected";
const NAME: &str = "tiny-reduced";

#[test]
fn tools_are_driven_by_poses_and_measured() {
    let folder = tempfile::tempdir().unwrap();
    let press = simulate(folder.path(), MESH, &["--tool", "press"]);
    let lift = simulate(folder.path(), MESH, &["--tool", "lift"]);
    let out = folder.path().join("out");
    let page = folder.path().join("page.md");
    let report = json(&[
        "report",
        "--tools",
        &press,
        "--tools",
        &lift,
        "--bundle",
        BUNDLE,
        "--corrections",
        "0,2",
        "--out",
        out.to_str().unwrap(),
        "--json",
    ]);
    let rows = report["rows"].as_array().unwrap();
    let of = |bundle: &str, programme: &str| -> Vec<&serde_json::Value> {
        let fits =
            |row: &&serde_json::Value| row["bundle"] == bundle && row["programme"] == programme;
        rows.iter().filter(fits).collect()
    };
    let truth = of("", "press");
    assert_eq!(truth.len(), 1);
    assert_eq!(truth[0]["mse_mean_mm2"], 0.0);
    assert!(truth[0]["min_det"].as_f64().unwrap() > 0.0);
    for programme in ["press", "lift", "all but grasp"] {
        let own = of(NAME, programme);
        assert!(own.len() >= 2, "{programme}: {} rows", own.len());
        for row in own {
            assert!(row["mse_mean_mm2"].as_f64().unwrap().is_finite(), "{row}");
            assert!(row["penetration_mm"].as_f64().unwrap() >= 0.0, "{row}");
        }
    }
    let html = std::fs::read_to_string(out.join("tools.html")).unwrap();
    // The dent of each case by each method, and a force a tool.
    assert!(html.matches("<svg").count() >= 2 * 2 + 2);
    assert!(html.contains("reference solver") && html.contains("press, press"));
    // The first case plays, with a pose of its tool for each frame.
    let (_, tools) = html.split_once("&quot;tools&quot;:[{").unwrap();
    assert!(tools.contains("&quot;poses&quot;:[["));

    let marked = "before\n<!-- begin: study report --tools box -->\n<!-- end: study report --tools box -->\nafter\n";
    std::fs::write(&page, marked).unwrap();
    let output = study(&[
        "report",
        "--tools",
        &press,
        "--bundle",
        BUNDLE,
        "--out",
        out.to_str().unwrap(),
        "--markdown",
        page.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", told(&output));
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.starts_with("before\n") && text.ends_with("after\n"));
    assert!(text.contains(&format!("| {NAME}, ")), "{text}");
}

#[test]
fn cases_that_cannot_be_measured_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let refused = |arguments: &[&str], words: &[&str]| {
        let output = study(&[&["report", "--out", out], arguments].concat());
        let message = told(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
    };
    let plain = simulate(folder.path(), MESH, &["--scheme", "5"]);
    refused(
        &["--tools", &plain, "--bundle", BUNDLE],
        &["has no tools", "--tool NAME"],
    );
    let press = simulate(folder.path(), MESH, &["--tool", "press"]);
    let stiff = &simulate(folder.path(), MESH, &["--tool", "press", "--young", "5000"]);
    refused(
        &["--tools", stiff, "--bundle", BUNDLE],
        &["E = 3000 Pa", "have E = 5000 Pa", "--young"],
    );
    refused(
        &["--tools", &press, "--tools", stiff, "--bundle", BUNDLE],
        &["its tissue is not the first case's"],
    );
    refused(
        &["--tools", &press, "--bundle", "onnx/brain-coarse-reduced"],
        &["a mesh other than", "brain-coarse-reduced"],
    );
    refused(
        &[
            "--tools",
            folder.path().to_str().unwrap(),
            "--bundle",
            BUNDLE,
        ],
        &["manifest.json"],
    );
    let data = folder.path().join("data");
    let data = data.to_str().unwrap();
    let output = study(&[
        "dataset", "--mesh", MESH, "--tools", "press", "--count", "1", "--out", data,
    ]);
    assert!(output.status.success(), "{}", told(&output));
    refused(
        &["--tools", data, "--bundle", BUNDLE],
        &["no finished case of the split `test`", "--split"],
    );
    let output = study(&[
        "report", "--tools", data, "--split", "all", "--bundle", BUNDLE, "--out", out,
    ]);
    assert!(output.status.success(), "{}", told(&output));
}

#[test]
fn random_tools_are_compared_with_the_solver() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.md");
    let name = format!("study compare --tools {NAME}");
    let marked = format!("<!-- begin: {name} -->\n<!-- end: {name} -->\n");
    std::fs::write(&page, marked).unwrap();
    let output = study(&[
        "compare",
        "--bundle",
        BUNDLE,
        "--steps",
        "0",
        "--tools",
        "2",
        "--markdown",
        page.to_str().unwrap(),
    ]);
    // 1: the command ran and found a growing error, which two cases of a tiny bundle do not tell.
    assert!(output.status.code() < Some(2), "{}", told(&output));
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(
        text.contains("| press | ") && text.contains("| probe | "),
        "{text}"
    );
}

#[test]
fn a_press_held_deep_at_the_edge_of_a_lobe_stays_where_the_solver_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let organ = "onnx/liver-coarse/mesh.safetensors";
    let load = "--tool press --seed 1 --young 5000 --density 1060";
    let load: Vec<&str> = load.split(' ').collect();
    let file = simulate(folder.path(), organ, &load);
    let asked = "--bundle onnx/liver-coarse --corrections 3,30 --json";
    let asked: Vec<&str> = asked.split(' ').collect();
    let report = json(&[&["report", "--tools", &file][..], &asked].concat());
    let methods = report["methods"].as_array().unwrap().iter();
    let is_solved = |method: &&serde_json::Value| {
        let name = method["method"].as_str().unwrap_or_default();
        name.starts_with("liver, contact solved")
    };
    let solved: Vec<_> = methods.filter(is_solved).collect();
    assert_eq!(solved.len(), 2);
    for method in solved {
        // Until the tool draws back. Before the iterations reached farther: 0.9 mm², the tissue had slipped aside by 7 mm.
        let errors = method["cases"][0]["mse_by_step_mm2"].as_array().unwrap();
        for (step, error) in errors.iter().take(36).enumerate() {
            assert!(error.as_f64().unwrap() < 0.02, "step {step}: {error} mm²");
        }
    }
}
