//! The committed bindings are what the generator writes today.

#[test]
fn committed_bindings_are_fresh() {
    for output in upt_bindgen::outputs().unwrap() {
        let path = upt_bindgen::root().join(output.path);
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            committed == output.text,
            "{} is stale; run `cargo xtask header`",
            output.path
        );
    }
}
