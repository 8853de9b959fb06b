//! How the library is driven by the poses of tools, through the C calls of a host.

mod alone;
mod geometric;
mod linear;
mod solved;

use std::time::Instant;

use anyhow::{Context, Result};
use contact::{Body, Shape, Vector};
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{Tool, ToolPose};
use upt::ffi;

use crate::bundle_folder::BundleFolder;

/// A way to drive it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// `upt_scene_step` with `instruments`: contact is solved in the step.
    Solved,
    /// `upt_scene_contacts_from_instruments`, then `upt_scene_step` with `contact_nodes`: each touched node is projected on its own.
    Geometric,
    /// The linear response of the bundle's tables alone, contact solved as without corrections.
    Linear,
}

impl Drive {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Drive::Solved => "contact solved",
            Drive::Geometric => "geometric rule",
            Drive::Linear => "linear elasticity alone, contact solved",
        }
    }
}

/// Force, torque and contacts of a tool after a step, by the tissue on the tool.
#[derive(Clone, Copy, Debug, Default)]
pub struct Felt {
    /// mN.
    pub force: [f64; 3],
    /// About the tool's position, mN mm.
    pub torque: [f64; 3],
    pub contacts: u32,
    /// How deep tool and tissue lie in each other, mm.
    pub penetration_mm: f64,
}

/// The parts of a force between tool and tissue at one place, mN.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    pub tool: usize,
    /// Along the tool's normal, positive where it pushes.
    pub push: f64,
    /// Size of the rest.
    pub drag: f64,
}

/// What one step came to.
#[derive(Clone, Debug, Default)]
pub struct Step {
    /// Wall time of the calls that make the step, ms.
    pub ms: f64,
    /// Of it, finding and solving contact, ms.
    pub contact_ms: f64,
    pub flags: u32,
    pub felt: Vec<Felt>,
    pub loads: Vec<Load>,
}

/// A tool made ready.
struct Taken {
    tool: Tool,
    body: Body,
    hull: Option<host::Hull>,
}

/// A scene that tools drive.
pub struct Driver {
    drive: Drive,
    scene: host::Scene,
    linear: Option<linear::Linear>,
    rest: Vec<Vector>,
    tools: Vec<Taken>,
    nodes: Vec<u32>,
    vectors: Vec<[f32; 3]>,
}

impl Driver {
    /// A scene at rest, without tools.
    pub fn new(model: &host::Model, drive: Drive) -> Result<Self> {
        let positions = model.positions()?;
        Ok(Self {
            drive,
            scene: host::Scene::create(model, ffi::UPT_KERNEL_AUTO)?,
            linear: None,
            rest: positions.into_iter().map(Vector::from).collect(),
            tools: Vec::new(),
            nodes: Vec::new(),
            vectors: Vec::new(),
        })
    }

    /// [`Drive::Linear`] of a bundle: `mesh` is the bundle's, `decay` the factor a step after a release.
    pub fn of_linear(
        model: &host::Model,
        bundle: &BundleFolder,
        mesh: &Mesh,
        boundary: Boundary,
        decay: f32,
        threads: u32,
    ) -> Result<Self> {
        let samples = mesh.samples(boundary);
        let linear = linear::Linear::new(bundle, samples, &mesh.positions, decay, threads)?;
        Ok(Self {
            linear: Some(linear),
            ..Self::new(model, Drive::Linear)?
        })
    }

    /// Other tools; the tissue stays as it is.
    ///
    /// # Errors
    /// A shape that no tool has, or that this way of driving does not take.
    pub fn take(&mut self, tools: &[Tool]) -> Result<()> {
        let drive = self.drive;
        let taken = tools.iter().enumerate().map(|(index, tool)| {
            let body = Body::new(&tool.shape).with_context(|| format!("tool {index}"))?;
            let hull = hull(drive, &tool.shape).with_context(|| format!("tool {index}"))?;
            Ok(Taken {
                tool: tool.clone(),
                body,
                hull,
            })
        });
        self.tools = taken.collect::<Result<_>>()?;
        Ok(())
    }

    /// Back to rest.
    pub fn reset(&mut self) -> Result<()> {
        if let Some(linear) = &mut self.linear {
            linear.reset();
        }
        self.scene.reset()
    }

    /// One step with the tools at `poses` at its end; `out` `[K]` is the state after it, mm.
    pub fn step(&mut self, poses: &[ToolPose], out: &mut [[f32; 3]]) -> Result<Step> {
        let tools = self.tools.iter().zip(poses);
        let instruments: Vec<ffi::upt_instrument> = tools
            .map(|(taken, to)| instrument(&taken.tool, to, taken.hull.as_ref()))
            .collect();
        match self.drive {
            Drive::Solved => self.solved(&instruments, poses, out),
            Drive::Geometric => self.geometric(&instruments, poses, out),
            Drive::Linear => self.linear(poses, out),
        }
    }

