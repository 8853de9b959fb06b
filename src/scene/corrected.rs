//! How a scene corrects: what its options and the bundle ask for, and when a step has been corrected enough.
//!
//! The corrector holds what the implicit solver needs beside a step's input, and three limits of
//! its iterations, of which the first that is reached ends them: a count, an estimate of the error,
//! and a time. The estimate is the solver's own; by the bundle's calibration `c`, measured when it
//! was made, the true error is about `c` times as large. So a target `t` is reached at the estimate
//! `t / c`, and what a step reports is `c` times its estimate.

use crate::clock::Instant;
use std::sync::Arc;

use super::own_pace::OwnPace;
use crate::corrections::Substeps;
use crate::corrections::{Enough, ImplicitSolver, Report, SolverContext, Substepper, TimeStep};
use crate::error::{Error, Result};
use crate::kernels::{Isa, Pool};
use crate::memory::{self, HeldBytes};
use crate::model::Model;
use crate::options::{Corrections, MOST_CORRECTIONS, MOST_SUBSTEPS, SceneOptions};
use crate::stats::{SceneStats, flag};

const WHAT: &str = "the corrections of a scene";

/// The stage of a scene that corrects, and how far it goes.
#[derive(HeldBytes)]
pub struct Corrector {
    /// What iterates, and the motion that it remembers between steps.
    pub solver: Box<ImplicitSolver>,
    /// Steps in parts.
    pub(super) parts: StepParts,
    /// When a step has been corrected enough.
    #[held(skip)]
    goal: Goal,
    /// Where the basis of each block of the linear response starts.
    pub(super) basis_starts: Vec<usize>,
    /// The length of the scene's steps, and the damping.
    #[held(skip)]
    pub time_step: Arc<TimeStep>,
    /// The scene has a length of step or a damping of its own.
    pub(super) own_pace: bool,
    /// The tissue relaxes, which no learned map knows.
    pub(super) relaxes: bool,
}

/// When a step has been corrected enough, and how its error is told.
#[derive(Clone, Copy, Debug)]
struct Goal {
    /// Iterations at most.
    most: u32,
    /// 0: none.
    target_mm: f32,
    /// 0: none.
    budget_us: u32,
    /// Above it a step raises [`flag::ERROR`]; 0: none.
    error_limit_mm: f32,
    /// The true error over the estimate, as the bundle was measured.
    calibration: f32,
}

impl Goal {
    /// The estimate that reaches the target, mm.
    ///
    /// 0 where there is no target: no estimate is below it, and the count alone ends the
    /// iterations.
    fn estimate_mm(&self) -> f32 {
        self.target_mm / self.calibration
    }
}

/// Steps in parts: how many there may be, and what makes them, from the first step that needs it.
#[derive(HeldBytes)]
pub struct StepParts {
    /// Substeps of steps that tools drive; made at their first contact, where the options allow any.
    pub substeps: Option<Box<Substeps>>,
    /// Of a step that tools drive, at most; below 2 every step is whole.
    pub(super) most_substeps: u32,
    /// Substeps of a step without contact; 1 for a whole one.
    pub(super) free_substeps: u32,
    /// The solver of steps in parts, made at the first step that needs it.
    pub substepper: Option<Box<Substepper>>,
    /// An estimate above it asks for substeps, mm.
    pub(super) limit_mm: f32,
}

impl StepParts {
    /// Makes what substeps need, where the steps may have any.
    pub(super) fn be_ready(&mut self, context: SolverContext<'_>, model: &Model) -> Result<()> {
        if self.most_substeps < 2 || self.substeps.is_some() {
            return Ok(());
        }
        self.be_shorter(context, model)?;
        self.substeps = Some(memory::boxed(Substeps::new(self.limit_mm)?, WHAT)?);
        Ok(())
    }

