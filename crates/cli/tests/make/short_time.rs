//! Runs whose time is up before they begin: what every bundle needs ends them, each simulation stops where it is, and the certificate
//! says so.

use std::path::Path;
use std::process::{Command, Output};

use super::{HELD, command, plain, text, works};

/// `upt make` of the small organ without --cases, with so many minutes.
pub fn made(surface: &Path, out: &Path, minutes: &str, more: &[&str]) -> Output {
    let whole = command(surface, out, &HELD);
    let arguments: Vec<_> = whole.get_args().collect();
    let at = arguments
        .iter()
        .position(|word| *word == "--cases")
        .unwrap();
    Command::new(env!("CARGO_BIN_EXE_upt"))
        .args(&arguments[..at])
        .args(&arguments[at + 2..])
        .args(["--minutes", minutes, "--threads", "2"])
        .args(more)
        .env("ORT_DYLIB_PATH", "/nowhere/libonnxruntime.so")
        .output()
        .unwrap()
}

fn certificate(out: &Path) -> serde_json::Value {
    let text = std::fs::read(out.join("certificate.json")).unwrap();
    serde_json::from_slice(&text).unwrap()
}

/// What makes every bundle of this organ is in the work folder: a run of that is killed, or whole.
pub fn begun(surface: &Path, out: &Path) {
    let mut child = command(surface, out, &HELD).spawn().unwrap();
    let record = out.with_extension("work").join("tables.stage.json");
    while !record.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(record.exists());
}

#[test]
fn what_every_bundle_needs_ends_a_run_without_time_and_the_same_command_goes_on_from_there() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("organ.obj"), folder.path().join("organ"));
    plain(&surface);
    for _ in 0..2 {
        let output = made(&surface, &out, "0.0001", &[]);
        let said = text(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.contains("--minutes 0.0001 is too short for this body")
                && said.contains("stage `columns`")
                && said.contains("give --minutes"),
            "{said}"
        );
        assert!(!out.exists(), "{said}");
    }
    assert!(out.with_extension("work").join("body.stage.json").exists());
}

#[test]
fn a_run_without_time_stops_its_simulations_and_its_certificate_can_be_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("organ.obj"), folder.path().join("organ"));
    plain(&surface);
    begun(&surface, &out);
    let output = made(&surface, &out, "0.001", &[]);
    let said = text(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("nothing is refined"), "{said}");
    works(&out);
    let found = certificate(&out);
    let programmes = found["tested"]["programmes"].as_array().unwrap();
    assert_eq!(programmes.len(), 2, "{found:#}");
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

#[test]
fn cases_and_tools_that_were_asked_for_stop_in_time_and_what_is_left_out_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("organ.obj"), folder.path().join("organ"));
    plain(&surface);
    begun(&surface, &out);
    let more = ["--cases", "7", "--tools", "press,stroke,grasp"];
    let output = made(&surface, &out, "0.001", &more);
    let said = text(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("no time for 5 of the 7 --cases"), "{said}");
    let found = certificate(&out);
    assert_eq!(found["tested"]["cases"], 2, "{found:#}");
    // One of each on two threads, and the third not at all.
    let tested = found["tools"].as_array().unwrap();
    let left_out = found["tools_left_out"].as_array().unwrap();
    assert_eq!((tested.len(), left_out.len()), (2, 1), "{found:#}");
    assert!(tested.iter().all(|row| row["cases"] == 1), "{found:#}");
    let name = left_out[0].as_str().unwrap();
    assert!(
        said.contains(&format!("no time for --tools {name}")),
        "{said}"
    );
    assert!(said.contains("not good enough: "), "{said}");
}

/// A bar that is held in the middle and touched on one arm: no contact shows how the other one swings, but gravity moves it.
#[test]
fn an_arm_that_no_tool_reaches_has_modes_for_loads() {
    let folder = tempfile::tempdir().unwrap();
    let (surface, out) = (folder.path().join("bar.obj"), folder.path().join("bar"));
    let mut bar = String::new();
    for corner in 0..8 {
        let at = |bit: u32, half: i32| if corner >> bit & 1 == 1 { half } else { -half };
        bar += &format!("v {} {} {}\n", at(2, 90), at(1, 24), at(0, 24));
    }
    for [a, b, c, d] in [
        [1, 2, 4, 3],
        [5, 7, 8, 6],
        [1, 5, 6, 2],
        [3, 4, 8, 7],
        [1, 3, 7, 5],
        [2, 6, 8, 4],
    ] {
        bar += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    std::fs::write(&surface, bar).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_upt"))
        .args(["make".as_ref(), surface.as_os_str(), "--out".as_ref()])
        .arg(&out)
        .args(["--fixed", "ball:0,0,0,30", "--domain", "plane:1,0,0,-45"])
        .args(["--nodes", "700", "--patches", "24", "--natural", "24"])
        .args(["--cases", "1", "--minutes", "0.4"])
        .env("ORT_DYLIB_PATH", "/nowhere/libonnxruntime.so")
        .output()
        .unwrap();
    let said = text(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("fields for loads"), "{said}");
    let manifest = std::fs::read(out.join("bundle.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    assert_eq!(manifest["corrections"]["whole"], "whole.safetensors");
    works(&out);
}
