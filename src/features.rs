//! The cargo features `instruments` and `learned`, and how a build without one leaves its code out.
//!
//! [`Instruments`] and [`Learned`] are proofs that the build has the feature: elsewhere such a type has no value. What holds a
//! proof, as [`Proven`] does, is then never made, and the compiler drops the code that would use it. So this file and `onnx`,
//! which takes the crate `ort` out of the build, alone ask for a feature; all others compile the same lines in every build.

use std::ops::{Deref, DerefMut};

use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};

/// A proof that a feature is there.
pub(crate) trait Feature: Sized {
    /// The proof, where there is one.
    const PROOF: Option<Self>;
    /// Why there is none.
    const MISSING: &str;
}

macro_rules! feature {
    ($(#[$doc:meta])* $proof:ident, $kept:ident, $name:literal, if $given:meta) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct $proof($kept::Proof);

        #[cfg($given)]
        mod $kept {
            #[derive(Debug, Clone, Copy)]
            pub enum Proof {
                Given,
            }
            pub const PROOF: Option<Proof> = Some(Proof::Given);
        }
        #[cfg(not($given))]
        mod $kept {
            #[derive(Debug, Clone, Copy)]
            pub enum Proof {}
            pub const PROOF: Option<Proof> = None;
        }

        impl Feature for $proof {
            const PROOF: Option<Self> = match $kept::PROOF {
                Some(proof) => Some($proof(proof)),
                None => None,
            };
            const MISSING: &str = concat!("this build has no feature \"", $name, "\"");
        }
    };
}

feature! {
    /// A proof that this build has instruments. Unit tests have them in every build.
    Instruments, instruments_kept, "instruments", if any(test, feature = "instruments")
}

feature! {
    /// A proof that this build has learned models: ONNX Runtime, and the bundles with networks.
    Learned, learned_kept, "learned", if feature = "learned"
}

/// Whether this build has instruments.
pub(crate) const HAS_INSTRUMENTS: bool = Instruments::PROOF.is_some();

/// The proof of a feature.
///
/// # Errors
/// [`Error::Unsupported`] in a build without the feature.
pub(crate) fn proof<P: Feature>() -> Result<P> {
    P::PROOF.ok_or_else(|| Error::Unsupported(P::MISSING.into()))
}

/// Asked by every call that instruments need.
///
/// # Errors
/// Those of [`proof`].
pub(crate) fn instruments() -> Result<Instruments> {
    proof()
}

/// A boxed value that only a build with the feature `P` makes.
#[derive(Debug)]
pub(crate) struct Proven<P, T> {
    value: Box<T>,
    _proof: P,
}

impl<P: Feature, T> Proven<P, T> {
    /// Makes the value.
    ///
    /// # Errors
    /// [`Error::Unsupported`] in a build without the feature, what `make` says, [`Error::OutOfMemory`].
    pub(crate) fn new(make: impl FnOnce() -> Result<T>, what: &str) -> Result<Self> {
        Ok(Proven {
            _proof: proof()?,
            value: memory::boxed(make()?, what)?,
        })
    }
}

impl<P, T: HeldBytes> HeldBytes for Proven<P, T> {
    fn held_bytes(&self) -> usize {
        self.value.held_bytes()
    }
}

impl<P, T> Deref for Proven<P, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<P, T> DerefMut for Proven<P, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}
