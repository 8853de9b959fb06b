//! Datasets: shards make the bytes of one run, interruption loses nothing, failures are kept.

use std::path::Path;
use tissue::dataset::{Dataset, DatasetPlan, Load, Manifest};
use tissue::mesh::{Boundary, Mesh, box_phantom};
use tissue::programmes::ToolScale;
use tissue::schemes::Scheme;
use tissue::solver::SolverOptions;
use tissue::trajectory::Trajectory;

fn phantom() -> Mesh {
    box_phantom([60.0, 60.0, 30.0], [5, 5, 3]).unwrap()
}

fn plan(schemes: &[Scheme]) -> DatasetPlan {
    DatasetPlan {
        training: None,
        columns: None,
        boundary: Boundary::Fixed,
        loads: schemes.iter().map(|s| Load::Scheme(*s)).collect(),
        count: 4,
        seed: 11,
        half: false,
        frames_per_step: 1,
        tool_scale: ToolScale::TABLE,
        options: SolverOptions {
            // The phantom is stable well above the default.
            inner_step_s: 5e-4,
            ..SolverOptions::default()
        },
    }
}

fn compute(dataset: &Dataset, shard: usize, shards: usize) -> Manifest {
    for case in dataset.pending(shard, shards) {
        dataset.compute(&case, |_| {}).unwrap();
    }
    dataset.write_manifest().unwrap()
}

fn trajectories(folder: &Path) -> Vec<Vec<u8>> {
    (0..4)
        .map(|i| std::fs::read(folder.join(format!("case-{i:05}.trajectory.safetensors"))).unwrap())
        .collect()
}

/// Everything but the seconds that each case took.
fn timeless(mut manifest: Manifest) -> Manifest {
    manifest.cases.iter_mut().for_each(|c| c.wall_time_s = 0.0);
    manifest
}

#[test]
fn shards_and_interrupted_runs_give_the_bytes_of_one_run() {
    let (mesh, plan) = (phantom(), plan(&[Scheme::One, Scheme::Three]));
    let (whole, split) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let one = compute(&Dataset::open(&plan, &mesh, whole.path()).unwrap(), 0, 1);

    let dataset = Dataset::open(&plan, &mesh, split.path()).unwrap();
    let halfway = compute(&dataset, 1, 2);
    assert_eq!(
        halfway
            .cases
            .iter()
            .map(|c| c.status.as_str())
            .collect::<Vec<_>>(),
        ["pending", "done", "pending", "done"]
    );
    // A run killed in the middle of case 0, and one killed before case 3's record was written.
    std::fs::write(
        split
            .path()
            .join("case-00000.trajectory.safetensors.77.tmp"),
        b"half",
    )
    .unwrap();
    std::fs::remove_file(split.path().join("case-00003.record.json")).unwrap();
    let again = Dataset::open(&plan, &mesh, split.path()).unwrap();
    assert_eq!(again.pending(0, 1).len(), 3);
    compute(&again, 0, 2);
    let two = compute(&again, 1, 2);
    assert!(
        !split
            .path()
            .join("case-00000.trajectory.safetensors.77.tmp")
            .exists()
    );
    assert!(trajectories(whole.path()) == trajectories(split.path()));
    assert_eq!(timeless(one), timeless(two));
}

