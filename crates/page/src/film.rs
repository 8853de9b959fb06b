//! A contact that the page plays: how the surface moves, how far it is from the truth, and where it is touched.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use tissue::mesh::Mesh;
use tissue::solver::{Tool, ToolPose};

use crate::organ::surface_nodes;
use crate::tools;

/// Bytes of a film before they become text, about: beyond them frames are left out.
const MOST_BYTES: usize = 6_000_000;

/// Frames of one contact.
pub struct Film {
    title: String,
    step_s: f64,
    nodes: Vec<u32>,
    frames: Vec<Frame>,
    tools: Vec<Tool>,
}

struct Frame {
    /// Displacement of each node of the surface, mm.
    moved: Vec<[f32; 3]>,
    /// Its distance from the truth, mm.
    error: Vec<f32>,
    /// Middle of the touched nodes, mm.
    touched: Option<[f32; 3]>,
    /// Where the tools are.
    poses: Vec<ToolPose>,
}

impl Film {
    pub fn new(mesh: &Mesh, title: String, step_s: f64) -> Self {
        Self {
            title,
            step_s,
            nodes: surface_nodes(mesh).1,
            frames: Vec::new(),
            tools: Vec::new(),
        }
    }

    /// Tools that are shown, in frames that give their poses.
    pub fn take(&mut self, tools: &[Tool]) {
        self.tools = tools.to_vec();
    }

    /// Adds a frame with the tools at `poses`.
    pub fn add_tools(
        &mut self,
        mesh: &Mesh,
        field: &[[f32; 3]],
        truth: &[[f32; 3]],
        poses: &[ToolPose],
    ) {
        self.add(mesh, field, truth, &[]);
        if let Some(frame) = self.frames.last_mut() {
            frame.poses = poses.to_vec();
        }
    }

    /// Adds a frame: the displacements `[K]` of a bundle and of the reference solver, and what is touched.
    pub fn add(&mut self, mesh: &Mesh, field: &[[f32; 3]], truth: &[[f32; 3]], touched: &[u32]) {
        let moved = self.nodes.iter().map(|&node| field[node as usize]);
        let error = self.nodes.iter().map(|&node| {
            let (a, b) = (field[node as usize], truth[node as usize]);
            (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
        });
        let middle = |k: usize| {
            let places = touched
                .iter()
                .map(|&node| mesh.positions[node as usize][k] + field[node as usize][k]);
            places.sum::<f32>() / touched.len() as f32
        };
        self.frames.push(Frame {
            moved: moved.collect(),
            error: error.collect(),
            touched: (!touched.is_empty()).then(|| [0, 1, 2].map(middle)),
            poses: Vec::new(),
        });
    }

    /// For the page: displacements in 16 bits, errors in 8.
    pub fn json(&self) -> Value {
        let bytes = 7 * self.nodes.len() * self.frames.len();
        let every = bytes.div_ceil(MOST_BYTES).max(1);
        let kept = || self.frames.iter().step_by(every);
        let largest = |values: &mut dyn Iterator<Item = f32>| {
            values.fold(f32::MIN_POSITIVE, |most, x| most.max(x.abs()))
        };
        let moved = largest(&mut kept().flat_map(|frame| &frame.moved).flatten().copied());
        let error = largest(&mut kept().flat_map(|frame| &frame.error).copied());
        let shorts = kept()
            .flat_map(|frame| frame.moved.as_flattened())
            .flat_map(|x| ((x / moved * 32767.0).round() as i16).to_le_bytes());
        let small = kept()
            .flat_map(|frame| &frame.error)
            .map(|x| (x / error * 255.0).round() as u8);
        let touched =
            kept().map(|frame| frame.touched.map(|p| p.map(|x| (x * 10.0).round() / 10.0)));
        json!({
            "title": self.title,
            "step_s": self.step_s * every as f64,
            "count": kept().count(),
            "largest_moved_mm": moved,
            "largest_error_mm": error,
            "moved": STANDARD.encode(shorts.collect::<Vec<u8>>()),
            "error": STANDARD.encode(small.collect::<Vec<u8>>()),
            "touched": touched.collect::<Vec<_>>(),
            "tools": tools::json(&self.tools, kept().map(|frame| &frame.poses)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_holds_the_surface_and_leaves_frames_out_where_it_is_large() {
        let mesh = tissue::mesh::box_phantom([20.0, 20.0, 10.0], [3, 3, 2]).unwrap();
        let truth = vec![[0.0; 3]; mesh.node_count()];
        let mut film = Film::new(&mesh, "a push".into(), 0.05);
        let nodes = film.nodes.len();
        let frames = MOST_BYTES / (7 * nodes) + 1;
        for frame in 0..frames {
            let depth = -4.0 * frame as f32 / (frames - 1) as f32;
            let field = vec![[0.0, 0.0, depth]; mesh.node_count()];
            film.add(&mesh, &field, &truth, &[0]);
        }
        let made = film.json();
        assert_eq!(made["step_s"], 0.1);
        let count = frames.div_ceil(2);
        assert_eq!(made["count"], count);
        let bytes = |name: &str| STANDARD.decode(made[name].as_str().unwrap()).unwrap();
        assert_eq!(bytes("moved").len(), 6 * nodes * count);
        assert_eq!(bytes("error").len(), nodes * count);
        assert_eq!(made["touched"].as_array().unwrap().len(), count);
        // The last kept frame's node has moved to the largest depth or a step before it.
        let last = bytes("moved");
        let z = i16::from_le_bytes([last[last.len() - 2], last[last.len() - 1]]);
        assert!(z < -32_000, "{z}");
    }
}
