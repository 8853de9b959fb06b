//! The five simulation schemes, the `hard` regimes, and `probe`, which only serves training.
//!
//! A scheme fixes the magnitude, the number of collision faces and three functions
//! of time on [0, 8 s]: the push factor `p(t)` in [0, 1], the tilt `phi(t)` from the
//! inward normal and the turn `theta(t)` about it. Contact nodes are prescribed to
//! `magnitude * p(t) * direction(phi, theta)`; there is no contact where `p(t)` is
//! zero. As in the paper, only the site varies between the cases of a scheme.
//! Scheme 3 is the paper's; the others follow its description (10 to 15 mm, 25 to
//! 100 faces, continuous functions). See `docs/datasets.md` for a plot of each.

use crate::contact::{ContactDomain, ContactError, FACE_AREA_MM2, Patch};
use crate::solver::ContactNode;
use std::f64::consts::PI;

/// Length of every simulation, s.
pub const DURATION_S: f64 = 8.0;
/// Time between frames, s.
pub const FRAME_S: f64 = 0.05;
/// Frames of a trajectory, rest included.
pub const FRAMES: usize = 161;

/// A loading programme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scheme {
    /// Straight push, hold, slow release: 12 mm, 50 faces.
    One,
    /// Three presses of growing depth, tilt swinging to and fro: 10 mm, 25 faces.
    Two,
    /// The paper's: tilt pi/8, one full turn while pushing in, lifted at 6.5 s: 13 mm, 60 faces.
    Three,
    /// Quick push, then the direction slides while held, two-stage retreat: 15 mm, 100 faces.
    Four,
    /// Withheld from training: pulsating push, tilt growing, turning back and forth, lifted at 5.5 s: 12.5 mm, 75 faces.
    Five,
    /// 20 to 40 mm.
    HardDeep,
    /// Full depth in one or two frames, abrupt lift.
    HardFast,
    /// Two instruments at once.
    HardTwo,
    /// The contact slides along the surface.
    HardSlide,
    /// Scheme 3's load with a tenth of the damping.
    HardRing,
    /// For training: five sites in a row, each pushed, tilted and let go within 1.6 s. Sites are what a learned
    /// correction lacks, and 160 frames at one site say little more about it than 32.
    Probe,
}

impl Scheme {
    /// The paper's five.
    pub const NUMBERED: [Scheme; 5] = [
        Scheme::One,
        Scheme::Two,
        Scheme::Three,
        Scheme::Four,
        Scheme::Five,
    ];
    /// Regimes beyond them.
    pub const HARD: [Scheme; 5] = [
        Scheme::HardDeep,
        Scheme::HardFast,
        Scheme::HardTwo,
        Scheme::HardSlide,
        Scheme::HardRing,
    ];

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Scheme::One => "1",
            Scheme::Two => "2",
            Scheme::Three => "3",
            Scheme::Four => "4",
            Scheme::Five => "5",
            Scheme::HardDeep => "hard-deep",
            Scheme::HardFast => "hard-fast",
            Scheme::HardTwo => "hard-two",
            Scheme::HardSlide => "hard-slide",
            Scheme::HardRing => "hard-ring",
            Scheme::Probe => "probe",
        }
    }

    /// Parses a list: `3`, `1-4`, `1,3`, `hard`, `hard-deep`.
    pub fn parse_list(text: &str) -> Result<Vec<Scheme>, String> {
        let mut schemes = Vec::new();
        for part in text.split(',').map(str::trim) {
            if part == "hard" {
                schemes.extend(Self::HARD);
                continue;
            }
            let range = part
                .split_once('-')
                .and_then(|(a, b)| Some((a.parse::<usize>().ok()?, b.parse::<usize>().ok()?)));
            match range {
                Some((a, b)) if (1..=5).contains(&a) && (a..=5).contains(&b) => {
                    schemes.extend(&Self::NUMBERED[a - 1..b]);
                }
                _ => schemes.push(part.parse()?),
            }
        }
        Ok(schemes)
    }

    /// Damping of the regime relative to the material's.
    pub fn damping_factor(self) -> f64 {
        match self {
            Scheme::HardRing => 0.1,
            _ => 1.0,
        }
    }
}

