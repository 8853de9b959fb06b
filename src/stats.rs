//! What a scene reports about its last step: flags, what ran where, and apart from them the times of its stages.

use crate::options::{DecoderKernel, Precision, Provider, StepPath};

/// Bits of [`SceneStats::flags`] (values of `UPT_FLAG_*`).
pub mod flag {
    /// A contact displacement is larger than the model was trained on.
    pub const PUSH: u32 = 1;
    /// A contact patch's area is outside the trained range.
    pub const CONTACT_AREA: u32 = 2;
    /// A contact node is outside the domain.
    pub const SITE: u32 = 4;
    /// A contact moved faster than the model was trained on.
    pub const RATE: u32 = 8;
    /// More contact patches at once than the model was trained on.
    pub const SITES: u32 = 16;
    /// Guard: a displacement is beyond the bound.
    pub const BOUND: u32 = 32;
    /// Guard: a displacement is NaN or infinite.
    pub const NON_FINITE: u32 = 64;
    /// An element at the contact is inverted; with `check_inversion` any element, and the guard refuses the state.
    pub const INVERTED: u32 = 128;
    /// Guard: the state grows without cause.
    pub const GROWTH: u32 = 256;
    /// The learned correction was bounded.
    pub const CLAMPED: u32 = 512;
    /// The contact block was near singular and was regularised.
    pub const REGULARISED: u32 = 1024;
    /// The corrections ended with inverted elements, or had lost the contact of an instrument: something simpler took their place.
    pub const FELL_BACK: u32 = 2048;
    /// The estimated error is above the host's limit.
    pub const ERROR: u32 = 4096;
    /// Tissue lies more than 1 mm inside an instrument, or an instrument in the tissue.
    pub const DEEP: u32 = 8192;
    /// The solve of the instruments' contact was stopped by its bounds; the readings say what it left.
    pub const UNSOLVED: u32 = 16384;
    /// The bundle's tissue relaxes, and this scene makes no corrections, which alone know of it: what it shows and feels is elastic.
    pub const ELASTIC: u32 = 32768;

    /// What the flags say, as text.
    ///
    /// ```
    /// use upt::flag;
    ///
    /// let text = flag::names(flag::PUSH | flag::BOUND);
    /// assert_eq!(text, "a push is longer than trained; guard: a displacement passes the bound");
    /// ```
    pub fn names(flags: u32) -> String {
        let meanings = [
            (PUSH, "a push is longer than trained"),
            (CONTACT_AREA, "a contact area is outside the trained range"),
            (SITE, "a contact lies outside the domain"),
            (RATE, "a push changes faster than trained"),
            (SITES, "more contact sites than trained"),
            (BOUND, "guard: a displacement passes the bound"),
            (NON_FINITE, "guard: the state is not finite"),
            (INVERTED, "an element is inverted"),
            (GROWTH, "guard: the displacement grew without cause"),
            (CLAMPED, "the learned correction was bounded"),
            (REGULARISED, "the contact block was nearly singular"),
            (
                FELL_BACK,
                "the corrections ended with inverted elements or without their contact and were given up",
            ),
            (ERROR, "the estimated error is above the limit"),
            (DEEP, "tissue lies more than 1 mm inside an instrument"),
            (
                UNSOLVED,
                "the instruments' contact was not solved to the end",
            ),
            (
                ELASTIC,
                "the tissue relaxes, but without corrections this scene is elastic",
            ),
        ];
        let said = meanings.iter().filter(|(flag, _)| flags & flag != 0);
        said.map(|(_, text)| *text).collect::<Vec<_>>().join("; ")
    }
}

/// Statistics of a scene's last step.
#[derive(Debug, Clone, Copy)]
pub struct SceneStats {
    /// Bits of [`flag`].
    pub flags: u32,
    /// Steps since creation or reset.
    pub step_count: u64,
    /// Corrections made.
    pub corrections: u32,
    /// Evaluations of the element forces.
    pub evaluations: u32,
    /// Substeps that the step was made of; 0 where it is one.
    pub substeps: u32,
    /// `|r|` after the corrections over `|r|` before them; 0 without corrections.
    pub residual: f32,
    /// Estimated root mean square error of the corrected state over all nodes, mm; 0 without corrections.
    pub error_mm: f32,
    /// Smallest det F of the corrected state; without corrections, of the elements at the contact; 0 where there is neither.
    pub min_det: f32,
    /// Nodes decoded by the step.
    pub decoded_node_count: u64,
    /// Nodes in contact.
    pub contact_count: u64,
    /// Bytes of the scene's own buffers.
    pub memory_bytes: u64,
    /// Threads of a step.
    pub threads: u32,
    /// What decodes.
    pub kernel: DecoderKernel,
    /// Where the latent stage runs.
    pub provider: Provider,
    /// Precision that runs.
    pub precision: Precision,
    /// Who makes a step: [`StepPath::Split`] or [`StepPath::Whole`].
    pub step_path: StepPath,
    /// Largest displacement of the last state, mm.
    pub max_displacement_mm: f32,
    /// Largest ratio of push, rate, contact area and number of sites to what the model was trained on; above 1 is outside.
    pub indicator: f32,
    /// [`crate::Scene::contact_force`] gives the contact forces of the linear response, not the elements' elastic forces.
    pub prior_forces: bool,
    /// The scene is at rest and a step is free.
    pub sleeping: bool,
    /// A panic was caught in the scene; only dropping it is allowed.
    pub poisoned: bool,
    /// Given out by [`crate::Scene::timing`] alone.
    pub(crate) timing: SceneTiming,
}

/// How long a scene's last step and its stages took: [`crate::Scene::timing`].
#[derive(Debug, Clone, Copy, Default)]
pub struct SceneTiming {
    /// Steps since creation or reset: the step that this is about.
    pub step_count: u64,
    /// Wall time of the whole step, ms; the stages follow.
    pub step_ms: f64,
    /// Input checks.
    pub check_ms: f64,
    /// Contact solve and linear response.
    pub prior_ms: f64,
    /// Node features and encoder half.
    pub encode_ms: f64,
    /// Mean over the radius graph.
    pub aggregate_ms: f64,
    /// `latent.onnx`, or `step.onnx` on the whole path.
    pub latent_ms: f64,
    /// Decoder or table products.
    pub decode_ms: f64,
    /// Guard.
    pub guard_ms: f64,
    /// Corrections by the elements.
    pub corrections_ms: f64,
    /// Solves of the contact of instruments, part of the corrections' or the check's time.
    pub contact_ms: f64,
    /// Of the stages' times, copies to a device; 0 on the CPU.
    pub upload_ms: f64,
    /// Of the stages' times, copies back from a device; 0 on the CPU.
    pub download_ms: f64,
}
