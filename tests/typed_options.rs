//! Options that make no sense on this machine, and points that are no places, are told with their names.

use upt::kernels::decoder::DecoderPrecision;
use upt::{ModelOptions, Precision, Provider, SceneOptions};

fn refused(options: &ModelOptions) -> String {
    let error = upt::Model::open(&fixture::path("tiny-upt"), options)
        .err()
        .unwrap();
    assert_eq!(error.status(), -2, "{error}");
    error.to_string()
}

#[test]
fn options_of_a_gpu_without_one_are_refused_by_name() {
    fixture::find_runtime();
    let negative = ModelOptions {
        device_id: -1,
        ..ModelOptions::default()
    };
    assert!(refused(&negative).contains("device_id is -1"));
    let limited = ModelOptions {
        gpu_memory_limit: 1 << 30,
        providers: vec![Provider::Cpu],
        ..ModelOptions::default()
    };
    assert!(refused(&limited).contains("gpu_memory_limit"));
}

#[test]
fn a_point_that_is_no_place_is_told_from_one_that_is_no_number() {
    let scene = fixture::scene(&fixture::model("tiny-upt"), &fixture::plain());
    let status = |points: &[f32]| scene.attach_points(Some(points)).unwrap_err();
    let far = status(&[10.0, 10.0, 10.0, 0.0, 1e7, 0.0]);
    assert_eq!(far.status(), -2, "{far}");
    assert!(far.to_string().contains("points: element 1"), "{far}");
    let none = status(&[f32::NAN, 0.0, 0.0]);
    assert_eq!(none.status(), -6, "{none}");
}

/// A zeroed option inherits; float32 has a value of its own.
#[test]
fn a_scene_of_a_bf16_model_can_ask_for_float32() {
    let options = ModelOptions {
        precision: Some(Precision::Bf16),
        ..ModelOptions::default()
    };
    fixture::find_runtime();
    let model = upt::Model::open(&fixture::path("tiny-upt"), &options).unwrap();
    let inherited = fixture::scene(&model, &SceneOptions::default());
    let asked = SceneOptions {
        precision: Some(Precision::F32),
        ..SceneOptions::default()
    };
    let plain = fixture::scene(&model, &asked);
    assert_eq!(plain.stats().precision, Precision::F32);
    // Where bf16 is not faster, what runs is float32.
    let wanted = match DecoderPrecision::fastest_bf16() {
        DecoderPrecision::F32 => Precision::F32,
        DecoderPrecision::Bf16Vectors | DecoderPrecision::Bf16Tiles => Precision::Bf16,
    };
    assert_eq!(inherited.stats().precision, wanted);
}
