//! Programmes of rigid tools: what a surgeon's hand does, as one table of specifications.
//!
//! A case draws everything that its row leaves open from a seed: site, sizes, depth, speeds, direction. Poses are checked before
//! anything is simulated (`case`): a tool starts just outside of the tissue, wherever else its shaft may be. All programmes
//! are the same sequence with parts left out: press in, slide, tilt and turn, close and pull, hold, go back, wait. Frames are
//! those of the schemes, 50 ms; their number depends on the case.

mod approach;
mod case;
mod legs;
mod scale;
mod site;

pub(crate) use case::{BLADE_MM, FOOT_MM};
pub use case::{ProgrammeError, ToolCase};
pub use scale::{BodySize, DEEPEST_SHARE, REFERENCE_THICKNESS_MM, REFERENCE_WIDTH_MM, ToolScale};

use serde::Serialize;

use crate::schemes::Range;

/// What touches the tissue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tip {
    /// A rod with a round end of the drawn radius.
    Rod,
    /// A flat blade, as wide as drawn and 3 mm thick, its end foremost; it slides across its width.
    Blade,
    /// A rounded foot, twice the drawn radius wide and 6 mm thick.
    Foot,
}

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Specification {
    /// Name on the command line.
    pub name: &'static str,
    /// What it does, in one phrase.
    pub summary: &'static str,
    pub tip: Tip,
    /// Radius of a rod or half width of a blade or foot, mm.
    pub radius_mm: Range,
    /// How far it goes in after the first touch, mm.
    pub depth_mm: Range,
    /// Speed on the way in, mm/s.
    pub press_mm_s: Range,
    /// Way along the surface, mm.
    pub slide_mm: Range,
    /// mm/s.
    pub slide_mm_s: Range,
    /// Largest tilt and turn about the tip while pressed, radians; to and fro twice.
    pub wobble_rad: [f64; 2],
    /// Way out while it grasps, mm.
    pub pull_mm: Range,
    /// Pull at which every second grasp tears off, mN.
    pub tear_off_mn: Range,
    /// Time that it stays where it is, s.
    pub hold_s: Range,
    /// Speed on the way out, mm/s.
    pub lift_mm_s: Range,
    /// Coulomb's coefficient.
    pub friction: Range,
    /// Largest angle between the way in and the surface's normal, radians.
    pub lean_rad: f64,
    /// Distance of a second tool's site, mm.
    pub second_mm: Option<Range>,
    /// The site lies on the border of the domain.
    pub border: bool,
    /// Quicker or finer than the tools that models learn from: left out of `all`.
    pub extreme: bool,
}

/// What most rows share.
const PLAIN: Specification = Specification {
    name: "",
    summary: "",
    tip: Tip::Rod,
    radius_mm: [4.0, 8.0],
    depth_mm: [4.0, 8.0],
    press_mm_s: [10.0, 25.0],
    slide_mm: [0.0, 0.0],
    slide_mm_s: [10.0, 10.0],
    wobble_rad: [0.0, 0.0],
    pull_mm: [0.0, 0.0],
    tear_off_mn: [0.0, 0.0],
    hold_s: [0.4, 0.8],
    lift_mm_s: [10.0, 30.0],
    friction: [0.0, 0.3],
    lean_rad: 0.35,
    second_mm: None,
    border: false,
    extreme: false,
};

