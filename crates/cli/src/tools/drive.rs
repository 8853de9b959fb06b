//! How the library is driven by the poses of tools, through the C calls of a host.

use std::time::Instant;

use anyhow::{Context, Result, bail};
use contact::{Body, Pose, Shape, Vector};
use tissue::solver::{Tool, ToolPose};
use upt::ffi;

use crate::host;

/// A way to drive it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// `upt_scene_contacts_from_instruments`, then `upt_scene_step_contacts`: each touched node is projected on its own.
    Geometric,
}

impl Drive {
    /// All of them.
    pub const ALL: [Drive; 1] = [Drive::Geometric];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Drive::Geometric => "geometric rule",
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

/// A scene that tools drive.
pub struct Driver {
    drive: Drive,
    scene: host::Scene,
    rest: Vec<Vector>,
    tools: Vec<(Tool, Body)>,
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
            rest: positions.into_iter().map(Vector::from).collect(),
            tools: Vec::new(),
            nodes: Vec::new(),
            vectors: Vec::new(),
        })
    }

    /// Other tools; the tissue stays as it is.
    ///
    /// # Errors
    /// A shape that this way of driving does not have.
    pub fn take(&mut self, tools: &[Tool]) -> Result<()> {
        let taken = tools.iter().enumerate().map(|(index, tool)| {
            self.instrument(tool, &Pose::IDENTITY)
                .with_context(|| format!("tool {index}"))?;
            Ok((tool.clone(), Body::new(&tool.shape)?))
        });
        self.tools = taken.collect::<Result<_>>()?;
        Ok(())
    }

    /// Back to rest.
    pub fn reset(&mut self) -> Result<()> {
        self.scene.reset()
    }

    /// One step with the tools at `poses` at its end; `out` `[K]` is the state after it, mm.
    pub fn step(&mut self, poses: &[ToolPose], out: &mut [[f32; 3]]) -> Result<Step> {
        let instruments = self.tools.iter().zip(poses);
        let instruments: Vec<ffi::upt_instrument> = instruments
            .map(|((tool, _), to)| self.instrument(tool, &to.pose))
            .collect::<Result<_>>()?;
        match self.drive {
            Drive::Geometric => self.geometric(&instruments, poses, out),
        }
    }

    fn geometric(
        &mut self,
        instruments: &[ffi::upt_instrument],
        poses: &[ToolPose],
        out: &mut [[f32; 3]],
    ) -> Result<Step> {
        let started = Instant::now();
        self.scene
            .contacts(instruments, &mut self.nodes, &mut self.vectors)?;
        let found_ms = started.elapsed().as_secs_f64() * 1e3;
        self.scene.step(&self.nodes, &self.vectors, out)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let stats = self.scene.stats()?;
        let forces = if self.nodes.is_empty() {
            Vec::new()
        } else {
            self.scene.contact_force(self.nodes.len())?
        };
        let mut step = Step {
            ms,
            contact_ms: found_ms + stats.prior_ms,
            flags: stats.flags,
            felt: vec![Felt::default(); poses.len()],
            loads: Vec::new(),
        };
        for ((node, u), force) in self.nodes.iter().zip(&self.vectors).zip(forces) {
            let point = self.rest[*node as usize] + Vector::from(*u);
            let nearest = self.tools.iter().zip(poses).enumerate();
            let nearest = nearest
                .map(|(index, ((_, body), to))| (index, body.nearest_at(&to.pose, point)))
                .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
            let Some((index, nearest)) = nearest else {
                continue;
            };
            let force = Vector::from(force);
            let felt = &mut step.felt[index];
            felt.contacts += 1;
            let torque = (point - poses[index].pose.translation).cross(force);
            for k in 0..3 {
                felt.force[k] += f64::from(force[k]);
                felt.torque[k] += f64::from(torque[k]);
            }
            step.loads.push(load(index, -force, nearest.normal));
        }
        Ok(step)
    }

    /// A tool as the C interface takes it.
    fn instrument(&self, tool: &Tool, pose: &Pose) -> Result<ffi::upt_instrument> {
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
            Shape::Hull { .. } | Shape::Mesh { .. } => bail!(
                "a {} cannot be driven by the {}: it takes spheres, capsules, boxes and spatulas",
                if matches!(tool.shape, Shape::Hull { .. }) {
                    "hull"
                } else {
                    "surface of triangles"
                },
                self.drive.name()
            ),
        };
        Ok(host::instrument(
            shape,
            half_extents,
            radius,
            pose.translation.to_array(),
            pose.rotation.to_array(),
        ))
    }
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
