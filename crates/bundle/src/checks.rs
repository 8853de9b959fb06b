//! What the values of a manifest must satisfy; every failure names the field.
//!
//! REQ-005: Damage that no hash shows gives a typed error or a model whose published states are finite.

use super::faults::{bad, check};
use super::manifest::{Envelope, Manifest, ManifestKind, ReducedEntry, ToolEnvelope, UptEntry};
use crate::limits::{
    LARGEST_GRAVITY, LONGEST_STEP_S, MOST_CORRECTIONS, MOST_SUBSTEPS, SHORTEST_STEP_S,
};
use field::INPUT_LIMIT;
use field::error::Result;

impl Manifest {
    /// Checks each value on its own and against the others. Whether files agree with them is found when they are read.
    ///
    /// # Errors
    /// [`field::Error::Bundle`] with the field and what it must be.
    pub(super) fn check(&self) -> Result<()> {
        check(
            self.dt_s > 0.0 && self.dt_s <= 10.0,
            "dt_s",
            "must be positive and at most 10 s",
        )?;
        check(self.length_unit == "mm", "length_unit", "must be `mm`")?;
        check(self.force_unit == "mN", "force_unit", "must be `mN`")?;
        self.material.validate().map_err(|error| {
            bad(
                &format!("material.{}", error.field),
                format!("is {}; it must be {}", error.value, error.wanted),
            )
        })?;
        check(
            (0.0..=1.0).contains(&self.rest_displacement_mm),
            "rest_displacement_mm",
            "must be in [0, 1] mm",
        )?;
        let gravity = self.gravity_at_rest_m_s2;
        check(
            gravity.iter().all(|g| g.abs() <= LARGEST_GRAVITY),
            "gravity_at_rest_m_s2",
            "must be three numbers of at most 1000 m/s²",
        )?;
        check(
            self.precisions.iter().any(|one| one == "f32"),
            "precisions",
            "must list `f32`, which every bundle has",
        )?;
        for one in &self.precisions {
            check(
                ["f32", "f16", "int8"].contains(&one.as_str()),
                "precisions",
                "may list `f32`, `f16`, `int8`",
            )?;
        }
        check(
            self.mesh.nodes >= 4 && self.mesh.nodes < i32::MAX as usize,
            "mesh.nodes",
            "must be at least 4",
        )?;
        self.envelope.check()?;
        if let Some(corrections) = &self.corrections {
            check(
                corrections.recommended <= MOST_CORRECTIONS,
                "corrections.recommended",
                "must be at most 64",
            )?;
            check(
                corrections.target_mm.is_finite() && corrections.target_mm >= 0.0,
                "corrections.target_mm",
                "must be zero or positive",
            )?;
            check(
                (1..=MOST_SUBSTEPS).contains(&corrections.substeps),
                "corrections.substeps",
                "must be 1 to 8",
            )?;
            check(
                corrections.calibration.is_finite() && corrections.calibration > 0.0,
                "corrections.calibration",
                "must be positive",
            )?;
            if let Some(step_s) = corrections.frame_step_s {
                check(
                    (SHORTEST_STEP_S..=LONGEST_STEP_S).contains(&step_s),
                    "corrections.frame_step_s",
                    "must be 0.01 to 0.05",
                )?;
                check(
                    corrections.recommended > 0,
                    "corrections.frame_step_s",
                    "needs corrections that the bundle recommends (field `corrections.recommended`)",
                )?;
            }
            check(
                self.prior.is_some(),
                "corrections",
                "needs a linear response (field `prior`)",
            )?;
        }
        if let Some(body) = &self.body {
            check_name(body, "body")?;
        }
        for (name, entry) in &self.files {
            check_name(name, &format!("files.{name}"))?;
            check(
                entry.sha256.len() == 64 && entry.sha256.bytes().all(|b| b.is_ascii_hexdigit()),
                &format!("files.{name}.sha256"),
                "must be 64 hex digits",
            )?;
        }
        self.listed(&self.mesh.file, "mesh.file")?;
        if let Some(whole) = (self.corrections.as_ref()).and_then(|own| own.whole.as_ref()) {
            self.listed(whole, "corrections.whole")?;
        }
        if let Some(prior) = &self.prior {
            self.listed(&prior.file, "prior.file")?;
            if let Some(residual) = &prior.residual {
                self.listed(residual, "prior.residual")?;
                check(
                    self.reduced.is_some(),
                    "prior.residual",
                    "needs a learned map (field `reduced`)",
                )?;
            }
            if let Some(vibration) = &prior.vibration {
                self.listed(vibration, "prior.vibration")?;
                let swings = match self.kind {
                    ManifestKind::Upt => true,
                    ManifestKind::Reduced => self.reduced.is_none(),
                };
                check(
                    swings,
                    "prior.vibration",
                    "in kind `reduced` it is allowed only without a learned map (field `reduced`)",
                )?;
            }
            if let Some(release) = &prior.release {
                self.listed(release, "prior.release")?;
                let swings = match self.kind {
                    ManifestKind::Upt => false,
                    ManifestKind::Reduced => prior.vibration.is_some(),
                };
                check(
                    swings,
                    "prior.release",
                    "needs the free vibration of kind `reduced` (field `prior.vibration`)",
                )?;
            }
        }
        match self.kind {
            ManifestKind::Upt => {
                let upt = self
                    .upt
                    .as_ref()
                    .ok_or_else(|| bad("upt", "is missing; kind `upt` needs it"))?;
                upt.check()?;
                for file in ["embed.onnx", "latent.onnx", "decoder.onnx"] {
                    self.listed(file, "files")?;
                }
                self.listed(&upt.weights, "upt.weights")?;
                if let Some(anchors) = &upt.anchors {
                    self.listed(anchors, "upt.anchors")?;
                }
                check(
                    !upt.needs_prior() || self.prior.is_some(),
                    "prior",
                    "is missing; the features or the base need it",
                )
            }
            ManifestKind::Reduced => {
                match &self.reduced {
                    Some(reduced) => {
                        reduced.check()?;
                        self.listed("latent.onnx", "files")?;
                    }
                    None => check(
                        self.prior
                            .as_ref()
                            .is_none_or(|prior| prior.vibration.is_some()),
                        "reduced",
                        "is missing; kind `reduced` needs it, or a free vibration in its place (field `prior.vibration`)",
                    )?,
                }
                check(
                    self.prior.is_some(),
                    "prior",
                    "is missing; kind `reduced` needs it",
                )
            }
        }
    }

