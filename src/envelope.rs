//! The envelope: whether a step's contact is inside what the model was trained on, as flags and a number.
//!
//! REQ-022: A contact outside of what the model was trained on raises its flag, and one inside does not.

use crate::bundle::{Envelope, Mesh, ToolEnvelope};
use crate::contact::ToolUse;
use crate::error::Result;
use crate::field::ContactSet;
use crate::memory::{self, HeldBytes};
use crate::stats::flag;

/// Rounding that is no violation, relative.
const SLACK: f32 = 1.0 + 1e-4;
/// A node in no patch.
const NO_PATCH: u32 = u32::MAX;

/// What a check found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnvelopeReport {
    /// Bits of [`flag`].
    pub flags: u32,
    /// Largest ratio of a quantity to its limit; above 1 is outside.
    pub ratio: f32,
    /// Largest `|c|`, mm.
    pub max_push: f32,
}

/// Contact patches of a mesh, found by its surface edges; kept while the contact nodes stay the same.
#[derive(Debug, HeldBytes)]
pub struct EnvelopeCheck {
    /// Neighbours along edges of the surface: those of node `n` are `neighbours[offsets[n]..offsets[n + 1]]`.
    offsets: Vec<u32>,
    neighbours: Vec<u32>,
    /// By node: tools may touch it.
    in_domain: Vec<bool>,
    /// By node: its patch while patches are searched, else [`NO_PATCH`].
    patch: Vec<u32>,
    /// Nodes of a patch whose neighbours are still to be looked at.
    stack: Vec<u32>,
    /// The contact nodes that the patches are of, and what was found: while the nodes stay the same, so does that.
    nodes: Vec<u32>,
    patch_flags: u32,
    patch_ratio: f32,
}

