//! A step of a scene at rest, which costs nothing.

use std::sync::Arc;
use std::time::Instant;

use upt::{Model, Scene, SceneOptions};

use super::measure::{Row, quick};
use super::{FREE, options};

/// Steps within which a trained bundle falls asleep; random weights may never do.
const PATIENCE: usize = 60;

/// The row of a bundle whose scene falls asleep.
pub fn measure(model: &Arc<Model>, name: &str) -> upt::Result<()> {
    let scene = Scene::new(
        Arc::clone(model),
        &SceneOptions {
            sleep: true,
            ..options(1)
        },
    )?;
    for _ in 0..PATIENCE {
        scene.step(FREE, None)?;
        if scene.stats().sleeping {
            break;
        }
    }
    if !scene.stats().sleeping {
        return Ok(());
    }
    let times: Vec<f64> = (0..if quick() { 100 } else { 1000 })
        .map(|_| {
            let start = Instant::now();
            scene
                .step(FREE, None)
                .map(|()| start.elapsed().as_secs_f64() * 1e6)
        })
        .collect::<upt::Result<_>>()?;
    Row::new(format!("{name}/sleeping step"), gauge::median(times), "us")
        .limits(Some(10.0), None)
        .print();
    Ok(())
}
