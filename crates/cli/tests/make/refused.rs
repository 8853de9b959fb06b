//! Input that cannot become a bundle: named, with what to do.

use std::path::Path;

use super::{HELD, command, organ, plain, text};

/// The message of a run that must fail and leave no bundle.
pub fn refused(surface: &Path, more: &[&str]) -> String {
    let out = surface.with_extension("bundle");
    let output = command(surface, &out, more).output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(!out.exists());
    text(&output)
}

#[test]
fn input_that_cannot_become_a_bundle_is_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let has = |message: String, words: &[&str]| {
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
    };

    let good = file("good.obj");
    plain(&good);
    has(
        refused(&good, &[]),
        &["nothing is held", "--fixed plane:0,0,-1,", "preview.html"],
    );
    has(
        refused(
            &good,
            &[
                "--fixed",
                "plane:0,0,-1,-20",
                "--domain",
                "plane:0,0,-1,-22",
            ],
        ),
        &["--fixed holds all"],
    );
    has(refused(&good, &["--fixed", "all"]), &["holds every node"]);
    has(
        refused(&good, &["--fixed", "ball:900,0,0,5"]),
        &["no node lies in the region of --fixed", "x -"],
    );
    has(
        refused(&good, &["--fixed", "plane:0,0,0,1"]),
        &["must not be zero"],
    );
    has(
        refused(&good, &["--fixed", "plane:0,0,-1,-20", "--minutes", "0"]),
        &["--minutes is 0"],
    );
    has(
        refused(&good, &["--fixed", "plane:0,0,-1,-20", "--unit", "m"]),
        &["with --unit m,", "--unit mm it would be 98 mm"],
    );
    has(
        refused(&good, &["--fixed", "plane:0,0,-1,-20", "--unit", "0.001"]),
        &["0.098 mm long", "--unit mm"],
    );
    has(
        refused(&good, &["--fixed", "plane:0,0,-1,-20", "--poisson", "0.5"]),
        &["poisson"],
    );

    let rind = ["--region", "rind=plane:0,0,1,-12"];
    for (more, words) in [
        (
            &rind[..],
            "region `rind` has no law; give --material rind=LAW",
        ),
        (
            &["--material", "rind=cortex"],
            "there is no region of that name",
        ),
        (&["--material", "rind=spleen"], "upt materials"),
        (&["--material", "rind=ogden:-0.157,-18"], "not kPa"),
        (
            &["--material", "rind=ogden:157,-18"],
            "region `rind`: law.terms[0]",
        ),
        (&["--material", "stone"], "--material is `stone`"),
        (
            &["--law", "fibres:5,2"],
            "material: number of directions in `fibre`",
        ),
        (&["--law", "fibres:-5,2"], "law.k1_over_mu"),
        (&["--fibre", "0,0,0"], "three numbers not all 0"),
        (
            &["--fibre", "rind=0,0,1"],
            "there is no region of that name",
        ),
        (
            &[
                "--region",
                "rind=ball:900,0,0,5",
                "--material",
                "rind=cortex",
            ],
            "no tetrahedron lies in region `rind`",
        ),
        (
            &[
                rind[0],
                rind[1],
                "--material",
                "rind=cortex",
                "--stiffness",
                "all=2",
            ],
            "region `rind` has a law with a modulus of its own",
        ),
    ] {
        has(refused(&good, &[&HELD, more].concat()), &[words]);
    }
    has(
        refused(&good, &[HELD[0], HELD[1], "--gravity", "0,-9.81"]),
        &["--gravity", "three numbers"],
    );
    has(
        refused(&good, &[HELD[0], HELD[1], "--unload"]),
        &["--unload", "--gravity"],
    );
    let heavy = ["--gravity", "0,0,-900", "--unload", "--young", "100"];
    has(
        refused(&good, &[&HELD[..], &heavy].concat()),
        &["--unload", "no rest shape", "stiffer material"],
    );

    has(
        refused(&good, &[HELD[0], HELD[1], "--tools", "press,saw"]),
        &["--tools: ", "`saw` is unknown", "stroke"],
    );

    let open = file("open.obj");
    plain(&open);
    let lines = std::fs::read_to_string(&open).unwrap();
    std::fs::write(&open, lines.rsplit_once("f ").unwrap().0).unwrap();
    has(refused(&open, &HELD), &["open", "edge"]);

    let crossed = file("crossed.obj");
    let through = |[x, y, z]: [f64; 3]| {
        if z > 29.0 {
            [x + 3.0, y + 2.0, -60.0]
        } else {
            [x, y, z]
        }
    };
    organ(&crossed, through, false);
    has(refused(&crossed, &HELD), &["passes through itself"]);

    let inside_out = file("inside-out.obj");
    organ(&inside_out, |p| p, true);
    has(
        refused(&inside_out, &["--fixed", "plane:0,0,-1,-20", "--no-repair"]),
        &["inside out"],
    );

    let taken = file("taken");
    std::fs::create_dir(&taken).unwrap();
    std::fs::write(taken.join("thesis.txt"), "text").unwrap();
    let output = command(&good, &taken, &HELD).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    has(text(&output), &["`upt make` did not make it"]);
    assert!(taken.join("thesis.txt").exists());
}

