//! The samples between two steps: where they are, and the forces of a tool at a pose on them.

use ::contact::{Body, Contact, Law, Limits, Pose, Spring, Sweeps, Vector, Whole};

use super::modes::Modes;
use super::pushed::Pushed;
use super::snapshot::{ContactSnapshot, MOST_SAMPLES};
use super::stiffness::{Direction, Stiffness};
use crate::contact::Pair;
use crate::contact::ties::Placed;
use crate::error::Result;
use crate::memory;

const WHAT: &str = "haptics";
/// Samples in one solve at most; those that push come first: the solve has a millisecond, and its
/// matrix `[192,192]` then has 147 kB.
const MOST_ROWS: usize = 64;
/// Samples this near to the tool are solved for, and farther by its motion, mm.
const SKIN_MM: f32 = 0.5;
/// What a step put elsewhere fades out to nothing this far outside of the tissue, mm.
pub const FADE_MM: f32 = 0.5;
/// A tool that has gone so far sideways since the step is at other tissue, mm: two samples' spacing.
const SLIDES_MM: f32 = 3.4;
/// Of a solve that goes on from the one a millisecond before: few sweeps bring it to balance, and a
/// bounded number of them keeps the time.
const LIMITS: Limits = Limits {
    tolerance_mm: 1e-4,
    least_sweeps: 4,
    most_sweeps: 40,
    most_work: u64::MAX,
};

/// The samples between two steps.
pub struct Solver {
    /// How the natural modes go on between two steps.
    pub modes: Modes,
    /// How long support groups have carried the samples since the step, s.
    carried_s: f64,
    /// Where samples are and what pushes them.
    samples: Pushed,
    /// What they were before a solve, to which one that loses the tool goes back.
    before: Pushed,
    /// Of the last solve; the stiffness reads it.
    problem: Problem,
    /// Room for the stiffness that the tool feels.
    stiffness: Stiffness,
    /// Distance to the nearest sample, mm.
    pub nearest: f32,
    /// All samples that the step pushed have slid off the tool since it. Until the next step they are the tissue's plane beneath it.
    slid: bool,
}

/// The contact problem of one solve.
struct Problem {
    /// Its samples by their distance, their contacts and forces, and `W` among them.
    rows: Vec<(f32, usize)>,
    /// By row: the law there, and gap and slip without the change of forces.
    contacts: Vec<Contact>,
    /// By row: the force on the sample, mN, from which the sweeps start and in which they end.
    solved: Vec<Vector>,
    /// `[3n,3n]`, mm/mN, row-major.
    w: Vec<f32>,
    /// Room of the sweeps.
    sweeps: Sweeps,
}

impl Problem {
    /// Room for [`MOST_ROWS`].
    fn new() -> Result<Problem> {
        let mut sweeps = Sweeps::default();
        memory::tried(sweeps.reserve(MOST_ROWS), WHAT)?;
        Ok(Problem {
            rows: memory::room(MOST_SAMPLES, WHAT)?,
            contacts: memory::room(MOST_ROWS, WHAT)?,
            solved: memory::room(MOST_ROWS, WHAT)?,
            w: memory::room(9 * MOST_ROWS * MOST_ROWS, WHAT)?,
            sweeps,
        })
    }
}