    /// Makes the solver of substeps. There is one length for steps under tools and for free ones, so one solver serves both.
    pub(super) fn be_shorter(&mut self, context: SolverContext<'_>, model: &Model) -> Result<()> {
        let count = self.most_substeps.max(self.free_substeps);
        if count < 2 || self.substepper.is_some() {
            return Ok(());
        }
        // The damping is a rate, and stays.
        let whole = context.time_step.integrator;
        let integrator = whole.over(whole.step_s / f64::from(count));
        let time_step = (context.corrections).time_step(
            &model.mesh,
            &model.manifest.step_material(),
            integrator,
        )?;
        let substepper = Substepper::new(context, Arc::new(time_step), count)?;
        self.substepper = Some(memory::boxed(substepper, WHAT)?);
        Ok(())
    }
}

impl Corrector {
    /// What the options and the bundle ask for; none where that is no correction.
    pub fn new(
        model: &Arc<Model>,
        options: &SceneOptions,
        isa: Isa,
        pool: &Pool,
    ) -> Result<Option<Corrector>> {
        // What the bundle recommends, as it was measured; absent in a bundle that was made without
        // elements.
        let entry = model.manifest.corrections.as_ref();
        let own = OwnPace::new(model, options)?;
        // Three ways to say enough: a count, a target in mm, or a time; the first that is reached ends the iterations.
        let (most, target_mm, budget_us) = match options.corrections {
            Corrections::None => return none(own, options.substeps),
            Corrections::Recommended | Corrections::RecommendedWithin { .. } => match entry {
                Some(entry) if entry.recommended > 0 && options.boundary => {
                    let budget_us = match options.corrections {
                        Corrections::RecommendedWithin { budget_us } => budget_us,
                        _ => 0,
                    };
                    (entry.recommended, entry.target_mm, budget_us)
                }
                _ => return none(own, options.substeps),
            },
            Corrections::Fixed(count) => (count, 0.0, 0),
            Corrections::Auto {
                most,
                target_mm,
                budget_us,
            } => {
                if !(target_mm.is_finite() && target_mm >= 0.0)
                    || (target_mm == 0.0 && budget_us == 0)
                {
                    return Err(Error::Argument(
                        "corrections: `auto` needs a budget in µs or a target in mm, finite and above 0".into(),
                    ));
                }
                (most, target_mm, budget_us)
            }
        };
        // A portable model promises equal bits on all machines, and a clock is different on each.
        if budget_us > 0 && isa.is_portable() {
            return Err(Error::Argument(
                "corrections: a budget in µs makes steps depend on time, and the model was opened as portable; set 0, and a count or a target"
                    .into(),
            ));
        }
        if !(1..=MOST_CORRECTIONS).contains(&most) {
            return Err(Error::Argument(format!(
                "corrections is {most}, must be 1 to {MOST_CORRECTIONS}"
            )));
        }
        // The bundle's number is for its own length of step and for steps that go on to a target; a
        // budget would be used up by the parts.
        let most_substeps = match options.substeps {
            0 => match entry {
                Some(entry) if target_mm > 0.0 && budget_us == 0 && !own.has_step() => {
                    entry.substeps
                }
                _ => 1,
            },
            1 => 1,
            count if count > MOST_SUBSTEPS => {
                return Err(Error::Argument(format!(
                    "substeps is {count}, must be at most {MOST_SUBSTEPS}, or 0 for the bundle's"
                )));
            }
            count if target_mm == 0.0 => {
                return Err(Error::Argument(format!(
                    "substeps is {count}: without a target no step needs them; give corrections a target in mm"
                )));
            }
            count => count,
        };
        if !(options.error_limit_mm.is_finite() && options.error_limit_mm >= 0.0) {
            return Err(Error::Argument(format!(
                "error_limit_mm is {}, must be finite and not negative",
                options.error_limit_mm
            )));
        }
        if !options.boundary {
            return Err(Error::Unsupported(
                "corrections: the equation of motion needs the boundary; leave `boundary` on"
                    .into(),
            ));
        }
        let corrections = model.corrections()?;
        let prior = model.prior.as_ref().ok_or_else(|| {
            Error::Unsupported("corrections: the bundle has no linear response".into())
        })?;
        let integrator = own.integrator(corrections.time_step.integrator);
        // `K + kappa M` and its inverse blocks depend on the length of the step: the bundle's are shared, a scene's own are its own.
        let time_step = match own.is_some() {
            false => Arc::clone(&corrections.time_step),
            true => Arc::new(corrections.time_step(
                &model.mesh,
                &model.manifest.step_material(),
                integrator,
            )?),
        };
        let context = SolverContext {
            isa,
            pool,
            prior,
            corrections,
            time_step: &time_step,
            held: &corrections.body.held,
        };
        let relaxes = model.manifest.relaxes();
        // Without an entry nothing was measured, and the solver's own estimate stands for the
        // error.
        let goal = Goal {
            most,
            target_mm,
            budget_us,
            error_limit_mm: options.error_limit_mm,
            calibration: entry.map_or(1.0, |entry| entry.calibration),
        };
        Ok(Some(Corrector {
            solver: memory::boxed(ImplicitSolver::new(context)?, WHAT)?,
            parts: StepParts {
                // In most scenes no step is ever made in parts; what parts need is made with the
                // first that is.
                substeps: None,
                most_substeps,
                free_substeps: own.free_substeps(integrator.step_s, relaxes),
                substepper: None,
                limit_mm: goal.estimate_mm(),
            },
            goal,
            relaxes,
            basis_starts: prior.basis_starts()?,
            own_pace: own.is_some(),
            time_step,
        }))
    }
}

