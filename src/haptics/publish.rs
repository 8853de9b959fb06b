//! The scene's end: after each published state the contact problem near the tool.
//!
//! A hand asks for forces a thousand times a second and may not wait for a step, so it works on a
//! copy: the compliance `W` of the samples near the tool, where they are, what they were pushed
//! with, and how the modes move. The copy is made here, in the thread that steps, and handed over
//! by an exchange of three buffers (`exchange`) in which neither side waits for the other.

mod leaving;
mod link;
mod motion;
mod near;
mod softened;
mod stepped;
mod tied;
pub mod tissue;

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ::contact::{Sample, Samples, Search, Vector};
use exchange::exchange;

pub use self::link::Link;
pub use self::stepped::Stepped;

use self::leaving::{Leaving, Modal};
use self::link::HandLine;
use self::motion::{Carried, ModalRoom};
use self::near::{FeltTool, NearSamples};
use self::softened::Softened;
use self::tied::OwnTies;
use super::HapticOptions;
use super::ends::Ends;
use super::modes::Modes;
use super::render::Haptics;
use super::snapshot::{ContactSnapshot, Facing, MOST_SAMPLES};
use crate::contact::{Compliance, Delassus, Mode, Pair, State};
use crate::corrections::{Corrections, Integrator};
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::prior::PriorTable;

const WHAT: &str = "the haptics of a scene";
/// Time over which samples move at once, s: the modes take no part.
const AT_ONCE_S: f64 = 1e-3;

/// Times the impedance of a sample's mass on its spring. With 1 taps on two meshes lag behind the solver's force, with 2 strokes feel
/// too much of it (`docs/guide/haptics.md`).
const IMPEDANCE: f32 = 1.5;

/// Both ends for a tool on a body.
///
/// # Errors
/// [`Error::Argument`] for a tool or an option out of range, [`Error::OutOfMemory`].
pub fn join(
    options: &HapticOptions,
    prior: &PriorTable,
    corrections: &Corrections,
    integrator: Integrator,
    samples: Arc<Samples>,
) -> Result<(Link, Haptics)> {
    check(options)?;
    let tool = &options.tool;
    let natural = corrections.space.natural()?;
    let snapshot = || ContactSnapshot::new(natural.len());
    let buffers = [snapshot()?, snapshot()?, snapshot()?];
    let snapshot_bytes = buffers[0].held_bytes();
    let (out, snapshot) = exchange(buffers);
    let (at, pose) = exchange([tool.pose; 3]);
    let ends = Arc::new(Ends::default());
    let modes = Modes::new(&natural, integrator.damping_per_s)?;
    let kappa = integrator.over(AT_ONCE_S).kappa();
    let link = Link {
        tool: FeltTool {
            instrument: options.instrument,
            body: tool.body.clone(),
            friction: tool.friction,
            grasps: tool.mode == Mode::Grasp,
        },
        line: HandLine {
            out,
            pose,
            snapshot_bytes,
            ends: Arc::clone(&ends),
            number: 0,
            latency_s: options.latency_s,
            last_pose: None,
        },
        near: NearSamples {
            samples: Arc::clone(&samples),
            search: memory::tried(Search::with_room(&samples), WHAT)?,
            found: memory::room(4 * MOST_SAMPLES, WHAT)?,
            sampled: memory::room(MOST_SAMPLES, WHAT)?,
        },
        delassus: Delassus::default(),
        softened: Softened::default(),
        inertial_compliance: corrections.space.inertial_compliance(kappa)?,
        modal: ModalRoom {
            starts: prior.basis_starts()?,
            coordinates: memory::zeros(prior.width(), WHAT)?,
            field: memory::zeros(3 * corrections.body.mass.len(), WHAT)?,
            masses: memory::collected(natural.len(), natural.iter().map(|mode| mode.1), WHAT)?,
            rows: memory::collected(natural.len(), 0..natural.len() as u32, WHAT)?,
        },
        carried: Carried::default(),
        ties: OwnTies::default(),
        leaving: Leaving::default(),
    };
    let haptics = Haptics::new(options, modes, snapshot, at, ends)?;
    Ok((link, haptics))
}

/// Mass that a force on a sample has to move first, g.
fn mass(sample: Sample, masses: &[f32], held: &[bool]) -> f32 {
    let free = sample.entries().filter(|entry| !held[entry.0 as usize]);
    let eased: f32 = free.map(|(node, w)| w * w / masses[node as usize]).sum();
    if eased > 0.0 { 1.0 / eased } else { 0.0 }
}