impl std::str::FromStr for Scheme {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::NUMBERED
            .into_iter()
            .chain(Self::HARD)
            .chain([Scheme::Probe])
            .find(|scheme| scheme.name() == text)
            .ok_or_else(|| {
                format!(
                    "scheme `{text}` is unknown; use 1 to 5, a range such as 1-4, `hard`, `probe`, or one of {}",
                    Self::HARD.map(Scheme::name).join(", ")
                )
            })
    }
}

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
    fn new(random: &mut SplitMix) -> Self {
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
        match self {
            Scheme::One => 12.0,
            Scheme::Two => 10.0,
            Scheme::Three | Scheme::HardRing => 13.0,
            Scheme::Four => 15.0,
            Scheme::Five => 12.5,
            Scheme::HardDeep => 20.0 + 20.0 * draw.depth,
            Scheme::HardFast | Scheme::HardTwo => 10.0 + 5.0 * draw.depth,
            Scheme::HardSlide => 8.0 + 4.0 * draw.depth,
            Scheme::Probe => 8.0 + 7.0 * draw.depth,
        }
    }

    /// Patch area as a number of the paper's collision faces.
    pub fn face_count(self, draw: Draw) -> f64 {
        match self {
            Scheme::One => 50.0,
            Scheme::Two => 25.0,
            Scheme::Three | Scheme::HardRing => 60.0,
            Scheme::Four => 100.0,
            Scheme::Five => 75.0,
            // Deep pushes on few faces would only tear the mesh.
            Scheme::HardDeep => 60.0 + 40.0 * draw.size,
            Scheme::HardFast | Scheme::HardTwo | Scheme::HardSlide => 25.0 + 50.0 * draw.size,
            Scheme::Probe => 25.0 + 75.0 * draw.size,
        }
    }

    /// Push factor and angles at `t` seconds.
    pub fn pose(self, t: f64, draw: Draw) -> Pose {
        let spin = 2.0 * PI * draw.angle;
        match self {
            Scheme::One => Pose {
                push: rise(t, 0.0, 2.5) * (1.0 - rise(t, 4.5, 7.5)),
                phi: 0.0,
                theta: 0.0,
            },
            Scheme::Two => Pose {
                push: 0.6 * bump(t, 0.0, 2.2) + 0.8 * bump(t, 2.4, 4.6) + bump(t, 4.8, 7.0),
                phi: PI / 6.0 * (2.0 * PI * t / 3.5).sin().abs(),
                theta: PI * rise(t, 0.0, 7.0),
            },
            Scheme::Three | Scheme::HardRing => Pose {
                push: if t < 6.5 { (t / 6.0).min(1.0) } else { 0.0 },
                phi: PI / 8.0,
                theta: 2.0 * PI * (t / 6.5).min(1.0),
            },
            Scheme::Four => Pose {
                push: rise(t, 0.0, 1.0) * (1.0 - 0.5 * rise(t, 4.0, 5.0) - 0.5 * rise(t, 6.0, 7.2)),
                phi: PI / 5.0 * rise(t, 1.0, 2.5) - 2.0 * PI / 5.0 * rise(t, 2.5, 5.5),
                theta: PI / 2.0 * rise(t, 0.0, 8.0),
            },
            Scheme::Five => Pose {
                push: if t < 5.5 {
                    rise(t, 0.0, 1.5) * (0.8 - 0.2 * (2.0 * PI * (t - 1.5) / 2.0).cos())
                } else {
                    0.0
                },
                phi: PI / 7.0 * rise(t, 0.0, 4.0),
                theta: PI / 2.0 * (2.0 * PI * t / 4.0).sin() + PI * t / 8.0,
            },
            Scheme::HardDeep => Pose {
                push: rise(t, 0.0, 3.0) * (1.0 - rise(t, 5.0, 6.5)),
                phi: PI / 12.0,
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
                phi: PI / 10.0,
                theta: spin,
            },
            Scheme::HardTwo => Pose {
                push: rise(t, 0.0, 2.0) * (1.0 - rise(t, 5.0, 7.0)),
                phi: PI / 8.0 * rise(t, 2.0, 4.0),
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
        }
    }
}

/// One site of `probe` takes this long, s.
const PROBE_S: f64 = 1.6;
/// When the contact of a probe is lifted, s.
const PROBE_LIFT_S: f64 = 0.8;
/// Sites of `probe`.
const PROBE_SITES: usize = 5;

/// A case: a scheme at a site, ready to say what touches at each frame.
pub struct Programme {
    scheme: Scheme,
    /// One, or one a site (`probe`).
    draws: Vec<Draw>,
    /// One patch, two (`hard-two`), one a waypoint (`hard-slide`), or one a site (`probe`).
    patches: Vec<Patch>,
}

/// Waypoints of a sliding contact.
const SLIDE_STOPS: usize = 24;
/// Length of the walk, mm.
const SLIDE_MM: f64 = 25.0;

