//! The scene's end: after each published state the contact problem near the tool.

mod motion;
mod stepped;
mod tied;
pub mod tissue;

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ::contact::{Body, Placed, Pose, Sample, Samples, Search, Vector};
use exchange::{Reader, Writer, exchange};

pub use self::stepped::Stepped;

use self::motion::{Carried, ModalRoom};
use self::tied::OwnTies;
use super::HapticOptions;
use super::ends::Ends;
use super::modes::Modes;
use super::render::Haptics;
use super::snapshot::{ContactSnapshot, MOST_SAMPLES};
use crate::contact::{Compliance, Delassus, Mode, PUT_MM, Pair, State, outward, vector};
use crate::corrections::{Corrections, Integrator};
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::prior::PriorTable;

const WHAT: &str = "the haptics of a scene";
/// Samples this near to the tool are published, mm: what it may reach before the next step.
const REACH_MM: f32 = 6.0;
/// Time over which samples move at once, s: the modes take no part.
const AT_ONCE_S: f64 = 1e-3;

/// Times the impedance of a sample's mass on its spring. With 1 taps on two meshes lag behind the solver's force, with 2 strokes feel
/// too much of it (`docs/guide/haptics.md`).
const IMPEDANCE: f32 = 1.5;

/// A tool of a scene that a hand feels.
#[derive(HeldBytes)]
pub struct Link {
    /// Its place in the list of the scene's tools: forces and grasps of that place are its own.
    instrument: u32,
    #[held(skip)]
    body: Body,
    friction: f32,
    grasps: bool,
    #[held(skip)]
    out: Writer<ContactSnapshot>,
    #[held(skip)]
    pose: Reader<Pose>,
    /// Bytes of one of the three buffers that the two threads exchange.
    snapshot_bytes: usize,
    /// Says to each end that the other has gone.
    #[held(skip)]
    ends: Arc<Ends>,
    #[held(skip)]
    samples: Arc<Samples>,
    search: Search,
    /// `W` of the published samples within [`AT_ONCE_S`]: natural modes are too slow to take part, and go on in the hand's thread.
    delassus: Delassus,
    inertial_compliance: Vec<f32>,
    /// Nearest samples by distance and row, and their rows alone.
    found: Vec<(f32, u32)>,
    sampled: Vec<u32>,
    /// Where the basis of each block starts.
    starts: Vec<usize>,
    /// A field `[K,3]` that is projected on the modes, and its block coordinates `[Q]`.
    coordinates: Vec<f32>,
    field: Vec<f32>,
    /// Mass of the natural modes, g.
    masses: Vec<f32>,
    rows: Vec<u32>,
    carried: Carried,
    ties: OwnTies,
    /// How many states were published: the hand sees by it how many it missed.
    number: u64,
    /// Age of a state when the hand gets it, s; the time that the step took where the host gave none.
    latency_s: Option<f64>,
    /// Where the hand was when the last state was published.
    last_pose: Option<Pose>,
}

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
        instrument: options.instrument,
        body: tool.body.clone(),
        friction: tool.friction,
        grasps: tool.mode == Mode::Grasp,
        out,
        pose,
        snapshot_bytes,
        ends: Arc::clone(&ends),
        samples: Arc::clone(&samples),
        search: memory::tried(Search::with_room(&samples), WHAT)?,
        delassus: Delassus::default(),
        inertial_compliance: corrections.space.inertial_compliance(kappa)?,
        found: memory::room(4 * MOST_SAMPLES, WHAT)?,
        sampled: memory::room(MOST_SAMPLES, WHAT)?,
        starts: prior.basis_starts()?,
        coordinates: memory::zeros(prior.width(), WHAT)?,
        field: memory::zeros(3 * corrections.body.mass.len(), WHAT)?,
        masses: memory::collected(natural.len(), natural.iter().map(|mode| mode.1), WHAT)?,
        rows: memory::collected(natural.len(), 0..natural.len() as u32, WHAT)?,
        carried: Carried::default(),
        ties: OwnTies::default(),
        number: 0,
        latency_s: options.latency_s,
        last_pose: None,
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
    pub fn is_over(&self) -> bool {
        self.ends.hand_gone.load(Ordering::Acquire)
    }

    /// Publishes a state.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; [`Error::Panic`] of a worker. The problem before stays.
    pub fn publish(&mut self, step: &Stepped<'_>) -> Result<()> {
        self.find(step)?;
        let held = &step.corrections.body.held.is;
        let compliance = Compliance::at_rest(
            step.prior,
            held,
            Some((&step.corrections.space, &self.inertial_compliance)),
        );
        let samples = &*self.samples;
        let ties = &self.ties;
        let of = self.found.iter().map(|(_, row)| ties.sample(samples, *row));
        let masses = of
            .clone()
            .map(|sample| mass(sample, &step.corrections.body.mass, held));
        self.sampled.clear();
        self.sampled.extend(self.found.iter().map(|(_, row)| *row));
        let all = ties.points(samples);
        let w = self.delassus.of(compliance, all, &self.sampled)?;
        let snapshot = self.out.buffer();
        snapshot.delassus[..w.len()].copy_from_slice(w);
        snapshot.delay_s = delay(w, masses);
        let modes = self.rows.len();
        for (at, sample) in of.enumerate() {
            let out = &mut snapshot.at_samples[3 * at * modes..3 * (at + 1) * modes];
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
        let room = ModalRoom {
            starts: &self.starts,
            masses: &self.masses,
            rows: &self.rows,
            field: &mut self.field,
            coordinates: &mut self.coordinates,
        };
        let out = [&mut *snapshot.velocity, &mut *snapshot.drive];
        motion::modal(step, &mut self.carried, room, out)?;
        snapshot.followed_s = motion::FOLLOWED_STEPS * step.integrator.step_s;
        let state = State {
            rest: step.rest,
            u: step.u,
            start: step.u,
        };
        let index = self.instrument as usize;
        let past = step
            .problem
            .and_then(|problem| Some((&problem.past, problem.past.tools.get(index)?)));
        snapshot.pose = past.map(|(_, tool)| tool.pose);
        snapshot.count = self.found.len();
        for (at, &(_, row)) in self.found.iter().enumerate() {
            let tie = self.ties.of(row);
            let sample = self.ties.sample(&self.samples, row);
            let point = sample.gather(|node| state.position(node));
            let anchor = past.and_then(|(_, tool)| tool.grasp.place(row));
            let force = past.map_or(Vector::ZERO, |(past, _)| {
                let key = |force: &crate::contact::past::Force| (force.tool, force.sample);
                let found = past
                    .forces
                    .binary_search_by_key(&(self.instrument, row), key);
                found.map_or_else(|_| tied::force(past, row), |at| past.forces[at].force)
            });
            snapshot.points[at] = point;
            let groups = step.corrections.groups.as_slice();
            let base = |node| Vector::from(self.carried.velocity(groups, node));
            snapshot.carried[at] = sample.gather(base);
            snapshot.outward[at] = match tie {
                Some(_) => Vector::X,
                None => outward(&self.samples, row, state),
            };
            snapshot.ties[at] = tie;
            snapshot.forces[at] = force;
            snapshot.anchors[at] = anchor;
            // What the step's solve left, which the hand must not feel as a motion.
            snapshot.errors[at] = snapshot.pose.map_or(Vector::ZERO, |pose| {
                if let Some(tie) = &tie {
                    return tied::error(tie, &pose, point, force);
                }
                let pair = Pair {
                    body: &self.body,
                    friction: self.friction,
                    from: &pose,
                    now: &pose,
                    anchor,
                    put: false,
                    swept: true,
                    way_out: None,
                };
                let pushed = force != Vector::ZERO;
                let contact = pair.contact(point, point, snapshot.outward[at], force);
                match (anchor, pushed) {
                    (Some(_), _) => contact.slip,
                    _ if contact.gap == f32::MAX => Vector::ZERO,
                    (None, true) => Vector::new(contact.gap, 0.0, 0.0),
                    (None, false) => Vector::new(contact.gap.min(0.0), 0.0, 0.0),
                }
            });
        }
        self.number += 1;
        snapshot.number = self.number;
        snapshot.latency_s = self.latency_s.unwrap_or(step.took_s);
        self.out.publish();
        Ok(())
    }

    /// The samples that are pushed or held by the tool, and the nearest to where the hand is now.
    fn find(&mut self, step: &Stepped<'_>) -> Result<()> {
        let pose = *self.pose.read();
        self.found.clear();
        self.ties.find(step.problem, self.instrument)?;
        memory::fit(&mut self.found, self.ties.rows().count(), WHAT)?;
        self.found
            .extend(self.ties.rows().map(|row| (f32::MIN, row)));
        let index = self.instrument as usize;
        if let Some(problem) = step.problem {
            let past = &problem.past;
            let anchors = past.tools.get(index).map(|tool| tool.grasp.anchors().len());
            let more = past.forces.len() + anchors.unwrap_or(0);
            memory::reserve(&mut self.found, more, WHAT)?;
            let own = problem.past.forces.iter();
            let own = own.filter(|force| force.tool == self.instrument);
            self.found.extend(own.map(|force| (f32::MIN, force.sample)));
            if let Some(tool) = problem.past.tools.get(index)
                && self.grasps
            {
                let anchors = tool.grasp.anchors().iter();
                self.found
                    .extend(anchors.map(|anchor| (f32::MIN, anchor.sample)));
            }
        }
        // A quick hand is elsewhere before the next state: what lies on its way, if it goes on as it did, is within reach too.
        let last = self.last_pose.replace(pose).unwrap_or(pose);
        let ahead = pose.translation - last.translation;
        let on = |part: f32| Pose::from_parts(pose.translation + ahead * part, pose.rotation);
        let is_quick = ahead.length() > REACH_MM;
        let position = |node| vector(step.rest, node) + vector(step.u, node);
        // One that starts suddenly may be at the nearest part of the surface before the next state.
        let nodes = self.samples.nodes().iter();
        let gaps = nodes.map(|node| self.body.nearest_at(&pose, position(*node)).distance);
        let gap = gaps.fold(f32::MAX, f32::min);
        let gap = if gap <= PUT_MM { gap.max(0.0) } else { 0.0 };
        let placed = Placed {
            body: &self.body,
            pose: if is_quick { on(0.5) } else { pose },
            skin: REACH_MM + gap.max(if is_quick { 0.5 * ahead.length() } else { 0.0 }),
        };
        let near = self.search.find(&self.samples, &[placed], position);
        memory::reserve(&mut self.found, near.len(), WHAT)?;
        let body = &self.body;
        let near = near.iter().map(|near| {
            let ways = (0..=8).map(|part| on(part as f32 / 8.0));
            let distance = match is_quick {
                true => ways.fold(f32::MAX, |least, pose| {
                    least.min(body.nearest_at(&pose, near.point).distance)
                }),
                false => near.distance,
            };
            (distance, near.sample)
        });
        self.found.extend(near);
        // Of equals the pushed one comes first, and stays.
        self.found
            .sort_unstable_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
        self.found.dedup_by_key(|found| found.1);
        self.found
            .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.found.truncate(MOST_SAMPLES);
        self.found.sort_unstable_by_key(|found| found.1);
        Ok(())
    }

    /// Bytes held, of both ends.
    pub fn memory_bytes(&self) -> usize {
        3 * self.snapshot_bytes + self.held_bytes()
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.ends.scene_gone.store(true, Ordering::Release);
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
