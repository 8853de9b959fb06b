//! What drives a step, in a line of a recording.

use std::borrow::Cow;

use ::contact::{Pose, Shape};
use serde::{Deserialize, Serialize};

use crate::contact::{Mode, Tool};
use crate::error::Result;
use crate::memory;

const WHAT: &str = "a recording";

/// Some rows of a field.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rows<'a> {
    pub nodes: Cow<'a, [u32]>,
    /// `[m,3]`.
    pub vectors: Cow<'a, [f32]>,
}

impl Rows<'_> {
    /// The rows of a field `[K,3]` of which any bit is set.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(crate) fn of(field: &[f32]) -> Result<Rows<'static>> {
        let is_set = |row: &[f32; 3]| row.iter().any(|x| x.to_bits() != 0);
        let rows = field.as_chunks::<3>().0;
        let count = rows.iter().filter(|row| is_set(row)).count();
        let set = || (0u32..).zip(rows).filter(|(_, row)| is_set(row));
        let nodes = memory::collected(count, set().map(|(node, _)| node), WHAT)?;
        let vectors = memory::collected(3 * count, set().flat_map(|(_, row)| *row), WHAT)?;
        Ok(Rows {
            nodes: Cow::Owned(nodes),
            vectors: Cow::Owned(vectors),
        })
    }

    /// The field `[K,3]`; none where a node is beyond it, or the numbers are not three a node.
    pub fn field(&self, count: usize) -> Option<Vec<f32>> {
        let mut field = vec![0.0; 3 * count];
        let (places, (rows, rest)) = (field.as_chunks_mut::<3>().0, self.vectors.as_chunks::<3>());
        if rows.len() != self.nodes.len() || !rest.is_empty() {
            return None;
        }
        for (node, row) in self.nodes.iter().zip(rows) {
            *places.get_mut(*node as usize)? = *row;
        }
        Some(field)
    }
}

/// `upt_instrument`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Instrument<'a> {
    /// What it looks like; absent where it is a `hull`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<Cow<'a, Shape>>,
    /// Place among the lines of hulls.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hull: Option<usize>,
    /// mm.
    pub position: [f32; 3],
    /// Unit quaternion x, y, z, w.
    #[serde(default = "no_turn")]
    pub rotation: [f32; 4],
    #[serde(default)]
    pub mode: Mode,
    #[serde(default)]
    pub friction: f32,
    #[serde(default)]
    pub tear_off_mn: f32,
}

fn no_turn() -> [f32; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

impl<'a> Instrument<'a> {
    /// A tool, whose shape is the hull of that place or its own.
    pub(crate) fn new(tool: &'a Tool, hull: Option<usize>) -> Instrument<'a> {
        let plain = hull.is_none().then(|| Cow::Borrowed(tool.body.shape()));
        Instrument {
            shape: plain,
            hull,
            position: tool.pose.translation.to_array(),
            rotation: tool.pose.rotation.to_array(),
            mode: tool.mode,
            friction: tool.friction,
            tear_off_mn: tool.tear_off_mn,
        }
    }

    /// The tool, its pose to the bit where it is a unit quaternion to a float's precision.
    ///
    /// # Errors
    /// Those of [`Tool::new`]; [`crate::Error::Argument`] where it has no shape, two, or a hull that no line has defined.
    pub fn tool(&self, hulls: &[::contact::Body]) -> Result<Tool> {
        let wrong = |why: String| crate::Error::Argument(why);
        let (position, rotation) = (self.position, self.rotation);
        let mut tool = match (&self.shape, self.hull) {
            (Some(shape), None) => Tool::new(shape, position, rotation)?,
            (None, Some(at)) => {
                let body = hulls.get(at).ok_or_else(|| {
                    wrong(format!(
                        "hull {at} has no line before; there are {}",
                        hulls.len()
                    ))
                })?;
                Tool::of_body(body.clone(), position, rotation)?
            }
            _ => return Err(wrong("give one of `shape` and `hull`".into())),
        };
        let given = ::contact::Rotation::from_array(rotation);
        if (given.length() - 1.0).abs() < 1e-6 {
            tool.pose = Pose::from_parts(position.into(), given);
        }
        tool.mode = self.mode;
        (tool.friction, tool.tear_off_mn) = (self.friction, self.tear_off_mn);
        Ok(tool)
    }
}
