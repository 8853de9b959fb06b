//! One client's tissue: a scene that keeps step with the clock, a tool, a recording.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Result;
use upt::ffi;

use super::protocol::{HEADER, Hello, Tool, Wish};
use crate::host::{Model, Scene};

/// Steps that may be made up for at once when the clock has run ahead; the rest is dropped.
const MOST_STEPS: u32 = 2;
/// Coulomb's coefficient of a tool that sticks, and of one that slips, such as wet steel.
const STICKS: f32 = 1.0;
const SLIPS: f32 = 0.1;
/// A recording ends after so many steps: a quarter of an hour at 20 Hz.
const LONGEST_RECORDING: usize = 18_000;

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
    tool: Option<Tool>,
    sequence: u32,
    /// When the pose came that no step has taken yet.
    came: Option<Instant>,
    waited_ms: f32,
    /// When the last step was due.
    due: Instant,
    recording: Option<Vec<Option<Tool>>>,
    recorded: Vec<Option<Tool>>,
    replayed: Option<usize>,
    contacts: u32,
    /// Whether the library solves the tool's contact.
    solves: bool,
    penetration_mm: f32,
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
        let solves = scene.step_instruments(&[], &mut displacement).is_ok();
        scene.reset()?;
        Ok(Self {
            faces: faces.iter().map(|node| place[node]).collect(),
            rest: nodes.iter().map(|node| positions[*node as usize]).collect(),
            displacement,
            nodes,
            domain,
            scene,
            dt: f64::from(model.info().dt),
            tool: None,
            sequence: 0,
            came: None,
            waited_ms: 0.0,
            due: Instant::now(),
            recording: None,
            recorded: Vec::new(),
            replayed: None,
            contacts: 0,
            solves,
            penetration_mm: 0.0,
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
            dt: info.dt,
            max_push_mm: info.max_push_mm,
            flags: vec![
                (ffi::UPT_FLAG_PUSH, "push longer than trained"),
                (ffi::UPT_FLAG_CONTACT_AREA, "contact area not trained"),
                (ffi::UPT_FLAG_SITE, "contact outside the domain"),
                (ffi::UPT_FLAG_RATE, "faster than trained"),
                (ffi::UPT_FLAG_SITES, "several contacts"),
                (ffi::UPT_FLAG_BOUND, "guard: bound"),
                (ffi::UPT_FLAG_NON_FINITE, "guard: not finite"),
                (ffi::UPT_FLAG_INVERTED, "guard: inverted"),
                (ffi::UPT_FLAG_GROWTH, "guard: growth"),
                (ffi::UPT_FLAG_CLAMPED, "correction bounded"),
                (ffi::UPT_FLAG_REGULARISED, "contact regularised"),
                (ffi::UPT_FLAG_FELL_BACK, "fell back on linear elasticity"),
                (ffi::UPT_FLAG_DEEP, "tool deep in the tissue"),
            ],
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
                self.came.get_or_insert_with(Instant::now);
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
        }
        Ok(())
    }

    fn rest_again(&mut self) -> Result<()> {
        self.tool = None;
        self.replayed = None;
        self.force = [0.0; 3];
        self.scene.reset()
    }

    /// Steps as often as the clock asks, and writes the frame of this moment.
    pub fn frame(&mut self) -> Result<&[u8]> {
        let mut steps = 0;
        while self.due.elapsed().as_secs_f64() >= self.dt {
            if steps == MOST_STEPS {
                self.due = Instant::now();
                break;
            }
            self.due += std::time::Duration::from_secs_f64(self.dt);
            self.step()?;
            steps += 1;
        }
        let alpha = (self.due.elapsed().as_secs_f64() / self.dt).clamp(0.0, 1.0);
        self.scene.sample(alpha, &mut self.displacement)?;
        self.encode()
    }

    fn step(&mut self) -> Result<()> {
        if let Some(at) = &mut self.replayed {
            self.tool = self.recorded.get(*at).copied().flatten();
            *at += 1;
            if *at > self.recorded.len() {
                self.replayed = None;
            }
        }
        if let Some(recording) = &mut self.recording
            && recording.len() < LONGEST_RECORDING
        {
            recording.push(self.tool);
        }
        if let Some(came) = self.came.take() {
            self.waited_ms = came.elapsed().as_secs_f32() * 1e3;
        }
        let instruments: Vec<ffi::upt_instrument> = self.tool.iter().map(instrument).collect();
        if !self.solves {
            return self.step_nodes(&instruments);
        }
        self.scene
            .step_instruments(&instruments, &mut self.displacement)?;
        let readings = self.scene.readings(instruments.len())?;
        let first = readings.first();
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
        let header: [[u8; 4]; HEADER] = [
            self.sequence.to_le_bytes(),
            stats.flags.to_le_bytes(),
            self.contacts.to_le_bytes(),
            state.to_le_bytes(),
            (stats.step_ms as f32).to_le_bytes(),
            stats.indicator.to_le_bytes(),
            self.force[0].to_le_bytes(),
            self.force[1].to_le_bytes(),
            self.force[2].to_le_bytes(),
            stats.max_displacement_mm.to_le_bytes(),
            self.waited_ms.to_le_bytes(),
            (stats.step_count as u32).to_le_bytes(),
            stats.corrections.to_le_bytes(),
            stats.error_mm.to_le_bytes(),
            self.penetration_mm.to_le_bytes(),
        ];
        self.bytes.clear();
        self.bytes.extend(header.as_flattened());
        for x in self.displacement.as_flattened() {
            self.bytes.extend(x.to_le_bytes());
        }
        Ok(&self.bytes)
    }
}

fn instrument(tool: &Tool) -> ffi::upt_instrument {
    ffi::upt_instrument {
        struct_size: size_of::<ffi::upt_instrument>() as u32,
        shape: ffi::UPT_SHAPE_CAPSULE,
        position: tool.position,
        rotation: tool.rotation,
        half_extents: [0.0, tool.half_length, 0.0],
        radius: tool.radius,
        sticking: u8::from(tool.sticking),
        mode: ffi::UPT_MODE_SLIDE,
        reserved: [0; 2],
        friction: if tool.sticking { STICKS } else { SLIPS },
        tear_off_mn: 0.0,
        hull: std::ptr::null(),
    }
}
