//! Narrower graphs: the variant that the manifest lists is what runs, and one that is not there is an error that says so.

use std::path::Path;
use std::sync::Arc;

use fixture::{BUNDLES, bits, copy_of, find_runtime, plain, rollout, scene};
use upt::{DecoderKernel, Error, Model, ModelOptions, Precision, SceneOptions};

fn open(path: &Path, precision: Precision) -> upt::Result<Arc<Model>> {
    let options = ModelOptions {
        precision: Some(precision),
        ..ModelOptions::default()
    };
    Model::open(path, &options)
}

/// Adds `int8` graphs to a copy of a bundle: the float32 graphs after `change`.
fn with_int8(folder: &Path, change: impl Fn(&str, Vec<u8>) -> Vec<u8>) {
    let mut manifest = fixture::manifest(folder);
    manifest["precisions"] = serde_json::json!(["f32", "int8"]);
    for name in ["latent", "decoder"] {
        let Ok(bytes) = std::fs::read(folder.join(format!("{name}.onnx"))) else {
            continue;
        };
        let bytes = change(name, bytes);
        let file = format!("{name}.int8.onnx");
        std::fs::write(folder.join(&file), &bytes).unwrap();
        manifest["files"][file] = fixture::entry(&bytes);
    }
    fixture::write_manifest(folder, &mut manifest);
}

#[test]
fn a_variant_that_is_not_there_is_named() {
    find_runtime();
    for name in BUNDLES {
        for (precision, variant) in [(Precision::F16, "f16"), (Precision::Int8, "int8")] {
            let error = open(&fixture::path(name), precision).err().unwrap();
            assert!(matches!(error, Error::Unsupported(_)), "{name}: {error}");
            let text = error.to_string();
            assert!(text.contains(&format!("latent.{variant}.onnx")), "{text}");
            assert!(text.contains(&format!("export --{variant}")), "{text}");
        }
        // bfloat16 is an arithmetic of the native kernels.
        assert!(open(&fixture::path(name), Precision::Bf16).is_ok());
    }
}

#[test]
fn the_variants_graphs_run_and_are_reported() {
    find_runtime();
    for name in BUNDLES {
        let folder = copy_of(name);
        with_int8(folder.path(), |_, bytes| bytes);
        let model = open(folder.path(), Precision::Int8).unwrap();
        assert_eq!(model.info().precision, Precision::Int8);
        let narrow = scene(&model, &plain());
        let frames = rollout(&narrow, 12).concat();
        assert_eq!(narrow.stats().precision, Precision::Int8);
        // These variants hold the float32 weights, so their bits are those of the float32 graphs.
        let model = open(folder.path(), Precision::F32).unwrap();
        assert_eq!(model.info().precision, Precision::F32);
        let options = SceneOptions {
            kernel: DecoderKernel::Onnx,
            ..plain()
        };
        let wide = rollout(&scene(&model, &options), 12).concat();
        assert_eq!(bits(&frames), bits(&wide), "{name}");
    }
}

#[test]
fn the_variants_bytes_are_what_is_read() {
    find_runtime();
    for name in BUNDLES {
        let folder = copy_of(name);
        with_int8(folder.path(), |_, _| b"not a graph".to_vec());
        let error = open(folder.path(), Precision::Int8).err().unwrap();
        assert!(error.to_string().contains("latent.int8.onnx"), "{error}");
        assert!(open(folder.path(), Precision::F32).is_ok(), "{name}");
    }
}
