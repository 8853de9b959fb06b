//! What only a reduced bundle has: a contact solve that is new when the contact nodes are.

use std::sync::Arc;

use gauge::median;
use upt::{Model, Scene};

use super::measure::{Row, quick};
use super::{options, patch, push};

fn steps() -> usize {
    if quick() { 100 } else { 1000 }
}

/// Extra time of a step whose contact nodes are new, against one whose are not.
pub fn site_change(model: &Arc<Model>, name: &str) -> upt::Result<()> {
    let scene = Scene::new(Arc::clone(model), &options(1))?;
    let patches = [patch(&model.mesh, 300), patch(&model.mesh, 301)];
    let (mut same, mut new) = (Vec::new(), Vec::new());
    for t in 0..steps() {
        push(&scene, &patches[(t / 2) % 2], t, None)?;
        let times = if t.is_multiple_of(2) {
            &mut new
        } else {
            &mut same
        };
        times.push(scene.timing().prior_ms);
    }
    let extra = median(new) - median(same);
    Row::new(
        format!("{name}/site change, {} nodes", patches[0].len()),
        extra,
        "ms",
    )
    .limits(Some(5.0), Some(1.0))
    .print();
    Ok(())
}
