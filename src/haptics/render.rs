//! The hand's end: contact at the pose of a millisecond, on the contact problem of the last step.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ::contact::{Body, Contact, Law, Limits, Pose, Sweeps, Vector, pose};
use exchange::{Reader, Writer};

use super::modes::Modes;
use super::passivity::Observer;
use super::publish::Ends;
use super::slow::{MOST_SAMPLES, Slow};
use super::stiffness::{Direction, Stiffness};
use super::{HapticForce, HapticOptions, HapticPose};
use crate::contact::Pair;
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::memory;
use crate::scene::INPUT_LIMIT;

const WHAT: &str = "haptics";
/// Samples in one solve at most; those that push come first.
const MOST_ROWS: usize = 64;
/// Samples this near to the tool are solved for, and farther by its motion, mm.
const SKIN_MM: f32 = 0.5;
/// A tool that is farther from where it was has been put there, mm.
const PUT_MM: f32 = 40.0;
/// What a step put elsewhere fades out to nothing this far outside of the tissue, mm.
const FADE_MM: f32 = 0.5;
/// Time between calls that is taken at most, s.
const MOST_S: f64 = 0.1;
/// The time of the first call, s.
const FIRST_S: f64 = 0.001;
/// Of a solve that goes on from the one a millisecond before.
const LIMITS: Limits = Limits {
    tolerance_mm: 1e-4,
    least_sweeps: 4,
    most_sweeps: 40,
};

/// A tool that a hand feels. Used from one thread, which waits for nothing: no lock, no allocation.
pub struct Haptics {
    body: Body,
    friction: f32,
    blend_s: f64,
    passivity: bool,
    damping_limit: f32,
    force_limit_mn: f32,
    slow: Reader<Slow>,
    pose: Writer<Pose>,
    ends: Arc<Ends>,
    /// Time and pose of the last call.
    last: Option<(f64, Pose)>,
    seen: u64,
    age_s: f64,
    since_s: f64,
    /// What the last call gave before the damper, and what of it is blended out; mN, mN mm.
    shown: [Vector; 2],
    offset: [Vector; 2],
    observer: Observer,
    contact: Solver,
}

/// The samples between two steps.
struct Solver {
    modes: Modes,
    /// By sample: force, place, and what forces have moved it since the step `[3n]`.
    forces: Vec<Vector>,
    points: Vec<Vector>,
    moved: Vec<f32>,
    /// Of the samples in a solve.
    rows: Vec<(f32, usize)>,
    contacts: Vec<Contact>,
    solved: Vec<Vector>,
    w: Vec<f32>,
    sweeps: Sweeps,
    stiffness: Stiffness,
    /// Distance to the nearest sample, mm.
    nearest: f32,
}

impl Haptics {
    pub(super) fn new(
        options: &HapticOptions,
        modes: Modes,
        slow: Reader<Slow>,
        pose: Writer<Pose>,
        ends: Arc<Ends>,
    ) -> Result<Haptics> {
        let vectors = |count| memory::filled(count, Vector::ZERO, WHAT);
        Ok(Haptics {
            body: options.tool.body.clone(),
            friction: options.tool.friction,
            blend_s: options.blend_s,
            passivity: options.passivity,
            damping_limit: options.damping_limit_n_s_per_m,
            force_limit_mn: 1e3 * options.force_limit_n,
            slow,
            pose,
            ends,
            last: None,
            seen: 0,
            age_s: 0.0,
            since_s: 0.0,
            shown: [Vector::ZERO; 2],
            offset: [Vector::ZERO; 2],
            observer: Observer::default(),
            contact: Solver {
                modes,
                forces: vectors(MOST_SAMPLES)?,
                points: vectors(MOST_SAMPLES)?,
                moved: memory::zeros(3 * MOST_SAMPLES, WHAT)?,
                rows: memory::room(MOST_SAMPLES, WHAT)?,
                contacts: memory::room(MOST_ROWS, WHAT)?,
                solved: memory::room(MOST_ROWS, WHAT)?,
                w: memory::room(9 * MOST_ROWS * MOST_ROWS, WHAT)?,
                sweeps: Sweeps::with_capacity(MOST_ROWS),
                stiffness: Stiffness::new(),
                nearest: f32::MAX,
            },
        })
    }

