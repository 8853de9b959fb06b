//! The committed bindings are what the generator writes today, and what the last release's ABI had stands.

use upt_bindgen::{dump, source};

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

#[test]
fn the_last_releases_abi_stands() {
    let root = upt_bindgen::root();
    let old = std::fs::read_to_string(root.join(dump::PATH)).expect(dump::PATH);
    let faults = dump::broken(&old, &dump::write(&source::read(&root).unwrap()).unwrap());
    assert!(
        faults.is_empty(),
        "{}\nFrom 1.0 on this waits for the next major version. Before it: `cargo xtask header --release`, with a row in \
         docs/reference/from-0.1-to-1.0.md",
        faults.join("\n")
    );
}
