//! Float16 graphs whose numbers leave the range of float16: the step is refused and nothing is left of it.

use std::path::Path;

use anyhow::Result;
use upt::{Contact, Error, Model, ModelOptions, Precision, Scene, SceneOptions, StepInput};

use super::Row;
use crate::bench::{Bench, names, push, ramp};

const CASE: &str = "float16 overflow";
/// Above the largest float16, 65,504, and below the largest input, mm.
const FAR: f32 = 1e5;

/// The case for the bundle at `path`, where it has float16 graphs.
pub(super) fn row(bench: &Bench, path: &Path) -> Result<Row> {
    let options = ModelOptions {
        threads: 1,
        precision: Some(Precision::F16),
        ..Default::default()
    };
    let model = match Model::open(path, &options) {
        Err(Error::Unsupported(_)) => {
            return Ok(Row::left(
                &bench.subject,
                CASE,
                "the bundle has no float16 graphs",
            ));
        }
        model => model?,
    };
    let scene = Scene::new(model, &SceneOptions::default())?;
    let patch = bench.central()?;
    let depth = 0.7 * f64::from(bench.max_push);
    let mut run = bench.run(&scene, 20, |s| push(&patch, patch.inward, ramp(s, depth)));
    let mut before = vec![0.0; 3 * bench.mesh.node_count()];
    let mut after = before.clone();
    scene.read(&mut before)?;
    let given = vec![FAR; before.len()];
    let (nodes, vectors) = push(&patch, patch.inward, f64::from(FAR));
    let input = StepInput {
        displacement: Some(&given),
        contact: Contact::Sparse {
            nodes: &nodes,
            vectors: &vectors,
        },
        ..StepInput::default()
    };
    let refused = match scene.step(input, None) {
        Err(Error::Guard(_)) => true,
        Ok(()) => false,
        Err(error) => return Err(error.into()),
    };
    let flags = scene.stats().flags;
    scene.read(&mut after)?;
    let same = before == after;
    let more = bench.run(&scene, 10, |_| push(&patch, patch.inward, depth));
    run.largest = run.largest.max(more.largest);
    let back = bench.recovers(&scene)?;
    let sound =
        run.sound(bench.bound) && more.sound(bench.bound) && run.refused + more.refused == 0;
    let text = format!(
        "displacement and contact of {FAR:.0} mm: refused: {refused} (flags {}), state unchanged: {same}; before and after it |u| at \
         most {:.2} mm; back to rest after: {back}",
        names(flags),
        run.largest
    );
    let good = refused && same && back && sound;
    Ok(Row::new(&bench.subject, CASE, text, good))
}