    /// The wrench on the tool at a pose.
    ///
    /// # Errors
    /// [`Error::NonFinite`] and [`Error::Argument`] for a pose or a time before the last call's: nothing has changed.
    /// [`Error::State`] once the scene is gone.
    pub fn render(&mut self, at: &HapticPose) -> Result<HapticForce> {
        let _flush = FlushToZero::enter();
        let now = check(at)?;
        let (last_s, from) = self.last.unwrap_or((at.time_s - FIRST_S, now));
        if at.time_s < last_s {
            return Err(Error::Argument(format!(
                "time_s is {}, before the last call's {last_s}",
                at.time_s
            )));
        }
        if self.ends.scene_gone.load(Ordering::Acquire) {
            return Err(Error::State("the scene was destroyed: no force".into()));
        }
        let put = self.body.motion(&from, &now) > PUT_MM;
        let from = if put { now } else { from };
        let passed = at.time_s - last_s;
        let seconds = passed.min(MOST_S);
        self.last = Some((at.time_s, now));
        self.pose.write(now);
        self.observer.observe(&from, &now);

        let arrived = self.slow.update();
        let slow = self.slow.buffer();
        let (mut before, mut time) = (from, seconds);
        if arrived {
            self.contact.begin(slow);
            self.seen = slow.number;
            self.age_s = slow.latency_s;
            self.since_s = 0.0;
            let moved = |pose: &Pose| self.body.motion(pose, &now) <= PUT_MM;
            before = slow.pose.filter(moved).unwrap_or(now);
            time = slow.latency_s.min(MOST_S);
        } else {
            self.age_s += passed;
            self.since_s += seconds;
        }
        if time > 0.0 {
            self.contact.modes.advance(time, &slow.drive);
        }
        self.contact
            .solve(slow, &self.body, self.friction, &before, &now);
        let [mut force, mut torque] = self.contact.wrench(slow.count, now.translation);
        let contacts = self.contact.pushing(slow.count).count() as u32;
        // A force starts from none, and goes on from the one before.
        if arrived {
            self.offset = [self.shown[0] - force, self.shown[1] - torque];
        }
        // The difference from the last step's force fades out in time, and outside of the tissue in space.
        let near = match contacts > 0 {
            true => 1.0,
            false => 1.0 - self.contact.nearest.max(0.0) / FADE_MM,
        };
        let late = match self.blend_s > 0.0 {
            true => 1.0 - (self.since_s / self.blend_s) as f32,
            false => 0.0,
        };
        let part = near.max(0.0) * late.max(0.0);
        if part > 0.0 {
            force += self.offset[0] * part;
            torque += self.offset[1] * part;
        }
        let size = force.length();
        if self.force_limit_mn > 0.0 && size > self.force_limit_mn {
            (force, torque) = (
                force * (self.force_limit_mn / size),
                torque * (self.force_limit_mn / size),
            );
        }
        self.shown = [force, torque];
        let (mut force_n, torque_n_m) = (force * 1e-3, torque * 1e-6);
        let mut damped = false;
        if self.passivity && force_n != Vector::ZERO && seconds > 0.0 {
            let way = (now.translation - from.translation) * 1e-3 / seconds as f32;
            let velocity = at.velocity.map_or(way, |[linear, _]| Vector::from(linear));
            let damping = self.observer.damping(velocity, self.damping_limit);
            force_n -= velocity * damping;
            damped = damping > 0.0;
        }
        self.observer.hold(force_n, torque_n_m);
        let stiffness = match contacts > 0 {
            true => self.contact.stiffness(slow, now.translation),
            false => [0.0; 36],
        };
        Ok(HapticForce {
            force_n: force_n.to_array(),
            torque_n_m: torque_n_m.to_array(),
            stiffness,
            contacts,
            contact: force_n != Vector::ZERO,
            damped,
            age_s: self.age_s,
            excess_energy_j: self.observer.excess(),
            steps: self.seen,
        })
    }
}

impl Drop for Haptics {
    fn drop(&mut self) {
        self.ends.hand_gone.store(true, Ordering::Release);
    }
}

/// A pose in millimetres.
fn check(at: &HapticPose) -> Result<Pose> {
    let velocities = at.velocity.unwrap_or_default();
    if !at.time_s.is_finite() || !velocities.as_flattened().iter().all(|v| v.is_finite()) {
        return Err(Error::NonFinite(
            "the pose's time or velocity is not finite".into(),
        ));
    }
    let position = at.position_m.map(|x| 1e3 * x);
    let now = pose::checked(position, at.rotation).map_err(|error| match error {
        pose::PoseError::NotFinite => Error::NonFinite(error.to_string()),
        pose::PoseError::NotUnit { .. } => Error::Argument(error.to_string()),
    })?;
    if position.iter().any(|x| x.abs() > INPUT_LIMIT) {
        return Err(Error::Argument(format!(
            "position_m is {:?}, beyond {} m; units are m",
            at.position_m,
            1e-3 * INPUT_LIMIT
        )));
    }
    Ok(now)
}

/// What a change of the force on a sample moves at once.
fn displace(moved: &mut [f32], slow: &Slow, at: usize, change: Vector) {
    if change == Vector::ZERO {
        return;
    }
    let all = 3 * slow.count;
    for (axis, change) in change.to_array().into_iter().enumerate() {
        // Symmetric: a row is a column.
        let row = &slow.delassus[(3 * at + axis) * all..][..all];
        for (moved, w) in moved.iter_mut().zip(row) {
            *moved += change * w;
        }
    }
}

impl Solver {
    /// From the state of a step.
    fn begin(&mut self, slow: &Slow) {
        self.modes.begin(&slow.velocity);
        self.forces[..slow.count].copy_from_slice(&slow.forces[..slow.count]);
        self.points[..slow.count].copy_from_slice(&slow.points[..slow.count]);
        self.moved.fill(0.0);
    }

