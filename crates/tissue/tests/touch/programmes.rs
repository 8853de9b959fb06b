//! Programmes of tools: what they draw is in the table, starts clear, and comes out of a file as it went in.

use contact::{Body, Samples, Shape, Vector};
use tissue::dataset::{Dataset, DatasetPlan, Load};
use tissue::mesh::{Boundary, Mesh, ellipsoid_phantom};
use tissue::programmes::{BodySize, DEEPEST_SHARE, TABLE, ToolCase, ToolProgramme, ToolScale};
use tissue::simulate::{ToolOrder, simulate_tools};
use tissue::solver::SolverOptions;
use tissue::trajectory::Trajectory;

fn phantom() -> Mesh {
    let mut mesh = ellipsoid_phantom([70.0, 70.0, 50.0], 8).unwrap();
    mesh.name = "phantom".into();
    mesh
}

fn all() -> Vec<ToolProgramme> {
    ToolProgramme::parse_list("all").unwrap()
}

/// No step shorter than this phantom needs.
fn options() -> SolverOptions {
    let mut options = SolverOptions {
        inner_step_s: 4e-4,
        ..SolverOptions::default()
    };
    options.material.poisson = 0.45;
    options
}

#[test]
fn names_are_parsed_and_unknown_ones_listed() {
    let extreme = TABLE.iter().filter(|row| row.extreme);
    assert_eq!(all().len() + extreme.count(), TABLE.len());
    assert_eq!(ToolProgramme::every().count(), TABLE.len());
    let two = ToolProgramme::parse_list("lift, grasp").unwrap();
    assert_eq!(
        two.iter().map(|p| p.name()).collect::<Vec<_>>(),
        ["lift", "grasp"]
    );
    let error = ToolProgramme::parse_list("press,shove").unwrap_err();
    assert!(
        error.contains("`shove` is unknown") && error.contains("wobble"),
        "{error}"
    );
}

#[test]
fn every_programme_starts_clear_and_reaches_the_tissue() {
    let mesh = phantom();
    let samples = Samples::new(&mesh.positions, mesh.surface.iter().copied(), &[], 1.7);
    let position = |n: u32| Vector::from(mesh.positions[n as usize]);
    let rows = samples.rows().iter();
    let surface: Vec<Vector> = rows.map(|s| s.gather(position)).collect();
    for programme in all() {
        let row = programme.specification();
        for seed in [1, 2, 3] {
            let case = ToolCase::new(programme, &mesh, seed, None).unwrap();
            assert_eq!(case, ToolCase::new(programme, &mesh, seed, None).unwrap());
            assert_ne!(
                case,
                ToolCase::new(programme, &mesh, seed + 10, None).unwrap()
            );
            assert_eq!(case.tools.len(), 1 + usize::from(row.second_mm.is_some()));
            for (index, tool) in case.tools.iter().enumerate() {
                assert!((row.friction[0]..=row.friction[1]).contains(&f64::from(tool.friction)));
                let body = Body::new(&tool.shape).unwrap();
                let nearest = |pose| {
                    let at = surface.iter().map(|p| body.nearest_at(pose, *p).distance);
                    at.fold(f32::INFINITY, f32::min)
                };
                assert!(nearest(&case.start[index]) > 0.25, "{}", row.name);
                let deepest = case.frames.iter().map(|f| nearest(&f[index].pose));
                let deepest = deepest.fold(f32::INFINITY, f32::min);
                assert!(deepest < -0.8, "{} {seed}: {deepest}", row.name);
                // It leaves at the end.
                assert!(nearest(&case.frames[case.frames.len() - 1][index].pose) > 1.0);
            }
        }
    }
}

