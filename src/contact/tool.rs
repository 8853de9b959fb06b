//! What a host gives: a rigid tool at a pose; and what it gets back of it.

use ::contact::{Body, Pose, Shape, pose};

use crate::error::{Error, Result};
use crate::field::INPUT_LIMIT;
use crate::memory;

/// A tool that is farther than this from where it was has been put there, not moved, mm.
pub(crate) const PUT_MM: f32 = 40.0;
/// Tools at once.
pub const MAX_TOOLS: usize = 64;

/// How a tool holds the tissue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Pushes, with Coulomb friction.
    #[default]
    Slide,
    /// Holds what it touches when it closes, until it opens or the tissue tears off.
    Grasp,
}

/// A rigid tool where it is at the end of a step.
#[derive(Clone, Debug)]
pub struct Tool {
    /// Its shape.
    pub body: Body,
    /// Where it is, mm, in the mesh's frame.
    pub pose: Pose,
    /// How it holds.
    pub mode: Mode,
    /// Coulomb's coefficient.
    pub friction: f32,
    /// A grasp lets go where its samples pull harder than this together, mN; 0: never.
    pub tear_off_mn: f32,
}

impl Tool {
    /// A sliding tool without friction.
    ///
    /// # Errors
    /// [`Error::Argument`] for a shape that no tool has, [`Error::NonFinite`] for its pose; `index` names it.
    pub fn new(
        index: usize,
        shape: &Shape,
        position: [f32; 3],
        rotation: [f32; 4],
    ) -> Result<Tool> {
        let body = Body::new(shape)
            .map_err(|error| Error::Argument(format!("instruments[{index}]: {error}")))?;
        Tool::of_body(index, body, position, rotation)
    }

    /// The same of a shape that is ready.
    ///
    /// # Errors
    /// As [`Tool::new`].
    pub fn of_body(
        index: usize,
        body: Body,
        position: [f32; 3],
        rotation: [f32; 4],
    ) -> Result<Tool> {
        let pose = pose::checked(position, rotation).map_err(|error| {
            let message = format!("instruments[{index}]: {error}");
            match error {
                pose::PoseError::NotFinite => Error::NonFinite(message),
                pose::PoseError::NotUnit { .. } => Error::Argument(message),
            }
        })?;
        if position.iter().any(|x| x.abs() > INPUT_LIMIT) {
            return Err(Error::Argument(format!(
                "instruments[{index}]: position is {position:?}, beyond {INPUT_LIMIT} mm; units are mm"
            )));
        }
        Ok(Tool {
            body,
            pose,
            mode: Mode::Slide,
            friction: 0.0,
            tear_off_mn: 0.0,
        })
    }

    /// Whether another tool is this one at the same place, told from their bits; equal hulls made twice are two.
    pub(crate) fn is_same(&self, other: &Tool) -> bool {
        let bits = |tool: &Tool| {
            let (at, turn) = (tool.pose.translation, tool.pose.rotation);
            let [x, y, z] = at.to_array();
            let [i, j, k, w] = turn.to_array();
            [x, y, z, i, j, k, w, tool.friction, tool.tear_off_mn].map(f32::to_bits)
        };
        self.mode == other.mode && bits(self) == bits(other) && self.body.is_same(&other.body)
    }

    /// Friction and tear-off force are numbers that a tool can have; `index` names it.
    ///
    /// # Errors
    /// [`Error::Argument`].
    pub fn check(&self, index: usize) -> Result<()> {
        for (field, value) in [
            ("friction", self.friction),
            ("tear_off_mn", self.tear_off_mn),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::Argument(format!(
                    "instruments[{index}]: {field} is {value}; it must be zero or positive"
                )));
            }
        }
        Ok(())
    }
}

/// What the tissue does to a tool at the end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Force on the tool, mN.
    pub force: [f32; 3],
    /// Torque on the tool about its position, mN mm.
    pub torque: [f32; 3],
    /// Samples that push or hold.
    pub contacts: u32,
    /// How deep the deepest sample lies inside of the tool, mm.
    pub penetration_mm: f32,
    /// The grasp tore off in this step.
    pub torn: bool,
    /// What the step's last contact solve left unsolved, mm.
    pub residual_mm: f32,
}

/// A sample that pushes or holds a tool.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Push {
    /// Place in the list of tools.
    pub tool: u32,
    /// Where it is, mm.
    pub point: [f32; 3],
    /// On the tool, mN.
    pub force: [f32; 3],
}

/// What the tools of the last step were told.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// One a tool.
    pub readings: Vec<Reading>,
    /// Ascending by tool.
    pub pushes: Vec<Push>,
}

impl Told {
    /// Room for what so many tools and samples are told.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn fit(&mut self, tools: usize, pushes: usize) -> Result<()> {
        const WHAT: &str = "the readings of instruments";
        memory::fit(&mut self.readings, tools, WHAT)?;
        memory::fit(&mut self.pushes, pushes, WHAT)
    }

    /// No tools.
    pub fn clear(&mut self) {
        self.readings.clear();
        self.pushes.clear();
    }
}
