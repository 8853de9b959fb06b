//! The table of schemes and programmes: what reads it outside of this crate is fresh, and the motions keep to its ranges.

use std::path::Path;

use tissue::loads::{json, programmes_table, replace, schemes_table};
use tissue::schemes::{Draw, FRAME_S, Group, PROBE_S, TABLE};

fn committed(path: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(path);
    std::fs::read_to_string(file).unwrap().replace("\r\n", "\n")
}

const HOW: &str = "is stale; run `cargo run --release -p tissue --example load_tables`";

#[test]
fn the_guide_shows_the_tables() {
    let page = committed("docs/guide/datasets.md");
    for (marker, table) in [
        ("schemes", schemes_table()),
        ("programmes", programmes_table()),
    ] {
        let fresh = replace(&page, marker, &table).expect(marker);
        assert!(page == fresh, "docs/guide/datasets.md {HOW}");
    }
}

#[test]
fn python_reads_the_tables() {
    let fresh = json().unwrap();
    let file = "training/upt_training/loads.json";
    assert!(committed(file) == fresh, "{file} {HOW}");
    let tables: serde_json::Value = serde_json::from_str(&fresh).unwrap();
    assert_eq!(tables["schemes"][2]["magnitude_mm"][0], 13.0);
    assert_eq!(tables["programmes"][6]["second_mm"][1], 40.0);
}

/// Draws that reach the ends of the ranges, and some between.
fn draws() -> impl Iterator<Item = Draw> {
    (0..=200).map(|i| {
        let part = f64::from(i) / 200.0;
        Draw {
            depth: part,
            size: 1.0 - part,
            angle: part.min(0.999),
        }
    })
}

#[test]
fn every_scheme_spans_the_ranges_of_its_row() {
    for scheme in TABLE.map(|row| row.scheme) {
        let row = scheme.specification();
        assert_eq!((row.scheme, scheme.name().parse()), (scheme, Ok(scheme)));
        assert!(!row.summary.is_empty() && !row.source.is_empty());
        let end = match row.group {
            Group::Trained | Group::Withheld | Group::Hard => 8.0,
            Group::Probe => PROBE_S,
            Group::Static => row.depths as f64 * FRAME_S,
        };
        let mut tilt = [f64::INFINITY, f64::NEG_INFINITY];
        let mut push: f64 = 0.0;
        for draw in draws() {
            let magnitude = scheme.magnitude_mm(draw);
            assert!((row.magnitude_mm[0]..=row.magnitude_mm[1]).contains(&magnitude));
            let faces = scheme.face_count(draw);
            assert!((row.faces[0]..=row.faces[1]).contains(&faces));
            for step in 1..160 {
                let pose = scheme.pose(end * f64::from(step) / 160.0, draw);
                push = push.max(pose.push);
                tilt = [tilt[0].min(pose.phi), tilt[1].max(pose.phi)];
            }
        }
        let [low, high] = row.tilt_rad;
        assert!(
            low <= tilt[0] + 1e-12 && tilt[1] <= high + 1e-12,
            "{}: {tilt:?}",
            row.name
        );
        // The row promises no more than there is.
        let slack = 0.05 * (high - low) + 1e-12;
        assert!(
            tilt[0] < low + slack && tilt[1] > high - slack,
            "{}: {tilt:?} of {low} to {high}",
            row.name
        );
        assert!((0.95..=1.0).contains(&push), "{}: {push}", row.name);
    }
}
