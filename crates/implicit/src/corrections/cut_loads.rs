//! What steps under loads need of a body that has been cut: the intact body's whole modes on it.
//!
//! Whole modes are large and made by an eigenvalue solve, so a cut body goes on with those of the
//! intact one: a copy of a node moves as its parent, and the products lose what the cut has taken.

use topology::Body as CutBody;

use super::Corrections;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::prior::PriorTable;
use ::elements::Material;

impl Corrections {
    /// Gives `cut`, which this body was cut to, the whole modes that this one has read.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn cut_loads(
        &self,
        cut: &Corrections,
        (mesh, body): (&Mesh, &CutBody),
        material: &Material,
        prior: &PriorTable,
    ) -> Result<()> {
        if cut.whole.get().is_some() {
            return Ok(());
        }
        let modes = match self.whole.get().and_then(Option::as_ref) {
            Some(modes) => {
                let lost = self.lost_elements((mesh, body), material, prior)?;
                Some(modes.cut(body.parents(), &lost)?)
            }
            None => None,
        };
        cut.whole.get_or_init(|| modes);
        Ok(())
    }
}
