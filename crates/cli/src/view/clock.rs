//! When to step: the host's part between frames (docs/guide/frames.md), for one tool.
//!
//! The tool's poses of the last frames are kept with their times. A step is submitted with the pose of its own moment, which lies between
//! two frames; the next one is due a step later, or now where more than 0.1 s or two steps were lost.

use std::collections::VecDeque;

use upt::contact::PUT_MM;

use super::protocol::Tool;

/// Frames that are kept.
const MOST_POSES: usize = 256;
/// What was lost for longer is not made up for, s.
const LOST_S: f64 = 0.1;

/// Times in seconds, from any beginning.
pub struct Clock {
    dt: f64,
    /// Moment of the next step, of the one in flight, of the published one.
    next: f64,
    step: f64,
    published: f64,
    started: bool,
    in_flight: bool,
    poses: VecDeque<(f64, Option<Tool>)>,
}

impl Clock {
    pub fn new(dt: f64) -> Self {
        Self {
            dt,
            next: 0.0,
            step: 0.0,
            published: 0.0,
            started: false,
            in_flight: false,
            poses: VecDeque::new(),
        }
    }

    /// The tool is here at `now`.
    pub fn moved(&mut self, now: f64, tool: Option<Tool>) {
        if !self.started {
            self.started = true;
            (self.next, self.published) = (now, now);
        }
        if self.poses.len() == MOST_POSES {
            self.poses.pop_front();
        }
        self.poses.push_back((now, tool));
    }

    /// Whether a step is due.
    pub fn due(&self, now: f64) -> bool {
        self.started && !self.in_flight && now + 1e-9 >= self.next
    }

    /// A step begins: the tool at its moment.
    pub fn begin(&mut self, now: f64) -> Option<Tool> {
        if now - self.next > (2.0 * self.dt).max(LOST_S) {
            self.next = now;
        }
        self.step = self.next;
        self.next += self.dt;
        self.in_flight = true;
        self.place(self.step)
    }

    /// The moment of the step that has begun.
    pub fn moment(&self) -> f64 {
        self.step
    }

    /// The step's state is published.
    pub fn finished(&mut self) {
        self.in_flight = false;
        self.published = self.step;
    }

    pub fn in_flight(&self) -> bool {
        self.in_flight
    }

    /// Since the moment of the published step.
    pub fn since(&self, now: f64) -> f64 {
        (now - self.published).max(0.0)
    }

    /// How much of a step has passed since the last one began, 0 to 1.
    pub fn part(&self, now: f64) -> f32 {
        ((now - self.step) / self.dt).clamp(0.0, 1.0) as f32
    }

    fn place(&mut self, time: f64) -> Option<Tool> {
        while self.poses.len() > 2 && self.poses[1].0 <= time {
            self.poses.pop_front();
        }
        let (from_s, from) = *self.poses.front()?;
        let (to_s, to) = match self.poses.get(1) {
            Some(next) if time > from_s => *next,
            _ => return from,
        };
        let part = ((time - from_s) / (to_s - from_s).max(1e-9)).min(1.0);
        between(from, to, part as f32)
    }
}

/// The tool on its way from one place to another.
pub fn between(from: Option<Tool>, to: Option<Tool>, part: f32) -> Option<Tool> {
    let (Some(from), Some(mut at)) = (from, to) else {
        return to;
    };
    if from.kind != at.kind {
        return to;
    }
    let far = |k: usize| (at.position[k] - from.position[k]).abs() > PUT_MM;
    if part >= 1.0 || (0..3).any(far) {
        return to;
    }
    let dot: f32 = (0..4).map(|k| from.rotation[k] * at.rotation[k]).sum();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    for (end, start) in at.rotation.iter_mut().zip(from.rotation) {
        let start = sign * start;
        *end = start + part * (*end - start);
    }
    let length = at.rotation.iter().map(|x| x * x).sum::<f32>().sqrt();
    at.rotation = at.rotation.map(|x| x / length);
    for (end, start) in at.position.iter_mut().zip(from.position) {
        *end = start + part * (*end - start);
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::super::protocol::Kind;
    use super::*;

    fn tool(x: f32) -> Option<Tool> {
        Some(Tool {
            position: [x, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
            radius: 5.0,
            half_length: 20.0,
            friction: 0.3,
            grasp: false,
            kind: Kind::Press,
        })
    }

    #[test]
    fn a_step_has_the_pose_of_its_own_moment() {
        let mut clock = Clock::new(0.05);
        clock.moved(1.0, tool(0.0));
        assert!(clock.due(1.0));
        assert_eq!(clock.begin(1.0), tool(0.0));
        assert!(!clock.due(1.2), "one is in flight");
        clock.finished();
        // Frames at 40 and 60 ms: the step's moment, 50 ms, lies between.
        clock.moved(1.04, tool(4.0));
        assert!(!clock.due(1.04));
        clock.moved(1.06, tool(6.0));
        assert!(clock.due(1.06));
        let x = clock.begin(1.06).unwrap().position[0];
        assert!((x - 5.0).abs() < 1e-4, "{x}");
        assert!((clock.since(1.06) - 0.06).abs() < 1e-9, "the first step");
        clock.finished();
        assert!((clock.since(1.06) - 0.01).abs() < 1e-9);
    }

    #[test]
    fn frames_slower_than_steps_lose_no_step() {
        let mut clock = Clock::new(0.02);
        let mut steps = 0;
        for frame in 0..60 {
            let now = f64::from(frame) / 30.0;
            clock.moved(now, tool(now as f32));
            while clock.due(now) {
                let x = clock.begin(now).unwrap().position[0];
                assert!((x - 0.02 * steps as f32).abs() < 1e-4, "{steps}: {x}");
                steps += 1;
                clock.finished();
            }
            assert!(clock.since(now) < 0.02);
        }
        assert_eq!(steps, 99, "59 / 30 s and the first");
    }

    #[test]
    fn lost_time_is_not_made_up_for() {
        let mut clock = Clock::new(0.05);
        clock.moved(0.0, None);
        clock.begin(0.0);
        clock.finished();
        clock.moved(5.0, tool(1.0));
        clock.begin(5.0);
        clock.finished();
        assert!(!clock.due(5.04));
        assert!(clock.due(5.05));
    }

    #[test]
    fn a_tool_that_is_put_somewhere_does_not_pass_between() {
        assert_eq!(between(tool(0.0), tool(100.0), 0.5), tool(100.0));
        assert_eq!(between(None, tool(3.0), 0.5), tool(3.0));
        assert_eq!(between(tool(3.0), None, 0.5), None);
        let mut turned = tool(0.0).unwrap();
        turned.rotation = [0.0, 0.0, 0.0, -1.0]; // the same rotation
        let half = between(tool(0.0), Some(turned), 0.5).unwrap();
        assert!((half.rotation[3].abs() - 1.0).abs() < 1e-6);
    }
}