/// [`IMPEDANCE`] times the mean over samples of `sqrt(m w)`, `w` the sample's own compliance in the matrix `[3n,3n]`, mm/mN; s. With it a
/// sample resists a velocity by as many times `sqrt(m / w)`, the impedance of its mass on its spring: what a hit radiates into the tissue.
fn delay(delassus: &[f32], masses: impl ExactSizeIterator<Item = f32>) -> f32 {
    let count = masses.len();
    let own = |row: usize| delassus[row * 3 * count + row];
    let delays = masses.enumerate().map(|(at, mass)| {
        let w: f32 = (3 * at..3 * at + 3).map(own).sum();
        (1e-3 * mass * (w / 3.0).max(0.0)).sqrt()
    });
    IMPEDANCE * delays.sum::<f32>() / count.max(1) as f32
}

/// Ranges of the options, each named in its error.
fn check(options: &HapticOptions) -> Result<()> {
    let most = crate::contact::MAX_TOOLS as u32;
    if options.instrument >= most {
        return Err(Error::Argument(format!(
            "instrument is {}; it must be a place in a list of at most {most} instruments",
            options.instrument
        )));
    }
    options.tool.check(options.instrument as usize)?;
    let latency = options.latency_s.unwrap_or(0.0);
    for (name, value, most) in [
        ("blend_s", options.blend_s, 1.0),
        (
            "damping_limit_n_s_per_m",
            options.damping_limit_n_s_per_m.into(),
            1e6,
        ),
        ("force_limit_n", options.force_limit_n.into(), 1e6),
        ("latency_s", latency, 1.0),
    ] {
        if !(value >= 0.0 && value <= most) {
            return Err(Error::Argument(format!(
                "{name} is {value}, must be 0 to {most}"
            )));
        }
    }
    Ok(())
}

impl Link {
    /// Whether the hand has gone.
    /// The scene then stops publishing for it.
    pub fn is_over(&self) -> bool {
        self.line.ends.hand_gone.load(Ordering::Acquire)
    }

