//! Ties ([`contact::tie`]) of the tissue, solved inside every inner step as contact is: after the free update, over lumped masses, so that the stiffest tie
//! takes no shorter step. Contact comes after them. Forces are µN inside and mN in reports.
//!
//! A force `f` on a tie moves its length's ends by `f sum w_k² g_k`, `g` the gains of the central differences at its nodes, `w` its weights (those of the far end,
//! where that is tissue too, negative). [`SWEEPS`] sweeps of Gauss-Seidel find the forces of ties that share nodes.

use super::fields::Node;
use super::touch::{REPORT_S, SWEEPS};
use contact::{End, Tie, TiePoint, Vector};

/// The tension that breaks a tie is a mean over this time, s: one inner step's is noisy.
const BREAK_S: f64 = 0.001;

/// A tie at the end of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TieReport {
    /// On the tissue at the tie's point, mN; mean over the last 2 ms of the frame.
    pub force: [f32; 3],
    /// From end to end, mm.
    pub length_mm: f32,
    /// When it broke, s since rest.
    pub broke_s: Option<f64>,
}

/// A node of a tie.
#[derive(Clone, Copy, Debug)]
struct Entry {
    slot: u32,
    weight: f32,
    /// Increment before the last inner step, and what the ties have added to that of this one, mm.
    earlier: Vector,
}

#[derive(Clone, Debug)]
struct Tied {
    tie: Tie,
    entries: Vec<Entry>,
    /// Its length at rest is that of these: `sum w_k X_k`, mm.
    rest: Vector,
    /// Where its far end is in its frame at the start and the end of the frame.
    places: [Vector; 2],
    /// On the tissue in the last inner step, µN; mean tension, µN.
    force: Vector,
    mean: f64,
    broke_s: Option<f64>,
    length: f32,
    sum: Vector,
}

/// What ties ask of the rest of the solver.
pub(super) trait Frames {
    /// Where a place of a frame is at a part of the solver's frame: of the support, or of a tool.
    fn at(&self, tool: Option<u32>, place: Vector, part: f32) -> Vector;
    /// A tool takes the force (µN) at a point.
    fn feel(&mut self, tool: u32, point: Vector, force: Vector);
}

/// The ties of a solver.
#[derive(Clone, Debug, Default)]
pub(super) struct Ties {
    tied: Vec<Tied>,
    /// What they have added to increments in this inner step, by slot, ascending.
    changes: Vec<(u32, Vector)>,
    steps: u32,
    dt: f64,
    start_s: f64,
}

/// Where the far end of a tie is in its frame.
fn place_of(end: &End) -> Vector {
    match *end {
        End::World(place) | End::Support(place) | End::Tool { place, .. } => place,
        End::Tissue(_) => Vector::ZERO,
    }
}

fn vector(node: &Node) -> Vector {
    Vector::new(node.0[0], node.0[1], node.0[2])
}

impl Tied {
    /// Whether it is this tie that another list has in its place.
    fn goes_on_as(&self, tie: &Tie) -> bool {
        let same_end = match (&self.tie.end, &tie.end) {
            (End::World(_), End::World(_)) | (End::Support(_), End::Support(_)) => true,
            (End::Tool { tool, .. }, End::Tool { tool: other, .. }) => tool == other,
            (End::Tissue(a), End::Tissue(b)) => a == b,
            _ => false,
        };
        same_end && self.tie.point == tie.point && tie.spring.stiffness > 0.0
    }

    fn pulls(&self) -> bool {
        self.broke_s.is_none() && self.tie.spring.stiffness > 0.0
    }

    /// Where its far end is; what is tissue is part of its entries.
    fn end(&self, frames: &impl Frames, part: f32) -> Vector {
        let [from, to] = self.places;
        let place = from + (to - from) * part;
        match self.tie.end {
            End::World(_) => place,
            End::Support(_) => frames.at(None, place, part),
            End::Tool { tool, .. } => frames.at(Some(tool), place, part),
            End::Tissue(_) => Vector::ZERO,
        }
    }
}

/// The solver's slot arrays; only the thread that resolves ties may use them.
#[derive(Clone, Copy)]
pub(super) struct Slots {
    pub displacement: *mut Node,
    pub increment: *mut Node,
    pub force: *const Node,
    /// Of the central differences.
    pub beta: f32,
}

impl Ties {
    /// Ties that go on from those before; `node` gives the slot of a mesh node and where it is at rest.
    pub fn following(before: Ties, ties: &[Tie], node: impl Fn(u32) -> (u32, Vector)) -> Ties {
        let made = ties.iter().enumerate().map(|(index, tie)| {
            let known = before.tied.get(index).filter(|known| known.goes_on_as(tie));
            let far = match tie.end {
                End::Tissue(sample) => Some(sample),
                _ => None,
            };
            let near = tie.point.entries();
            let far = far.iter().flat_map(TiePoint::entries);
            let nodes = near.chain(far.map(|(node, weight)| (node, -weight)));
            let nodes: Vec<(u32, f32)> = nodes.collect();
            let entries = nodes.iter().map(|&(own, weight)| Entry {
                slot: node(own).0,
                weight,
                earlier: Vector::ZERO,
            });
            let place = place_of(&tie.end);
            Tied {
                tie: *tie,
                entries: entries.collect(),
                rest: (nodes.iter().map(|(own, weight)| node(*own).1 * *weight)).sum(),
                places: [known.map_or(place, |known| known.places[1]), place],
                force: Vector::ZERO,
                mean: known.map_or(0.0, |known| known.mean),
                broke_s: known.and_then(|known| known.broke_s),
                length: 0.0,
                sum: Vector::ZERO,
            }
        });
        Ties {
            tied: made.collect(),
            ..Ties::default()
        }
    }