    /// Samples with a force.
    fn pushing(&self, count: usize) -> impl Iterator<Item = usize> {
        (0..count).filter(|at| self.forces[*at] != Vector::ZERO)
    }

    /// Where a sample is: the step's place, the modes, what forces have moved.
    fn place(&self, slow: &Slow, at: usize) -> Vector {
        let m = slow.modes;
        let axis = |k: usize| {
            let row = 3 * at + k;
            self.moved[row] + self.modes.moved(&slow.at_samples[row * m..(row + 1) * m])
        };
        slow.points[at] + Vector::new(axis(0), axis(1), axis(2))
    }

    /// Forces with the tool at `now`, which was at `from` when the samples were where they are.
    fn solve(&mut self, slow: &Slow, body: &Body, friction: f32, from: &Pose, now: &Pose) {
        let skin = SKIN_MM + body.motion(from, now);
        let (low, high) = body.bounds(now, skin.max(FADE_MM));
        self.rows.clear();
        self.nearest = f32::MAX;
        for at in 0..slow.count {
            let pushed = self.forces[at] != Vector::ZERO;
            let point = self.place(slow, at);
            let outside = point.cmplt(low).any() || point.cmpgt(high).any();
            let held = slow.anchors[at].is_some();
            let distance = match outside && !pushed && !held {
                true => f32::MAX,
                false => body.nearest_at(now, point).distance,
            };
            self.nearest = self.nearest.min(distance);
            if pushed || held {
                self.rows.push((f32::MIN, at));
            } else if distance <= skin {
                self.rows.push((distance, at));
            }
        }
        if self.rows.len() > MOST_ROWS {
            self.rows
                .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for &(_, at) in &self.rows[MOST_ROWS..] {
                let force = std::mem::take(&mut self.forces[at]);
                displace(&mut self.moved, slow, at, -force);
            }
            self.rows.truncate(MOST_ROWS);
            self.rows.sort_unstable_by_key(|row| row.1);
        }
        let (n, all) = (self.rows.len(), 3 * slow.count);
        self.contacts.clear();
        self.solved.clear();
        self.w.clear();
        for &(_, at) in &self.rows {
            let force = self.forces[at];
            let error = slow.errors[at];
            let pair = Pair {
                body,
                friction,
                from,
                now,
                anchor: slow.anchors[at],
                put: false,
            };
            let (point, start) = (self.place(slow, at), self.points[at]);
            let mut contact = pair.contact(point, start, slow.outward[at], force);
            match contact.law {
                Law::Bound => contact.slip -= error,
                Law::Touch { .. } if contact.gap < f32::MAX => contact.gap -= error.x,
                Law::Touch { .. } => {}
            }
            self.contacts.push(contact);
            self.solved.push(force);
            for axis in 0..3 {
                let row = &slow.delassus[(3 * at + axis) * all..][..all];
                for &(_, other) in &self.rows {
                    self.w.extend_from_slice(&row[3 * other..3 * other + 3]);
                }
            }
        }
        debug_assert_eq!(self.w.len(), 9 * n * n);
        self.sweeps
            .solve(&self.w, &self.contacts, &mut self.solved, LIMITS);
        for (&(_, at), &force) in self.rows.iter().zip(&self.solved) {
            let change = force - self.forces[at];
            self.forces[at] = force;
            displace(&mut self.moved, slow, at, change);
        }
        for at in 0..slow.count {
            self.points[at] = self.place(slow, at);
        }
        let m = slow.modes;
        self.modes.push.fill(0.0);
        for at in 0..slow.count {
            let change = self.forces[at] - slow.forces[at];
            if change == Vector::ZERO {
                continue;
            }
            for (axis, change) in change.to_array().into_iter().enumerate() {
                let row = 3 * at + axis;
                let own = &slow.at_samples[row * m..(row + 1) * m];
                self.modes.add_push(own, change);
            }
        }
    }

    /// Force and torque on a tool about its position, mN and mN mm.
    fn wrench(&self, count: usize, about: Vector) -> [Vector; 2] {
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        for at in self.pushing(count) {
            force -= self.forces[at];
            torque -= (self.points[at] - about).cross(self.forces[at]);
        }
        [force, torque]
    }

    fn stiffness(&mut self, slow: &Slow, about: Vector) -> [f32; 36] {
        self.stiffness.directions.clear();
        for (&(_, at), contact) in self.rows.iter().zip(&self.contacts) {
            let force = self.forces[at];
            if force == Vector::ZERO {
                continue;
            }
            let along = force.dot(contact.normal);
            let across = (force - contact.normal * along).length();
            let sticks = match contact.law {
                Law::Bound => true,
                Law::Touch { friction } => across < 0.999 * friction * along,
            };
            let frame = ::contact::friction::frame(contact.normal);
            let axes = [frame.x_axis, frame.y_axis, frame.z_axis];
            for along in &axes[..if sticks { 3 } else { 1 }] {
                self.stiffness.add(Direction {
                    sample: at,
                    along: *along,
                    arm: self.points[at] - about,
                });
            }
        }
        let all = 3 * slow.count;
        self.stiffness.of(|i, j| slow.delassus[i * all + j])
    }
}
