//! The hand's end: contact at the pose of a millisecond, on the contact problem of the last step.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use ::contact::{Body, Pose, Vector, pose};
use exchange::{Reader, Writer};

use super::ends::Ends;
use super::modes::Modes;
use super::passivity::Observer;
use super::snapshot::ContactSnapshot;
use super::solver::{FADE_MM, Solver};
use super::{HapticForce, HapticOptions, HapticPose};
use crate::contact::PUT_MM;
use crate::error::{Error, Result};
use crate::field::INPUT_LIMIT;
use crate::kernels::FlushToZero;

/// Time between calls that is taken at most, s: a longer pause counts as this.
const MOST_S: f64 = 0.1;
/// The time of the first call, s: a hand's usual period.
const FIRST_S: f64 = 0.001;
/// Time between calls over which samples follow forces at least, s: in none they would be rigid.
const LEAST_S: f64 = 1e-4;

/// A step arrives with an age, over which contact is solved in parts of this time, s, and in so many at most.
const PART_S: f64 = 0.002;
const MOST_PARTS: u32 = 8;

/// A tool that a hand feels. Used from one thread, which waits for nothing: no lock, no allocation.
pub struct Haptics {
    /// Its shape and friction as the host gave them; the pose comes with each call.
    tool: Felt,
    /// Largest force, mN; 0 for none. The torque is scaled with it.
    force_limit_mn: f32,
    /// The contact near the tool in the last published step, and the way back: where the hand is now.
    snapshot: Reader<ContactSnapshot>,
    pose: Writer<Pose>,
    /// Which of the two ends is gone.
    ends: Arc<Ends>,
    /// Time and pose of the last call.
    last: Option<(f64, Pose)>,
    /// What the last call has read of the scene.
    seen: Seen,
    blend: Blend,
    damper: Damper,
    /// The tissue between two steps.
    contact: Solver,
}

/// What of the tool touches.
struct Felt {
    body: Body,
    friction: f32,
}

/// The last snapshot.
#[derive(Default)]
struct Seen {
    number: u64,
    /// How old its state is by now, s.
    age_s: f64,
}

/// How the force of a new step takes the place of the one before.
struct Blend {
    /// It is blended in over this time, s; 0 for at once.
    over_s: f64,
    /// How long ago the last snapshot was seen, s.
    since_s: f64,
    /// What the last call gave before the damper, and what of it is blended out; mN, mN mm.
    shown: [Vector; 2],
    offset: [Vector; 2],
}

/// Gives back what the rendered spring makes of its own.
struct Damper {
    is_on: bool,
    /// Up to this damping, N s/m.
    limit: f32,
    observer: Observer,
}

