//! What a step hands to its corrections, and what they report.

use crate::clock::Instant;

use super::Corrections;
use super::boundary::Held;
use super::extent::Extent;
use super::group::Group;
use super::load::Load;
use super::precondition::Env;
use super::time_step::TimeStep;
use crate::field::ContactSet;
use crate::kernels::{Isa, Pool};
use crate::prior::PriorTable;

/// How the corrections of a step went.
#[derive(Debug, Clone, Copy, Default)]
pub struct Report {
    pub effort: Effort,
    /// `|r|` at the end over `|r|` of the guess.
    pub residual: f32,
    /// Root mean square over the nodes of what a further iteration would move, estimated, mm.
    pub remaining_mm: f32,
    /// Root mean square over the nodes that the smoothing far from the tools has moved, mm: as much at least is out of balance there.
    pub far_mm: f32,
    /// How far from the tools the next step iterates.
    pub extent: Extent,
    /// Root mean square error over the nodes, estimated before the bundle's calibration, mm.
    pub error_mm: f32,
    /// Smallest det F at the end.
    pub min_det: f32,
    /// The load was taken in this many parts.
    pub parts: u32,
    /// The iterations ended inverted and something else took their place.
    pub fell_back: bool,
    /// The step was made of this many shorter ones; 0 where it is one.
    pub substeps: u32,
}

/// What a step took; that of its shorter ones adds up.
#[derive(Debug, Clone, Copy, Default)]
pub struct Effort {
    /// Iterations made.
    pub iterations: u32,
    /// Evaluations of the element forces.
    pub evaluations: u32,
}

impl Report {
    /// Of both together, the second of which is the state's.
    pub(super) fn and(&self, second: &Report) -> Report {
        Report {
            effort: Effort {
                iterations: self.effort.iterations + second.effort.iterations,
                evaluations: self.effort.evaluations + second.effort.evaluations,
            },
            ..*second
        }
    }
}

/// The step being corrected.
pub struct Input<'a> {
    /// Rest positions `[K,3]`, mm.
    pub rest: &'a [f32],
    /// Prescribed nodes and where they end, mm.
    pub contact: &'a ContactSet,
    /// `u_n [K,3]`.
    pub last: &'a [f32],
    /// `u_{n-1} [K,3]`.
    pub before: &'a [f32],
    /// The host handed `last` over: nothing is known of its velocity.
    pub still: bool,
    /// Loads beside contact, where there are any.
    pub load: Option<Load<'a>>,
    /// The parts of the scene's step at which this one starts and ends.
    pub way: [f32; 2],
    /// When to stop.
    pub enough: Enough,
}

/// When a step has been corrected enough.
#[derive(Debug, Clone, Copy)]
pub struct Enough {
    /// Iterations at most.
    pub iterations: u32,
    /// [`Report::error_mm`] that suffices; 0 for never.
    pub error_mm: f32,
    /// No iteration starts after this.
    pub until: Option<Instant>,
}

impl Enough {
    /// All iterations that there may be, and time is for.
    pub fn all(self) -> Enough {
        Enough {
            error_mm: 0.0,
            ..self
        }
    }
}

/// What a scene lends.
#[derive(Clone, Copy)]
pub struct SolverContext<'a> {
    pub isa: Isa,
    pub pool: &'a Pool,
    pub prior: &'a PriorTable,
    pub corrections: &'a Corrections,
    /// The length of the scene's steps.
    pub time_step: &'a TimeStep,
    /// What holds the body in this step.
    pub held: &'a Held,
}

impl<'a> SolverContext<'a> {
    /// The support groups that hold nothing.
    pub(super) fn let_go_groups(&self) -> impl Iterator<Item = &'a Group> {
        let let_go = self.held.let_go;
        let groups = self.corrections.groups.iter().enumerate();
        groups.filter_map(move |(at, group)| (let_go >> at & 1 != 0).then_some(group))
    }

    /// Whether loads move all of the body, and no whole modes know how.
    pub(super) fn moves_all(&self, input: &Input<'_>) -> bool {
        input.load.is_some() && !self.corrections.has_whole_modes()
    }

    /// What products with fields need of it.
    pub(super) fn env(&self) -> Env<'a> {
        Env {
            isa: self.isa,
            pool: self.pool,
            prior: self.prior,
            space: &self.corrections.space,
            body: &self.corrections.body,
            time_step: self.time_step,
            whole: match &self.held.modes.0 {
                Some(modes) => Some(modes),
                None => self.corrections.whole.get().and_then(Option::as_ref),
            },
            held: self.held,
        }
    }
}
