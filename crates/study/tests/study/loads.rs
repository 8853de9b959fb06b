//! `report --load`: gravity that turns, and pressure.

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
