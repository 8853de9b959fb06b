//! Everything that can be stepped through a contact: the library and the plain methods.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, bail};
use tissue::baselines::CoarseTled;
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use tissue::trajectory::TrajectoryHeader;
#[cfg(feature = "linear")]
use tissue::{baselines::LinearQuasiStatic, linear::Lame};
use upt::ffi;

pub use super::bundle_folder::{BundleFolder, is_one_tissue};
use super::setting::{Precision, Provider, Region};
use crate::effort::Effort;
use crate::host;

/// A method in one configuration.
#[derive(Clone, Debug)]
pub enum Method {
    Surrogate {
        bundle: BundleFolder,
        provider: Provider,
        precision: Precision,
        region: Region,
        threads: u32,
        /// Corrections a step in contact.
        corrections: Effort,
    },
    PaperSplit {
        bundle: BundleFolder,
        threads: u32,
    },
    /// A bundle's linear response alone. `decay`: factor a step after release.
    Prior {
        bundle: BundleFolder,
        threads: u32,
        decay: f32,
    },
    Zero,
    /// `decay`: factor a step after release.
    #[cfg(feature = "linear")]
    Linear {
        threads: u32,
        decay: f32,
    },
    CoarseTled {
        mesh: PathBuf,
        threads: u32,
    },
    Tled {
        threads: u32,
    },
}

/// A method made ready to step.
pub enum Stepper {
    Surrogate(Box<SurrogateStepper>),
    PaperSplit(Box<super::paper_split::PaperSplit>),
    Prior(Box<super::prior_alone::PriorAlone>),
    Zero,
    #[cfg(feature = "linear")]
    Linear(Box<LinearQuasiStatic>),
    CoarseTled(Box<CoarseTled>),
    Tled {
        solver: Box<Solver>,
        dt: f64,
    },
}

pub struct SurrogateStepper {
    scene: host::Scene,
    model: host::Model,
    /// Nodes of the region, empty for all; and the others, decoded after the timed call.
    region: Vec<u32>,
    others: Vec<u32>,
    returned: Vec<[f32; 3]>,
}

impl Stepper {
    /// Makes the method ready; the time of this call is the row's load time.
    pub fn new(method: &Method, mesh: &Mesh, header: &TrajectoryHeader) -> Result<Self> {
        let boundary: Boundary = header.boundary.parse().map_err(anyhow::Error::msg)?;
        Ok(match method {
            Method::Surrogate {
                bundle,
                provider,
                precision,
                region,
                threads,
                corrections,
            } => {
                let settings = host::ModelSettings {
                    threads: *threads,
                    provider: provider.code(),
                    precision: precision.code(),
                    exact: true,
                    corrections: Some(*corrections),
                    // Without corrections the bundle knows one damping only: what it errs by then is part of the row.
                    damping_per_s: match corrections.most {
                        0 => 0.0,
                        _ => header.material.damping_per_s,
                    },
                    ..host::ModelSettings::default()
                };
                Self::Surrogate(Box::new(SurrogateStepper::new(bundle, &settings, *region)?))
            }
            Method::PaperSplit { bundle, threads } => Self::PaperSplit(Box::new(
                super::paper_split::PaperSplit::new(bundle, *threads)?,
            )),
            Method::Prior {
                bundle,
                threads,
                decay,
            } => Self::Prior(Box::new(super::prior_alone::PriorAlone::new(
                bundle, *decay, *threads,
            )?)),
            Method::Zero => Self::Zero,
            #[cfg(feature = "linear")]
            Method::Linear { threads, decay } => {
                let lame = Lame::from_young(header.material.young_pa, header.material.poisson)?;
                Self::Linear(Box::new(LinearQuasiStatic::new(
                    mesh,
                    boundary,
                    lame,
                    *decay,
                    *threads as usize,
                )?))
            }
            Method::CoarseTled {
                mesh: coarse,
                threads,
            } => {
                let coarse = Mesh::read(coarse)?;
                Self::CoarseTled(Box::new(CoarseTled::new(
                    &coarse,
                    mesh,
                    boundary,
                    solver_options(header, *threads),
                )?))
            }
            Method::Tled { threads } => Self::Tled {
                solver: Box::new(Solver::new(
                    mesh,
                    boundary,
                    solver_options(header, *threads),
                )?),
                dt: header.dt_s,
            },
        })
    }

    /// Back to rest.
    pub fn reset(&mut self) -> Result<()> {
        match self {
            Self::Surrogate(surrogate) => surrogate.scene.reset()?,
            Self::PaperSplit(split) => split.reset(),
            Self::Prior(prior) => prior.reset(),
            Self::Zero => {}
            #[cfg(feature = "linear")]
            Self::Linear(linear) => linear.reset(),
            Self::CoarseTled(coarse) => coarse.reset(),
            Self::Tled { solver, .. } => solver.reset(),
        }
        Ok(())
    }

