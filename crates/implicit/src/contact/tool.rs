//! What a host gives: a rigid tool at a pose; and what it gets back of it.

use ::contact::{Body, Pose, Shape, pose};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::field::INPUT_LIMIT;
use crate::memory::{self, HeldBytes};

/// A tool that is farther than this from where it was has been put there, not moved, mm.
pub const PUT_MM: f32 = 40.0;
/// Tools at once.
pub const MAX_TOOLS: usize = 64;

/// How a tool holds the tissue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, HeldBytes, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Pushes, with Coulomb friction.
    #[default]
    Slide,
    /// Holds what it touches when it closes, until it opens or the tissue tears off.
    Grasp,
}

/// A rigid tool where it is at the end of a step.
#[derive(Clone, Debug, HeldBytes)]
pub struct Tool {
    /// Its shape.
    #[held(skip)]
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
    /// A sliding tool without friction: `position` in mm, `rotation` a unit quaternion `[x, y, z, w]`.
    ///
    /// ```
    /// use contact::Shape; // `upt` has all of these
    /// use implicit::Error;
    /// use implicit::contact::{Mode, Tool};
    ///
    /// let rod = Shape::Capsule { half_length: 20.0, radius: 2.5 };
    /// let mut tool = Tool::new(&rod, [0.0, 0.0, 30.0], [0.0, 0.0, 0.0, 1.0])?;
    /// tool.mode = Mode::Grasp;
    /// tool.tear_off_mn = 400.0;
    ///
    /// let lost = Tool::new(&rod, [f32::NAN, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
    /// assert!(matches!(lost, Err(Error::NonFinite(_))));
    /// # implicit::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`] for a shape that no tool has, for a rotation that is none and for a place beyond a kilometre,
    /// [`Error::NonFinite`].
    pub fn new(shape: &Shape, position: [f32; 3], rotation: [f32; 4]) -> Result<Tool> {
        let body = Body::new(shape).map_err(|error| Error::Argument(error.to_string()))?;
        Tool::of_body(body, position, rotation)
    }

    /// A tool of a shape that was made ready before, as a hull is.
    ///
    /// # Errors
    /// As [`Tool::new`].
    pub fn of_body(body: Body, position: [f32; 3], rotation: [f32; 4]) -> Result<Tool> {
        let pose = pose::checked(position, rotation).map_err(|error| match error {
            pose::PoseError::NotFinite => Error::NonFinite(error.to_string()),
            pose::PoseError::NotUnit { .. } => Error::Argument(error.to_string()),
        })?;
        if position.iter().any(|x| x.abs() > INPUT_LIMIT) {
            return Err(Error::Argument(format!(
                "position is {position:?}, beyond {INPUT_LIMIT} mm; units are mm"
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
    pub fn is_same(&self, other: &Tool) -> bool {
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
#[derive(Clone, Copy, Debug, Default, PartialEq, HeldBytes)]
pub struct ToolReading {
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

/// What a tie does at the end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, HeldBytes)]
pub struct TieReading {
    /// On the tissue at the tie's point, mN.
    pub force: [f32; 3],
    /// From end to end, mm.
    pub length_mm: f32,
    /// It has broken, in this step or before.
    pub broken: bool,
    /// In this step.
    pub broke: bool,
}

/// What each tool of the last step feels, and the samples that push it.
#[derive(Clone, Debug, Default)]
pub struct ContactReport {
    /// One a tool.
    pub readings: Vec<ToolReading>,
    /// Ascending by tool.
    pub pushes: Vec<Push>,
    /// One a tie.
    pub ties: Vec<TieReading>,
}

impl ContactReport {
    /// Room for the readings of `tools` tools and `ties` ties and for `pushes` samples.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn fit(&mut self, tools: usize, ties: usize, pushes: usize) -> Result<()> {
        const WHAT: &str = "the readings of instruments";
        memory::fit(&mut self.readings, tools, WHAT)?;
        memory::fit(&mut self.ties, ties, WHAT)?;
        memory::fit(&mut self.pushes, pushes, WHAT)
    }

    /// Takes what another holds.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn take(&mut self, other: &ContactReport) -> Result<()> {
        self.fit(other.readings.len(), other.ties.len(), other.pushes.len())?;
        self.clear();
        self.readings.extend_from_slice(&other.readings);
        self.ties.extend_from_slice(&other.ties);
        self.pushes.extend_from_slice(&other.pushes);
        Ok(())
    }

    /// No tools and no ties.
    pub fn clear(&mut self) {
        self.readings.clear();
        self.ties.clear();
        self.pushes.clear();
    }
}
