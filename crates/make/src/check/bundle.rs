//! What is checked: a bundle, and with which contacts.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, bail};
use tissue::mesh::{Boundary, Mesh};
use tissue::programmes::ToolProgramme;
use upt::bundle::file_of;
use upt::{Model, ModelOptions};

use super::case::{self, Body};
use super::certificate::Certificate;
use super::score::{self, Regions, Score};
use crate::Watch;
use yardstick::tool_scale::Chosen;

/// Where the sizes of tools come from.
#[derive(Clone)]
pub enum ToolSizes {
    /// From the user, the body and the bundle's deepest push.
    Asked(Option<f64>),
    /// From a certificate that is repeated.
    Stated(Chosen),
}

impl ToolSizes {
    pub(super) fn choose(&self, bundle: &Bundle) -> Chosen {
        match self {
            Self::Stated(chosen) => chosen.clone(),
            Self::Asked(factor) => {
                let push = f64::from(bundle.model.manifest.envelope.max_push_mm);
                Chosen::of(*factor, &bundle.mesh, Some(push))
            }
        }
    }
}

/// What to measure.
pub struct Plan {
    pub bundle: PathBuf,
    /// Cases at most; none: `ORDER`'s. As many as fit into `seconds`, the last ones perhaps not to their ends.
    pub cases: Option<usize>,
    /// Frames of each case, where a certificate that is repeated had no time for all.
    pub frames: Vec<Option<usize>>,
    pub seconds: f64,
    pub seed: u64,
    /// Programmes of rigid tools in addition to the contacts.
    pub tools: Vec<ToolProgramme>,
    /// Their sizes.
    pub sizes: ToolSizes,
    pub threads: usize,
    pub watch: Watch,
}

/// A bundle with what a check needs of it.
pub(super) struct Bundle {
    pub(super) model: Arc<Model>,
    pub(super) mesh: Mesh,
    pub(super) boundary: Boundary,
    pub(super) regions: Regions,
}

impl Bundle {
    pub(super) fn open(folder: &Path) -> Result<Self> {
        let options = ModelOptions {
            threads: 1,
            ..Default::default()
        };
        let model = Model::open(folder, &options)?;
        if model.prior.is_none() {
            bail!(
                "{}: has no linear response to compare with; use `cargo xtask study report`",
                folder.display()
            );
        }
        let stated = &model.manifest;
        let mesh = file_of(folder, stated.body.as_deref(), &stated.mesh.file);
        let mesh = Mesh::read(&mesh)?;
        let boundary = match model.manifest.boundary {
            upt::bundle::Boundary::Fixed => Boundary::Fixed,
            upt::bundle::Boundary::Supported => Boundary::Supported,
        };
        let regions = score::regions(&mesh);
        Ok(Self {
            model,
            mesh,
            boundary,
            regions,
        })
    }

    pub(super) fn body(&self) -> Body<'_> {
        Body {
            mesh: &self.mesh,
            boundary: self.boundary,
            regions: &self.regions,
        }
    }

    pub(super) fn certificate(&self, seed: u64, scores: Vec<Score>) -> Result<Certificate> {
        let speed = case::speed(&self.model, &scores)?;
        let regions = self.regions.len();
        Ok(Certificate::of(
            &self.model,
            &self.mesh,
            seed,
            scores,
            regions,
            &speed,
        ))
    }
}