#[test]
fn trajectories_keep_the_contract_of_docs_formats() {
    let (mesh, plan) = (phantom(), plan(&[Scheme::Three]));
    let folder = tempfile::tempdir().unwrap();
    let dataset = Dataset::open(&plan, &mesh, folder.path()).unwrap();
    let case = dataset.pending(0, 1).remove(0);
    assert_eq!(dataset.compute(&case, |_| {}).unwrap().status, "done");
    let path = folder.path().join(&case.file);
    let trajectory = Trajectory::read(&path).unwrap();
    assert_eq!(trajectory.frame_count(), 161);
    assert_eq!(trajectory.header.mesh_sha256, mesh.hash());
    assert!(trajectory.frame(0).iter().flatten().all(|v| *v == 0.0));
    for frame in 0..161 {
        let (nodes, vectors) = trajectory.contact(frame);
        assert_eq!(
            nodes.is_empty(),
            frame == 0 || frame >= 130,
            "lifted at 6.5 s"
        );
        for (node, vector) in nodes.iter().zip(vectors) {
            assert_eq!(trajectory.frame(frame)[*node as usize], *vector);
        }
        for node in &mesh.fixed {
            assert_eq!(trajectory.frame(frame)[*node as usize], [0.0; 3]);
        }
    }
    let half = folder.path().join("half.trajectory.safetensors");
    trajectory.write(&half, true).unwrap();
    let narrow = Trajectory::read(&half).unwrap();
    assert!(
        std::fs::metadata(&half).unwrap().len() < std::fs::metadata(&path).unwrap().len() * 6 / 10
    );
    for (a, b) in narrow
        .displacement
        .iter()
        .flatten()
        .zip(trajectory.displacement.iter().flatten())
    {
        assert!((a - b).abs() < 0.01);
    }
    let mut bytes = std::fs::read(&path).unwrap();
    bytes.truncate(bytes.len() / 2);
    std::fs::write(&half, bytes).unwrap();
    assert!(
        Trajectory::read(&half)
            .unwrap_err()
            .to_string()
            .contains("half.trajectory")
    );
}

#[test]
fn a_case_that_fails_is_recorded_with_its_cause() {
    // 100 faces need 271 mm²; this top has 144.
    let mesh = box_phantom([12.0; 3], [3; 3]).unwrap();
    let plan = plan(&[Scheme::Four]);
    let folder = tempfile::tempdir().unwrap();
    let dataset = Dataset::open(&plan, &mesh, folder.path()).unwrap();
    let manifest = compute(&dataset, 0, 1);
    for record in &manifest.cases {
        assert_eq!(record.status, "failed");
        assert!(record.cause.as_ref().unwrap().contains("too small"));
        assert!(!folder.path().join(&record.case.file).exists());
    }
    assert!(dataset.pending(0, 1).is_empty(), "not tried again");
}

#[test]
fn a_folder_of_another_dataset_is_refused() {
    let (mesh, mut plan) = (
        box_phantom([12.0; 3], [3; 3]).unwrap(),
        plan(&[Scheme::Four]),
    );
    let folder = tempfile::tempdir().unwrap();
    compute(&Dataset::open(&plan, &mesh, folder.path()).unwrap(), 0, 1);
    plan.seed = 12;
    let Err(error) = Dataset::open(&plan, &mesh, folder.path()) else {
        panic!("accepted");
    };
    assert!(error.to_string().contains("another dataset"), "{error}");
}

#[test]
fn every_fifth_group_is_held_out() {
    let mut plan = plan(&Scheme::NUMBERED[..4]);
    plan.count = 200;
    let cases: Vec<_> = (0..200).map(|i| plan.case(i)).collect();
    assert_eq!(cases.iter().filter(|c| c.split == "test").count(), 40);
    for name in ["1", "2", "3", "4"] {
        let held = cases
            .iter()
            .filter(|c| c.split == "test" && c.scheme == name);
        assert_eq!(held.count(), 10);
    }
    let seeds: std::collections::HashSet<u64> = cases.iter().map(|c| c.seed).collect();
    assert_eq!(seeds.len(), 200);
}

#[test]
fn equilibria_without_compliance_columns_are_refused() {
    let (mesh, plan) = (phantom(), plan(&[Scheme::One, Scheme::StaticTwo]));
    let folder = tempfile::tempdir().unwrap();
    let error = Dataset::open(&plan, &mesh, folder.path()).err().unwrap();
    assert!(
        error
            .to_string()
            .contains("`static-two` needs the compliance columns")
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