/// All programmes.
pub const TABLE: [Specification; 12] = [
    Specification {
        name: "press",
        summary: "presses, holds, leaves",
        radius_mm: [4.0, 12.0],
        depth_mm: [2.0, 15.0],
        ..PLAIN
    },
    Specification {
        name: "probe",
        summary: "presses with a fine tip",
        radius_mm: [2.0, 2.0],
        depth_mm: [2.0, 6.0],
        ..PLAIN
    },
    Specification {
        name: "stroke",
        summary: "presses, then slides along the surface",
        radius_mm: [3.0, 6.0],
        slide_mm: [10.0, 25.0],
        slide_mm_s: [5.0, 50.0],
        lean_rad: 0.2,
        ..PLAIN
    },
    Specification {
        name: "retract",
        summary: "pushes tissue aside with the flat of a blade, and holds it",
        tip: Tip::Blade,
        radius_mm: [4.0, 10.0],
        depth_mm: [3.0, 6.0],
        slide_mm: [4.0, 8.0],
        slide_mm_s: [5.0, 10.0],
        hold_s: [1.0, 1.5],
        lean_rad: 0.2,
        ..PLAIN
    },
    Specification {
        name: "poke",
        summary: "presses and leaves fast",
        radius_mm: [3.0, 6.0],
        depth_mm: [4.0, 10.0],
        press_mm_s: [50.0, 100.0],
        lift_mm_s: [50.0, 100.0],
        hold_s: [0.2, 0.4],
        ..PLAIN
    },
    Specification {
        name: "lift",
        summary: "presses, and leaves at any speed",
        depth_mm: [3.0, 5.0],
        lift_mm_s: [1.0, 200.0],
        ..PLAIN
    },
    Specification {
        name: "two",
        summary: "two rods press, together or one after the other",
        radius_mm: [3.0, 5.0],
        depth_mm: [3.0, 8.0],
        lean_rad: 0.15,
        second_mm: Some([10.0, 40.0]),
        ..PLAIN
    },
    Specification {
        name: "wobble",
        summary: "presses, then tilts and turns to and fro",
        tip: Tip::Foot,
        radius_mm: [4.0, 7.0],
        depth_mm: [4.0, 6.0],
        wobble_rad: [0.35, 0.8],
        lean_rad: 0.15,
        ..PLAIN
    },
    Specification {
        name: "grasp",
        summary: "touches, closes, pulls; every second one tears off",
        radius_mm: [3.0, 4.0],
        depth_mm: [1.0, 2.0],
        pull_mm: [5.0, 8.0],
        tear_off_mn: [40.0, 120.0],
        lean_rad: 0.2,
        ..PLAIN
    },
    Specification {
        name: "edge",
        summary: "presses on the border of `domain`",
        border: true,
        lean_rad: 0.15,
        ..PLAIN
    },
    Specification {
        name: "jab",
        summary: "presses within a frame, as a slip of the hand does",
        radius_mm: [1.0, 5.0],
        press_mm_s: [200.0, 1000.0],
        lift_mm_s: [50.0, 200.0],
        lean_rad: 0.2,
        extreme: true,
        ..PLAIN
    },
    Specification {
        name: "needle",
        summary: "presses with a point thinner than the mesh is fine",
        radius_mm: [0.5, 0.75],
        depth_mm: [2.0, 5.0],
        lean_rad: 0.2,
        extreme: true,
        ..PLAIN
    },
];

/// A row of [`TABLE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolProgramme {
    row: usize,
}

impl ToolProgramme {
    /// Its row.
    pub fn specification(self) -> &'static Specification {
        &TABLE[self.row]
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.specification().name
    }

    /// All of them, the extreme ones last.
    pub fn every() -> impl Iterator<Item = Self> {
        (0..TABLE.len()).map(|row| Self { row })
    }

    /// Parses a list: `press,lift`, or `all` for every one that is not extreme.
    pub fn parse_list(text: &str) -> Result<Vec<Self>, String> {
        let mut programmes = Vec::new();
        for part in text.split(',').map(str::trim) {
            match part {
                "all" => {
                    programmes.extend(Self::every().filter(|one| !one.specification().extreme))
                }
                name => programmes.push(name.parse()?),
            }
        }
        Ok(programmes)
    }
}

impl std::str::FromStr for ToolProgramme {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let row = TABLE.iter().position(|row| row.name == text);
        row.map(|row| Self { row }).ok_or_else(|| {
            let names: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
            format!(
                "programme of tools `{text}` is unknown; use one of {}, or `all`",
                names.join(", ")
            )
        })
    }
}