impl Solver {
    /// Of a body with these modes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(modes: Modes) -> Result<Solver> {
        Ok(Solver {
            modes,
            carried_s: 0.0,
            samples: Pushed::new()?,
            before: Pushed::new()?,
            problem: Problem::new()?,
            stiffness: Stiffness::new()?,
            nearest: f32::MAX,
            slid: false,
        })
    }

    /// Starts anew from the state of a step.
    pub fn begin(&mut self, snapshot: &ContactSnapshot) {
        self.modes.begin(&snapshot.modes.velocity);
        self.carried_s = 0.0;
        self.slid = false;
        self.samples.begin(snapshot);
    }

    /// Samples with a force.
    pub fn pushing(&self, count: usize) -> impl Iterator<Item = usize> {
        self.samples.pushing(count)
    }

    /// Lets time pass for the modes and what support groups carry.
    pub fn advance(&mut self, snapshot: &ContactSnapshot, seconds: f64) {
        self.modes.advance(seconds, &snapshot.modes.drive);
        self.carried_s = (self.carried_s + seconds).min(snapshot.samples.followed_s);
    }

    /// Where a sample is: the step's place, what carries it, the modes, what forces have moved.
    fn place(&self, snapshot: &ContactSnapshot, at: usize) -> Vector {
        let m = snapshot.modes.count;
        let axis = |k: usize| {
            let row = 3 * at + k;
            self.samples.moved[row]
                + self
                    .modes
                    .moved(&snapshot.modes.at_samples[row * m..(row + 1) * m])
        };
        let carried = snapshot.samples.carried[at] * self.carried_s as f32;
        snapshot.samples.points[at] + carried + Vector::new(axis(0), axis(1), axis(2))
    }

    /// [`Pushed::follow`].
    pub fn follow(&mut self, snapshot: &ContactSnapshot, seconds: f32) -> f32 {
        self.samples.follow(snapshot.delay_s, seconds)
    }

    /// [`Solver::solve_once`], and again where it loses the tool.
    ///
    /// A hand knows the samples alone, and a thin tool that dents the tissue between three of them may lose them all sideways, while the
    /// tissue between them is still there.
    pub fn solve(
        &mut self,
        snapshot: &ContactSnapshot,
        body: &Body,
        friction: f32,
        way: [&Pose; 2],
        part: f32,
    ) {
        let pushed = !self.slid && self.pushing(snapshot.samples.count).next().is_some();
        if pushed {
            self.before.copy_from(&self.samples);
        }
        self.solve_once(snapshot, body, friction, way, part);
        if pushed && self.pushing(snapshot.samples.count).next().is_none() {
            self.slid = true;
            self.samples.copy_from(&self.before);
            self.solve_once(snapshot, body, friction, way, part);
        }
    }

    /// Where contact with a sample is looked for: where it is, or, once all have slid off, where the tool has it since the step, as high as it is.
    fn touched_at(&self, snapshot: &ContactSnapshot, body: &Body, at: usize, now: &Pose) -> Vector {
        let point = self.place(snapshot, at);
        let pose = match &snapshot.pose {
            Some(pose) if self.slid && snapshot.samples.forces[at] != Vector::ZERO => pose,
            _ => return point,
        };
        let beside = now.transform_point(pose.inverse_transform_point(snapshot.samples.points[at]));
        let normal = body.nearest_at(now, beside).normal;
        let plane = beside + normal * (point - beside).dot(normal);
        match (beside - snapshot.samples.points[at])
            .reject_from(normal)
            .length()
            <= SLIDES_MM
        {
            true => plane,
            false => point,
        }
    }

    /// Forces with the tool at `now`, which was at `from` when the samples were where they are; a change of them moves samples by
    /// `part` of what it will.
    fn solve_once(
        &mut self,
        snapshot: &ContactSnapshot,
        body: &Body,
        friction: f32,
        [from, now]: [&Pose; 2],
        part: f32,
    ) {
        let skin = SKIN_MM + body.motion(from, now);
        let (low, high) = body.bounds(now, skin.max(FADE_MM));
        self.problem.rows.clear();
        self.nearest = f32::MAX;
        for at in 0..snapshot.samples.count {
            let pushed = self.samples.forces[at] != Vector::ZERO;
            let point = self.touched_at(snapshot, body, at, now);
            let outside = point.cmplt(low).any() || point.cmpgt(high).any();
            let tied = snapshot.samples.ties[at].is_some();
            let held = snapshot.samples.anchors[at].is_some() || tied;
            let distance = match tied || outside && !pushed && !held {
                true => f32::MAX,
                false => body.nearest_at(now, point).distance,
            };
            self.nearest = self.nearest.min(distance);
            if pushed || held {
                self.problem.rows.push((f32::MIN, at));
            } else if distance <= skin {
                self.problem.rows.push((distance, at));
            }
        }
        if self.problem.rows.len() > MOST_ROWS {
            self.problem
                .rows
                .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            for row in MOST_ROWS..self.problem.rows.len() {
                let (_, at) = self.problem.rows[row];
                let force = std::mem::take(&mut self.samples.forces[at]);
                self.samples.change(snapshot, at, -force, part);
            }
            self.problem.rows.truncate(MOST_ROWS);
            self.problem.rows.sort_unstable_by_key(|row| row.1);
        }
        let (n, all) = (self.problem.rows.len(), 3 * snapshot.samples.count);
        self.problem.contacts.clear();
        self.problem.solved.clear();
        self.problem.w.clear();
        for &(_, at) in &self.problem.rows {
            let force = self.samples.forces[at];
            let error = snapshot.samples.errors[at];
            let pair = Pair {
                body,
                friction,
                from,
                now,
                anchor: snapshot.samples.anchors[at],
                put: false,
                swept: true,
                way_out: None,
                is_wall: snapshot.samples.facing[at].is_wall,
            };
            let (point, start) = (
                self.touched_at(snapshot, body, at, now),
                self.samples.points[at],
            );
            let mut contact = match &snapshot.samples.ties[at] {
                Some(tie) => pulling(tie, now, point),
                None => pair.contact(point, start, snapshot.samples.facing[at].outward, force),
            };
            match contact.law {
                Law::Bound | Law::Tie(_) => contact.slip -= error,
                Law::Touch { .. } if contact.gap < f32::MAX => contact.gap -= error.x,
                Law::Touch { .. } => {}
            }
            self.problem.contacts.push(contact);
            self.problem.solved.push(force);
            for axis in 0..3 {
                let row = &snapshot.delassus[(3 * at + axis) * all..][..all];
                for &(_, other) in &self.problem.rows {
                    let block = &row[3 * other..3 * other + 3];
                    self.problem.w.extend(block.iter().map(|w| part * w));
                }
            }
        }
        self.problem.sweeps.solve(
            &mut Whole::new(&self.problem.w, n),
            &self.problem.contacts,
            &mut self.problem.solved,
            LIMITS,
        );
        for row in 0..self.problem.rows.len() {
            let ((_, at), force) = (self.problem.rows[row], self.problem.solved[row]);
            let change = force - self.samples.forces[at];
            self.samples.forces[at] = force;
            self.samples.change(snapshot, at, change, part);
        }
        for at in 0..snapshot.samples.count {
            // A tie pulls the tool at its own end.
            self.samples.points[at] = match &snapshot.samples.ties[at] {
                Some(tie) => now.transform_point(tie.place),
                None => self.touched_at(snapshot, body, at, now),
            };
        }
        let m = snapshot.modes.count;
        self.modes.push.fill(0.0);
        for at in 0..snapshot.samples.count {
            let change = self.samples.forces[at] - snapshot.samples.forces[at];
            if change == Vector::ZERO {
                continue;
            }
            for (axis, change) in change.to_array().into_iter().enumerate() {
                let row = 3 * at + axis;
                let own = &snapshot.modes.at_samples[row * m..(row + 1) * m];
                self.modes.add_push(own, change);
            }
        }
    }

    /// Force and torque on a tool about its position, mN and mN mm.
    pub fn wrench(&self, count: usize, about: Vector) -> [Vector; 2] {
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        for at in self.pushing(count) {
            force -= self.samples.forces[at];
            torque -= (self.samples.points[at] - about).cross(self.samples.forces[at]);
        }
        [force, torque]
    }

    /// How the wrench changes with the tool's pose `[6,6]`, see [`super::stiffness`]: sticking
    /// samples push in three directions, sliding ones along the normal alone.
    pub fn stiffness(&mut self, snapshot: &ContactSnapshot, about: Vector) -> [f32; 36] {
        self.stiffness.directions.clear();
        for (&(_, at), contact) in self.problem.rows.iter().zip(&self.problem.contacts) {
            let force = self.samples.forces[at];
            if force == Vector::ZERO {
                continue;
            }
            let along = force.dot(contact.normal);
            let across = (force - contact.normal * along).length();
            let sticks = match contact.law {
                Law::Bound | Law::Tie(_) => true,
                Law::Touch { friction } => across < 0.999 * friction * along,
            };
            let frame = ::contact::friction::frame(contact.normal);
            let axes = [frame.x_axis, frame.y_axis, frame.z_axis];
            for along in &axes[..if sticks { 3 } else { 1 }] {
                self.stiffness.add(Direction {
                    sample: at,
                    along: *along,
                    arm: self.samples.points[at] - about,
                });
            }
        }
        let all = 3 * snapshot.samples.count;
        self.stiffness.of(|i, j| snapshot.delassus[i * all + j])
    }
}