#[test]
fn of_two_pieces_one_is_chosen_and_a_speck_is_left_out_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let surface = folder.path().join("two.obj");
    plain(&surface);
    let body = std::fs::read_to_string(&surface).unwrap();
    let count = body.lines().filter(|line| line.starts_with("v ")).count();
    let with_another = |scale: f64| {
        let mut text = body.clone();
        for line in body.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let moved: Vec<String> = match words[0] {
                "v" => words[1..]
                    .iter()
                    .map(|x| (scale * x.parse::<f64>().unwrap() + 90.0).to_string())
                    .collect(),
                _ => words[1..]
                    .iter()
                    .map(|n| (n.parse::<usize>().unwrap() + count).to_string())
                    .collect(),
            };
            text += &format!("{} {}\n", words[0], moved.join(" "));
        }
        std::fs::write(&surface, text).unwrap();
    };
    let out = surface.with_extension("bundle");
    let previewed = |more: &[&str]| {
        let all = [&HELD[..], &["--preview"], more].concat();
        let output = command(&surface, &out, &all).output().unwrap();
        assert!(output.status.success(), "{}", crate::text(&output));
        crate::text(&output)
    };
    with_another(0.1);
    let said = previewed(&[]);
    assert!(said.contains("a speck was left out: "), "{said}");
    let message = refused(&surface, &[HELD[0], HELD[1], "--no-repair"]);
    assert!(message.contains("2 bodies"), "{message}");

    with_another(0.3);
    let message = refused(&surface, &HELD);
    assert!(
        message.contains("choose one with --part") && message.contains("(90.0, 90.0, 90.0)"),
        "{message}"
    );
    let said = previewed(&["--part", "1"]);
    assert!(said.contains("x -49"), "{said}");
    let message = refused(&surface, &[HELD[0], HELD[1], "--label", "1"]);
    assert!(message.contains("has no labels"), "{message}");
}

/// A box of 40 mm of 8 cubes, with its inner node hardly off one side: slivers.
fn slivers(path: &Path) {
    let node = |i: usize, j: usize, k: usize| (i * 3 + j) * 3 + k;
    let (mut points, mut tets) = (String::new(), Vec::new());
    for (i, j, k) in (0..27).map(|n| (n / 9, n / 3 % 3, n % 3)) {
        let x = if (i, j, k) == (1, 1, 1) {
            0.001
        } else {
            i as f64
        };
        points += &format!("{} {} {}\n", 20.0 * x, 20 * j, 20 * k);
        if i < 2 && j < 2 && k < 2 {
            let corner = |bits: usize| node(i + (bits >> 2), j + (bits >> 1 & 1), k + (bits & 1));
            for [b, c] in [[4, 6], [6, 2], [2, 3], [3, 1], [1, 5], [5, 4]] {
                let [a, b, c, d] = [0, b, c, 7].map(corner);
                tets.push(format!("4 {a} {b} {c} {d}\n"));
            }
        }
    }
    let head = "# vtk DataFile Version 3.0\nbox\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 27 float";
    let count = tets.len();
    let text = format!(
        "{head}\n{points}CELLS {count} {}\n{}CELL_TYPES {count}\n{}",
        5 * count,
        tets.concat(),
        "10\n".repeat(count)
    );
    std::fs::write(path, text).unwrap();
}

#[test]
fn a_preview_refuses_what_the_run_would_and_a_refill_cures_it() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("box.vtk");
    slivers(&mesh);
    let held = ["--fixed", "plane:0,0,-1,10", "--preview"];
    let message = refused(&mesh, &held);
    assert!(
        message.contains("the run itself would refuse") && message.contains("--refill"),
        "{message}"
    );
    assert!(folder.path().join("box.preview.html").is_file());
    let out = mesh.with_extension("bundle");
    let output = command(&mesh, &out, &[&held[..], &["--refill"]].concat())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
}