impl EnvelopeCheck {
    /// Surface adjacency of a mesh.
    pub fn new(mesh: &Mesh) -> Result<EnvelopeCheck> {
        const WHAT: &str = "the surface's edges";
        let mut edges: Vec<(u32, u32)> = memory::room(2 * mesh.surface.faces.len(), WHAT)?;
        for f in mesh.surface.faces.chunks_exact(3) {
            for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
                edges.extend([(a, b), (b, a)]);
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let count = mesh.node_count();
        let mut offsets = memory::filled(count + 1, 0u32, WHAT)?;
        for &(a, _) in &edges {
            offsets[a as usize + 1] += 1;
        }
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut in_domain = memory::filled(count, false, WHAT)?;
        for &node in &mesh.domain.nodes {
            in_domain[node as usize] = true;
        }
        Ok(EnvelopeCheck {
            offsets,
            neighbours: memory::collected(edges.len(), edges.iter().map(|edge| edge.1), WHAT)?,
            in_domain,
            patch: memory::filled(count, NO_PATCH, WHAT)?,
            stack: memory::room(count, WHAT)?,
            nodes: memory::room(count, WHAT)?,
            patch_flags: 0,
            patch_ratio: 0.0,
        })
    }

    /// That of a body that has been cut from the same one, of `intact` nodes: patches are those of its surface.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    /// Copies of nodes have no neighbours of their own: a patch ends at a lip.
    pub fn cut(&self, mesh: &Mesh, intact: usize) -> Result<EnvelopeCheck> {
        const WHAT: &str = "the surface's edges";
        let count = mesh.node_count();
        let mut offsets = memory::room(count + 1, WHAT)?;
        offsets.extend_from_slice(&self.offsets[..=intact]);
        offsets.resize(count + 1, offsets[intact]);
        let mut in_domain = memory::filled(count, false, WHAT)?;
        for &node in &mesh.domain.nodes {
            in_domain[node as usize] = true;
        }
        Ok(EnvelopeCheck {
            offsets,
            neighbours: memory::copied(&self.neighbours, WHAT)?,
            in_domain,
            patch: memory::filled(count, NO_PATCH, WHAT)?,
            stack: memory::room(count, WHAT)?,
            nodes: memory::room(count, WHAT)?,
            patch_flags: 0,
            patch_ratio: 0.0,
        })
    }

    /// Compares a step's contact, and the one of the step before, with the envelope; `step`: the length of a step in the bundle's.
    pub fn check(
        &mut self,
        mesh: &Mesh,
        envelope: &Envelope,
        now: &ContactSet,
        before: &ContactSet,
        step: f32,
    ) -> EnvelopeReport {
        if now.nodes != self.nodes {
            self.nodes.clear();
            self.nodes.extend_from_slice(&now.nodes);
            self.find_patches(mesh, envelope);
        }
        let mut report = EnvelopeReport {
            flags: self.patch_flags,
            ratio: self.patch_ratio,
            max_push: now.max_push(),
        };
        let push = report.max_push / envelope.max_push_mm;
        if push > SLACK {
            report.flags |= flag::PUSH;
        }
        let rate = largest_rate(now, before) / (step * envelope.max_push_rate_mm);
        if rate > SLACK {
            report.flags |= flag::RATE;
        }
        report.ratio = report.ratio.max(push).max(rate);
        report
    }

    /// Compares tools that push with those that the bundle is good for, in their own terms: [`flag::PUSH`] says too deep,
    /// [`flag::RATE`] too fast, [`flag::CONTACT_AREA`] a size outside of the range, [`flag::SITES`] too many. `touched`: the nodes
    /// that they push and where these are.
    pub fn check_tools(
        &self,
        limits: &ToolEnvelope,
        used: &ToolUse,
        touched: &ContactSet,
    ) -> EnvelopeReport {
        let max_push = touched.max_push();
        let mut report = EnvelopeReport {
            max_push,
            ..EnvelopeReport::default()
        };
        let [low, high] = limits.size_mm;
        let [smallest, largest] = used.size_mm;
        for (flag, ratio) in [
            (flag::PUSH, max_push / limits.depth_mm),
            (flag::RATE, used.speed_mm_s / limits.speed_mm_s),
            (flag::CONTACT_AREA, (largest / high).max(low / smallest)),
            (flag::SITES, used.count as f32 / limits.max_tools as f32),
        ] {
            report.ratio = report.ratio.max(ratio);
            if ratio > SLACK {
                report.flags |= flag;
            }
        }
        let outside = |node: &u32| !self.in_domain[*node as usize];
        if touched.nodes.iter().any(outside) {
            report.flags |= flag::SITE;
            report.ratio = report.ratio.max(2.0);
        }
        report
    }

    /// Flood fill over surface edges: areas of the patches and how many there are. `O(m)` for `m` contact nodes; the marks of this
    /// search are taken back at the end, so the array of all nodes is cleared only once.
    fn find_patches(&mut self, mesh: &Mesh, envelope: &Envelope) {
        self.patch_flags = 0;
        self.patch_ratio = 0.0;
        const IN_CONTACT: u32 = u32::MAX - 1;
        for &node in &self.nodes {
            self.patch[node as usize] = IN_CONTACT;
            if !self.in_domain[node as usize] {
                self.patch_flags |= flag::SITE;
                self.patch_ratio = self.patch_ratio.max(2.0);
            }
        }
        let mut patches = 0u32;
        let [low, high] = envelope.contact_area_mm2;
        for start in 0..self.nodes.len() {
            let start = self.nodes[start];
            if self.patch[start as usize] != IN_CONTACT {
                continue;
            }
            let mut area = 0.0;
            self.patch[start as usize] = patches;
            self.stack.push(start);
            while let Some(node) = self.stack.pop() {
                let node = node as usize;
                area += mesh.surface.node_area[node];
                for &other in
                    &self.neighbours[self.offsets[node] as usize..self.offsets[node + 1] as usize]
                {
                    if self.patch[other as usize] == IN_CONTACT {
                        self.patch[other as usize] = patches;
                        self.stack.push(other);
                    }
                }
            }
            patches += 1;
            if area > high * SLACK || area * SLACK < low {
                self.patch_flags |= flag::CONTACT_AREA;
                let ratio = if area > high {
                    area / high
                } else {
                    low / area.max(1e-3 * low)
                };
                self.patch_ratio = self.patch_ratio.max(ratio);
            }
        }
        if patches as usize > envelope.max_sites {
            self.patch_flags |= flag::SITES;
            self.patch_ratio = self
                .patch_ratio
                .max(patches as f32 / envelope.max_sites as f32);
        }
        for &node in &self.nodes {
            self.patch[node as usize] = NO_PATCH;
        }
    }
}

/// Largest `|c[t] - c[t-1]|` of a node in both sets; where no node is in both, the largest `|c[t]|`: a new touch
/// starts from the undeformed surface.
fn largest_rate(now: &ContactSet, before: &ContactSet) -> f32 {
    let mut rate = 0.0f32;
    let mut shared = false;
    let mut at = 0;
    for (&node, c) in now.nodes.iter().zip(now.vectors.chunks_exact(3)) {
        while at < before.nodes.len() && before.nodes[at] < node {
            at += 1;
        }
        if before.nodes.get(at) == Some(&node) {
            shared = true;
            let b = &before.vectors[3 * at..3 * at + 3];
            let d = [c[0] - b[0], c[1] - b[1], c[2] - b[2]];
            rate = rate.max(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        }
    }
    if shared { rate.sqrt() } else { now.max_push() }
}
