//! One case of a programme: its tools and their poses at each frame, drawn from a seed and checked.

use super::approach::Surface;
use super::legs::Legs;
use super::scale::{Thickness, ToolScale};
use super::site::{Site, Sites};
use super::{Specification, Tip, ToolProgramme};
use crate::mesh::Mesh;
use crate::schemes::{FRAME_S, FRAMES, SplitMix};
use crate::solver::{Tool, ToolPose};
use contact::{Body, Matrix, Pose, Rotation, Shape, Vector, pose};

/// Half the length of a shaft, mm.
const SHAFT_MM: f32 = 20.0;
/// Half the thickness of a blade and a foot, and the radius of their edges, mm.
pub(crate) const BLADE_MM: [f32; 2] = [1.5, 1.0];
pub(crate) const FOOT_MM: [f32; 2] = [3.0, 2.0];
/// How deep a tool may be in what it cannot touch, the surface outside of the domain at rest, mm.
const STRAY_MM: f32 = 1.0;
/// Sites that are tried for one seed.
const TRIES: usize = 400;

/// A programme that cannot be placed on a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProgrammeError {
    #[error("the tool's own shape: {0}")]
    Shape(#[from] contact::ShapeError),
    #[error("the mesh has no `domain` faces; tools have nowhere to touch")]
    EmptyDomain,
    #[error(
        "programme `{name}`, seed {seed}: none of {TRIES} sites lets its tools start clear of the tissue and stay on `domain`; use another seed, or a mesh with a larger domain"
    )]
    NoSite { name: &'static str, seed: u64 },
}

/// Tools and what they do.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolCase {
    pub tools: Vec<Tool>,
    /// Where they start.
    pub start: Vec<Pose>,
    /// By frame from the first after rest, one a tool.
    pub frames: Vec<Vec<ToolPose>>,
    /// The first tool's site, mm.
    pub site: [f64; 3],
}

/// A tool and its motion.
struct Hand {
    tool: Tool,
    body: Body,
    start: Pose,
    tip: Vector,
    inward: Vector,
    legs: Legs,
    site: Vector,
}

impl ToolCase {
    /// Draws a case from `seed`: the same one on every machine. A shape of one's own takes the place of the row's: its
    /// y axis is the shaft, and the end that touches the lowest. Sizes are the table's.
    ///
    /// # Errors
    /// [`ProgrammeError`] where the mesh has no domain, or no site of `TRIES` passes the checks.
    pub fn new(
        programme: ToolProgramme,
        mesh: &Mesh,
        seed: u64,
        own: Option<&Shape>,
    ) -> Result<Self, ProgrammeError> {
        Self::scaled(programme, mesh, seed, own, ToolScale::TABLE)
    }

    /// The same with the table's sizes at a scale; a shape of one's own stays as large as it is.
    ///
    /// # Errors
    /// As of [`ToolCase::new`].
    pub fn scaled(
        programme: ToolProgramme,
        mesh: &Mesh,
        seed: u64,
        own: Option<&Shape>,
        scale: ToolScale,
    ) -> Result<Self, ProgrammeError> {
        if mesh.domain.is_empty() {
            return Err(ProgrammeError::EmptyDomain);
        }
        let specification = &scale.of(programme.specification());
        if let Some(shape) = own {
            Body::new(shape)?;
        }
        let surface = Surface::new(mesh);
        let place = Place {
            sites: Sites::new(mesh),
            thickness: Thickness::new(mesh),
            scale,
        };
        // Programmes of one seed go to different sites.
        let mut random = SplitMix(seed);
        random.0 ^= SplitMix(programme.row as u64).next();
        for _ in 0..TRIES {
            if let Some(hands) = hands(specification, own, &surface, &place, &mut random)
                && let Some(case) = Self::of(&hands, specification, &surface)
            {
                return Ok(case);
            }
        }
        Err(ProgrammeError::NoSite {
            name: programme.name(),
            seed,
        })
    }

    /// The frames of hands that stay clear of each other and of what they cannot touch.
    fn of(hands: &[Hand], specification: &Specification, surface: &Surface) -> Option<Self> {
        let seconds = hands.iter().map(|h| h.legs.seconds()).fold(0.0, f64::max);
        let count = ((seconds / FRAME_S).ceil() as usize).min(FRAMES - 1);
        let mut frames = Vec::with_capacity(count);
        for frame in 1..=count {
            let poses: Vec<ToolPose> = hands
                .iter()
                .map(|hand| {
                    let seconds = frame as f64 * FRAME_S;
                    let (pose, grasp) = hand.legs.pose(seconds, &hand.start, hand.tip, hand.inward);
                    ToolPose { pose, grasp }
                })
                .collect();
            let stray = |(hand, to): (&Hand, &ToolPose)| {
                !specification.border && surface.strays(&hand.body, &to.pose, STRAY_MM)
            };
            if hands.iter().zip(&poses).any(stray) || collide(hands, &poses) {
                return None;
            }
            frames.push(poses);
        }
        Some(Self {
            tools: hands.iter().map(|h| h.tool.clone()).collect(),
            start: hands.iter().map(|h| h.start).collect(),
            frames,
            site: hands[0].site.to_array().map(f64::from),
        })
    }

