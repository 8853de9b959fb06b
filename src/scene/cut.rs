//! A scene whose body changes: the core of the cut body takes the place of the one before it, with its state.
//!
//! The cut body is a model like any other ([`crate::model::Model`]): its mesh has the copies of nodes, its tables their parents' rows, its near set
//! the cut. A new core of it is made beside the old one; only when it is whole, with the state moved over, do they change places. Copies take
//! displacement and velocity of the node that they come from, so that nothing moves at the moment of a cut.
//!
//! REQ-060: Nothing moves at the moment of a cut, and a cut that is refused changes nothing.

use std::sync::{Arc, PoisonError, RwLock};

use topology::{Body, Change, Point, TopologyError};

use super::build::build;
use super::core::Core;
use super::counters::Counters;
use super::cut_motion::spread;
use super::cut_state::CutState;
use super::maker::StepMaker;
use super::published::{BodyNumber, CutModel, Frame, Published, ShownBody, ShownContact};
use super::published::{SCENE, lock_read, lock_write};
use crate::contact::ContactReport;
use crate::error::{Error, Result};
use crate::haptics::publish::tissue::HandTissue;
use crate::memory::{self, HeldBytes};
use crate::model::Model;
use crate::stats::SceneStats;

impl Published {
    /// What a core shows at rest, without region and points.
    pub(super) fn rest(core: &Core) -> Result<Published> {
        let body = &core.maker.body;
        let count = body.mesh.node_count();
        // Cubic sampling between frames needs one frame more than linear.
        let is_cubic = core.maker.options.cubic_sampling;
        Ok(Published {
            last: Frame::rest(count)?,
            before: Frame::rest(count)?,
            earlier: is_cubic.then(|| Frame::rest(count)).transpose()?,
            region: None,
            stats: core.blank_stats(),
            contact: ShownContact {
                nodes: memory::room(count, SCENE)?,
                vectors: memory::room(3 * count, SCENE)?,
            },
            tools: Default::default(),
            frame_state: None,
            body: ShownBody {
                number: BodyNumber::default(),
                cut: (body.cut.as_ref()).map(|_| CutModel(Arc::clone(&body.model))),
            },
            attached: Arc::default(),
        })
    }
}