impl Programme {
    /// Draws the site (and a hard regime's parameters) from `seed`.
    ///
    /// A seed face whose part of `domain` is too small is passed over for the next draw.
    pub fn new(scheme: Scheme, domain: &ContactDomain, seed: u64) -> Result<Self, ContactError> {
        let mut random = SplitMix(seed);
        let draw = Draw::new(&mut random);
        let area = scheme.face_count(draw) * FACE_AREA_MM2;
        let mut place = |area: f64| -> Result<Patch, ContactError> {
            let mut outcome = Err(ContactError::EmptyDomain);
            for _ in 0..64 {
                let face = (random.unit() * domain.face_count() as f64) as usize;
                outcome = domain.grow(face, area);
                if outcome.is_ok() {
                    break;
                }
            }
            outcome
        };
        let mut patches = vec![place(area)?];
        let mut draws = vec![draw];
        match scheme {
            Scheme::HardTwo => {
                // Far enough apart that the patches share no node.
                let mut second = place(area)?;
                for _ in 0..64 {
                    if !shares_node(&patches[0], &second) {
                        break;
                    }
                    second = place(area)?;
                }
                patches.push(second);
            }
            Scheme::HardSlide => patches = slide(domain, &patches[0], draw, area)?,
            Scheme::Probe => {
                // Seeds of their own: `place` holds the case's.
                let mut others = SplitMix(seed ^ 0x5EED);
                for _ in 1..PROBE_SITES {
                    let draw = Draw::new(&mut others);
                    patches.push(place(scheme.face_count(draw) * FACE_AREA_MM2)?);
                    draws.push(draw);
                }
            }
            _ => {}
        }
        Ok(Self {
            scheme,
            draws,
            patches,
        })
    }

    /// Centroid of the (first) seed face, mm.
    pub fn site(&self) -> [f64; 3] {
        self.patches[0].site
    }

    /// Contact nodes and their displacement at the end of frame `frame` (0 is rest), ascending, mm.
    pub fn contact(&self, frame: usize) -> Vec<ContactNode> {
        let t = frame as f64 * FRAME_S;
        let site = match self.scheme {
            Scheme::Probe => ((t / PROBE_S + 1e-9) as usize).min(PROBE_SITES - 1),
            _ => 0,
        };
        let draw = self.draws[site];
        // Whole frames: 1.6 s is a multiple of them, and the remainder of a rounded time is not.
        let since = match self.scheme {
            Scheme::Probe => (t - site as f64 * PROBE_S).clamp(0.0, PROBE_S - 1e-9),
            _ => t,
        };
        let pose = self.scheme.pose(since, draw);
        if frame == 0 || pose.push <= 1e-6 {
            return Vec::new();
        }
        let length = self.scheme.magnitude_mm(draw) * pose.push;
        let active: &[Patch] = match self.scheme {
            Scheme::HardSlide => {
                let stop = (t / 7.5 * SLIDE_STOPS as f64) as usize;
                let stop = stop.min(self.patches.len() - 1);
                &self.patches[stop..=stop]
            }
            Scheme::Probe => &self.patches[site..=site],
            _ => &self.patches,
        };
        let mut contact: Vec<ContactNode> = Vec::new();
        for patch in active {
            let direction = patch.direction(pose.phi, pose.theta);
            let displacement = direction.map(|v| (v * length) as f32);
            contact.extend(patch.nodes.iter().map(|node| ContactNode {
                node: *node,
                displacement,
            }));
        }
        contact.sort_by_key(|entry| entry.node);
        contact.dedup_by_key(|entry| entry.node);
        contact
    }
}

fn shares_node(a: &Patch, b: &Patch) -> bool {
    a.nodes
        .iter()
        .any(|node| b.nodes.binary_search(node).is_ok())
}

/// Patches along a straight walk over `domain`: of eight headings, the first being the draw's, the one
/// whose end lies nearest to a face (the walk must not leave `domain`).
fn slide(
    domain: &ContactDomain,
    start: &Patch,
    draw: Draw,
    area: f64,
) -> Result<Vec<Patch>, ContactError> {
    let point = |heading: [f64; 3], part: f64| {
        [0, 1, 2].map(|k| start.site[k] + SLIDE_MM * part * heading[k])
    };
    let nearest_to = |goal: [f64; 3]| {
        (0..domain.face_count())
            .map(|face| (distance(domain.centroids()[face], goal), face))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((0.0, start.seed))
    };
    let heading = (0..8)
        .map(|turn| {
            let theta = 2.0 * PI * (draw.angle + f64::from(turn) / 8.0);
            start.direction(PI / 2.0, theta)
        })
        .min_by(|a, b| {
            let miss = |heading| nearest_to(point(heading, 1.0)).0;
            miss(*a).total_cmp(&miss(*b))
        })
        .unwrap_or(start.tangents[0]);
    let mut patches: Vec<Patch> = Vec::with_capacity(SLIDE_STOPS);
    for stop in 0..SLIDE_STOPS {
        let part = stop as f64 / (SLIDE_STOPS - 1) as f64;
        let (_, nearest) = nearest_to(point(heading, part));
        match patches.last() {
            Some(last) if last.seed == nearest => patches.push(last.clone()),
            _ => patches.push(domain.grow(nearest, area)?),
        }
    }
    Ok(patches)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// SplitMix64 (Steele et al. 2014): the same numbers on every platform and in every version.
pub(crate) struct SplitMix(pub u64);

impl SplitMix {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}
