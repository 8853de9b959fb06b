//! A scene whose body changes: the core of the cut body takes the place of the one before it, with its state.
//!
//! The cut body is a model like any other ([`crate::model::Model`]): its mesh has the copies of nodes, its tables their parents' rows, its near set
//! the cut. A new core of it is made beside the old one; only when it is whole, with the state moved over, do they change places. Copies take
//! displacement and velocity of the node that they come from, so that nothing moves at the moment of a cut.
//!
//! REQ-060: Nothing moves at the moment of a cut, and a cut that is refused changes nothing.

use std::sync::{Arc, PoisonError, RwLock};

use topology::{Body, Change, Point, TopologyError};

use super::StepInput;
use super::build::build;
use super::core::{Core, SCENE, lock_read, lock_write};
use super::cut_state::CutState;
use super::published::{BodyNumber, CutModel, Frame, Published};
use crate::bundle::Mesh;
use crate::contact::ties::tie_of;
use crate::contact::{Force, Past};
use crate::corrections::{History, Linearisation, Motion};
use crate::error::{Error, Result};
use crate::haptics::publish::tissue::HandTissue;
use crate::memory::{self, HeldBytes};
use crate::model::Model;

/// A cut body has at most as many copies as the mesh has nodes.
const MOST_COPIES: usize = 1;

impl Core {
    /// Published states at rest, without region and points.
    pub(super) fn blank_published(&self) -> Result<Published> {
        let count = self.mesh.node_count();
        let earlier = self.options.cubic_sampling.then(|| Frame::rest(count));
        Ok(Published {
            last: Frame::rest(count)?,
            before: Frame::rest(count)?,
            earlier: earlier.transpose()?,
            region: None,
            stats: self.blank_stats(),
            contact_nodes: memory::room(count, SCENE)?,
            contact_vectors: memory::room(3 * count, SCENE)?,
            tools: Default::default(),
            frame_state: None,
            cut: (self.cut.as_ref()).map(|_| CutModel(Arc::clone(&self.model))),
            body: BodyNumber::default(),
            attached: Arc::default(),
        })
    }