impl Core {
    /// Changes the body, and the scene with it; or neither.
    pub(super) fn change(
        &mut self,
        published: &RwLock<Published>,
        operation: impl FnOnce(&mut Body, &[Point]) -> std::result::Result<Change, TopologyError>,
    ) -> Result<Change> {
        let maker = &self.maker;
        if maker.corrected.is_none() {
            return Err(Error::Unsupported(
                "cut: the elements move a cut body, and this scene makes no corrections; set `corrections`".into(),
            ));
        }
        let mut body = match &maker.body.cut {
            Some(cut) => cut.body.clone(),
            None => maker.body.whole_body()?,
        };
        // A cut goes through the tissue where it is now, not where it was meshed.
        let positions = maker.body.positions(&lock_read(published).last)?;
        // Beside its lists the topology makes many small parts.
        memory::probe(body.most_bytes(), SCENE)?;
        let change = operation(&mut body, &positions)?;
        // The blade met no tissue: no core is made, and the body's number stays.
        if change == Change::default() {
            return Ok(change);
        }
        let first = maker.body.mesh.node_count();
        // A copy may be of a copy that the same operation made: followed back to a node that was there before.
        let source = |node: usize| {
            let mut node = node;
            while node >= first {
                node = change.copied[node - first] as usize;
            }
            node
        };
        // The next core is made whole beside this one: memory may run out until the two change places.
        let mut next = self.with_body(Some(body))?;
        let mut shown = Published::rest(&next)?;
        {
            let own = lock_read(published);
            let pairs = [
                (&own.last, &mut shown.last),
                (&own.before, &mut shown.before),
            ];
            // Equal displacement at a copy and its source, in all frames that are kept: nothing
            // moves, and who interpolates between frames sees no jump.
            for (from, to) in pairs {
                spread(&from.field, &mut to.field, source);
            }
            if let (Some(from), Some(to)) = (&own.earlier, &mut shown.earlier) {
                spread(&from.field, &mut to.field, source);
            }
        }
        // What the last step did and told stays, until the next one.
        let (stats, mut told) = (lock_read(published).stats, ContactReport::default());
        told.take(&lock_read(published).tools)?;
        next.maker.follow(&self.maker, source)?;
        next.maker.loads.push(&next.maker.body, &change.pushes)?;
        let before = lock_read(published).body.number;
        // Whoever reads meshes and frames apart tells by this number whether they belong together.
        shown.body.number = BodyNumber {
            change: before.change + 1,
            ..before
        };
        let shown = self.hand_over(published, &mut next, shown)?;
        // Nothing has moved: hands go on with what they were told, forces included, until the next step.
        let hands = std::mem::take(&mut next.hands);
        self.replace(published, next, shown);
        self.hands = hands;
        let mut shown = lock_write(published);
        shown.tools = told;
        shown.stats = SceneStats {
            memory_bytes: shown.stats.memory_bytes,
            ..stats
        };
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
        self.hands.forget_gone();
        let region = lock_read(published).region_copy()?;
        let has_frames = lock_read(published).frame_state.is_some();
        let shown = RwLock::new(shown);
        let points = &self.maker.shown.points;
        if region.is_some() || points.len() > 0 {
            let body = next.maker.body.cut.as_ref().map(|cut| &cut.body);
            let points = points.following(self.maker.body.intact_mesh(), body)?;
            next.set_plan(&shown, region, Arc::new(points))?;
        }
        if has_frames {
            next.start_frame_states(&shown)?;
        }
        let body = &next.maker.body;
        if let (false, Some(prior)) = (self.hands.links.is_empty(), &body.model.prior) {
            let (corrections, samples) = (body.model.corrections()?, body.model.samples()?);
            let mut tissues = memory::room(self.hands.links.len(), SCENE)?;
            // All of their tissue is made before the first hand is moved, since making it may fail.
            for _ in &self.hands.links {
                let integrator = body.integrator;
                tissues.push(HandTissue::new(prior, corrections, integrator, &samples)?);
            }
            next.hands = std::mem::take(&mut self.hands);
            let hands = next.hands.links.iter_mut();
            hands.zip(tissues).for_each(|(hand, own)| hand.take(own));
        }
        Ok(shown.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// A core of a body that is not the next of this one's takes its place.
    ///
    /// # Errors
    /// Those of handing over; nothing has then changed.
    /// The line of the body's number is another then: a host that follows changes one by one has to
    /// take the whole body anew.
    pub(super) fn put_back(
        &mut self,
        published: &RwLock<Published>,
        mut next: Core,
        shown: Published,
    ) -> Result<()> {
        let mut shown = self.hand_over(published, &mut next, shown)?;
        let before = lock_read(published).body.number;
        shown.body.number = BodyNumber {
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
        let StepMaker {
            body: own, options, ..
        } = &self.maker;
        let intact = own.intact();
        let Some(body) = body else {
            return build(intact, options, None);
        };
        let model = intact.cut(&body)?;
        let nodes = intact.mesh.node_count();
        let envelope = self.maker.watch.envelope.cut(&model.mesh, nodes)?;
        let mut core = build(&model, options, Some(envelope))?;
        let cut = CutState {
            intact: Arc::clone(intact),
            model_bytes: bytes_of(&model)?,
            body,
        };
        core.maker.body.cut = Some(memory::boxed(cut, SCENE)?);
        Ok(core)
    }
}

impl StepMaker {
    /// Takes loads, motion, tools and numbers from before the body was cut; `source` is the node there of each node.
    fn follow(&mut self, before: &StepMaker, source: impl Fn(usize) -> usize + Copy) -> Result<()> {
        let loads = (&before.loads, &before.body);
        self.loads.follow(loads, &self.body, source)?;
        if let (Some(own), Some(old)) = (&mut self.corrected, &before.corrected) {
            let time_step = Arc::clone(&own.time_step);
            let context = self.loads.context(&self.body, &self.machine, &time_step)?;
            if let Some(context) = context {
                own.follow(context, (old, &before.body), &self.body, source)?;
            }
            let tools = (&before.tools, &before.body);
            self.tools.follow(tools, &self.body)?;
        }
        // The scene is awake and counts as corrected: whatever predicts next has to start from the
        // fields, since its own record is of another body.
        self.states.counters = Counters {
            sleeping: false,
            quiet: 0,
            was_corrected: [true; 2],
            ..before.states.counters
        };
        self.watch.logged_flags = before.watch.logged_flags;
        Ok(())
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