#[test]
fn a_trajectory_of_tools_agrees_with_itself_and_its_file() {
    let mesh = phantom();
    let folder = tempfile::tempdir().unwrap();
    let samples = mesh.samples(Boundary::Fixed);
    for name in ["poke", "two", "grasp"] {
        let programme: ToolProgramme = name.parse().unwrap();
        let trajectory = simulate_tools(
            &mesh,
            Boundary::Fixed,
            ToolOrder::new(programme, 5),
            &options(),
            |_, _| {},
        )
        .unwrap();
        let path = folder.path().join("case.trajectory.safetensors");
        trajectory.write(&path, false).unwrap();
        assert_eq!(Trajectory::read(&path).unwrap(), trajectory);
        let tracks = trajectory.tools.as_ref().unwrap();
        assert_eq!(trajectory.header.scheme, format!("tool-{name}"));
        let frames = trajectory.frame_count();
        let count = tracks.tools.len();
        assert_eq!(tracks.poses.len(), frames * count);
        assert!(tracks.contacts.iter().any(|c| *c > 0), "{name} touches");
        assert!(tracks.penetration.iter().all(|p| *p < 0.05));
        for frame in 0..frames {
            // The collision field is where the nodes are, and its reaction is the tools' force.
            let (nodes, vectors) = trajectory.contact(frame);
            let u = trajectory.frame(frame);
            assert!(nodes.is_sorted());
            for (node, vector) in nodes.iter().zip(vectors) {
                assert_eq!(u[*node as usize], *vector);
            }
            let row = trajectory.contact_offsets[frame] as usize
                ..trajectory.contact_offsets[frame + 1] as usize;
            let sum: Vector = trajectory.reaction[row]
                .iter()
                .map(|f| Vector::from(*f))
                .sum();
            let wrenches = &tracks.wrenches[frame * count..(frame + 1) * count];
            let felt: Vector = wrenches.iter().map(|w| Vector::new(w[0], w[1], w[2])).sum();
            assert!(
                (sum - felt).length() < 1e-3 * (1.0 + felt.length()),
                "{name} {frame}: {sum} {felt}"
            );
        }
        let rows = tracks.sample_rows.iter().max().unwrap();
        assert!((*rows as usize) < samples.len());
        let held = tracks.held.iter().any(|h| *h > 0);
        assert_eq!(held, name == "grasp");
    }
}