    /// One step; the wall time of it in ms. `out` `[K][3]` holds the whole field after it.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<f64> {
        let started = Instant::now();
        match self {
            Self::Surrogate(surrogate) => return surrogate.step(nodes, vectors, out),
            Self::PaperSplit(split) => split.step(nodes, vectors, out)?,
            Self::Prior(prior) => prior.step(nodes, vectors, out)?,
            Self::Zero => out.fill([0.0; 3]),
            #[cfg(feature = "linear")]
            Self::Linear(linear) => linear.step(nodes, vectors, out)?,
            Self::CoarseTled(coarse) => coarse.step(nodes, vectors, out)?,
            Self::Tled { solver, dt } => {
                let contact: Vec<ContactNode> = nodes
                    .iter()
                    .zip(vectors)
                    .map(|(node, vector)| ContactNode {
                        node: *node,
                        displacement: *vector,
                    })
                    .collect();
                solver.step_frame(&contact, *dt)?;
                solver.displacement(out);
            }
        }
        Ok(started.elapsed().as_secs_f64() * 1e3)
    }

    /// Estimated error of the last corrected step, root mean square over all nodes, mm; none without corrections.
    pub fn estimated_mm(&self) -> Result<Option<f32>> {
        let Self::Surrogate(surrogate) = self else {
            return Ok(None);
        };
        let stats = surrogate.scene.stats()?;
        Ok((stats.corrections > 0).then_some(stats.error_mm))
    }

    /// Force of the tissue on the instruments at the `count` contact nodes of the last step, mN; none of a method without.
    pub fn contact_force(&mut self, count: usize) -> Result<Option<Vec<[f32; 3]>>> {
        let Self::Surrogate(surrogate) = self else {
            return Ok(None);
        };
        surrogate.scene.contact_force(count).map(Some)
    }

    /// Stage times of the last step, ms; empty where the method has none.
    pub fn stages(&self) -> Result<Vec<(&'static str, f64)>> {
        let Self::Surrogate(surrogate) = self else {
            return Ok(Vec::new());
        };
        let stats = surrogate.scene.stats()?;
        let named = [
            ("check", stats.check_ms),
            ("prior", stats.prior_ms),
            ("encode", stats.encode_ms),
            ("aggregate", stats.aggregate_ms),
            ("latent", stats.latent_ms),
            ("decode", stats.decode_ms),
            ("corrections", stats.corrections_ms),
            ("guard", stats.guard_ms),
        ];
        let other = stats.step_ms - named.iter().map(|stage| stage.1).sum::<f64>();
        Ok(named
            .into_iter()
            .chain([("other", other.max(0.0))])
            .collect())
    }

    /// Host memory that the library says it holds, MB; none for other methods.
    pub fn memory_mb(&self) -> Result<Option<f64>> {
        let Self::Surrogate(surrogate) = self else {
            return Ok(None);
        };
        let bytes = surrogate.model.info().memory_bytes + surrogate.scene.stats()?.memory_bytes;
        Ok(Some(bytes as f64 / 1e6))
    }
}

fn solver_options(header: &TrajectoryHeader, threads: u32) -> SolverOptions {
    SolverOptions {
        material: header.material,
        inner_step_s: header.inner_dt_s,
        mass_scaling_s: header.mass_scaling_s,
        threads: threads as usize,
        ..SolverOptions::default()
    }
}

impl SurrogateStepper {
    fn new(bundle: &BundleFolder, settings: &host::ModelSettings, region: Region) -> Result<Self> {
        let model = host::Model::open(&bundle.path, settings)?;
        let mut scene = host::Scene::create(&model, ffi::UPT_KERNEL_AUTO)?;
        let count = model.info().node_count as usize;
        let region = match region {
            Region::All => Vec::new(),
            Region::Surface => model.indices(ffi::UPT_SET_SURFACE_NODES)?,
            Region::Domain => model.indices(ffi::UPT_SET_DOMAIN_NODES)?,
        };
        if !region.is_empty() {
            scene.set_region(&region)?;
        }
        let stats = scene.stats()?;
        if stats.precision != settings.precision {
            bail!(
                "{}: precision {} is not available on this machine; the library would run another",
                bundle.name,
                settings.precision
            );
        }
        let inside: std::collections::HashSet<u32> = region.iter().copied().collect();
        let others = if region.is_empty() {
            Vec::new()
        } else {
            (0..count as u32)
                .filter(|node| !inside.contains(node))
                .collect()
        };
        let returned = vec![[0.0; 3]; region.len()];
        Ok(Self {
            scene,
            model,
            region,
            others,
            returned,
        })
    }

    /// Nodes that a step returns.
    pub fn decoded(&self) -> usize {
        if self.region.is_empty() {
            self.model.info().node_count as usize
        } else {
            self.region.len()
        }
    }

    fn step(&mut self, nodes: &[u32], vectors: &[[f32; 3]], out: &mut [[f32; 3]]) -> Result<f64> {
        let started = Instant::now();
        if self.region.is_empty() {
            self.scene.step(nodes, vectors, out)?;
            return Ok(started.elapsed().as_secs_f64() * 1e3);
        }
        self.scene.step(nodes, vectors, &mut self.returned)?;
        let elapsed = started.elapsed().as_secs_f64() * 1e3;
        // The rest of the field is decoded outside the timed call, so that all rows are judged on all nodes.
        let mut rest = vec![[0.0; 3]; self.others.len()];
        self.scene.decode(&self.others, &mut rest)?;
        for (list, values) in [(&self.region, &self.returned), (&self.others, &rest)] {
            for (node, value) in list.iter().zip(values) {
                out[*node as usize] = *value;
            }
        }
        Ok(elapsed)
    }
}
