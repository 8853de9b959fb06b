//! Runs whose time is up before they begin: each simulation stops where it is, and the certificate says so.

use std::process::Command;

use super::{HELD, command, plain, text, works};

#[test]
fn a_run_without_time_stops_its_simulations_and_its_certificate_can_be_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("organ.obj"), folder.path().join("organ"));
    plain(&surface);
    // No --cases: those would be simulated to their ends.
    let mut short = Command::new(env!("CARGO_BIN_EXE_upt"));
    let whole = command(&surface, &out, &HELD);
    let arguments: Vec<_> = whole.get_args().collect();
    let at = arguments
        .iter()
        .position(|word| *word == "--cases")
        .unwrap();
    short
        .args(&arguments[..at])
        .args(&arguments[at + 2..])
        .args(["--minutes", "0.001", "--threads", "2"])
        .env("ORT_DYLIB_PATH", "/nowhere/libonnxruntime.so");
    let output = short.output().unwrap();
    let said = text(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("what every bundle needs took"), "{said}");
    works(&out);
    let certificate = std::fs::read(out.join("certificate.json")).unwrap();
    let certificate: serde_json::Value = serde_json::from_slice(&certificate).unwrap();
    let programmes = certificate["tested"]["programmes"].as_array().unwrap();
    assert_eq!(programmes.len(), 2, "{certificate:#}");
    for programme in programmes {
        let frames = programme["frames_in_time"].as_u64().unwrap();
        assert!((20..100).contains(&frames), "{programme}");
        let ended = programme["ended"].as_str().unwrap();
        assert!(ended.starts_with("no time after"), "{programme}");
    }
    let again = Command::new(env!("CARGO_BIN_EXE_upt"))
        .args(["check".as_ref(), out.as_os_str()])
        .output()
        .unwrap();
    assert!(again.status.success(), "{}", text(&again));
    assert!(
        text(&again).contains("as the certificate says"),
        "{}",
        text(&again)
    );
}
