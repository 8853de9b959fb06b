//! Tools that cannot be: typed errors, and the state stays; the same bits for any number of threads and after a reset.

use std::path::Path;

use anyhow::Result;
use contact::{Pose, Rotation, Shape, Vector};
use tissue::solver::{Tool, ToolPose};

use super::Row;
use super::hand::{at, central, rod};
use crate::bench::Bench;
use yardstick::drive::{Drive, Driver};

/// More instruments than a scene takes at once.
const TOO_MANY: usize = 65;

pub(super) fn rows(bench: &Bench, path: &Path) -> Result<Vec<Row>> {
    let mut rows = bad(bench, path)?;
    rows.push(same_bits(bench, path)?);
    Ok(rows)
}

fn driver(path: &Path, threads: u32) -> Result<Driver> {
    let settings = host::ModelSettings {
        threads,
        ..host::ModelSettings::default()
    };
    Driver::new(&host::Model::open(path, &settings)?, Drive::Solved)
}

/// A press of 5 mm within ten steps.
fn press(driver: &mut Driver, bench: &Bench, tool: &Tool, steps: usize) -> Result<Vec<[f32; 3]>> {
    let site = central(bench)?;
    let mut field = vec![[0.0; 3]; bench.mesh.node_count()];
    driver.take(std::slice::from_ref(tool))?;
    for step in 1..=steps {
        let depth = 5.0 * (step as f32 / 10.0).min(1.0);
        driver.step(&[at(tool, &site, depth)?], &mut field)?;
    }
    Ok(field)
}

fn bad(bench: &Bench, path: &Path) -> Result<Vec<Row>> {
    let tool = rod(5.0, 0.2);
    let site = central(bench)?;
    let good = at(&tool, &site, 5.0)?;
    let placed = |translation: Vector, rotation: Rotation| ToolPose {
        pose: Pose::from_parts(translation, rotation),
        grasp: false,
    };
    let (place, turn) = (good.pose.translation, good.pose.rotation);
    let nan = placed(Vector::new(f32::NAN, 0.0, 0.0), turn);
    let far = placed(place * f32::INFINITY, turn);
    let long = placed(place, Rotation::from_array([0.0, 0.0, 0.0, 2.0]));
    let gripping = |friction| Tool {
        friction,
        ..tool.clone()
    };
    let thin = Tool {
        shape: Shape::Capsule {
            half_length: 20.0,
            radius: 0.0,
        },
        ..tool.clone()
    };
    let many = vec![tool.clone(); TOO_MANY];
    let cases: [(&str, Vec<Tool>, ToolPose); 7] = [
        ("a pose that is NaN", vec![tool.clone()], nan),
        ("a pose that is infinite", vec![tool.clone()], far),
        ("a rotation of length 2", vec![tool.clone()], long),
        ("negative friction", vec![gripping(-0.1)], good),
        ("friction that is NaN", vec![gripping(f32::NAN)], good),
        ("a radius of 0", vec![thin], good),
        ("65 tools", many, good),
    ];
    let mut rows = Vec::new();
    for (name, tools, pose) in cases {
        let mut scene = driver(path, 1)?;
        let before = press(&mut scene, bench, &tool, 15)?;
        let mut after = vec![[0.0; 3]; before.len()];
        let poses = vec![pose; tools.len()];
        let refused = scene.step_raw(&tools, &poses, &mut after).err();
        // One step more of the press, compared with a scene that was never asked.
        let mut other = driver(path, 1)?;
        let expected = press(&mut other, bench, &tool, 16)?;
        scene.step_raw(std::slice::from_ref(&tool), &[good], &mut after)?;
        let same = after == expected;
        let told = refused.map(|error| format!("{error:#}"));
        let text = format!(
            "{}; the next step is as if it had not been asked: {same}",
            told.as_deref().unwrap_or("accepted")
        );
        let row = Row::new(&bench.subject, name, text, told.is_some() && same);
        rows.push(row);
    }
    Ok(rows)
}

fn same_bits(bench: &Bench, path: &Path) -> Result<Row> {
    let tool = rod(5.0, 0.3);
    let mut fields = Vec::new();
    for threads in [1, 2, 4] {
        fields.push(press(&mut driver(path, threads)?, bench, &tool, 20)?);
    }
    let mut again = driver(path, 1)?;
    press(&mut again, bench, &rod(8.0, 0.0), 15)?;
    again.reset()?;
    fields.push(press(&mut again, bench, &tool, 20)?);
    let equal = fields.iter().all(|field| *field == fields[0]);
    Ok(Row::new(
        &bench.subject,
        "tools: 1, 2 and 4 threads, and after a reset",
        format!("the same bits: {equal}"),
        equal,
    ))
}
