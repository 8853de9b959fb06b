//! A bundle under tools: its scene is stepped through poses, and what becomes of the tissue is looked at.

use std::path::Path;

use anyhow::Result;
use contact::Body;
use tissue::solver::{Tool, ToolPose};
use upt::flag;

use crate::bench::{Bench, names};
use crate::stress::Row;
use yardstick::drive::{Drive, Driver};
use yardstick::yard::Yard;

/// Flags that say that elements are inside out, or that the answer is the linear one.
const INVERTED: u32 = flag::INVERTED | flag::FELL_BACK;
/// A tool this deep in the tissue must raise a flag, mm: the library tells of 1 mm at its samples, and a point between samples that are
/// 1.7 mm apart lies at most 1 mm from one.
const DEEP_MM: f64 = 2.0;
/// Steps without tools after which the tissue must be at rest, and how near, mm.
const REST_STEPS: usize = 400;
const REST_MM: f32 = 0.05;

/// What a run came to.
#[derive(Default)]
pub struct Run {
    pub steps: usize,
    pub flags: u32,
    pub largest: f32,
    pub det: f64,
    /// Steps with an element inside out, and those of them without a flag.
    pub inverted: usize,
    pub silent: usize,
    /// Deepest point of the surface in a tool, and steps that are deep without a flag, mm.
    pub depth: f64,
    pub silent_depth: usize,
    pub finite: bool,
    pub other: Option<String>,
}

impl Run {
    pub fn new() -> Self {
        Self {
            det: 1.0,
            finite: true,
            ..Self::default()
        }
    }

    pub fn text(&self) -> String {
        let mut text = format!(
            "{} steps, |u| at most {:.2} mm, det F from {:.2}, inverted {} ({} without a flag), {:.2} mm deep at most, flags {}",
            self.steps,
            self.largest,
            self.det,
            self.inverted,
            self.silent,
            self.depth,
            names(self.flags)
        );
        if self.silent_depth > 0 {
            text += &format!(", deep without a flag in {} steps", self.silent_depth);
        }
        if let Some(error) = &self.other {
            text += &format!("; error: {error}");
        }
        text
    }

    pub fn sound(&self, bound: f32) -> bool {
        self.finite
            && self.other.is_none()
            && self.largest <= bound
            && self.silent == 0
            && self.silent_depth == 0
    }
}

/// A bundle under tools.
pub struct Hands<'a> {
    pub bench: &'a Bench,
    pub driver: Driver,
    pub yard: Yard,
    pub field: Vec<[f32; 3]>,
    /// Length of a step.
    pub step_s: f64,
}

impl<'a> Hands<'a> {
    /// With the bundle's steps.
    pub fn new(bench: &'a Bench, path: &Path) -> Result<Self> {
        let settings = host::ModelSettings::default();
        Self::of(bench, &host::Model::open(path, &settings)?)
    }

    /// With those that it recommends for frames.
    pub fn for_frames(bench: &'a Bench, path: &Path) -> Result<Self> {
        let settings = host::ModelSettings::default();
        Self::of(bench, &host::Model::open(path, &settings)?.for_frames())
    }

    /// With the steps of a model.
    pub fn of(bench: &'a Bench, model: &host::Model) -> Result<Self> {
        Ok(Self {
            bench,
            step_s: model.step_s(),
            driver: Driver::new(model, Drive::Solved)?,
            yard: Yard::new(&bench.mesh, bench.boundary),
            field: vec![[0.0; 3]; bench.mesh.node_count()],
        })
    }

    /// Steps tools through poses and adds to `run`.
    pub fn drive(
        &mut self,
        run: &mut Run,
        tools: &[Tool],
        frames: impl Iterator<Item = Vec<ToolPose>>,
    ) -> Result<()> {
        self.driver.take(tools)?;
        let bodies: Vec<Body> = tools
            .iter()
            .map(|tool| Body::new(&tool.shape))
            .collect::<Result<_, _>>()?;
        for poses in frames {
            let flags = match self.driver.step(&poses, &mut self.field) {
                Ok(step) => step.flags,
                Err(error) => {
                    run.other = Some(format!("{error:#}"));
                    break;
                }
            };
            run.steps += 1;
            run.flags |= flags;
            for u in self.field.as_flattened() {
                run.finite &= u.is_finite();
                run.largest = run.largest.max(u.abs());
            }
            let det = self.yard.smallest_det(&self.field);
            run.det = run.det.min(det);
            if det <= 0.0 {
                run.inverted += 1;
                run.silent += usize::from(flags & INVERTED == 0);
            }
            let places: Vec<_> = poses.iter().map(|to| to.pose).collect();
            let depth = self.yard.penetration(&self.field, &bodies, &places);
            run.depth = run.depth.max(depth);
            run.silent_depth += usize::from(depth > DEEP_MM && flags == 0);
        }
        Ok(())
    }

    /// What is left after steps without tools, mm.
    pub fn left(&mut self) -> Result<f32> {
        let mut run = Run::new();
        self.drive(&mut run, &[], std::iter::repeat_n(Vec::new(), REST_STEPS))?;
        let left = self.field.as_flattened().iter();
        let left = left.fold(0.0f32, |m, u| m.max(u.abs()));
        match run.other {
            Some(error) => Err(anyhow::anyhow!(
                "without tools, step {}: {error}",
                run.steps + 1
            )),
            None => Ok(left),
        }
    }

    /// A row of one run from rest, with a look at whether the tissue comes back.
    pub fn row(
        &mut self,
        case: &str,
        tools: &[Tool],
        frames: impl Iterator<Item = Vec<ToolPose>>,
    ) -> Result<Row> {
        self.driver.reset()?;
        let mut run = Run::new();
        self.drive(&mut run, tools, frames)?;
        self.judged(case, &run, true)
    }

    pub fn judged(&mut self, case: &str, run: &Run, more: bool) -> Result<Row> {
        let (rest, after) = match self.left() {
            Ok(left) => (left < REST_MM, format!("{left:.3} mm left 20 s after")),
            Err(error) => (false, format!("{error:#}")),
        };
        let bound = self.bench.bound.max(40.0);
        let text = format!("{}; {after}", run.text());
        let good = more && rest && run.sound(bound);
        Ok(Row::new(&self.bench.subject, case, text, good))
    }
}
