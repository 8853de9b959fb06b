//! Snapshots: the state of a scene as bytes, from which it resumes to the bit.
//!
//! A magic and a version, little-endian; then in postcard's format the scene's origin and its [`State`]; at the end the SHA-256 of all
//! before it (`docs/decisions/013-state.md`).
//!
//! REQ-031: A restored snapshot goes on to the bit, with contact, friction and grasps.
//!
//! REQ-032: A damaged snapshot is refused and changes nothing.

use std::sync::{PoisonError, RwLock};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use topology::{Body, Kept};

use super::body::{MOST_COPIES, SceneBody, with_most_copies};
use super::core::Core;
use super::maker::StepMaker;
use super::published::Published;
use super::state::State;
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::stored;

const MAGIC: &[u8; 8] = b"UPTSNAP\0";
const VERSION: u32 = 25;
/// Magic and version.
const HEAD: usize = MAGIC.len() + 4;
/// The checksum is no signature: it finds damage. A snapshot that was made to mislead is met by the
/// checks of what it says.
const DIGEST: usize = 32;

/// Which scenes may take a state. What follows it is read only where this fits.
#[derive(Serialize, Deserialize)]
struct Origin {
    /// SHA-256 of the bundle's manifest.
    model: [u8; 32],
    /// SHA-256 of the mesh's name, which is a hash itself.
    mesh: [u8; 32],
    /// Length of a step, µs.
    step_us: u32,
    /// Damping, 1/s.
    damping_per_s: f64,
    /// Whether it has instruments.
    driven: bool,
}

/// Whether bytes say that they are of a cut body; they may be damaged.
pub(super) fn has_body(bytes: &[u8]) -> bool {
    let rest = bytes.get(HEAD..).unwrap_or_default();
    let body =
        stored::read::<Origin>(rest).and_then(|(_, rest)| stored::read::<Option<Kept>>(rest));
    matches!(body, Ok((Some(_), _)))
}

impl Origin {
    /// Of a scene with this body; `driven`: with instruments.
    fn of(body: &SceneBody, driven: bool) -> Origin {
        Origin {
            model: body.model.hash,
            mesh: Sha256::digest(body.mesh.sha256.as_bytes()).into(),
            step_us: (1e6 * body.step_s()).round() as u32,
            damping_per_s: body.integrator.damping_per_s,
            driven,
        }
    }

    /// Whether a scene with this body takes what it says.
    fn check(&self, body: &SceneBody) -> Result<()> {
        let (saved, own) = (self, Origin::of(body, self.driven));
        if saved.model != own.model {
            return Err(Error::Snapshot("belongs to another model".into()));
        }
        if saved.mesh != own.mesh {
            return Err(Error::Snapshot("belongs to another mesh".into()));
        }
        if saved.step_us != own.step_us {
            return Err(Error::Snapshot(format!(
                "was saved by a scene with steps of {} µs; restore it in one with that `step_s`, here {} µs",
                saved.step_us, own.step_us
            )));
        }
        // To the bit: a scene takes its host's number as it is.
        if saved.damping_per_s.to_bits() != own.damping_per_s.to_bits() {
            return Err(Error::Snapshot(format!(
                "was saved by a scene with a damping of {} 1/s; restore it in one with that `damping_per_s`, here {} 1/s",
                saved.damping_per_s, own.damping_per_s
            )));
        }
        if saved.driven && !crate::features::HAS_INSTRUMENTS {
            return Err(Error::Snapshot(
                "was saved by a scene with instruments; this build has no feature \"instruments\""
                    .into(),
            ));
        }
        Ok(())
    }
}

impl Core {
    /// The state as bytes.
    pub(super) fn save(&self, published: &RwLock<Published>) -> Result<Vec<u8>> {
        let state = State::of(&self.maker, published)?;
        let own = &self.maker.body;
        let body = own.cut.as_ref().map(|cut| cut.body.kept());
        let whole = (Origin::of(own, state.is_driven()), body, state);
        let mut bytes = stored::write(&whole, HEAD, DIGEST)?;
        bytes[..MAGIC.len()].copy_from_slice(MAGIC);
        bytes[MAGIC.len()..HEAD].copy_from_slice(&VERSION.to_le_bytes());
        // Room for head and digest was left when the state was written: nothing is copied to put
        // them round it.
        let end = bytes.len() - DIGEST;
        let (body, digest) = bytes.split_at_mut(end);
        digest.copy_from_slice(&Sha256::digest(body));
        Ok(bytes)
    }

