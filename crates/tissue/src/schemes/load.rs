//! What each scheme does: its row's ranges at a case's draw, and push factor and angles as functions of time.

use std::f64::consts::PI;

use super::random::SplitMix;
use super::{FRAME_S, Scheme};

/// One site of `probe` takes this long, s.
pub const PROBE_S: f64 = 1.6;
/// When the contact of a probe is lifted, s.
pub(super) const PROBE_LIFT_S: f64 = 0.8;

/// Push factor and angles at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// In [0, 1]; zero means no contact.
    pub push: f64,
    /// Radians from the inward normal.
    pub phi: f64,
    /// Radians about the inward normal.
    pub theta: f64,
}

/// Smooth step from 0 at `from` to 1 at `to` (cubic, flat ends).
fn rise(t: f64, from: f64, to: f64) -> f64 {
    let x = ((t - from) / (to - from)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// `sin²` bump between `from` and `to`, zero outside.
fn bump(t: f64, from: f64, to: f64) -> f64 {
    if t <= from || t >= to {
        return 0.0;
    }
    ((t - from) / (to - from) * PI).sin().powi(2)
}

/// Parameters that a hard regime draws from its seed; unused by the numbered schemes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// Uniform in [0, 1).
    pub depth: f64,
    /// Uniform in [0, 1).
    pub size: f64,
    /// Uniform in [0, 1).
    pub angle: f64,
}

impl Draw {
    pub(super) fn new(random: &mut SplitMix) -> Self {
        Self {
            depth: random.unit(),
            size: random.unit(),
            angle: random.unit(),
        }
    }
}

impl Scheme {
    /// Largest displacement, mm.
    pub fn magnitude_mm(self, draw: Draw) -> f64 {
        let [low, high] = self.specification().magnitude_mm;
        low + (high - low) * draw.depth
    }

    /// Patch area as a number of the paper's collision faces.
    pub fn face_count(self, draw: Draw) -> f64 {
        let [low, high] = self.specification().faces;
        low + (high - low) * draw.size
    }

    /// Push factor and angles at `t` seconds. At a site of a static scheme frame `k` is its `k`-th depth.
    pub fn pose(self, t: f64, draw: Draw) -> Pose {
        let spin = 2.0 * PI * draw.angle;
        let [_, tilt] = self.specification().tilt_rad;
        match self {
            Scheme::One => Pose {
                push: rise(t, 0.0, 2.5) * (1.0 - rise(t, 4.5, 7.5)),
                phi: 0.0,
                theta: 0.0,
            },
            Scheme::Two => Pose {
                push: 0.6 * bump(t, 0.0, 2.2) + 0.8 * bump(t, 2.4, 4.6) + bump(t, 4.8, 7.0),
                phi: tilt * (2.0 * PI * t / 3.5).sin().abs(),
                theta: PI * rise(t, 0.0, 7.0),
            },
            Scheme::Three | Scheme::HardRing => Pose {
                push: if t < 6.5 { (t / 6.0).min(1.0) } else { 0.0 },
                phi: tilt,
                theta: 2.0 * PI * (t / 6.5).min(1.0),
            },
            Scheme::Four => Pose {
                push: rise(t, 0.0, 1.0) * (1.0 - 0.5 * rise(t, 4.0, 5.0) - 0.5 * rise(t, 6.0, 7.2)),
                phi: tilt * rise(t, 1.0, 2.5) - 2.0 * tilt * rise(t, 2.5, 5.5),
                theta: PI / 2.0 * rise(t, 0.0, 8.0),
            },
            Scheme::Five => Pose {
                push: if t < 5.5 {
                    rise(t, 0.0, 1.5) * (0.8 - 0.2 * (2.0 * PI * (t - 1.5) / 2.0).cos())
                } else {
                    0.0
                },
                phi: tilt * rise(t, 0.0, 4.0),
                theta: PI / 2.0 * (2.0 * PI * t / 4.0).sin() + PI * t / 8.0,
            },
            Scheme::HardDeep => Pose {
                push: rise(t, 0.0, 3.0) * (1.0 - rise(t, 5.0, 6.5)),
                phi: tilt,
                theta: spin,
            },
            Scheme::HardFast => Pose {
                // One frame below half of the draw, two above.
                push: {
                    let ramp = if draw.angle < 0.5 {
                        FRAME_S
                    } else {
                        2.0 * FRAME_S
                    };
                    let cycle = t % 2.5;
                    if cycle > 1e-9 && cycle < 1.6 {
                        (cycle / ramp).min(1.0)
                    } else {
                        0.0
                    }
                },
                phi: tilt,
                theta: spin,
            },
            Scheme::HardTwo => Pose {
                push: rise(t, 0.0, 2.0) * (1.0 - rise(t, 5.0, 7.0)),
                phi: tilt * rise(t, 2.0, 4.0),
                theta: spin,
            },
            Scheme::HardSlide => Pose {
                push: rise(t, 0.0, 1.0) * (1.0 - rise(t, 6.5, 7.5)),
                phi: 0.0,
                theta: spin,
            },
            Scheme::Probe => {
                // A rounded frame time may lie just below the end of the contact.
                let since = t % PROBE_S;
                Pose {
                    push: if since < PROBE_LIFT_S - 1e-9 {
                        rise(since, 0.0, 0.6)
                    } else {
                        0.0
                    },
                    phi: PI / 6.0 * (7.0 * draw.angle).fract() + PI / 12.0 * rise(since, 0.3, 0.75),
                    theta: spin,
                }
            }
            Scheme::Static | Scheme::StaticTwo | Scheme::StaticDeep => {
                // Each depth with a direction of its own: neighbours on the path stay good guesses of each other.
                let depth = t / FRAME_S;
                let deepest = self.specification().depths as f64;
                Pose {
                    push: (depth / deepest).min(1.0),
                    phi: tilt * (7.0 * draw.angle + 0.31 * depth).fract(),
                    theta: spin + 0.5 * depth,
                }
            }
        }
    }
}
