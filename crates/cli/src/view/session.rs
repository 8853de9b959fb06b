//! One client's tissue: a scene that keeps step with the clock, a tool, a recording.
//!
//! Steps run on the scene's worker; each frame shows the tissue of its own moment (`upt_scene_present`). A bundle that cannot present is
//! shown one step behind (`upt_scene_sample`), and one without a linear response is driven by the nodes that the tool touches.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Result;
use serde_json::json;
use tungstenite::Message;
use upt::ffi;

use super::breath::Breath;
use super::clock::{Clock, between};
use super::instruments::pressing;
use super::protocol::{HEADER, Hello, Kind, SurfaceHeader, Tool, Wish};
use super::surgery::Surgery;
use host::{Model, Scene};

/// A recording ends after so many steps: a quarter of an hour of 20 ms.
const LONGEST_RECORDING: usize = 45_000;

pub struct Session {
    scene: Scene,
    /// Surface nodes, which are the region of the scene.
    nodes: Vec<u32>,
    rest: Vec<[f32; 3]>,
    /// Indices into `nodes`.
    faces: Vec<u32>,
    /// 1 where the model was trained to be touched.
    domain: Vec<u32>,
    dt: f64,
    begun: Instant,
    /// When the last frame was made, s since `begun`.
    framed: f64,
    clock: Clock,
    /// As the page has it, and as the frame shows it.
    tool: Option<Tool>,
    shown: Option<Tool>,
    sequence: u32,
    /// A frame was asked for.
    asked: bool,
    /// The tool at each step.
    recording: Option<Vec<Option<Tool>>>,
    recorded: Vec<Option<Tool>>,
    /// The recorded step that comes next.
    replayed: Option<usize>,
    contacts: u32,
    /// Whether the library solves the tool's contact, and whether it presents.
    solves: bool,
    presents: bool,
    /// Tools of the step in flight.
    count: usize,
    penetration_mm: f32,
    frame_ms: f32,
    /// What changes the body, and what the page must know of it.
    surgery: Surgery,
    breath: Breath,
    news: Vec<(SurfaceHeader, Vec<u8>)>,
    displacement: Vec<[f32; 3]>,
    force: [f32; 3],
    bytes: Vec<u8>,
}

impl Session {
    pub fn new(model: &Model) -> Result<Self> {
        let mut scene = Scene::create(model, ffi::UPT_KERNEL_AUTO)?;
        let nodes = model.indices(ffi::UPT_SET_SURFACE_NODES)?;
        let positions = model.positions()?;
        let place: BTreeMap<u32, u32> = (0..).zip(&nodes).map(|(at, node)| (*node, at)).collect();
        let faces = model.indices(ffi::UPT_SET_SURFACE_FACES)?;
        let mut domain = vec![0; nodes.len()];
        for node in model.indices(ffi::UPT_SET_DOMAIN_NODES)? {
            if let Some(at) = place.get(&node) {
                domain[*at as usize] = 1;
            }
        }
        scene.set_region(&nodes)?;
        let mut displacement = vec![[0.0; 3]; nodes.len()];
        let solves = scene.solves_contact();
        scene.reset()?;
        let presents = solves && scene.present(0.0, &[], &mut displacement).is_ok();
        let dt = model.step_s();
        Ok(Self {
            faces: faces.iter().map(|node| place[node]).collect(),
            rest: nodes.iter().map(|node| positions[*node as usize]).collect(),
            displacement,
            nodes,
            domain,
            scene,
            dt,
            begun: Instant::now(),
            framed: 0.0,
            clock: Clock::new(dt),
            tool: None,
            shown: None,
            sequence: 0,
            asked: false,
            recording: None,
            recorded: Vec::new(),
            replayed: None,
            contacts: 0,
            solves,
            presents,
            count: 0,
            penetration_mm: 0.0,
            frame_ms: 0.0,
            surgery: Surgery::new(model)?,
            breath: Breath::default(),
            news: Vec::new(),
            force: [0.0; 3],
            bytes: Vec::new(),
        })
    }

    pub fn hello(&self, bundle: &str, model: &Model) -> Hello {
        let info = model.info();
        Hello {
            bundle: bundle.to_owned(),
            node_count: info.node_count as usize,
            surface_node_count: self.nodes.len(),
            surface_face_count: self.faces.len() / 3,
            dt: self.dt as f32,
            max_push_mm: info.max_push_mm,
            presents: self.presents,
        }
    }

    /// Rest positions, faces and domain, for the page's second message.
    pub fn geometry(&self) -> Vec<u8> {
        let positions = self.rest.as_flattened().iter().map(|x| x.to_le_bytes());
        let numbers = self.faces.iter().chain(&self.domain);
        let numbers = numbers.map(|x| x.to_le_bytes());
        positions.chain(numbers).flatten().collect()
    }

