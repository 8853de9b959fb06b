//! What a trajectory says about tools: poses, wrenches and the forces at the samples of contact (docs/reference/formats.md).

use crate::solver::{FrameReport, Tool, ToolPose};
use crate::tensors::{self, Dtype, Tensor};
use contact::Pose;
use safetensors::SafeTensors;

/// Tools over all frames. `F` frames, `n` tools, `M` forces at samples over all frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToolTracks {
    /// `[n]`, the metadata `tools`.
    pub tools: Vec<Tool>,
    /// `[F,n,7]` at the end of the frame: position, mm; unit quaternion x, y, z, w.
    pub poses: Vec<[f32; 7]>,
    /// `[F,n]` 1 where the tool grasps.
    pub grasp: Vec<u32>,
    /// `[F,n]` samples that it holds.
    pub held: Vec<u32>,
    /// `[F,n,6]` of the tissue on the tool: force, mN; torque about its position, mN mm.
    pub wrenches: Vec<[f32; 6]>,
    /// `[F,n]` samples that push or pull.
    pub contacts: Vec<u32>,
    /// `[F,n]` deepest sample within the frame, mm.
    pub penetration: Vec<f32>,
    /// `[F+1]` rows of the arrays of samples.
    pub sample_offsets: Vec<u32>,
    /// `[M]` tool, ascending in a row.
    pub sample_tools: Vec<u32>,
    /// `[M]` row of the mesh's samples.
    pub sample_rows: Vec<u32>,
    /// `[M,3]` force on the tissue, mN.
    pub sample_forces: Vec<[f32; 3]>,
}

/// Position and quaternion x, y, z, w.
fn numbers(pose: &Pose) -> [f32; 7] {
    let [x, y, z] = pose.translation.to_array();
    let [a, b, c, d] = pose.rotation.to_array();
    [x, y, z, a, b, c, d]
}

impl ToolTracks {
    /// The frame at rest: tools where they start.
    pub fn at_rest(tools: &[Tool], start: &[Pose]) -> Self {
        let count = tools.len();
        Self {
            tools: tools.to_vec(),
            poses: start.iter().map(numbers).collect(),
            grasp: vec![0; count],
            held: vec![0; count],
            wrenches: vec![[0.0; 6]; count],
            contacts: vec![0; count],
            penetration: vec![0.0; count],
            sample_offsets: vec![0, 0],
            ..Self::default()
        }
    }

    /// Adds a frame.
    pub fn push(&mut self, poses: &[ToolPose], report: &FrameReport) {
        for (to, felt) in poses.iter().zip(&report.tools) {
            let ([a, b, c], [d, e, f]) = (felt.force, felt.torque);
            self.poses.push(numbers(&to.pose));
            self.grasp.push(u32::from(to.grasp));
            self.held.push(felt.held);
            self.wrenches.push([a, b, c, d, e, f]);
            self.contacts.push(felt.contacts);
            self.penetration.push(felt.penetration_mm);
        }
        for entry in &report.sample_forces {
            self.sample_tools.push(entry.tool);
            self.sample_rows.push(entry.sample);
            self.sample_forces.push(entry.force);
        }
        self.sample_offsets.push(self.sample_rows.len() as u32);
    }

    /// Poses of one frame, as the solver takes them.
    pub fn frame(&self, frame: usize) -> Vec<ToolPose> {
        let count = self.tools.len();
        let rows = frame * count..(frame + 1) * count;
        rows.map(|row| {
            let [x, y, z, a, b, c, d] = self.poses[row];
            ToolPose {
                pose: Pose::from_parts(
                    contact::Vector::new(x, y, z),
                    contact::Rotation::from_array([a, b, c, d]),
                ),
                grasp: self.grasp[row] != 0,
            }
        })
        .collect()
    }

