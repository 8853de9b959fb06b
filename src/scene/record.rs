//! The recording that a scene may have: each call that changes what later steps compute has its line ([`crate::replay`]).

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};

use sha2::{Digest, Sha256};

use super::loads::Loads;
use super::published::Published;
use super::published::lock_read;
use super::step_input::{Contact, StepInput};
use super::support::SupportPose;
use crate::error::Result;
use crate::memory;
use crate::replay::Recorder;
use crate::replay::drive::Rows;
use crate::replay::lines::Step;
use crate::replay::loads::{Loading, PointForce, Pose, Pressure, Support, Tie};

pub(super) const WHAT: &str = "a recording";

/// The recording of a scene, if there is one.
#[derive(Default)]
pub(super) struct Record {
    /// Whether calls look for it.
    pub(super) on: AtomicBool,
    /// Held while a line is begun and while it is ended, never during the call between: a step may take long, and the host
    /// may take the recording meanwhile.
    recorder: Mutex<Option<Box<Recorder>>>,
}

impl Record {
    /// The recording of this moment.
    pub(super) fn lock(&self) -> MutexGuard<'_, Option<Box<Recorder>>> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins the line of a call with what `line` writes; says whether [`Record::end`] is to follow the call.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]: then no line is begun, and the call must not be made.
    pub(super) fn begin(&self, line: impl FnOnce(&mut Recorder) -> Result<()>) -> Result<bool> {
        if !self.on.load(Ordering::Acquire) {
            return Ok(false);
        }
        let begun = self
            .lock()
            .as_mut()
            .map(|recorder| line(recorder).inspect_err(|_| recorder.drop_open()));
        begun.transpose()?;
        Ok(true)
    }

    /// Ends the line of a call, or takes it back where the call has failed.
    pub(super) fn end(&self, published: &RwLock<Published>, is_done: bool) {
        if let Some(recorder) = self.lock().as_mut() {
            match is_done {
                true => recorder.close(|| digest(published)),
                false => recorder.drop_open(),
            }
        }
    }

    /// Bytes of what no one has taken.
    pub(super) fn held_bytes(&self) -> usize {
        self.lock().as_ref().map_or(0, |own| own.held_bytes())
    }
}

/// Numbers that are hashed at once. Their bytes go through a buffer on the stack, little-endian on
/// every machine: a hash needs no memory.
const MOST: usize = 256;

/// Adds at most [`MOST`] numbers.
fn add(hash: &mut Sha256, values: &[f32]) {
    let mut bytes = [[0; 4]; MOST];
    for (bytes, value) in bytes.iter_mut().zip(values) {
        *bytes = value.to_le_bytes();
    }
    hash.update(bytes[..values.len()].as_flattened());
}

/// SHA-256 of what an output would hold.
///
/// Of the bits of f32 in little-endian order, so that a replay that differs in the last bit of one
/// node has another hash.
fn digest(published: &RwLock<Published>) -> [u8; 32] {
    let shared = lock_read(published);
    let field = &shared.last.field;
    let mut hash = Sha256::new();
    match &shared.region {
        Some(region) => {
            let rows = field.as_chunks::<3>().0;
            for &node in region {
                add(&mut hash, &rows[node as usize]);
            }
        }
        None => field.chunks(MOST).for_each(|part| add(&mut hash, part)),
    }
    hash.finalize().into()
}

/// The line of a step.
///
/// Dense fields are written as the rows in which any bit is set; what is the host's list already is
/// borrowed.
///
/// # Errors
/// [`crate::Error::OutOfMemory`].
pub(super) fn step(recorder: &mut Recorder, input: &StepInput<'_>) -> Result<()> {
    let mut line = Step {
        displacement: input.displacement.map(Rows::of).transpose()?,
        loads: loading(&input.loads)?,
        time_s: input.time_s,
        ..Step::default()
    };
    match input.contact {
        Contact::None => {}
        Contact::Dense(field) => line.collision = Some(Rows::of(field)?),
        Contact::Sparse { nodes, vectors } => {
            line.contact = Some(Rows {
                nodes: Cow::Borrowed(nodes),
                vectors: Cow::Borrowed(vectors),
            });
        }
        Contact::Tools(tools) => {
            let mut instruments = memory::room(tools.len(), WHAT)?;
            for tool in tools {
                instruments.push(recorder.instrument(tool)?);
            }
            line.instruments = Some(instruments);
        }
    }
    recorder.open_step(line)
}

/// The loads of a line, which borrows their lists.
fn loading<'a>(loads: &Loads<'a>) -> Result<Loading<'a>> {
    let pose = |pose: SupportPose| Pose {
        position: pose.position,
        rotation: pose.rotation,
    };
    let point_forces = loads.point_forces.iter().map(|own| PointForce {
        nodes: own.nodes,
        weights: own.weights,
        force: own.force,
    });
    let pressures = loads.pressures.iter().map(|own| Pressure {
        nodes: Cow::Borrowed(own.nodes),
        pascal: own.pascal,
    });
    let supports = loads.supports.iter().map(|own| Support {
        group: own.group,
        let_go: own.let_go,
        pose: own.pose.map(pose),
        displacements: own.displacements.map(Cow::Borrowed),
    });
    Ok(Loading {
        gravity: loads.gravity,
        gravity_at_rest: loads.gravity_at_rest,
        forces: loads.forces.map(Rows::of).transpose()?,
        point_forces: memory::collected(loads.point_forces.len(), point_forces, WHAT)?,
        pressures: memory::collected(loads.pressures.len(), pressures, WHAT)?,
        support: loads.support.map(pose),
        supports: memory::collected(loads.supports.len(), supports, WHAT)?,
        ties: memory::collected(loads.ties.len(), loads.ties.iter().map(Tie::from), WHAT)?,
    })
}