    fn listed(&self, file: &str, field: &str) -> Result<()> {
        check_name(file, field)?;
        check(
            self.files.contains_key(file),
            field,
            &format!("names `{file}`, which is not in `files`"),
        )
    }
}

/// A file of a bundle lies in its folder, and its body beside it: one plain name.
fn check_name(name: &str, field: &str) -> Result<()> {
    let plain =
        !name.is_empty() && !name.contains(['/', '\\', ':', '\0']) && name != "." && name != "..";
    check(plain, field, "must be a plain file name")
}

impl Envelope {
    fn check(&self) -> Result<()> {
        // No tissue is longer than the largest input.
        let positive = |x: f32| x > 0.0 && x <= INPUT_LIMIT;
        check(
            positive(self.max_push_mm),
            "envelope.max_push_mm",
            "must be positive and at most 1e6 mm",
        )?;
        check(
            positive(self.max_push_rate_mm),
            "envelope.max_push_rate_mm",
            "must be positive and at most 1e6 mm",
        )?;
        let [low, high] = self.contact_area_mm2;
        check(
            low >= 0.0 && high.is_finite() && low <= high,
            "envelope.contact_area_mm2",
            "must be a range [low, high]",
        )?;
        check(
            (1..=1 << 20).contains(&self.max_sites),
            "envelope.max_sites",
            "must be in 1..=1048576",
        )?;
        check(
            positive(self.displacement_bound_mm),
            "envelope.displacement_bound_mm",
            "must be positive and at most 1e6 mm",
        )?;
        self.tools.as_ref().map_or(Ok(()), ToolEnvelope::check)
    }
}