impl Haptics {
    pub(super) fn new(
        options: &HapticOptions,
        modes: Modes,
        snapshot: Reader<ContactSnapshot>,
        pose: Writer<Pose>,
        ends: Arc<Ends>,
    ) -> Result<Haptics> {
        Ok(Haptics {
            tool: Felt {
                body: options.tool.body.clone(),
                friction: options.tool.friction,
            },
            force_limit_mn: 1e3 * options.force_limit_n,
            snapshot,
            pose,
            ends,
            last: None,
            seen: Seen::default(),
            blend: Blend {
                over_s: options.blend_s,
                since_s: 0.0,
                shown: [Vector::ZERO; 2],
                offset: [Vector::ZERO; 2],
            },
            damper: Damper {
                is_on: options.passivity,
                limit: options.damping_limit_n_s_per_m,
                observer: Observer::default(),
            },
            contact: Solver::new(modes)?,
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
                "time_s is {}, earlier than {last_s} of the last call; time must not go back",
                at.time_s
            )));
        }
        if self.ends.scene_gone.load(Ordering::Acquire) {
            return Err(Error::State(
                "the scene was destroyed, so there is no force; destroy this object too".into(),
            ));
        }
        // A leap is no motion: nothing between the two places was touched.
        let put = self.tool.body.motion(&from, &now) > PUT_MM;
        let from = if put { now } else { from };
        let passed = at.time_s - last_s;
        let seconds = passed.min(MOST_S);
        self.last = Some((at.time_s, now));
        // The scene publishes what lies about this pose at its next step.
        self.pose.write(now);
        self.damper.observer.observe(&from, &now);

        // A new step: its forces belong to the pose at that step, from which the tool has gone on for the snapshot's age.
        let arrived = self.snapshot.update();
        let snapshot = self.snapshot.buffer();
        let (mut before, mut time) = (from, seconds);
        if arrived {
            self.contact.begin(snapshot);
            self.seen.number = snapshot.number;
            self.seen.age_s = snapshot.latency_s;
            self.blend.since_s = 0.0;
            let moved = |pose: &Pose| self.tool.body.motion(pose, &now) <= PUT_MM;
            before = snapshot.pose.filter(moved).unwrap_or(now);
            time = snapshot.latency_s.min(MOST_S);
        } else {
            self.seen.age_s += passed;
            self.blend.since_s += seconds;
        }
        self.follow(arrived, [&before, &now], time);
        let snapshot = self.snapshot.buffer();
        let [mut force, mut torque] = self.contact.wrench(snapshot.samples.count, now.translation);
        let contacts = self.contact.pushing(snapshot.samples.count).count() as u32;
        // A force starts from none, and goes on from the one before.
        if arrived {
            self.blend.offset = [self.blend.shown[0] - force, self.blend.shown[1] - torque];
        }
        // The difference from the last step's force fades out in time, and outside of the tissue in space.
        let near = match contacts > 0 {
            true => 1.0,
            false => 1.0 - self.contact.nearest.max(0.0) / FADE_MM,
        };
        let late = match self.blend.over_s > 0.0 {
            true => 1.0 - (self.blend.since_s / self.blend.over_s) as f32,
            false => 0.0,
        };
        let part = near.max(0.0) * late.max(0.0);
        if part > 0.0 {
            force += self.blend.offset[0] * part;
            torque += self.blend.offset[1] * part;
        }
        let size = force.length();
        if self.force_limit_mn > 0.0 && size > self.force_limit_mn {
            (force, torque) = (
                force * (self.force_limit_mn / size),
                torque * (self.force_limit_mn / size),
            );
        }
        self.blend.shown = [force, torque];
        let (mut force_n, torque_n_m) = (force * 1e-3, torque * 1e-6);
        let mut damped = false;
        if self.damper.is_on && force_n != Vector::ZERO && seconds > 0.0 {
            let way = (now.translation - from.translation) * 1e-3 / seconds as f32;
            let velocity = at.velocity.map_or(way, |[linear, _]| Vector::from(linear));
            let damping = self.damper.observer.damping(velocity, self.damper.limit);
            force_n -= velocity * damping;
            damped = damping > 0.0;
        }
        self.damper.observer.hold(force_n, torque_n_m);
        let stiffness = match contacts > 0 {
            true => self.contact.stiffness(snapshot, now.translation),
            false => [0.0; 36],
        };
        Ok(HapticForce {
            force_n: force_n.to_array(),
            torque_n_m: torque_n_m.to_array(),
            stiffness,
            contacts,
            contact: force_n != Vector::ZERO,
            damped,
            age_s: self.seen.age_s,
            excess_energy_j: self.damper.observer.excess(),
            steps: self.seen.number,
        })
    }
}

impl Haptics {
    /// Lets the tissue follow the tool on its way, in `time` s. What a step's age brings at once goes in parts: a tip that tissue lies about
    /// would slip out of it where contact is linearised over the whole of it.
    fn follow(&mut self, arrived: bool, [before, now]: [&Pose; 2], time: f64) {
        let snapshot = self.snapshot.buffer();
        let (parts, least) = match arrived {
            true => (
                ((time / PART_S).ceil() as u32).clamp(1, MOST_PARTS),
                FIRST_S,
            ),
            false => (1, LEAST_S),
        };
        let seconds = time / f64::from(parts);
        let mut from = *before;
        for part in 1..=parts {
            let to = match part == parts {
                true => *now,
                false => pose::between(before, now, part as f32 / parts as f32),
            };
            if seconds > 0.0 {
                self.contact.advance(snapshot, seconds);
            }
            let share = self.contact.follow(snapshot, seconds.max(least) as f32);
            let way = [&from, &to];
            (self.contact).solve(snapshot, &self.tool.body, self.tool.friction, way, share);
            from = to;
        }
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