/// A tie whose far end is on the tool, without its damper.
fn pulling(tie: &Placed, now: &Pose, point: Vector) -> Contact {
    let spring = Spring {
        damping: 0.0,
        ..tie.tie.spring
    };
    Contact {
        law: Law::Tie(spring.over(0.0, 1.0)),
        normal: Vector::X,
        gap: 0.0,
        slip: point - now.transform_point(tie.place),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force that begins moves a sample over a delay to where it holds it, and the spring and damper between take energy, never give.
    #[test]
    fn a_sample_follows_a_force_with_a_delay() {
        let mut solver = Solver::new(Modes::new(&[], 0.0).unwrap()).unwrap();
        let mut snapshot = ContactSnapshot::new(0).unwrap();
        snapshot.samples.count = 1;
        snapshot.delay_s = 4e-3;
        for axis in 0..3 {
            snapshot.delassus[4 * axis] = 0.02;
        }
        solver.begin(&snapshot);
        let mut force = Vector::new(50.0, 0.0, 0.0);
        let part = solver.follow(&snapshot, 1e-3);
        solver.samples.change(&snapshot, 0, force, part);
        let mut places = vec![solver.samples.moved[0]];
        let mut work = force.x * places[0];
        for tick in 1..200 {
            let part = solver.follow(&snapshot, 1e-3);
            let wanted = if tick < 100 { 50.0 } else { 0.0 };
            solver
                .samples
                .change(&snapshot, 0, Vector::new(wanted, 0.0, 0.0) - force, part);
            force.x = wanted;
            work += force.x * (solver.samples.moved[0] - places[tick - 1]);
            places.push(solver.samples.moved[0]);
        }
        // One part in five of what is left in each millisecond, to 50 mN on 0.02 mm/mN.
        assert!((places[0] - 0.2).abs() < 1e-5, "{}", places[0]);
        assert!((places[1] - 0.36).abs() < 1e-5, "{}", places[1]);
        assert!((places[99] - 1.0).abs() < 1e-4, "{}", places[99]);
        assert!(places[199].abs() < 1e-4, "{}", places[199]);
        assert!(work > 0.0, "{work} µJ");
        // Without a delay it is there at once.
        snapshot.delay_s = 0.0;
        assert_eq!(solver.follow(&snapshot, 1e-3), 1.0);
        assert_eq!(solver.follow(&snapshot, 0.0), 1.0);
    }
}
