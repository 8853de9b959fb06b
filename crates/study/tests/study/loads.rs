//! `report --load`, `--hang`, `--cut`: gravity that turns, and pressure; ties; bodies that are cut.

use crate::json;

/// The library is where the reference solver is.
#[test]
fn loads_move_the_library_as_the_solver() {
    let asked = "--load tilt,pulse --bundle onnx/liver-coarse --gravity 0,-1,0 --pressure 50 --threads 1 --json";
    let asked: Vec<&str> = asked.split(' ').collect();
    let rows = json(&[&["report"], &asked[..]].concat());
    for row in rows.as_array().unwrap() {
        let number = |name: &str| row[name].as_f64().unwrap();
        assert!(number("farthest_mm") > 0.2, "{row}");
        assert!(number("worst_mse") < 1e-3, "{row}");
    }
    assert_eq!(rows.as_array().unwrap().len(), 2);
}

/// Beds that a thread tears: the solver's forces, the same tie first, and as many torn.
#[test]
fn a_bed_tears_as_the_solvers_does() {
    let rows = json(&[
        "report",
        "--hang",
        "3",
        "--bundle",
        "onnx/liver-coarse",
        "--threads",
        "1",
        "--json",
    ]);
    let row = &rows[0];
    let number = |name: &str| row[name].as_f64().expect(name);
    assert!(number("force_error") < 0.05, "{row}");
    assert!(number("mse") < 1e-3, "{row}");
    assert_eq!(row["same_first"], 3, "{row}");
    let torn = row["torn"].as_array().expect("two numbers");
    assert!(torn[0] == torn[1] && torn[0].as_u64() > Some(10), "{row}");
}

/// Each programme of cuts is the solver's, with the same blades and tools.
#[test]
fn bodies_are_cut_as_the_solvers_are() {
    let asked = "--cut 1 --bundle onnx/liver-coarse --threads 1 --json";
    let asked: Vec<&str> = asked.split(' ').collect();
    let rows = json(&[&["report"], &asked[..]].concat());
    let rows = rows.as_array().unwrap();
    let names: Vec<&str> = (rows.iter())
        .map(|row| row["programme"].as_str().unwrap())
        .collect();
    let all = [
        "incise",
        "again",
        "flap",
        "resect",
        "biopsy",
        "divide",
        "wall",
        "part",
        "coagulate",
    ];
    assert_eq!(names, all);
    for row in rows {
        let number = |name: &str| row[name].as_f64();
        assert!(number("mse").unwrap() < 0.01, "{row}");
        assert!(number("near_mse").unwrap() < 0.05, "{row}");
        assert!(number("smallest_det").unwrap() > 0.2, "{row}");
        // Not every programme has a blade, or takes tissue away.
        assert!(
            number("blade_error").is_none_or(|error| error < 0.15),
            "{row}"
        );
        let left = number("removed_ratio");
        assert!(left.is_none_or(|part| (part - 1.0).abs() < 0.1), "{row}");
        assert!(number("force_error").unwrap() < 0.2, "{row}");
    }
}
