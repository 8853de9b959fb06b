//! `step.onnx` against the split: the same displacements to rounding, and every promise of a scene kept on it.

use fixture::{
    bits, copy_of, find_runtime, largest_difference, model, plain, push, rollout, scene, sparse,
};
use upt::{
    DecoderKernel, Error, IndexSet, Model, ModelOptions, Scene, SceneOptions, StepPath, UserStream,
};

/// The bundles that carry `step.onnx`: base none, and base and features from the prior.
const BUNDLES: [&str; 2] = ["tiny-upt", "tiny-upt-prior"];

fn on(step_path: StepPath) -> SceneOptions {
    SceneOptions {
        step_path,
        ..plain()
    }
}

#[test]
fn the_whole_step_equals_the_split() {
    for name in BUNDLES {
        let model = model(name);
        let (split, whole) = (
            scene(&model, &on(StepPath::Split)),
            scene(&model, &on(StepPath::Whole)),
        );
        let (want, found) = (rollout(&split, 30), rollout(&whole, 30));
        for (t, (want, found)) in want.iter().zip(&found).enumerate() {
            let scale = want.iter().fold(0.0f32, |a, x| a.max(x.abs()));
            let error = largest_difference(want, found) / scale;
            assert!(error < 1e-5, "{name}, step {t}: {error}");
        }
        assert!(want[29].iter().any(|u| u.abs() > 0.01), "{name}");
        assert_eq!(split.stats().step_path, StepPath::Split);
        assert_eq!(whole.stats().step_path, StepPath::Whole);
        assert_eq!(whole.stats().decoded_node_count, whole.node_count() as u64);
    }
}

#[test]
fn the_resident_decoder_equals_the_tiles() {
    for name in BUNDLES {
        let model = model(name);
        let with = |kernel| SceneOptions { kernel, ..plain() };
        let tiles = scene(&model, &with(DecoderKernel::Onnx));
        let resident = scene(&model, &with(DecoderKernel::Resident));
        let (want, found) = (rollout(&tiles, 20), rollout(&resident, 20));
        let error = largest_difference(&want.concat(), &found.concat());
        assert!(error < 1e-4, "{name}: {error} mm");
        assert_eq!(resident.stats().kernel, DecoderKernel::Resident);
        // A region is rows of the same run.
        let nodes = model.indices(IndexSet::SurfaceNodes);
        resident.set_region(Some(nodes)).unwrap();
        let mut out = vec![0.0; 3 * nodes.len()];
        resident.read(&mut out).unwrap();
        assert_eq!(bits(&out), bits(&rows(&found[19], nodes)), "{name}");
    }
}

fn rows(field: &[f32], nodes: &[u32]) -> Vec<f32> {
    let row = |&node: &u32| {
        field[3 * node as usize..3 * node as usize + 3]
            .iter()
            .copied()
    };
    nodes.iter().flat_map(row).collect()
}

#[test]
fn threads_region_and_snapshot_keep_the_bits_of_the_whole_step() {
    for name in BUNDLES {
        let model = model(name);
        let with = |threads| SceneOptions {
            threads,
            ..on(StepPath::Whole)
        };
        let full = rollout(&scene(&model, &with(1)), 20);
        for threads in [2, 4] {
            let other = rollout(&scene(&model, &with(threads)), 20);
            assert_eq!(
                bits(&full.concat()),
                bits(&other.concat()),
                "{name}, {threads} threads"
            );
        }
        let nodes = model.indices(IndexSet::SurfaceNodes);
        let regional = scene(&model, &with(1));
        regional.set_region(Some(nodes)).unwrap();
        for (t, out) in rollout(&regional, 20).iter().enumerate() {
            assert_eq!(bits(out), bits(&rows(&full[t], nodes)), "{name}, step {t}");
        }
        // Changed in the middle, the region shows the published state.
        regional.set_region(None).unwrap();
        let mut now = vec![0.0; 3 * regional.node_count()];
        regional.read(&mut now).unwrap();
        assert_eq!(bits(&now), bits(&full[19]), "{name}");

        let saved = scene(&model, &with(1));
        rollout(&saved, 9);
        let resumed = scene(&model, &with(1));
        resumed.restore(&saved.save().unwrap()).unwrap();
        for (t, want) in full.iter().enumerate().take(20).skip(9) {
            let mut out = vec![0.0; want.len()];
            resumed
                .step(sparse(&push(&model, t)), Some(&mut out))
                .unwrap();
            assert_eq!(bits(&out), bits(want), "{name}, step {t}");
        }
    }
}

