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
/// A step's way of a tool that holds tissue, mm and radians: what is lost on a slow machine must not tear it off.
const HELD_MM: f32 = 5.0;
const HELD_RAD: f32 = 0.1;

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
    /// The tool of the last step.
    last: Option<Tool>,
    /// When the tool was put elsewhere last.
    put: f64,
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
            last: None,
            put: f64::NEG_INFINITY,
        }
    }

    /// The tool is here at `now`.
    pub fn moved(&mut self, now: f64, tool: Option<Tool>) {
        if !self.started {
            self.started = true;
            (self.next, self.published) = (now, now);
        }
        if let (Some(&(when, Some(from))), Some(to)) = (self.poses.back(), &tool)
            && is_put(&from, to)
        {
            self.put = when;
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
        let before = std::mem::replace(&mut self.step, self.next);
        self.next += self.dt;
        self.in_flight = true;
        let wanted = self.place(self.step);
        let was_put = before <= self.put && self.put < self.step;
        self.last = match was_put {
            true => wanted,
            false => followed(self.last, wanted),
        };
        self.last
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

/// The tool on its way from one place to another. One that closes or opens there does so when it has come.
pub fn between(from: Option<Tool>, to: Option<Tool>, part: f32) -> Option<Tool> {
    let (Some(start), Some(end)) = (from, to) else {
        return to;
    };
    if start.kind != end.kind || part >= 1.0 || is_put(&start, &end) {
        return to;
    }
    Some(on(start, end, part))
}

fn is_put(from: &Tool, to: &Tool) -> bool {
    (0..3).any(|k| (to.position[k] - from.position[k]).abs() > PUT_MM)
}

/// The tool in the step after another: one that holds tissue goes no farther than the tissue can follow.
fn followed(last: Option<Tool>, wanted: Option<Tool>) -> Option<Tool> {
    let (Some(start), Some(end)) = (last, wanted) else {
        return wanted;
    };
    let ways = (0..3).map(|k| (end.position[k] - start.position[k]).powi(2));
    let way = ways.sum::<f32>().sqrt();
    let dot: f32 = (0..4).map(|k| start.rotation[k] * end.rotation[k]).sum();
    let turn = 2.0 * dot.abs().min(1.0).acos();
    let part = (HELD_MM / way).min(HELD_RAD / turn);
    match start.grasp && end.grasp && part < 1.0 {
        true => Some(on(start, end, part)),
        false => wanted,
    }
}

/// The tool at a part of its way.
fn on(from: Tool, to: Tool, part: f32) -> Tool {
    let mut at = Tool {
        grasp: from.grasp,
        ..to
    };
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
    at
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

    #[test]
    fn a_grasp_closes_where_it_has_come_to_and_holds_when_time_is_lost() {
        let tool = |x, grasp| tool(x).map(|tool| Tool { grasp, ..tool });
        let mut clock = Clock::new(0.02);
        let mut step = |now, at| {
            clock.moved(now, at);
            let tool = clock.begin(now).unwrap();
            clock.finished();
            (tool.position[0], tool.grasp)
        };
        assert_eq!(step(0.0, tool(0.0, false)), (0.0, false));
        assert!(!step(0.03, tool(3.0, true)).1, "on its way");
        assert!(step(0.05, tool(5.0, true)).1);
        // A page that shows a picture a second: the tool is where the tissue can follow.
        let (begun, _) = step(1.0, tool(35.0, true));
        let (next, holds) = step(2.0, tool(35.0, true));
        assert!(holds && (next - begun - 5.0).abs() < 1e-4, "{begun} {next}");
        assert_eq!(step(3.0, tool(135.0, true)), (135.0, true), "put");
        let lifted = step(4.0, tool(145.0, false));
        assert_eq!(lifted, (145.0, false), "it holds nothing");
    }
}