    pub fn take(&mut self, wish: Wish) -> Result<()> {
        match wish {
            Wish::Tool(tool, sequence) => {
                self.tool = tool;
                self.sequence = sequence;
                self.asked = true;
            }
            Wish::Reset => self.rest_again()?,
            Wish::Record(true) => self.recording = Some(Vec::new()),
            Wish::Record(false) => {
                if let Some(recording) = self.recording.take() {
                    self.recorded = recording;
                }
            }
            Wish::Replay => {
                self.rest_again()?;
                self.recording = None;
                self.replayed = Some(0);
            }
            Wish::Breathe(on) => {
                self.pause();
                self.breath = Breath::default();
                if on && self.presents {
                    let surface = (self.rest.as_slice(), self.faces.as_slice());
                    self.breath =
                        Breath::begin(&mut self.scene, self.framed, surface, &self.domain)?;
                }
            }
            Wish::Tear(limit) => self.surgery.limit = limit,
            Wish::Undo => {
                self.pause();
                self.surgery.undo(&mut self.scene)?;
                self.look()?;
            }
        }
        Ok(())
    }

    /// Whether a frame was asked for since the last one.
    pub fn asked(&self) -> bool {
        self.asked
    }

    fn pause(&mut self) {
        self.scene.settle();
        if self.clock.in_flight() {
            self.clock.finished();
        }
    }

    fn rest_again(&mut self) -> Result<()> {
        self.scene.settle();
        self.breath = Breath::default();
        self.clock = Clock::new(self.dt);
        self.tool = None;
        self.replayed = None;
        self.contacts = 0;
        self.penetration_mm = 0.0;
        self.force = [0.0; 3];
        self.surgery.reset();
        self.scene.reset()?;
        self.look()
    }

    /// Keeps what is new of the surface. No step is in flight.
    fn look(&mut self) -> Result<()> {
        self.news.extend(self.surgery.news(&mut self.scene)?);
        Ok(())
    }

    /// What the page must know before the next frame.
    pub fn told(&mut self) -> Vec<Message> {
        let mut messages = Vec::new();
        for (header, bytes) in self.news.drain(..) {
            let text = json!({ "surface": header }).to_string();
            messages.extend([Message::text(text), Message::binary(bytes)]);
        }
        let refused = self.surgery.refused.take();
        messages.extend(refused.map(|why| Message::text(json!({ "refused": why }).to_string())));
        messages
    }

    /// Takes the step that has finished, writes the frame of this moment, and submits the step that is due.
    pub fn frame(&mut self) -> Result<&[u8]> {
        let asked = Instant::now();
        let now = self.begun.elapsed().as_secs_f64();
        self.framed = now;
        self.finish(0)?;
        self.shown = match self.replayed {
            None => self.tool,
            Some(next) => {
                let at = |step: usize| self.recorded.get(step).copied().flatten();
                between(at(next.saturating_sub(1)), at(next), self.clock.part(now))
            }
        };
        self.clock.moved(now, self.shown);
        let since = self.clock.since(now);
        let framed = self.breath.in_frame(self.shown, now);
        let instruments = (self.breath.with(pressing(framed.as_ref()), now)).instruments;
        if self.surgery.begun {
            self.displacement.resize(self.surgery.vertices(), [0.0; 3]);
            self.scene
                .present_surface(since, &instruments, &mut self.displacement)?;
        } else if self.presents {
            self.scene
                .present(since, &instruments, &mut self.displacement)?;
        } else {
            let alpha = (since / self.dt).min(1.0);
            self.scene.sample(alpha, &mut self.displacement)?;
        }
        self.frame_ms = asked.elapsed().as_secs_f32() * 1e3;
        if self.clock.due(now) {
            self.step(now)?;
        }
        self.asked = false;
        self.encode()
    }

    /// Goes on with the steps that the tool's poses so far allow; waits at most 1 ms for the one in flight. False: there is none to go on
    /// with before the next frame is asked for.
    pub fn go_on(&mut self) -> Result<bool> {
        self.finish(1)?;
        if self.solves && self.clock.due(self.framed) {
            self.step(self.framed)?;
        }
        Ok(self.clock.in_flight())
    }

    /// Takes the step in flight if it finishes within so many milliseconds.
    fn finish(&mut self, within_ms: u32) -> Result<()> {
        if self.clock.in_flight() && self.scene.wait(within_ms)? {
            self.clock.finished();
            self.read()?;
        }
        Ok(())
    }

    fn step(&mut self, now: f64) -> Result<()> {
        let instruments = self.begin(now)?;
        if self.solves {
            let breathing = self.breath.with(instruments, self.clock.moment());
            return self.scene.submit(&self.breath.input(&breathing));
        }
        self.step_nodes(&instruments)?;
        self.clock.finished();
        Ok(())
    }