#[test]
fn a_snapshot_knows_its_step_path() {
    let model = model("tiny-upt");
    let (split, whole) = (
        scene(&model, &on(StepPath::Split)),
        scene(&model, &on(StepPath::Whole)),
    );
    let states = [&split, &whole].map(|scene| rollout(scene, 8).pop().unwrap());
    let error = whole.restore(&split.save().unwrap()).unwrap_err();
    assert!(matches!(error, Error::Snapshot(_)), "{error}");
    assert!(error.to_string().contains("step_path"), "{error}");
    let mut out = vec![0.0; states[1].len()];
    whole.read(&mut out).unwrap();
    assert_eq!(
        bits(&out),
        bits(&states[1]),
        "a failed call changes nothing"
    );
    // The other way the fields are decoded again from the latent state.
    split.restore(&whole.save().unwrap()).unwrap();
    split.read(&mut out).unwrap();
    assert!(largest_difference(&out, &states[1]) < 1e-4);
}

#[test]
fn the_path_is_chosen_by_rule_or_measured() {
    let with_step = model("tiny-upt");
    assert_eq!(
        scene(&with_step, &plain()).stats().step_path,
        StepPath::Split,
        "the CPU's rule"
    );
    let measured = scene(&with_step, &on(StepPath::Measured));
    let taken = measured.stats().step_path;
    assert!(
        matches!(taken, StepPath::Split | StepPath::Whole),
        "{taken:?}"
    );
    // The timing left no trace in the state.
    let again = scene(&with_step, &on(taken));
    assert_eq!(
        bits(&rollout(&measured, 12).concat()),
        bits(&rollout(&again, 12).concat())
    );
    let reduced = model("tiny-reduced");
    assert_eq!(
        scene(&reduced, &on(StepPath::Measured)).stats().step_path,
        StepPath::Split
    );
}

#[test]
fn a_missing_or_wrong_step_graph_is_named() {
    find_runtime();
    let create = |folder: &std::path::Path, path| {
        let model = Model::open(folder, &ModelOptions::default()).unwrap();
        Scene::new(model, &on(path))
    };
    let error = create(&fixture::path("tiny-reduced"), StepPath::Whole)
        .err()
        .unwrap();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");

    let folder = copy_of("tiny-upt");
    let path = folder.path().join("bundle.json");
    let mut manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let full = manifest.clone();
    manifest["files"]
        .as_object_mut()
        .unwrap()
        .remove("step.onnx");
    fixture::write_manifest(folder.path(), &mut manifest);
    let error = create(folder.path(), StepPath::Whole).err().unwrap();
    assert!(matches!(error, Error::Unsupported(_)), "{error}");
    assert!(error.to_string().contains("export --step"), "{error}");
    let measured = create(folder.path(), StepPath::Measured).unwrap();
    assert_eq!(measured.stats().step_path, StepPath::Split);

    // Another graph under its name: the split still runs, the whole step says what is wrong.
    let bytes = std::fs::read(folder.path().join("decoder.onnx")).unwrap();
    std::fs::write(folder.path().join("step.onnx"), &bytes).unwrap();
    manifest = full;
    manifest["files"]["step.onnx"] = fixture::entry(&bytes);
    fixture::write_manifest(folder.path(), &mut manifest);
    let error = create(folder.path(), StepPath::Whole).err().unwrap();
    assert!(matches!(error, Error::Bundle { .. }), "{error}");
    let text = error.to_string();
    assert!(
        text.contains("step.onnx") && text.contains("features"),
        "{text}"
    );
    assert!(create(folder.path(), StepPath::Split).is_ok());
    let measured = create(folder.path(), StepPath::Measured).unwrap();
    assert_eq!(measured.stats().step_path, StepPath::Split);
}

#[test]
fn a_stream_needs_a_gpu_provider() {
    find_runtime();
    let options = ModelOptions {
        // SAFETY: no provider is asked for, so that nothing ever runs on it.
        user_stream: Some(unsafe { UserStream::new(std::ptr::dangling_mut()) }),
        ..ModelOptions::default()
    };
    let error = Model::open(&fixture::path("tiny-upt"), &options)
        .err()
        .unwrap();
    assert!(matches!(error, Error::Argument(_)), "{error}");
    assert!(error.to_string().contains("user_stream"), "{error}");
}