    /// What a scene of a cut body does not do.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub(super) fn check_intact(&self, what: &str) -> Result<()> {
        match &self.cut {
            None => Ok(()),
            Some(_) => Err(refused(what)),
        }
    }

    /// Whether a cut body can make such a step.
    pub(super) fn check_cut(&self, input: &StepInput<'_>) -> Result<()> {
        match input.displacement {
            Some(_) => self.check_intact("a step from a displacement"),
            None => Ok(()),
        }
    }

    /// Changes the body, and the scene with it; or neither.
    pub(super) fn change(
        &mut self,
        published: &RwLock<Published>,
        operation: impl FnOnce(&mut Body, &[Point]) -> std::result::Result<Change, TopologyError>,
    ) -> Result<Change> {
        if self.corrected.is_none() {
            return Err(Error::Unsupported(
                "cut: the elements move a cut body, and this scene makes no corrections; set `corrections`".into(),
            ));
        }
        let mut body = match &self.cut {
            Some(cut) => cut.body.clone(),
            None => self.whole_body()?,
        };
        let positions = self.positions(&lock_read(published).last)?;
        // Beside its lists the topology makes many small parts.
        memory::probe(body.most_bytes(), SCENE)?;
        let change = operation(&mut body, &positions)?;
        if change == Change::default() {
            return Ok(change);
        }
        let first = self.mesh.node_count();
        let source = |node: usize| {
            let mut node = node;
            while node >= first {
                node = change.copied[node - first] as usize;
            }
            node
        };
        let mut next = self.with_body(Some(body))?;
        let mut shown = next.blank_published()?;
        {
            let own = lock_read(published);
            let pairs = [
                (&own.last, &mut shown.last),
                (&own.before, &mut shown.before),
            ];
            for (from, to) in pairs {
                spread(&from.field, &mut to.field, source);
            }
            if let (Some(from), Some(to)) = (&own.earlier, &mut shown.earlier) {
                spread(&from.field, &mut to.field, source);
            }
        }
        next.follow_loads(self, source)?;
        next.take_motion(self, source)?;
        next.take_pushes(&change.pushes)?;
        next.counters = self.counters;
        next.counters.sleeping = false;
        next.counters.quiet = 0;
        next.counters.was_corrected = [true; 2];
        next.logged_flags = self.logged_flags;
        let before = lock_read(published).body;
        shown.body = BodyNumber {
            change: before.change + 1,
            ..before
        };
        let shown = self.hand_over(published, &mut next, shown)?;
        // Nothing has moved: hands go on with what they were told, forces included, until the next step.
        let hands = std::mem::take(&mut next.hands);
        self.replace(published, next, shown);
        self.hands = hands;
        Ok(change)
    }

    /// What the host has asked of this core goes over to the next: its region, the attached points, frames between steps and hands. Where it fails, the hands
    /// stay this core's.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], a panic on another thread of the pool.
    fn hand_over(
        &mut self,
        published: &RwLock<Published>,
        next: &mut Core,
        shown: Published,
    ) -> Result<Published> {
        self.hands.retain(|hand| !hand.is_over());
        let region = self.region_copy(published)?;
        let has_frames = lock_read(published).frame_state.is_some();
        let shown = RwLock::new(shown);
        if region.is_some() || self.points.len() > 0 {
            let body = next.cut.as_ref().map(|cut| &cut.body);
            let points = self.points.following(self.intact_mesh(), body)?;
            next.set_plan(&shown, region, Arc::new(points))?;
        }
        if has_frames {
            next.start_frame_states(&shown)?;
        }
        if let (false, Some(prior)) = (self.hands.is_empty(), &next.model.prior) {
            let (corrections, samples) = (next.model.corrections()?, next.model.samples()?);
            let mut tissues = memory::room(self.hands.len(), SCENE)?;
            for _ in &self.hands {
                let integrator = next.integrator();
                tissues.push(HandTissue::new(prior, corrections, integrator, &samples)?);
            }
            next.hands = std::mem::take(&mut self.hands);
            let hands = next.hands.iter_mut();
            hands.zip(tissues).for_each(|(hand, own)| hand.take(own));
        }
        Ok(shown.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// A core of a body that is not the next of this one's takes its place.
    ///
    /// # Errors
    /// Those of handing over; nothing has then changed.
    pub(super) fn put_back(
        &mut self,
        published: &RwLock<Published>,
        mut next: Core,
        shown: Published,
    ) -> Result<()> {
        let mut shown = self.hand_over(published, &mut next, shown)?;
        let before = lock_read(published).body;
        shown.body = BodyNumber {
            line: before.line + 1,
            change: before.change + 1,
        };
        self.replace(published, next, shown);
        Ok(())
    }

    /// Another core takes this one's place.
    fn replace(&mut self, published: &RwLock<Published>, next: Core, shown: Published) {
        *self = next;
        *lock_write(published) = shown;
        self.publish_state(published);
    }

    /// A core at rest of the intact body, or of a cut one.
    pub(super) fn with_body(&self, body: Option<Body>) -> Result<Core> {
        let intact = self.intact();
        let Some(body) = body else {
            return build(intact, &self.options, None);
        };
        let model = intact.cut(&body)?;
        let envelope = self.envelope.cut(&model.mesh, intact.mesh.node_count())?;
        let mut core = build(&model, &self.options, Some(envelope))?;
        let cut = CutState {
            intact: Arc::clone(intact),
            model_bytes: bytes_of(&model)?,
            body,
        };
        core.cut = Some(memory::boxed(cut, SCENE)?);
        Ok(core)
    }

    /// The intact mesh, as what can be cut.
    pub(super) fn whole_body(&self) -> Result<Body> {
        Ok(self.with_most_copies(Body::new(self.intact().rest_mesh()?)))
    }

    pub(super) fn with_most_copies(&self, body: Body) -> Body {
        let room = MOST_COPIES * body.mesh().node_count();
        body.with_room(room)
    }

    /// Bytes that making the surface of the body takes, at most.
    pub(super) fn most_surface_bytes(&self) -> usize {
        let mesh = 64 * self.mesh.tets.len() + 320 * self.mesh.node_count();
        mesh + self.cut.as_ref().map_or(0, |cut| 8 * cut.body.heap_bytes())
    }

    /// Bytes of what a snapshot says of a cut body, at most, with its longer fields.
    pub(super) fn most_body_bytes(&self) -> usize {
        match self.corrected {
            Some(_) => MOST_COPIES * self.most_bytes() + 4096 * self.mesh.tets.len() / 4,
            None => 0,
        }
    }

    /// The mesh before any cut.
    pub(super) fn intact_mesh(&self) -> &Arc<Mesh> {
        self.cut.as_ref().map_or(&self.mesh, |cut| &cut.intact.mesh)
    }

    /// The model that the scene was made with.
    pub(super) fn intact(&self) -> &Arc<Model> {
        self.cut.as_ref().map_or(&self.model, |cut| &cut.intact)
    }

    /// Where each node is in a state.
    fn positions(&self, frame: &Frame) -> Result<Vec<Point>> {
        let rest = self.mesh.positions.as_chunks::<3>().0;
        let moved = frame.field.as_chunks::<3>().0;
        let place = |(rest, u): (&[f32; 3], &[f32; 3])| -> Point {
            [0, 1, 2].map(|k| f64::from(rest[k]) + f64::from(u[k]))
        };
        memory::collected(rest.len(), rest.iter().zip(moved).map(place), SCENE)
    }

    /// Takes velocities, inertia and the tools' places of the core before it.
    fn take_motion(&mut self, before: &Core, source: impl Fn(usize) -> usize + Copy) -> Result<()> {
        let (Some(own), Some(old)) = (&self.corrected, &before.corrected) else {
            return Ok(());
        };
        let len = 3 * self.mesh.node_count();
        let was = &old.solver.motion;
        let mut motion = Motion {
            velocity: memory::zeros(len, SCENE)?,
            velocity_before: memory::zeros(len, SCENE)?,
            inertia: memory::zeros(len, SCENE)?,
            load: memory::zeros(if was.load.is_empty() { 0 } else { len }, SCENE)?,
            min_det: was.min_det,
            level: was.level,
            truncated_mm: was.truncated_mm,
            error_mm: was.error_mm,
            reaction: Vec::new(),
        };
        spread(&was.velocity, &mut motion.velocity, source);
        spread(&was.velocity_before, &mut motion.velocity_before, source);
        spread(&was.inertia, &mut motion.inertia, source);
        if !was.load.is_empty() {
            spread(&was.load, &mut motion.load, source);
        }
        // Inertia is that of the mass which is at the node now, and the loads with it.
        let (now, then) = (self.model.corrections()?, before.model.corrections()?);
        let (now, then) = (&now.body.mass, &then.body.mass);
        let part = |node: usize| now[node] / then[source(node)].max(f32::MIN_POSITIVE);
        for field in [&mut motion.inertia, &mut motion.load] {
            let rows = field.chunks_exact_mut(3).enumerate();
            rows.for_each(|(node, row)| row.iter_mut().for_each(|x| *x *= part(node)));
        }
        debug_assert_eq!(own.basis_starts.len(), old.basis_starts.len());
        self.put_history(Some(History {
            motion,
            pairs: Vec::new(),
            local: Vec::new(),
            linearisation: Linearisation::default(),
            relaxing: None,
        }))?;
        self.take_stresses(before, source)?;
        let Some(problem) = &before.problem else {
            return Ok(());
        };
        // The same points of the tissue have other rows, with what pushes and holds them.
        let mut past: Past = problem.past.copy()?;
        let held = past.tools.iter().flat_map(|held| held.grasp.anchors());
        let pushed = past.forces.iter().map(|force| force.sample);
        let pushed = pushed.filter(|row| tie_of(*row).is_none());
        let count = held.clone().count() + past.forces.len();
        let all = held.map(|own| own.sample).chain(pushed);
        let mut rows = memory::collected(count, all, SCENE)?;
        rows.sort_unstable();
        rows.dedup();
        let samples = [before.model.samples()?, self.model.samples()?];
        let found = ::contact::followed(&samples[0], &samples[1], &rows);
        let found = memory::tried(found, SCENE)?;
        // A tie's row is its place in the list, whatever becomes of the surface.
        let renamed = |row: u32| match tie_of(row) {
            Some(_) => Some(row),
            None => rows.binary_search(&row).ok().and_then(|at| found[at]),
        };
        past.forces.retain_mut(|force| match renamed(force.sample) {
            Some(row) => {
                force.sample = row;
                true
            }
            None => false,
        });
        past.forces.sort_unstable_by_key(Force::key);
        past.forces.dedup_by_key(|force| force.key());
        for held in &mut past.tools {
            held.grasp.rename(renamed);
        }
        self.put_tools(Some(past))
    }
}

/// What a cut scene says to a call that it does not make.
pub(super) fn refused(what: &str) -> Error {
    Error::Unsupported(format!(
        "{what}: the body of this scene has been cut; reset it, or restore a snapshot from before"
    ))
}

/// Values `[K,3]` of the nodes that each node comes from.
fn spread(from: &[f32], to: &mut [f32], source: impl Fn(usize) -> usize) {
    for (node, to) in to.chunks_exact_mut(3).enumerate() {
        to.copy_from_slice(&from[3 * source(node)..][..3]);
    }
}

/// Bytes of a cut body's model beside what it shares with the intact one's.
fn bytes_of(model: &Model) -> Result<usize> {
    let made = model.corrections()?;
    let prior = (model.prior.as_ref()).map_or(0, |table| table.held_bytes() - table.shared_bytes());
    let space = made.space.held_bytes() - made.space.shared_bytes();
    let corrections = space + made.body.held_bytes() + made.far.held_bytes();
    Ok(model.mesh.held_bytes() + prior + corrections)
}
