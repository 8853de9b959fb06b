//! Finding ONNX Runtime: what is missing or broken gives a clear error and no hang, and a good one still loads after.

use std::path::PathBuf;

use upt::{InitOptions, Model, ModelOptions, Provider, SceneOptions};

fn try_with(path: PathBuf) -> upt::Error {
    upt::init(&InitOptions {
        threads: 0,
        onnxruntime_path: Some(path),
    })
    .unwrap();
    let error = Model::open(&fixture::path("tiny-upt"), &ModelOptions::default())
        .map(|_| ())
        .unwrap_err();
    upt::shutdown().unwrap();
    error
}

/// One test: the library can be loaded only once a process, so order matters.
#[test]
fn bad_libraries_are_errors_and_a_good_one_loads_after_them() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("libonnxruntime.so");
    let error = try_with(missing.clone());
    assert_eq!(error.status(), -20);
    assert!(
        error.to_string().contains(missing.to_str().unwrap()),
        "{error}"
    );

    let broken = folder.path().join("broken.so");
    std::fs::write(&broken, b"not a library").unwrap();
    let error = try_with(broken);
    assert_eq!(error.status(), -20);
    assert!(error.to_string().contains("broken.so"), "{error}");

    #[cfg(target_os = "linux")]
    {
        // A library, but not ONNX Runtime.
        let error = try_with(PathBuf::from("/lib/x86_64-linux-gnu/libm.so.6"));
        assert_eq!(error.status(), -20, "{error}");
    }

    fixture::find_runtime();
    let model = Model::open(&fixture::path("tiny-upt"), &ModelOptions::default()).unwrap();
    let description: serde_json::Value = serde_json::from_str(&model.describe_json()).unwrap();
    assert_eq!(description["stages"]["latent"], "cpu");
    assert!(description["latent_nodes"]["CPUExecutionProvider"].as_u64() > Some(10));
    assert!(
        description["onnxruntime"]["path"]
            .as_str()
            .unwrap()
            .contains("onnxruntime")
    );

    // Providers: an honest answer, and an honest fallback. A plugin that is not one is named with its file.
    let plugin = folder.path().join("broken.so");
    // SAFETY: this test is the only one of its process and no other thread reads the environment now.
    unsafe { std::env::set_var("UPT_TENSORRT_RTX_PATH", &plugin) };
    let providers: serde_json::Value =
        serde_json::from_str(&upt::providers_json().unwrap()).unwrap();
    assert_eq!(providers[0]["name"], "cpu");
    assert_eq!(providers[0]["available"], true);
    let wish = ModelOptions {
        providers: vec![Provider::TensorRtRtx, Provider::Cuda],
        ..ModelOptions::default()
    };
    let model = Model::open(&fixture::path("tiny-upt"), &wish).unwrap();
    let description: serde_json::Value = serde_json::from_str(&model.describe_json()).unwrap();
    if model.info().provider == Provider::Cpu {
        let refused = description["providers_refused"].as_array().unwrap();
        assert_eq!(refused.len(), 2);
        let reason = refused[0]["reason"].as_str().unwrap();
        assert!(reason.contains("broken.so"), "{reason}");
        assert!(!refused[1]["reason"].as_str().unwrap().is_empty());
        let strict = ModelOptions {
            fallback: false,
            ..wish
        };
        let error = Model::open(&fixture::path("tiny-upt"), &strict)
            .map(|_| ())
            .unwrap_err();
        assert_eq!(error.status(), -21);
        assert!(error.to_string().contains("cuda"), "{error}");
    }
    upt::Scene::new(model, &SceneOptions::default()).unwrap();
}