    /// The same motion in `parts` shorter frames each, with the poses that tools have within a frame.
    pub fn split(mut self, parts: usize) -> Self {
        let still = |pose: &Pose| ToolPose {
            pose: *pose,
            grasp: false,
        };
        let mut from: Vec<ToolPose> = self.start.iter().map(still).collect();
        let mut frames = Vec::with_capacity(parts * self.frames.len());
        for to in self.frames {
            for part in 1..=parts {
                let way = from.iter().zip(&to).map(|(from, to)| ToolPose {
                    pose: pose::between(&from.pose, &to.pose, part as f32 / parts as f32),
                    grasp: to.grasp,
                });
                frames.push(way.collect());
            }
            from = to;
        }
        self.frames = frames;
        self
    }
}

/// Where tools go, and how deep they may.
struct Place {
    sites: Sites,
    thickness: Thickness,
    scale: ToolScale,
}

fn hands(
    specification: &Specification,
    own: Option<&Shape>,
    surface: &Surface,
    place: &Place,
    random: &mut SplitMix,
) -> Option<Vec<Hand>> {
    // All numbers are drawn before anything can fail, so that tries do not hang together.
    let radius = random.within(specification.radius_mm) as f32;
    let unit = random.unit();
    let (turn, distance) = (random.unit(), random.unit());
    let sites = &place.sites;
    let first = hand(specification, own, radius, place, random, |reach| {
        sites.draw(unit, specification.border, reach)
    });
    let second = specification.second_mm.map(|range| {
        let from = sites.draw(unit, false, radius).map(|s| s.at);
        let away = (range[0] + (range[1] - range[0]) * distance) as f32;
        hand(specification, own, radius, place, random, |reach| {
            sites.beside(from?, away, turn, reach)
        })
    });
    let mut hands = vec![first];
    hands.extend(second);
    let mut placed = Vec::new();
    for hand in hands {
        let mut hand = hand?;
        let Hand { body, start, .. } = &hand;
        hand.start = surface.approach(body, start, hand.site, hand.inward, radius)?;
        placed.push(hand);
    }
    Some(placed)
}

/// A tool with its end on a site, and what it will do there.
fn hand(
    specification: &Specification,
    own: Option<&Shape>,
    radius: f32,
    place: &Place,
    random: &mut SplitMix,
    site: impl Fn(f32) -> Option<Site>,
) -> Option<Hand> {
    let friction = random.within(specification.friction) as f32;
    let tear_off = random.within(specification.tear_off_mn);
    let tears = random.unit() < 0.5;
    let (lean, round, spin) = (random.unit(), random.unit(), random.unit());
    let wait = random.unit();
    // Draws nothing: the numbers that follow are the same wherever the site is.
    let site = site(radius.max(5.0));
    let deepest = site.map_or(0.0, |site| {
        let Place {
            thickness, scale, ..
        } = place;
        scale.deepest(thickness, site.at, -site.outward)
    });
    let legs = Legs::new(specification, deepest, random);
    let site = site?;
    let blade = |[thick, edge]: [f32; 2]| Shape::Spatula {
        half_extents: [radius, SHAFT_MM, thick],
        radius: edge,
    };
    let (shape, end, pivot) = match (own, specification.tip) {
        (Some(shape), _) => {
            let (low, _) = Body::new(shape).ok()?.bounds(&Pose::IDENTITY, 0.0);
            (shape.clone(), -low.y, -low.y)
        }
        (None, Tip::Rod) => {
            let half_length = SHAFT_MM;
            let shape = Shape::Capsule {
                half_length,
                radius,
            };
            (shape, SHAFT_MM + radius, SHAFT_MM)
        }
        (None, Tip::Blade) => (blade(BLADE_MM), SHAFT_MM, SHAFT_MM),
        (None, Tip::Foot) => (blade(FOOT_MM), SHAFT_MM, SHAFT_MM),
    };
    let body = Body::new(&shape).ok()?;
    // The shaft leans from the normal by an angle whose sine is even in the disc.
    let frame = contact::friction::frame(site.outward);
    let angle = (lean.sqrt() * specification.lean_rad) as f32;
    let round = (round * std::f64::consts::TAU) as f32;
    let (sin, cos) = angle.sin_cos();
    let up = site.outward * cos + (frame.y_axis * round.cos() + frame.z_axis * round.sin()) * sin;
    let axes = contact::friction::frame(up);
    let (s, c) = ((spin * std::f64::consts::TAU) as f32).sin_cos();
    let x = axes.y_axis * c + axes.z_axis * s;
    let rotation = Rotation::from_mat3(&Matrix::from_cols(x, up, x.cross(up))).normalize();
    // A slide is centred on the site, where the normal is known.
    let along = rotation * Vector::Z;
    let half_slide = 0.5 * legs.slide() as f32;
    let from = site.at - along * half_slide;
    let second = specification.second_mm.is_some();
    Some(Hand {
        tool: Tool {
            shape,
            friction,
            tear_off_mn: if tears { tear_off as f32 } else { 0.0 },
        },
        body,
        start: Pose::from_parts(from + up * end, rotation),
        tip: Vector::new(0.0, -pivot, 0.0),
        inward: -up,
        legs: if second {
            legs.delayed(0.4 * wait)
        } else {
            legs
        },
        site: from,
    })
}

/// Whether two tools come closer than half a millimetre: rods, or whatever has the other's shaft within its skin.
fn collide(hands: &[Hand], poses: &[ToolPose]) -> bool {
    let [first, second] = hands else {
        return false;
    };
    let radius = match second.tool.shape {
        Shape::Capsule { radius, .. } => radius,
        _ => 0.0,
    };
    (0..=10).any(|i| {
        let local = Vector::new(0.0, SHAFT_MM * (i as f32 / 5.0 - 1.0), 0.0);
        let point = poses[1].pose.transform_point(local);
        first.body.nearest_at(&poses[0].pose, point).distance < radius + 0.5
    })
}