    /// Starts a frame of `steps` inner steps of `dt` at a time since rest.
    pub fn begin(&mut self, start_s: f64, steps: u32, dt: f64) {
        (self.start_s, self.steps, self.dt) = (start_s, steps, dt);
        for tied in &mut self.tied {
            tied.sum = Vector::ZERO;
        }
    }

    /// The frame has ended.
    pub fn arrive(&mut self) {
        for tied in &mut self.tied {
            tied.places[0] = tied.places[1];
        }
    }

    fn reported(&self) -> u32 {
        ((REPORT_S / self.dt).round() as u32).clamp(1, self.steps)
    }

    pub fn reports(&self) -> Vec<TieReport> {
        let part = 1e-3 / self.reported() as f32;
        let ties = self.tied.iter();
        ties.map(|tied| TieReport {
            force: (tied.sum * part).to_array(),
            length_mm: tied.length,
            broke_s: tied.broke_s,
        })
        .collect()
    }

    /// What the ties have added to a slot's increment in this inner step.
    pub fn change_at(&self, slot: u32) -> Vector {
        let found = self.changes.binary_search_by_key(&slot, |change| change.0);
        found.map_or(Vector::ZERO, |at| self.changes[at].1)
    }

    /// Corrects displacements and increments after the free update of inner step `step` (from 1).
    ///
    /// # Safety
    /// No other thread may touch the arrays of `slots`, which must have all of the solver's.
    pub unsafe fn resolve(&mut self, slots: Slots, frames: &mut impl Frames, step: u32) {
        let part = |step: u32| step as f32 / self.steps as f32;
        let (from, to) = (part(step - 1), part(step));
        self.changes.clear();
        for tied in &mut self.tied {
            tied.force = Vector::ZERO;
            for entry in &mut tied.entries {
                let slot = entry.slot as usize;
                // SAFETY: the caller's.
                let (increment, force) =
                    unsafe { (&*slots.increment.add(slot), &*slots.force.add(slot)) };
                let gain = increment.0[3];
                // A prescribed or held node moves as it is told, before and after.
                entry.earlier = match gain > 0.0 {
                    true => (vector(increment) - vector(force) * gain) / slots.beta,
                    false => vector(increment),
                };
                self.changes.push((entry.slot, Vector::ZERO));
            }
        }
        self.changes.sort_unstable_by_key(|change| change.0);
        self.changes.dedup_by_key(|change| change.0);
        for sweep in 0..SWEEPS {
            for tied in self.tied.iter_mut().filter(|tied| tied.pulls()) {
                let (mut way, mut start, mut gain) = (tied.rest, tied.rest, 0.0);
                for entry in &tied.entries {
                    // SAFETY: the caller's.
                    let (u, increment) = unsafe {
                        let slot = entry.slot as usize;
                        (&*slots.displacement.add(slot), &*slots.increment.add(slot))
                    };
                    way += vector(u) * entry.weight;
                    start += (vector(u) - vector(increment)) * entry.weight;
                    gain += entry.weight * entry.weight * increment.0[3];
                }
                let end = tied.end(frames, to);
                way -= end;
                let start = (start - tied.end(frames, from)).length();
                let pull = tied.tie.spring.over(start, self.dt as f32).scaled(1e3);
                let force = pull.solve_even(gain, way - tied.force * gain);
                let change = force - tied.force;
                tied.force = force;
                for entry in &tied.entries {
                    let slot = entry.slot as usize;
                    // SAFETY: the caller's.
                    let (u, increment) = unsafe {
                        (
                            &mut *slots.displacement.add(slot),
                            &mut *slots.increment.add(slot),
                        )
                    };
                    let moved = change * (entry.weight * increment.0[3]);
                    for (axis, moved) in moved.to_array().into_iter().enumerate() {
                        u.0[axis] += moved;
                        increment.0[axis] += moved;
                    }
                    let found = self.changes.binary_search_by_key(&entry.slot, |c| c.0);
                    if let Ok(at) = found {
                        self.changes[at].1 += moved;
                    }
                }
                if sweep + 1 == SWEEPS {
                    tied.length = (way + change * gain).length();
                    if let End::Tool { tool, .. } = tied.tie.end {
                        frames.feel(tool, end, -force);
                    }
                }
            }
        }
        let reported = step + self.reported() > self.steps;
        for tied in &mut self.tied {
            if reported {
                tied.sum += tied.force;
            }
            tied.mean +=
                (f64::from(tied.force.length()) - tied.mean) * (self.dt / BREAK_S).min(1.0);
            let most = 1e3 * f64::from(tied.tie.break_mn);
            if tied.pulls() && most > 0.0 && tied.mean > most {
                tied.broke_s = Some(self.start_s + f64::from(step) * self.dt);
            }
        }
    }

    /// Work of the ties on the tissue over the inner step, nJ, after contact.
    ///
    /// # Safety
    /// As [`Ties::resolve`].
    pub unsafe fn work(&self, slots: Slots) -> f64 {
        let mut work = 0.0;
        for tied in &self.tied {
            for entry in &tied.entries {
                // SAFETY: the caller's.
                let increment = unsafe { vector(&*slots.increment.add(entry.slot as usize)) };
                let mean = (increment + entry.earlier) * (0.5 * entry.weight);
                work += f64::from(tied.force.dot(mean));
            }
        }
        work
    }
}