    /// `upt_scene_sample`.
    pub fn sample(&mut self, alpha: f64, out: &mut [[f32; 3]]) -> Result<()> {
        self.scene.sample(alpha, out)
    }

    /// `upt_scene_present`: the tissue `seconds` after the last step, with the tools at `poses`; the time of the call, ms.
    pub fn present(
        &mut self,
        seconds: f64,
        poses: &[ToolPose],
        out: &mut [[f32; 3]],
    ) -> Result<f64> {
        let tools = self.tools.iter().zip(poses);
        let instruments: Vec<ffi::upt_instrument> = tools
            .map(|(taken, to)| instrument(&taken.tool, to, taken.hull.as_ref()))
            .collect();
        let started = Instant::now();
        self.scene.present(seconds, &instruments, out)?;
        Ok(started.elapsed().as_secs_f64() * 1e3)
    }

    /// A hand that holds the first tool, at a pose at first; the steps reach it `latency_ms` after their poses were taken.
    ///
    /// # Errors
    /// No tool was taken, and those of `upt_haptics_create`.
    pub fn hand(&mut self, at: &ToolPose, latency_ms: f32) -> Result<host::Hand> {
        let taken = self.tools.first().context("no tool")?;
        let tool = instrument(&taken.tool, at, taken.hull.as_ref());
        self.scene.hand(&tool, latency_ms)
    }

    /// Nodes that steps and frames write; an empty list means all.
    pub fn set_region(&mut self, nodes: &[u32]) -> Result<()> {
        self.scene.set_region(nodes)
    }

    /// One step with tools that are given to the library as they are, without a look at whether they can be.
    pub fn step_raw(
        &mut self,
        tools: &[Tool],
        poses: &[ToolPose],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        let tools = tools.iter().zip(poses);
        let instruments: Vec<ffi::upt_instrument> =
            tools.map(|(tool, to)| instrument(tool, to, None)).collect();
        self.scene.step_instruments(&instruments, out)
    }
}

/// The hull of a shape that has one.
fn hull(drive: Drive, shape: &Shape) -> Result<Option<host::Hull>> {
    match (shape, drive) {
        (Shape::Hull { points, margin }, Drive::Solved) if *margin == 0.0 => {
            Ok(Some(host::Hull::create(points, &[])?))
        }
        (
            Shape::Mesh {
                points,
                faces,
                margin,
            },
            Drive::Solved,
        ) if *margin == 0.0 => Ok(Some(host::Hull::create(points, faces)?)),
        (_, Drive::Linear) => Ok(None),
        (Shape::Hull { .. } | Shape::Mesh { .. }, _) => anyhow::bail!(
            "the library cannot drive this shape ({}): it takes spheres, capsules, boxes, spatulas and, where contact is solved, hulls and meshes without a margin",
            drive.name()
        ),
        _ => Ok(None),
    }
}

/// A tool as the C interface takes it.
fn instrument(tool: &Tool, to: &ToolPose, hull: Option<&host::Hull>) -> ffi::upt_instrument {
    let (shape, half_extents, radius) = match &tool.shape {
        Shape::Sphere { radius } => (ffi::UPT_SHAPE_CAPSULE, [0.0; 3], *radius),
        Shape::Capsule {
            half_length,
            radius,
        } => (ffi::UPT_SHAPE_CAPSULE, [0.0, *half_length, 0.0], *radius),
        Shape::Box { half_extents } => (ffi::UPT_SHAPE_BOX, *half_extents, 0.0),
        Shape::Spatula {
            half_extents,
            radius,
        } => (ffi::UPT_SHAPE_SPATULA, *half_extents, *radius),
        Shape::Hull { .. } | Shape::Mesh { .. } => (ffi::UPT_SHAPE_HULL, [0.0; 3], 0.0),
    };
    let mut instrument = host::instrument();
    instrument.shape = shape;
    instrument.half_extents = half_extents;
    instrument.radius = radius;
    instrument.position = to.pose.translation.to_array();
    instrument.rotation = to.pose.rotation.to_array();
    instrument.mode = match to.grasp {
        true => ffi::UPT_MODE_GRASP,
        false => ffi::UPT_MODE_SLIDE,
    };
    instrument.friction = tool.friction;
    instrument.tear_off_mn = tool.tear_off_mn;
    instrument.hull = hull.map_or(std::ptr::null(), host::Hull::handle);
    instrument
}

/// The parts of a force on the tissue, the tool's normal given.
pub fn load(tool: usize, force: Vector, normal: Vector) -> Load {
    let push = force.dot(normal);
    Load {
        tool,
        push: f64::from(push),
        drag: f64::from((force - normal * push).length()),
    }
}
