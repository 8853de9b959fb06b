//! `envelope`: limits of tools from simulated cases, into the manifest; what is refused leaves the bundle alone.

use std::path::Path;

use crate::{MESH, study, told};

fn simulate(folder: &Path, programme: &str) -> String {
    crate::simulate(folder, MESH, &["--tool", programme])
}

#[test]
fn limits_of_tools_are_measured_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let [press, two] = ["press", "two"].map(|programme| simulate(folder.path(), programme));
    let bundle = folder.path().join("tiny-corrected");
    fixture::copy_into(&bundle, "tiny-corrected");
    let manifest = || std::fs::read(bundle.join("bundle.json")).unwrap();
    let before = manifest();
    let name = bundle.to_str().unwrap();
    let page = folder.path().join("page.md");
    let marked = "a\n<!-- begin: study envelope tiny-reduced -->\n<!-- end: study envelope tiny-reduced -->\nb\n";
    std::fs::write(&page, marked).unwrap();
    let with = |limit: &'static str, more: &[&str]| {
        let fixed = [
            "envelope",
            name,
            "--tools",
            &press,
            "--tools",
            &two,
            "--corrections",
            "3",
            "--limit-mm2",
            limit,
        ];
        study(&[&fixed[..], more].concat())
    };

    let output = with("1e-12", &[]);
    let message = told(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("--limit-mm2"), "{message}");
    let output = with("100", &["--dry-run"]);
    assert!(output.status.success(), "{}", told(&output));
    assert!(
        before == manifest(),
        "neither an error nor a dry run writes"
    );

    let output = with("100", &["--json", "--markdown", page.to_str().unwrap()]);
    assert!(output.status.success(), "{}", told(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&manifest()).unwrap();
    assert_eq!(report["tools"], written["envelope"]["tools"]);
    let tools = &report["tools"];
    assert_eq!(
        (&tools["corrections"], &tools["max_tools"]),
        (&3.into(), &2.into())
    );
    for case in report["cases"].as_array().unwrap() {
        for (value, limit) in [("depth_mm", "depth_mm"), ("speed_mm_s", "speed_mm_s")] {
            let [value, limit] = [&case[value], &tools[limit]].map(|x| x.as_f64().unwrap());
            assert!(
                value > 0.0 && value <= limit && limit < value.max(1.0) * 20.0,
                "{case}"
            );
        }
    }
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(
        text.starts_with("a\n") && text.contains("| more tools at once | 1 |"),
        "{text}"
    );
    assert!(text.contains("Not measured: jab, needle;"), "{text}");

    // The library takes the sealed manifest, and everything else in it is as it was.
    let output = with("100", &["--dry-run"]);
    assert!(output.status.success(), "{}", told(&output));
    let old: serde_json::Value = serde_json::from_slice(&before).unwrap();
    for (key, value) in old.as_object().unwrap() {
        if key != "envelope" && key != "manifest_sha256" {
            assert_eq!(value, &written[key], "{key}");
        }
    }
}

#[test]
fn a_bundle_without_corrections_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let press = simulate(folder.path(), "press");
    let output = study(&["envelope", "tests/fixtures/tiny-reduced", "--tools", &press]);
    let message = told(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("upt corrections"), "{message}");
}
