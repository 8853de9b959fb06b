//! A case of a scheme: its site or sites, drawn from a seed, and what touches at each frame.

use std::ops::Range;

use super::load::{Draw, PROBE_S};
use super::random::SplitMix;
use super::slide::{SLIDE_STOPS, slide};
use super::{FRAME_S, Scheme};
use crate::contact::{ContactDomain, ContactError, FACE_AREA_MM2, Patch};
use crate::solver::ContactNode;

/// A case: a scheme at a site, ready to say what touches at each frame.
pub struct Programme {
    scheme: Scheme,
    /// One a patch for `probe` and the static schemes, one for all patches else.
    draws: Vec<Draw>,
    /// One patch, two (`hard-two`), one a waypoint (`hard-slide`), one a site (`probe`, `static`, `static-deep`), or two
    /// a site (`static-two`).
    patches: Vec<Patch>,
}

impl Programme {
    /// Draws the site (and a hard regime's parameters) from `seed`.
    ///
    /// A seed face whose part of `domain` is too small is passed over for the next draw.
    pub fn new(scheme: Scheme, domain: &ContactDomain, seed: u64) -> Result<Self, ContactError> {
        Self::at(scheme, domain, seed, &[])
    }

    /// The same with the first patches at these rows of `domain`, as far as they have room for them.
    pub fn at(
        scheme: Scheme,
        domain: &ContactDomain,
        seed: u64,
        faces: &[usize],
    ) -> Result<Self, ContactError> {
        let mut wanted = faces.iter();
        let mut random = SplitMix(seed);
        let draw = Draw::new(&mut random);
        let area = scheme.face_count(draw) * FACE_AREA_MM2;
        let mut place = |area: f64| -> Result<Patch, ContactError> {
            let mut outcome = Err(ContactError::EmptyDomain);
            if let Some(&face) = wanted.next() {
                outcome = domain.grow(face, area);
            }
            for _ in 0..64 {
                if outcome.is_ok() {
                    break;
                }
                let face = (random.unit() * domain.face_count() as f64) as usize;
                outcome = domain.grow(face, area);
            }
            outcome
        };
        // Far enough apart that two patches share no node, if 64 draws find such a place.
        fn beside(
            first: &Patch,
            mut place: impl FnMut() -> Result<Patch, ContactError>,
        ) -> Result<Patch, ContactError> {
            let mut second = place()?;
            for _ in 0..64 {
                if !shares_node(first, &second) {
                    break;
                }
                second = place()?;
            }
            Ok(second)
        }
        let mut patches = vec![place(area)?];
        let mut draws = vec![draw];
        // Seeds of their own: `place` holds the case's.
        let mut others = SplitMix(seed ^ 0x5EED);
        match scheme {
            Scheme::HardTwo => {
                let second = beside(&patches[0], || place(area))?;
                patches.push(second);
            }
            Scheme::HardSlide => patches = slide(domain, &patches[0], draw, area)?,
            Scheme::Probe | Scheme::Static | Scheme::StaticDeep | Scheme::StaticTwo => {
                let row = scheme.specification();
                for at in 1..row.sites * row.instruments {
                    let draw = Draw::new(&mut others);
                    let area = scheme.face_count(draw) * FACE_AREA_MM2;
                    patches.push(if scheme == Scheme::StaticTwo && at % 2 == 1 {
                        beside(&patches[at - 1], || place(area))?
                    } else {
                        place(area)?
                    });
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

    /// Patches that touch at `frame`, and the time since the contact with their site began, s.
    fn active(&self, frame: usize) -> (Range<usize>, f64) {
        let t = frame as f64 * FRAME_S;
        let row = self.scheme.specification();
        match self.scheme {
            Scheme::HardSlide => {
                let stop = (t / 7.5 * SLIDE_STOPS as f64) as usize;
                let stop = stop.min(self.patches.len() - 1);
                (stop..stop + 1, t)
            }
            Scheme::Probe => {
                let site = ((t / PROBE_S + 1e-9) as usize).min(row.sites - 1);
                // Whole frames: 1.6 s is a multiple of them, and the remainder of a rounded time is not.
                let since = (t - site as f64 * PROBE_S).clamp(0.0, PROBE_S - 1e-9);
                (site..site + 1, since)
            }
            Scheme::Static | Scheme::StaticTwo | Scheme::StaticDeep => {
                let at = frame.saturating_sub(1);
                let (site, depth) = (at / row.depths, at % row.depths + 1);
                let end = ((site + 1) * row.instruments).min(self.patches.len());
                (
                    (site * row.instruments).min(end)..end,
                    depth as f64 * FRAME_S,
                )
            }
            _ => (0..self.patches.len(), t),
        }
    }

    /// Contact nodes and their displacement at the end of frame `frame` (0 is rest), ascending, mm.
    pub fn contact(&self, frame: usize) -> Vec<ContactNode> {
        let mut contact: Vec<ContactNode> = Vec::new();
        if frame == 0 {
            return contact;
        }
        let (active, since) = self.active(frame);
        for at in active {
            let (patch, draw) = (&self.patches[at], self.draws[at.min(self.draws.len() - 1)]);
            let pose = self.scheme.pose(since, draw);
            if pose.push <= 1e-6 {
                continue;
            }
            let length = self.scheme.magnitude_mm(draw) * pose.push;
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