impl ToolEnvelope {
    fn check(&self) -> Result<()> {
        let positive = |x: f32| x > 0.0 && x <= INPUT_LIMIT;
        check(
            (1..=MOST_CORRECTIONS).contains(&self.corrections),
            "envelope.tools.corrections",
            "must be in 1..=64",
        )?;
        let [low, high] = self.size_mm;
        check(
            positive(low) && positive(high) && low <= high,
            "envelope.tools.size_mm",
            "must be a range [low, high] of positive lengths",
        )?;
        check(
            positive(self.depth_mm),
            "envelope.tools.depth_mm",
            "must be positive and at most 1e6 mm",
        )?;
        check(
            positive(self.speed_mm_s),
            "envelope.tools.speed_mm_s",
            "must be positive and at most 1e6 mm/s",
        )?;
        check(
            (1..=1 << 20).contains(&self.max_tools),
            "envelope.tools.max_tools",
            "must be in 1..=1048576",
        )
    }
}

impl UptEntry {
    fn check(&self) -> Result<()> {
        check(
            !self.features.is_empty(),
            "upt.features",
            "must not be empty",
        )?;
        for (i, feature) in self.features.iter().enumerate() {
            check(
                !self.features[..i].contains(feature),
                "upt.features",
                "holds a feature twice",
            )?;
        }
        for axis in 0..3 {
            check(
                self.normalisation.mean[axis].is_finite(),
                "upt.normalisation.mean",
                "must be finite",
            )?;
            check(
                self.normalisation.std[axis].is_finite() && self.normalisation.std[axis] > 0.0,
                "upt.normalisation.std",
                "must be positive",
            )?;
        }
        let coordinates = &self.coordinates;
        check(
            coordinates.offset.iter().all(|x| x.is_finite()),
            "upt.coordinates.offset",
            "must be finite",
        )?;
        check(
            coordinates.scale.is_finite() && coordinates.scale > 0.0,
            "upt.coordinates.scale",
            "must be positive",
        )?;
        let graph = &self.graph;
        check(
            graph.radius_mm.is_finite() && graph.radius_mm > 0.0,
            "upt.graph.radius_mm",
            "must be positive",
        )?;
        check(
            (1..=4096).contains(&graph.max_degree),
            "upt.graph.max_degree",
            "must be in 1..=4096",
        )?;
        check(
            (1..=1 << 20).contains(&graph.supernodes),
            "upt.graph.supernodes",
            "must be in 1..=1048576",
        )?;
        check(
            (0.0..=1.0).contains(&graph.domain_fraction),
            "upt.graph.domain_fraction",
            "must be in [0, 1]",
        )?;
        let dims = &self.dims;
        for (name, value) in [
            ("encoder", dims.encoder),
            ("latent_tokens", dims.latent_tokens),
            ("decoder", dims.decoder),
            ("decoder_heads", dims.decoder_heads),
            ("decoder_mlp", dims.decoder_mlp),
        ] {
            check(
                (1..=65536).contains(&value),
                &format!("upt.dims.{name}"),
                "must be in 1..=65536",
            )?;
        }
        check(
            dims.query == 2 * dims.decoder,
            "upt.dims.query",
            "must be twice `upt.dims.decoder`",
        )?;
        check(
            dims.decoder.is_multiple_of(dims.decoder_heads),
            "upt.dims.decoder_heads",
            "must divide `upt.dims.decoder`",
        )
    }
}

impl ReducedEntry {
    fn check(&self) -> Result<()> {
        check(
            (1..=65536).contains(&self.modes),
            "reduced.modes",
            "must be in 1..=65536",
        )?;
        check(
            self.response_modes <= 65536,
            "reduced.response_modes",
            "must be at most 65536",
        )?;
        check(
            !self.inputs.is_empty(),
            "reduced.inputs",
            "must not be empty",
        )?;
        check(
            self.bound.relative.is_finite() && self.bound.relative >= 0.0,
            "reduced.bound.relative",
            "must not be negative",
        )?;
        check(
            (0.0..1.0).contains(&self.bound.decay),
            "reduced.bound.decay",
            "must be in [0, 1)",
        )?;
        let fade = &self.fade;
        check(
            fade.start_push_mm.is_finite()
                && fade.start_push_mm >= 0.0
                && fade.end_push_mm.is_finite()
                && fade.end_push_mm > fade.start_push_mm,
            "reduced.fade",
            "must have 0 <= start_push_mm < end_push_mm",
        )
    }
}
