//! The cargo feature `instruments`, and how a build without it leaves their code out.
//!
//! [`Instruments`] is a proof that the build has the feature: elsewhere the type has no value. What holds a proof, as
//! [`OfInstruments`] does, is then never made, and the compiler drops the code that would use it. So this file alone asks
//! for the feature; all others compile the same lines in every build.

use std::ops::{Deref, DerefMut};

use crate::error::{Error, Result};
use crate::memory;

/// What a proof consists of; without the feature a type that has no value. Unit tests run with the feature in every build.
#[cfg(any(test, feature = "instruments"))]
mod proof {
    #[derive(Debug, Clone, Copy)]
    pub enum Proof {
        Given,
    }
    pub const PROOF: Option<Proof> = Some(Proof::Given);
}
#[cfg(not(any(test, feature = "instruments")))]
mod proof {
    #[derive(Debug, Clone, Copy)]
    pub enum Proof {}
    pub const PROOF: Option<Proof> = None;
}

/// A proof that this build has instruments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instruments {
    _proof: proof::Proof,
}

/// Whether this build has instruments.
pub(crate) const HAS_INSTRUMENTS: bool = proof::PROOF.is_some();

/// The proof, where there is one.
///
/// # Errors
/// [`Error::Unsupported`] in a build without the feature.
pub(crate) fn instruments() -> Result<Instruments> {
    let missing = || Error::Unsupported("this build has no feature \"instruments\"".into());
    let _proof = proof::PROOF.ok_or_else(missing)?;
    Ok(Instruments { _proof })
}

/// A boxed value that only a build with instruments makes.
#[derive(Debug)]
pub(crate) struct OfInstruments<T> {
    value: Box<T>,
    _proof: Instruments,
}

impl<T> OfInstruments<T> {
    /// Makes the value.
    ///
    /// # Errors
    /// [`Error::Unsupported`] in a build without the feature, what `make` says, [`Error::OutOfMemory`].
    pub(crate) fn new(make: impl FnOnce() -> Result<T>, what: &str) -> Result<Self> {
        Ok(OfInstruments {
            _proof: instruments()?,
            value: memory::boxed(make()?, what)?,
        })
    }
}

impl<T> Deref for OfInstruments<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for OfInstruments<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}