/// A scene that does not correct.
///
/// Options that only corrections would heed are refused: a host that sets them means something, and
/// would otherwise look for its effect in vain.
fn none(own: OwnPace, substeps: u32) -> Result<Option<Corrector>> {
    if substeps > 1 {
        return Err(Error::Argument(format!(
            "substeps is {substeps}: only corrections have substeps, and this scene makes none; leave substeps at 0, or set `corrections`"
        )));
    }
    own.refuse()?;
    Ok(None)
}

impl Corrector {
    /// When a step that began at `start` has been corrected enough.
    pub(super) fn enough(&self, start: Instant) -> Enough {
        // The budget counts from where the step began, so that search and contact are in it.
        let budget_us = self.goal.budget_us;
        Enough {
            iterations: self.goal.most,
            error_mm: self.goal.estimate_mm(),
            until: (budget_us > 0)
                .then(|| start + std::time::Duration::from_micros(budget_us.into())),
        }
    }

    /// Whether the elements make every step, those that nothing touches too.
    pub(super) fn alone(&self) -> bool {
        self.own_pace || self.relaxes
    }

    /// Whether the steps get as many corrections as the bundle's limits for tools were measured with.
    pub(super) fn covers_tools(&self, model: &Model) -> bool {
        let limits = model.manifest.envelope.tools;
        limits.is_some_and(|tools| self.goal.most >= tools.corrections)
    }

    /// Bytes held. The time step counts only where the scene has its own: else it is the model's.
    pub(super) fn memory_bytes(&self) -> usize {
        let own = match self.own_pace {
            true => memory::behind(&self.time_step),
            false => 0,
        };
        self.held_bytes() + own
    }

    /// Puts what the iterations report into the statistics.
    pub(super) fn report_to(&self, report: &Report, stats: &mut SceneStats) {
        stats.corrections = report.effort.iterations;
        stats.evaluations = report.effort.evaluations;
        stats.substeps = report.substeps;
        stats.residual = report.residual;
        stats.min_det = report.min_det;
        stats.error_mm = report.error_mm * self.goal.calibration;
        if report.fell_back {
            stats.flags |= flag::FELL_BACK;
        }
        let limit = self.goal.error_limit_mm;
        // NaN is larger than nothing; without its own question such a step would look good.
        if limit > 0.0 && (stats.error_mm > limit || stats.error_mm.is_nan()) {
            stats.flags |= flag::ERROR;
        }
    }
}