    /// The instruments of the step that begins.
    fn begin(&mut self, now: f64) -> Result<Vec<ffi::upt_instrument>> {
        let mut tool = self.clock.begin(now);
        if let Some(next) = &mut self.replayed {
            // The very poses of the recording: its steps again, to the bit where all corrections are made.
            tool = self.recorded.get(*next).copied().flatten();
            *next += 1;
            if *next > self.recorded.len() {
                self.replayed = None;
            }
        }
        if let Some(recording) = &mut self.recording
            && recording.len() < LONGEST_RECORDING
        {
            recording.push(tool);
        }
        let tool = self.breath.in_frame(tool, self.clock.moment());
        if self.presents {
            self.surgery.operate(&mut self.scene, tool, self.dt)?;
            self.look()?;
        }
        let instruments = pressing(tool.as_ref());
        self.count = instruments.len();
        Ok(instruments)
    }

    /// What the finished step says about its tool.
    fn read(&mut self) -> Result<()> {
        let place = self.breath.place_of_tool();
        let readings = self.scene.readings(place + self.count)?;
        self.breath.read(&self.scene)?;
        let first = readings.get(place);
        self.force = first.map_or([0.0; 3], |reading| reading.force);
        self.penetration_mm = first.map_or(0.0, |reading| reading.penetration_mm);
        self.contacts = first.map_or(0, |reading| reading.contact_count);
        Ok(())
    }

    /// A step of a bundle without a linear response: the nodes that the tool touches go where it puts them.
    fn step_nodes(&mut self, instruments: &[ffi::upt_instrument]) -> Result<()> {
        let (mut nodes, mut vectors) = (Vec::new(), Vec::new());
        self.scene.contacts(instruments, &mut nodes, &mut vectors)?;
        self.scene.step(&nodes, &vectors, &mut self.displacement)?;
        self.contacts = nodes.len() as u32;
        self.force = [0.0; 3];
        if !nodes.is_empty() {
            for force in self.scene.contact_force(nodes.len())? {
                for (sum, f) in self.force.iter_mut().zip(force) {
                    *sum += f;
                }
            }
        }
        Ok(())
    }

    fn encode(&mut self) -> Result<&[u8]> {
        let stats = self.scene.stats()?;
        let state = u32::from(self.recording.is_some())
            | (u32::from(self.replayed.is_some()) << 1)
            | (u32::from(stats.sleeping) << 2);
        let nowhere = ([0.0; 3], [0.0, 0.0, 0.0, 1.0], 0.0f32);
        let (place, turn, radius) =
            (self.shown).map_or(nowhere, |tool| (tool.position, tool.rotation, tool.radius));
        let force = match self.shown {
            Some(tool) if tool.kind != Kind::Press => self.surgery.force,
            _ => self.force,
        };
        let account = self.surgery.account;
        let [x, y, z, ball] = self.breath.ball(self.framed);
        let header: [[u8; 4]; HEADER] = [
            self.sequence.to_le_bytes(),
            stats.flags.to_le_bytes(),
            self.contacts.to_le_bytes(),
            state.to_le_bytes(),
            (self.scene.timing()?.step_ms as f32).to_le_bytes(),
            stats.indicator.to_le_bytes(),
            force[0].to_le_bytes(),
            force[1].to_le_bytes(),
            force[2].to_le_bytes(),
            stats.max_displacement_mm.to_le_bytes(),
            self.frame_ms.to_le_bytes(),
            (stats.step_count as u32).to_le_bytes(),
            stats.corrections.to_le_bytes(),
            stats.error_mm.to_le_bytes(),
            self.penetration_mm.to_le_bytes(),
            u32::from(self.shown.is_some()).to_le_bytes(),
            place[0].to_le_bytes(),
            place[1].to_le_bytes(),
            place[2].to_le_bytes(),
            turn[0].to_le_bytes(),
            turn[1].to_le_bytes(),
            turn[2].to_le_bytes(),
            turn[3].to_le_bytes(),
            radius.to_le_bytes(),
            (self.shown.map_or(0, |tool| tool.kind as u32)).to_le_bytes(),
            account.area_mm2.to_le_bytes(),
            account.removed_mm3.to_le_bytes(),
            account.copies.to_le_bytes(),
            (self.surgery.undo_count() as u32).to_le_bytes(),
            self.surgery.change_ms.to_le_bytes(),
            self.breath.height(self.framed).to_le_bytes(),
            x.to_le_bytes(),
            y.to_le_bytes(),
            z.to_le_bytes(),
            ball.to_le_bytes(),
            self.breath.torn.to_le_bytes(),
        ];
        self.bytes.clear();
        self.bytes.extend(header.as_flattened());
        for x in self.displacement.as_flattened() {
            self.bytes.extend(x.to_le_bytes());
        }
        Ok(&self.bytes)
    }
}
