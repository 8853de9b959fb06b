//! Everything that can be stepped through a contact: the library and the plain methods.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use tissue::baselines::CoarseTled;
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use tissue::trajectory::TrajectoryHeader;
#[cfg(feature = "linear")]
use tissue::{baselines::LinearQuasiStatic, linear::Lame};

use host::Effort;
use yardstick::bundle_folder::BundleFolder;
use yardstick::setting::{Precision, Provider, Region};
use yardstick::surrogate::Surrogate;

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
    Surrogate(Box<Surrogate>),
    PaperSplit(Box<super::paper_split::PaperSplit>),
    Prior(Box<yardstick::prior_alone::PriorAlone>),
    Zero,
    #[cfg(feature = "linear")]
    Linear(Box<LinearQuasiStatic>),
    CoarseTled(Box<CoarseTled>),
    Tled {
        solver: Box<Solver>,
        dt: f64,
    },
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
                let settings = yardstick::surrogate::settings(
                    *threads,
                    *provider,
                    *precision,
                    *corrections,
                    header.material.damping_per_s,
                );
                Self::Surrogate(Box::new(Surrogate::new(bundle, &settings, *region)?))
            }
            Method::PaperSplit { bundle, threads } => Self::PaperSplit(Box::new(
                super::paper_split::PaperSplit::new(bundle, *threads)?,
            )),
            Method::Prior {
                bundle,
                threads,
                decay,
            } => Self::Prior(Box::new(yardstick::prior_alone::PriorAlone::new(
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
            Self::Surrogate(surrogate) => surrogate.reset()?,
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

    /// Stage times of the last step, ms; empty where the method has none.
    pub fn stages(&self) -> Result<Vec<(&'static str, f64)>> {
        let Self::Surrogate(surrogate) = self else {
            return Ok(Vec::new());
        };
        let stats = surrogate.timing()?;
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
        Ok(Some(surrogate.memory_mb()?))
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
