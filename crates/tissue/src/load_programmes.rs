//! Programmes of loads: gravity that turns, a pulse, a pressure that is lost, a support that breathes. What acts at each moment of a case without tools.

use crate::mesh::Mesh;
use crate::solver::{Loads, SupportMotion, SurfacePressure};

/// What a case of loads does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadProgramme {
    /// Gravity turns by a right angle in two seconds, then stays.
    Tilt,
    /// Pressure on the domain comes and goes 1.2 times a second.
    Pulse,
    /// The domain loses a pressure within half a second.
    Sag,
    /// The support goes up by 15 mm (z) and turns by 15 degrees (about x) and comes back, once in four seconds.
    Breathe,
}

/// How strong the loads of a programme are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadSizes {
    /// Gravity under which the mesh is in equilibrium, m/s². A tilt turns it about the next axis but one.
    pub gravity_m_s2: [f64; 3],
    /// The largest pressure, Pa.
    pub pascal: f64,
}

/// A brain of a patient who lies on the back (RAS), of whose weight its fluid leaves a thirtieth; a pressure that moves it by about a millimetre.
impl Default for LoadSizes {
    fn default() -> Self {
        Self {
            gravity_m_s2: [0.0, -0.3, 0.0],
            pascal: 22.0,
        }
    }
}

const TURN_S: f64 = 2.0;
const PULSES_PER_S: f64 = 1.2;
const LOSS_S: f64 = 0.5;
const BREATHS_PER_S: f64 = 0.25;
const BREATH_MM: f64 = 15.0;
const BREATH_RAD: f64 = std::f64::consts::PI / 12.0;

impl LoadProgramme {
    /// All programmes.
    pub const ALL: [Self; 4] = [Self::Tilt, Self::Pulse, Self::Sag, Self::Breathe];

    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tilt => "tilt",
            Self::Pulse => "pulse",
            Self::Sag => "sag",
            Self::Breathe => "breathe",
        }
    }

    /// How long a case takes, s.
    pub fn duration_s(self) -> f64 {
        match self {
            Self::Tilt | Self::Pulse => 3.0,
            Self::Sag => 2.0,
            Self::Breathe => 4.0,
        }
    }

    /// What acts at a time from rest: gravity beyond that at rest, m/s², and the pressure on the domain, Pa.
    pub fn at(self, sizes: LoadSizes, time_s: f64) -> ([f64; 3], f64) {
        match self {
            Self::Tilt => {
                let angle = std::f64::consts::FRAC_PI_2 * (time_s / TURN_S).min(1.0);
                let [x, y, z] = sizes.gravity_m_s2;
                // Turned with each axis towards the one before it, y to x.
                let turned = [y, z, x];
                let (sine, cosine) = angle.sin_cos();
                let rest = [x, y, z];
                let difference =
                    std::array::from_fn(|k| (cosine - 1.0) * rest[k] + sine * turned[k]);
                (difference, 0.0)
            }
            Self::Pulse => {
                let phase = std::f64::consts::TAU * PULSES_PER_S * time_s;
                ([0.0; 3], 0.5 * sizes.pascal * (1.0 - phase.cos()))
            }
            Self::Sag => ([0.0; 3], -sizes.pascal * (time_s / LOSS_S).min(1.0)),
            Self::Breathe => ([0.0; 3], 0.0),
        }
    }

    /// Where the support is at a time from rest, where it moves.
    pub fn support_at(self, time_s: f64) -> Option<SupportMotion> {
        if self != Self::Breathe {
            return None;
        }
        let omega = std::f64::consts::TAU * BREATHS_PER_S;
        let (sine, cosine) = (omega * time_s).sin_cos();
        let (part, rate) = (0.5 * (1.0 - cosine), 0.5 * omega * sine);
        Some(SupportMotion {
            position: [0.0, 0.0, part * BREATH_MM],
            velocity: [0.0, 0.0, rate * BREATH_MM],
            turn: [part * BREATH_RAD, 0.0, 0.0],
            turning: [rate * BREATH_RAD, 0.0, 0.0],
        })
    }

    /// The same as loads of the solver.
    pub fn loads(self, sizes: LoadSizes, mesh: &Mesh, time_s: f64) -> Loads {
        let (gravity, pascal) = self.at(sizes, time_s);
        let pressure = SurfacePressure {
            faces: mesh.domain.clone(),
            walls: true,
            pascal,
        };
        Loads {
            gravity: gravity.map(|g| 1e3 * g),
            pressures: match pascal != 0.0 {
                true => vec![pressure],
                false => Vec::new(),
            },
            ..Loads::default()
        }
    }
}

impl std::str::FromStr for LoadProgramme {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = Self::ALL.into_iter().find(|own| own.name() == text);
        named.ok_or_else(|| format!("load `{text}` is unknown; use tilt, pulse, sag or breathe"))
    }
}