    /// Takes a saved state; on error nothing has changed.
    pub(super) fn restore(&mut self, published: &RwLock<Published>, bytes: &[u8]) -> Result<()> {
        let maker = &mut self.maker;
        let (body, mut state) = read(maker, bytes)?;
        if body.is_some() || maker.body.cut.is_some() {
            return self.restore_body(published, body, state);
        }
        state.admit(maker)?;
        // What is computed from it may still fail: the old state is kept until then.
        let _mode = FlushToZero::of(maker.machine.isa);
        let old = State::of(maker, published)?;
        let taken = state
            .put(maker, published)
            .and_then(|()| self.recompute(published));
        let taken = taken.and_then(|()| self.fit_state(published));
        if let Err(error) = taken {
            // Fails only where a worker panics, which has been reported by then: the old state's lists had their room.
            let _ = old.put(&mut self.maker, published);
            return Err(error);
        }
        self.publish_state(published);
        Ok(())
    }

    /// Takes a saved state of another body than the scene's, or of a cut one: a core is made for it.
    fn restore_body(
        &mut self,
        published: &RwLock<Published>,
        body: Option<Kept>,
        mut state: State,
    ) -> Result<()> {
        let body = match body {
            Some(kept) => {
                let own = &self.maker.body;
                let mesh = match &own.cut {
                    Some(cut) => cut.body.shared_mesh(),
                    None => own.whole_body()?.shared_mesh(),
                };
                Some(with_most_copies(Body::of_kept(mesh, kept)?))
            }
            None => None,
        };
        // Admitted and put into a core beside this one: a snapshot that turns out wrong leaves the scene as it is.
        let mut next = self.with_body(body)?;
        let shown = RwLock::new(Published::rest(&next)?);
        state.admit(&next.maker)?;
        let _mode = FlushToZero::of(self.maker.machine.isa);
        state.put(&mut next.maker, &shown)?;
        next.recompute(&shown)?;
        next.fit_state(&shown)?;
        let shown = shown.into_inner().unwrap_or_else(PoisonError::into_inner);
        self.put_back(published, next, shown)
    }
}

/// Reads a snapshot of a scene's: what its body was cut to, and the state.
fn read(maker: &StepMaker, bytes: &[u8]) -> Result<(Option<Kept>, State)> {
    // Asked first: a count that was never set is not followed to the end of the host's memory.
    if bytes.len() > HEAD + State::most_bytes(maker) + most_body_bytes(maker) + DIGEST {
        return Err(Error::Snapshot(format!(
            "has {} bytes, more than any snapshot of this scene",
            bytes.len()
        )));
    }
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(Error::Snapshot("is not a snapshot of a scene".into()));
    };
    let Some((version, rest)) = rest.split_first_chunk() else {
        return Err(Error::Snapshot("is cut short".into()));
    };
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        return Err(Error::Version(format!(
            "snapshot: version {version}, this library reads version {VERSION}"
        )));
    }
    let Some((rest, digest)) = rest.split_last_chunk::<DIGEST>() else {
        return Err(Error::Snapshot("is cut short".into()));
    };
    if Sha256::digest(&bytes[..bytes.len() - DIGEST]).as_slice() != digest {
        return Err(Error::Snapshot(
            "is damaged: its checksum does not match".into(),
        ));
    }
    let (saved, rest) = stored::read::<Origin>(rest)?;
    saved.check(&maker.body)?;
    let (body, rest) = stored::read::<Option<Kept>>(rest)?;
    let (state, rest) = stored::read::<State>(rest)?;
    if !rest.is_empty() {
        return Err(Error::Snapshot(format!(
            "has {} bytes too many",
            rest.len()
        )));
    }
    Ok((body, state))
}

/// Bytes of what a snapshot says of a cut body, at most, with its longer fields.
fn most_body_bytes(maker: &StepMaker) -> usize {
    match maker.corrected {
        Some(_) => MOST_COPIES * State::most_bytes(maker) + 4096 * maker.body.mesh.tets.len() / 4,
        None => 0,
    }
}
