//! One gesture: the scene steps at 20 Hz, the hand feels at 1 kHz, on a clock of its own.

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use contact::Vector;
use upt::contact::Tool;
use upt::haptics::{HapticOptions, HapticPose, Haptics};
use upt::{Contact, Model, Scene, SceneOptions};

use super::device::{Device, Random};
use super::gesture::{Gesture, Site};

/// What happened at one tick.
pub struct Tick {
    pub time_s: f64,
    /// By tool: position mm, force N, and what the last step told, N.
    pub tools: Vec<(Vector, Vector, Vector)>,
}

/// A gesture that was played.
#[derive(Default)]
pub struct Track {
    pub ticks: Vec<Tick>,
    /// Wall time of each call, µs.
    pub calls_us: Vec<f64>,
    /// Energy that tissue gave to the hands, over the touches in which it gave any to all of them together, J.
    pub given_j: f64,
    pub damped: usize,
    pub touching: usize,
    pub not_finite: usize,
    /// There is a force after the tools have gone.
    pub stuck: bool,
}

/// A scene and its hands.
pub struct Player {
    model: Arc<Model>,
    options: SceneOptions,
    latency_s: f64,
    tools: Vec<Tool>,
}

impl Player {
    pub fn new(
        model: &Arc<Model>,
        options: &SceneOptions,
        latency_ms: f64,
        site: &Site,
    ) -> Result<Player> {
        let tools = site.tools.iter().enumerate().map(|(index, tool)| {
            let at = site.pose(index, Vector::ZERO);
            let body = contact::Body::new(&tool.shape)?;
            let mut made = Tool::of_body(body, [0.0; 3], at.rotation.to_array())?;
            (made.friction, made.tear_off_mn) = (tool.friction, tool.tear_off_mn);
            anyhow::Ok(made)
        });
        Ok(Player {
            model: Arc::clone(model),
            options: options.clone(),
            latency_s: 1e-3 * latency_ms,
            tools: tools.collect::<Result<_>>()?,
        })
    }

    /// Plays a gesture from rest.
    pub fn play(
        &mut self,
        gesture: &Gesture,
        site: &Site,
        passivity: bool,
        seed: u64,
    ) -> Result<Track> {
        let scene = Scene::new(Arc::clone(&self.model), &self.options)?;
        let (count, step_s) = (self.tools.len(), scene.step_s());
        let mut devices: Vec<Device> = (0..count)
            .map(|tool| Device::new(site.wanted(gesture, tool, 0.0), gesture.stiffness))
            .collect();
        let mut hands = Vec::new();
        for (index, tool) in self.tools.iter_mut().enumerate() {
            tool.pose.translation = devices[index].position;
            let options = HapticOptions {
                latency_s: Some(self.latency_s),
                passivity,
                ..HapticOptions::new(index as u32, tool.clone())
            };
            hands.push(scene.haptics(&options).context("haptics")?);
        }
        let mut random = Random::new(seed);
        let mut track = Track::default();
        let mut forces = vec![Vector::ZERO; count];
        // Energy since tissue was last touched, to all hands: what one of them puts in may come out at another.
        let mut given = 0.0f64;
        let mut told = vec![Vector::ZERO; count];
        let (mut time, mut due) = (0.0, 0.0);
        let mut waiting: Option<f64> = None;
        while time < gesture.seconds {
            if time >= due {
                for (tool, device) in self.tools.iter_mut().zip(&devices) {
                    tool.pose.translation = device.read();
                }
                waiting = Some(due + self.latency_s);
                due += step_s;
            }
            if waiting.is_some_and(|at| time >= at) {
                waiting = None;
                scene.step(Contact::Tools(&self.tools), None)?;
                scene.with_contact_report(|all| {
                    for (told, reading) in told.iter_mut().zip(&all.readings) {
                        *told = Vector::from(reading.force) * 1e-3;
                    }
                });
            }
            let mut tick = Tick {
                time_s: time,
                tools: Vec::with_capacity(count),
            };
            for (index, hand) in hands.iter_mut().enumerate() {
                let position = devices[index].read();
                let force = self.call(hand, index, time, position, &mut track)?;
                forces[index] = force;
                tick.tools.push((position, force, told[index]));
            }
            if forces.iter().all(|force| *force == Vector::ZERO) {
                track.given_j += std::mem::take(&mut given).max(0.0);
            }
            track.ticks.push(tick);
            let passed = random.tick();
            for (index, device) in devices.iter_mut().enumerate() {
                let wanted = |part: f64| site.wanted(gesture, index, time + part * passed);
                given += device.advance(passed, forces[index], wanted);
            }
            time += passed;
        }
        track.stuck = forces.iter().any(|force| *force != Vector::ZERO);
        track.given_j += given.max(0.0);
        Ok(track)
    }

    fn call(
        &self,
        hand: &mut Haptics,
        index: usize,
        time_s: f64,
        position: Vector,
        track: &mut Track,
    ) -> Result<Vector> {
        let pose = HapticPose {
            time_s,
            position_m: (position * 1e-3).to_array(),
            rotation: self.tools[index].pose.rotation.to_array(),
            velocity: None,
        };
        let start = Instant::now();
        let felt = hand.render(&pose)?;
        track.calls_us.push(1e6 * start.elapsed().as_secs_f64());
        let force = Vector::from(felt.force_n);
        let numbers = felt.force_n.iter().chain(&felt.torque_n_m);
        track.not_finite += usize::from(!numbers.chain(&felt.stiffness).all(|x| x.is_finite()));
        track.touching += usize::from(felt.contact);
        track.damped += usize::from(felt.damped);
        Ok(force)
    }
}
