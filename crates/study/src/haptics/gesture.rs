//! What hands want to do with one or two tools, and where.

use anyhow::Result;
use contact::{Pose, Vector};
use tissue::mesh::Mesh;
use tissue::programmes::{ToolCase, ToolProgramme};
use tissue::solver::Tool;

/// A gesture; lengths mm, times s.
pub struct Gesture {
    pub name: &'static str,
    /// The reference programme whose tools and sites it takes.
    programme: &'static str,
    pub seconds: f64,
    /// Of the hand, N/m.
    pub stiffness: f32,
    /// Depth beyond the first touch at a time.
    depth: fn(f64) -> f64,
    /// Way along the surface at a time.
    slide: fn(f64) -> f64,
    /// The plot shows it.
    pub shown: bool,
}

/// From 0 to 1 between two times, smoothly.
fn rise(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// In and out again: down from the first time to the second, up from the third to the fourth.
fn press(t: f64, [a, b, c, d]: [f64; 4]) -> f64 {
    rise(t, a, b) - rise(t, c, d)
}

/// How far off a tool waits, mm.
const OFF_MM: f64 = 4.0;

/// All gestures; each ends off the tissue.
pub const GESTURES: [Gesture; 5] = [
    Gesture {
        name: "soft press",
        programme: "press",
        seconds: 6.0,
        stiffness: 80.0,
        depth: |t| -OFF_MM + (OFF_MM + 3.0) * press(t, [0.2, 1.6, 3.4, 4.8]),
        slide: |_| 0.0,
        shown: false,
    },
    Gesture {
        name: "stiff press",
        programme: "press",
        seconds: 6.0,
        stiffness: 600.0,
        depth: |t| -OFF_MM + (OFF_MM + 6.0) * press(t, [0.2, 0.8, 3.0, 3.5]),
        slide: |_| 0.0,
        shown: false,
    },
    Gesture {
        name: "stroke",
        programme: "stroke",
        seconds: 6.0,
        stiffness: 300.0,
        depth: |t| -OFF_MM + (OFF_MM + 2.5) * press(t, [0.2, 0.8, 4.4, 5.0]),
        slide: |t| 5.0 * (2.0 * (t - 1.0)).sin() * press(t, [0.9, 1.2, 4.0, 4.4]),
        shown: true,
    },
    Gesture {
        name: "taps",
        programme: "probe",
        seconds: 6.0,
        stiffness: 300.0,
        depth: |t| match t {
            0.3..5.05 => 0.5 - 3.0 * (4.0 * std::f64::consts::TAU * (t - 0.3)).cos(),
            _ => -OFF_MM,
        },
        slide: |_| 0.0,
        shown: false,
    },
    Gesture {
        name: "two tools",
        programme: "two",
        seconds: 6.0,
        stiffness: 300.0,
        depth: |t| {
            let wave = 0.8 * (5.0 * t).sin() * press(t, [1.0, 1.5, 4.0, 4.4]);
            -OFF_MM + (OFF_MM + 3.0) * press(t, [0.2, 0.9, 4.4, 5.0]) + wave
        },
        slide: |_| 0.0,
        shown: false,
    },
];

/// Tools clear of the tissue, each with its way in.
pub struct Site {
    pub tools: Vec<Tool>,
    /// Where they touch first.
    touch: Vec<Pose>,
    inward: Vec<Vector>,
}

impl Site {
    /// Drawn from a seed.
    ///
    /// # Errors
    /// No place on the mesh for the gesture's tools.
    pub fn new(gesture: &Gesture, mesh: &Mesh, seed: u64) -> Result<Site> {
        /// How far off the tissue a programme starts, mm.
        const CLEARANCE_MM: f32 = 0.3;
        let programme: ToolProgramme = gesture.programme.parse().map_err(anyhow::Error::msg)?;
        let case = ToolCase::new(programme, mesh, seed, None)?;
        let way = |index: usize| {
            let start = case.start[index].translation;
            let ways = case.frames.iter();
            let ways = ways.map(|poses| poses[index].pose.translation - start);
            let first = ways.into_iter().find(|way| way.length() > 0.5);
            first.map_or(Vector::NEG_Z, Vector::normalize)
        };
        let inward: Vec<Vector> = (0..case.tools.len()).map(way).collect();
        let touch = case.start.iter().zip(&inward).map(|(start, inward)| {
            Pose::from_parts(start.translation + *inward * CLEARANCE_MM, start.rotation)
        });
        Ok(Site {
            touch: touch.collect(),
            tools: case.tools,
            inward,
        })
    }

    /// Where the hand wants a tool at a time, mm; a second one lags behind.
    pub fn wanted(&self, gesture: &Gesture, tool: usize, t: f64) -> Vector {
        let t = t - 0.15 * tool as f64;
        let inward = self.inward[tool];
        let aside = ::contact::friction::frame(inward).y_axis;
        self.touch[tool].translation
            + inward * (gesture.depth)(t) as f32
            + aside * (gesture.slide)(t) as f32
    }

    /// A tool's pose at a position, mm: tools do not turn.
    pub fn pose(&self, tool: usize, position: Vector) -> Pose {
        Pose::from_parts(position, self.touch[tool].rotation)
    }
}
