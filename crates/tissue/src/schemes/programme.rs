//! A case of a scheme: its site or sites, drawn from a seed, and what touches at each frame.

use super::load::{Draw, PROBE_S, PROBE_SITES};
use super::random::SplitMix;
use super::slide::{SLIDE_STOPS, slide};
use super::{FRAME_S, Scheme};
use crate::contact::{ContactDomain, ContactError, FACE_AREA_MM2, Patch};
use crate::solver::ContactNode;

/// A case: a scheme at a site, ready to say what touches at each frame.
pub struct Programme {
    scheme: Scheme,
    /// One, or one a site (`probe`).
    draws: Vec<Draw>,
    /// One patch, two (`hard-two`), one a waypoint (`hard-slide`), or one a site (`probe`).
    patches: Vec<Patch>,
}

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
