//! Error metrics against NumPy and SciPy (fixture: tests/fixtures/make_metrics.py).

use safetensors::SafeTensors;
use tissue::metrics::{hausdorff_mm, max_error_mm, mse_mm2, relative_l2};
use tissue::tensors::f32_values;

#[test]
fn metrics_equal_scipys() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/fixtures/metrics.safetensors"
    );
    let bytes = std::fs::read(path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let field = |name: &str| -> Vec<[f32; 3]> {
        let values: Vec<f32> = f32_values(file.tensor(name).unwrap().data()).collect();
        values.as_chunks().0.to_vec()
    };
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let expected: serde_json::Value =
        serde_json::from_str(&header.metadata().as_ref().unwrap()["expected"]).unwrap();
    let number = |key: &str| expected[key].as_f64().unwrap();
    let site = [0, 1, 2].map(|k| expected["site"][k].as_f64().unwrap());
    let (rest, truth, predicted) = (field("rest"), field("truth"), field("predicted"));
    let near = |found: f64, key: &str| {
        assert!((found / number(key) - 1.0).abs() < 1e-6, "{key}: {found}");
    };
    near(mse_mm2(&truth, &predicted), "mse_mm2");
    near(relative_l2(&truth, &predicted), "relative_l2");
    near(max_error_mm(&truth, &predicted), "max_error_mm");
    near(
        hausdorff_mm(&rest, &truth, &predicted, site, number("radius_mm")),
        "hausdorff_mm",
    );
}