    /// Publishes a state.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; [`Error::Panic`] of a worker. The problem before stays.
    pub fn publish(&mut self, step: &Stepped<'_>) -> Result<()> {
        self.ties.find(step.problem, self.tool.instrument)?;
        let pose = *self.line.pose.read();
        let last = self.line.last_pose.replace(pose).unwrap_or(pose);
        (self.near).find(step, &self.tool, self.ties.rows(), [&last, &pose])?;
        let held = &step.corrections.body.held.is;
        let compliance = Compliance::at_rest(
            step.prior,
            held,
            Some((&step.corrections.space, &self.inertial_compliance)),
        );
        let samples = &*self.near.samples;
        let ties = &self.ties;
        let of = self
            .near
            .found
            .iter()
            .map(|(_, row)| ties.sample(samples, *row));
        let masses = of
            .clone()
            .map(|sample| mass(sample, &step.corrections.body.mass, held));
        self.near.sampled.clear();
        self.near
            .sampled
            .extend(self.near.found.iter().map(|(_, row)| *row));
        let all = ties.points(samples);
        let w = self.delassus.of(compliance, all, &self.near.sampled)?;
        let snapshot = self.line.out.buffer();
        let soft = (self.softened).factor(step, self.tool.instrument, (ties, samples))?;
        let published = &mut snapshot.delassus[..w.len()];
        published.copy_from_slice(w);
        published.iter_mut().for_each(|w| *w *= soft);
        snapshot.delay_s = delay(published, masses);
        let modes = self.modal.rows.len();
        for (at, sample) in of.enumerate() {
            let out = &mut snapshot.modes.at_samples[3 * at * modes..3 * (at + 1) * modes];
            out.fill(0.0);
            for (column, weight) in compliance.entries(sample) {
                for (axis, out) in out.chunks_exact_mut(modes.max(1)).enumerate() {
                    let own = step
                        .corrections
                        .space
                        .at_contact(3 * column as usize + axis);
                    for (sum, value) in out.iter_mut().zip(own) {
                        *sum += weight * value;
                    }
                }
            }
        }
        let out = [&mut *snapshot.modes.velocity, &mut *snapshot.modes.drive];
        motion::modal(step, &mut self.carried, &mut self.modal, out)?;
        snapshot.samples.followed_s = motion::FOLLOWED_STEPS * step.integrator.step_s;
        let state = State {
            rest: step.rest,
            u: step.u,
            start: step.u,
        };
        let index = self.tool.instrument as usize;
        let past = step
            .problem
            .and_then(|problem| Some((&problem.past, problem.past.tools.get(index)?)));
        snapshot.pose = past.map(|(_, tool)| tool.pose);
        snapshot.samples.count = self.near.found.len();
        self.leaving.begin(self.near.found.len(), modes)?;
        for (at, &(_, row)) in self.near.found.iter().enumerate() {
            let tie = self.ties.of(row);
            let sample = self.ties.sample(&self.near.samples, row);
            let point = sample.gather(|node| state.position(node));
            let anchor = past.and_then(|(_, tool)| tool.grasp.place(row));
            let force = past.map_or(Vector::ZERO, |(past, _)| {
                let key = |force: &crate::contact::past::Force| (force.tool, force.sample);
                let found = past
                    .forces
                    .binary_search_by_key(&(self.tool.instrument, row), key);
                found.map_or_else(|_| tied::force(past, row), |at| past.forces[at].force)
            });
            snapshot.samples.points[at] = point;
            let groups = step.corrections.groups.as_slice();
            let base = |node| Vector::from(self.carried.velocity(groups, node));
            snapshot.samples.carried[at] = sample.gather(base);
            let samples = &self.near.samples;
            snapshot.samples.facing[at] = match tie {
                Some(_) => Facing {
                    outward: Vector::X,
                    is_wall: false,
                },
                None => Facing {
                    outward: samples.outward(row, |node| state.position(node)),
                    is_wall: samples.is_on_wall(row),
                },
            };
            snapshot.samples.ties[at] = tie;
            snapshot.samples.forces[at] = force;
            snapshot.samples.anchors[at] = anchor;
            if let (None, None, Some(pose)) = (anchor, tie, &snapshot.pose) {
                let moves = (point, snapshot.samples.carried[at]);
                let tool = (&self.tool.body, pose);
                (self.leaving).take(at, moves, force, tool, step.integrator.step_s);
            }
            // What the step's solve left, which the hand must not feel as a motion.
            snapshot.samples.errors[at] = snapshot.pose.map_or(Vector::ZERO, |pose| {
                if let Some(tie) = &tie {
                    return tied::error(tie, &pose, point, force);
                }
                let pair = Pair {
                    body: &self.tool.body,
                    friction: self.tool.friction,
                    from: &pose,
                    now: &pose,
                    anchor,
                    put: false,
                    swept: true,
                    way_out: None,
                    is_wall: snapshot.samples.facing[at].is_wall,
                };
                let pushed = force != Vector::ZERO;
                let contact =
                    pair.contact(point, point, snapshot.samples.facing[at].outward, force);
                match (anchor, pushed) {
                    (Some(_), _) => contact.slip,
                    _ if contact.gap == f32::MAX => Vector::ZERO,
                    (None, true) => Vector::new(contact.gap, 0.0, 0.0),
                    (None, false) => Vector::new(contact.gap.min(0.0), 0.0, 0.0),
                }
            });
        }
        let modal = Modal {
            at_samples: &snapshot.modes.at_samples,
            masses: &self.modal.masses,
            velocity: &mut snapshot.modes.velocity,
        };
        self.leaving.hold(snapshot.pose, modal);
        self.line.number += 1;
        snapshot.number = self.line.number;
        snapshot.latency_s = self.line.latency_s.unwrap_or(step.took_s);
        self.line.out.publish();
        Ok(())
    }

    /// Bytes held, of both ends.
    pub fn memory_bytes(&self) -> usize {
        3 * self.line.snapshot_bytes + self.held_bytes()
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.line.ends.scene_gone.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_of_the_mass_that_a_force_moves_first() {
        // Two samples of 0.01 and 0.04 mm/mN, 0.1 and 0.4 g: 1 and 4 ms.
        let mut delassus = [0.0; 36];
        for row in 0..6 {
            delassus[7 * row] = if row < 3 { 0.01 } else { 0.04 };
        }
        let found = delay(&delassus, [0.1f32, 0.4].into_iter());
        assert!((found / IMPEDANCE - 2.5e-3).abs() < 1e-6, "{found}");
        assert_eq!(delay(&[], [0.0f32; 0].into_iter()), 0.0);
    }
}