#[test]
fn shorter_frames_are_the_same_motion() {
    let mesh = phantom();
    let whole = ToolOrder::new("poke".parse().unwrap(), 5);
    let parts = ToolOrder {
        frames_per_step: 10,
        ..whole
    };
    let [whole, parts] = [whole, parts]
        .map(|order| simulate_tools(&mesh, Boundary::Fixed, order, &options(), |_, _| {}).unwrap());
    assert!((parts.header.dt_s - 0.005).abs() < 1e-12);
    assert_eq!(parts.frame_count() - 1, 10 * (whole.frame_count() - 1));
    let [of_whole, of_parts] = [&whole, &parts].map(|t| t.tools.as_ref().unwrap());
    for frame in 1..whole.frame_count() {
        assert_eq!(of_whole.frame(frame), of_parts.frame(10 * frame));
        let pairs = whole.frame(frame).iter().zip(parts.frame(10 * frame));
        let apart = |(a, b): (&[f32; 3], &[f32; 3])| {
            (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
        };
        let farthest = pairs.map(apart).fold(0.0, f32::max);
        assert!(farthest < 0.1, "{farthest} mm apart at frame {frame}");
    }
}

#[test]
fn a_dataset_of_tools_has_a_test_split_and_says_what_it_holds() {
    let mesh = phantom();
    let folder = tempfile::tempdir().unwrap();
    let plan = DatasetPlan {
        training: None,
        columns: None,
        boundary: Boundary::Fixed,
        loads: ToolProgramme::parse_list("poke,lift")
            .unwrap()
            .into_iter()
            .map(Load::Tools)
            .collect(),
        count: 10,
        seed: 11,
        half: false,
        frames_per_step: 1,
        tool_scale: ToolScale::TABLE,
        options: options(),
    };
    let splits: Vec<String> = (0..10).map(|i| plan.case(i).split).collect();
    assert_eq!(splits.iter().filter(|s| *s == "test").count(), 2);
    assert_eq!(plan.case(8).split, "test");
    let dataset = Dataset::open(&plan, &mesh, folder.path()).unwrap();
    let record = dataset.compute(&plan.case(0), |_| {}).unwrap();
    assert_eq!(
        (record.status.as_str(), record.case.scheme.as_str()),
        ("done", "tool-poke")
    );
    assert!(
        record.plan_key.contains("schemes tool-poke,tool-lift"),
        "{}",
        record.plan_key
    );
}

#[test]
fn a_tool_of_ones_own_takes_the_place_of_the_tables() {
    let mesh = phantom();
    // A wedge 60 mm long, its end lowest and 2 mm thick.
    let edge = [-1.0, 1.0].map(|z| [[-5.0, -30.0, z], [5.0, -30.0, z]]);
    let top = [-4.0, 4.0].map(|z| [[-5.0, 30.0, z], [5.0, 30.0, z]]);
    let inner = [[0.0, 1.0, 0.5]; 3];
    let points = [edge.as_flattened(), top.as_flattened(), &inner].concat();
    let wedge = Shape::hull_of(&points).unwrap();
    let Shape::Hull {
        points: corners, ..
    } = &wedge
    else {
        panic!("a hull");
    };
    assert_eq!(corners.len(), 8, "inner points are left out: {corners:?}");
    let case = ToolCase::new("poke".parse().unwrap(), &mesh, 1, Some(&wedge)).unwrap();
    assert_eq!(case.tools[0].shape, wedge);
    let trajectory = simulate_tools(
        &mesh,
        Boundary::Fixed,
        ToolOrder {
            own: Some(&wedge),
            ..ToolOrder::new("poke".parse().unwrap(), 1)
        },
        &options(),
        |_, _| {},
    )
    .unwrap();
    let tracks = trajectory.tools.unwrap();
    assert!(tracks.contacts.iter().any(|c| *c > 0));
    let deepest = tracks.penetration.iter().copied().fold(0.0, f32::max);
    // Between the samples too, where a point is met up to a millisecond after the edge has come to it.
    assert!(deepest < 0.3, "{deepest} mm");
    let flat = Shape::Hull {
        points: vec![[0.0; 3]; 4],
        margin: 0.0,
    };
    let error = ToolCase::new("poke".parse().unwrap(), &mesh, 1, Some(&flat)).unwrap_err();
    assert!(error.to_string().contains("no volume"), "{error}");
}

/// How deep the case's tools go in the surface at rest, mm.
fn deepest(mesh: &Mesh, case: &ToolCase) -> f32 {
    let samples = Samples::new(&mesh.positions, mesh.surface.iter().copied(), &[], 1.7);
    let position = |n: u32| Vector::from(mesh.positions[n as usize]);
    let surface: Vec<Vector> = samples.rows().iter().map(|s| s.gather(position)).collect();
    let body = Body::new(&case.tools[0].shape).unwrap();
    let mut deepest = 0.0f32;
    for frame in &case.frames {
        let depths = (surface.iter()).map(|p| -body.nearest_at(&frame[0].pose, *p).distance);
        deepest = depths.fold(deepest, f32::max);
    }
    deepest
}

#[test]
fn a_thin_body_has_smaller_tools_that_do_not_go_through_it() {
    let mesh = ellipsoid_phantom([60.0, 60.0, 8.0], 10).unwrap();
    let size = BodySize::of(&mesh);
    assert!(
        size.thickness_mm < 16.0 && size.width_mm > 100.0,
        "{size:?}"
    );
    let scale = ToolScale::of_body(size);
    assert!(scale.factor < 0.4, "{scale}");
    assert_eq!(scale.deepest_share, Some(DEEPEST_SHARE));
    let deep = |case: &ToolCase| deepest(&mesh, case);
    for name in ["press", "poke", "stroke"] {
        let programme: ToolProgramme = name.parse().unwrap();
        for seed in 1..5 {
            let case = ToolCase::scaled(programme, &mesh, seed, None, scale).unwrap();
            let most = 16.0 * DEEPEST_SHARE as f32 + 0.2;
            assert!(
                (0.1..most).contains(&deep(&case)),
                "{name} {seed}: {}",
                deep(&case)
            );
        }
    }
    // A body as large as a brain has the table's tools, to the bit.
    let large = ellipsoid_phantom([70.0, 70.0, 50.0], 8).unwrap();
    assert_eq!(ToolScale::of_body(BodySize::of(&large)), ToolScale::TABLE);
    for programme in all() {
        let table = ToolCase::new(programme, &large, 1, None);
        assert_eq!(
            ToolCase::scaled(programme, &large, 1, None, ToolScale::TABLE),
            table
        );
    }
}

#[test]
fn a_mesh_without_room_is_refused() {
    let mut mesh = phantom();
    mesh.domain.truncate(2);
    let error = ToolCase::new("stroke".parse().unwrap(), &mesh, 1, None).unwrap_err();
    assert!(error.to_string().contains("`stroke`, seed 1"), "{error}");
    mesh.domain.clear();
    let error = ToolCase::new("press".parse().unwrap(), &mesh, 1, None).unwrap_err();
    assert!(error.to_string().contains("no `domain` faces"), "{error}");
}