    /// Tensors of the file.
    pub(crate) fn tensors(&self) -> Vec<Tensor> {
        let count = self.tools.len();
        let frames = self.sample_offsets.len() - 1;
        let integers = |name: &str, shape: Vec<usize>, values: &[u32]| {
            let bytes = values.iter().flat_map(|v| (*v as i32).to_le_bytes());
            Tensor::new(name, Dtype::I32, shape, bytes.collect())
        };
        let floats = |name: &str, shape: Vec<usize>, values: &[f32]| {
            let bytes = values.iter().flat_map(|v| v.to_le_bytes());
            Tensor::new(name, Dtype::F32, shape, bytes.collect())
        };
        let each = vec![frames, count];
        let entries = self.sample_rows.len();
        vec![
            floats(
                "tool_poses",
                vec![frames, count, 7],
                self.poses.as_flattened(),
            ),
            integers("tool_grasp", each.clone(), &self.grasp),
            integers("tool_held", each.clone(), &self.held),
            floats(
                "tool_wrenches",
                vec![frames, count, 6],
                self.wrenches.as_flattened(),
            ),
            integers("tool_contacts", each.clone(), &self.contacts),
            floats("tool_penetration", each, &self.penetration),
            integers(
                "sample_offsets",
                vec![self.sample_offsets.len()],
                &self.sample_offsets,
            ),
            integers("sample_tools", vec![entries], &self.sample_tools),
            integers("sample_rows", vec![entries], &self.sample_rows),
            floats(
                "sample_forces",
                vec![entries, 3],
                self.sample_forces.as_flattened(),
            ),
        ]
    }

    /// Reads the tensors of a file of `frames` frames whose metadata has `tools`; an error is the field and what is wrong.
    pub(crate) fn read(
        file: &SafeTensors,
        tools: &str,
        frames: usize,
    ) -> Result<Self, (String, String)> {
        let tools: Vec<Tool> = serde_json::from_str(tools).map_err(|error| {
            (
                "tools".to_string(),
                format!("is not a list of tools ({error})"),
            )
        })?;
        let bytes = |name: &str, shape: &[usize], dtype| {
            let fail = |reason: String| (name.to_string(), reason);
            let view = file.tensor(name).map_err(|_| fail("is missing".into()))?;
            let fits = view.shape().len() == shape.len()
                && view
                    .shape()
                    .iter()
                    .zip(shape)
                    .all(|(a, b)| *b == ANY || a == b);
            if !fits || view.dtype() != dtype {
                return Err(fail(format!("is {:?} {:?}", view.dtype(), view.shape())));
            }
            Ok(view.data().to_vec())
        };
        let integers = |name: &str, shape: &[usize]| -> Result<Vec<u32>, (String, String)> {
            let data = bytes(name, shape, safetensors::Dtype::I32)?;
            Ok(tensors::i32_values(&data).map(|v| v as u32).collect())
        };
        let floats = |name: &str, shape: &[usize]| -> Result<Vec<f32>, (String, String)> {
            let data = bytes(name, shape, safetensors::Dtype::F32)?;
            Ok(tensors::f32_values(&data).collect())
        };
        let each = [frames, tools.len()];
        let tracks = Self {
            poses: floats("tool_poses", &[frames, tools.len(), 7])?
                .as_chunks()
                .0
                .to_vec(),
            grasp: integers("tool_grasp", &each)?,
            held: integers("tool_held", &each)?,
            wrenches: floats("tool_wrenches", &[frames, tools.len(), 6])?
                .as_chunks()
                .0
                .to_vec(),
            contacts: integers("tool_contacts", &each)?,
            penetration: floats("tool_penetration", &each)?,
            sample_offsets: integers("sample_offsets", &[frames + 1])?,
            sample_tools: integers("sample_tools", &[ANY])?,
            sample_rows: integers("sample_rows", &[ANY])?,
            sample_forces: floats("sample_forces", &[ANY, 3])?.as_chunks().0.to_vec(),
            tools,
        };
        let entries = tracks.sample_rows.len();
        let offsets = &tracks.sample_offsets;
        if offsets.windows(2).any(|w| w[1] < w[0])
            || offsets[frames] as usize != entries
            || tracks.sample_tools.len() != entries
            || tracks.sample_forces.len() != entries
        {
            let reason = format!("does not describe {frames} rows of {entries} forces");
            return Err(("sample_offsets".into(), reason));
        }
        Ok(tracks)
    }
}

/// A length that the file decides.
const ANY: usize = usize::MAX;
