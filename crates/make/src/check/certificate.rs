//! `certificate.json`: what was tested and how large the errors, forces and times are (`docs/guide/make.md`).

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use gauge::{Sorted, median};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tissue::mesh::Mesh;
use tissue::programmes::ToolProgramme;
use tissue::tensors::{f32_values, write_whole};
use upt::Model;

use super::case::no_time;
use super::score::{Part, Score};
use super::{page, verdict};
use ::page::Film;
use yardstick::machine::Machine;
use yardstick::tool_scale::Chosen;

/// A region with fewer steps than this says nothing.
const ENOUGH_STEPS: usize = 20;

/// The certificate, the root mean square error of each node in contact, mm, and the first case as a film.
pub struct Certificate {
    value: Value,
    node_errors: Vec<f32>,
    film: Value,
}

/// Four significant digits: what another machine finds too.
pub fn short(x: f64) -> Value {
    format!("{x:.3e}")
        .parse::<f64>()
        .map_or(Value::Null, |x| json!(x))
}

fn part(part: &Part) -> Value {
    json!({
        "steps": part.steps, "mse_mm2": short(part.mean(part.mse)), "linear_mse_mm2": short(part.mean(part.baseline)),
        "true_mean_square_mm2": short(part.mean(part.truth)), "max_mm": short(part.largest),
        "share_of_linear": short(part.mse / part.baseline.max(f64::MIN_POSITIVE)),
    })
}

impl Certificate {
    /// From the scores of the cases.
    pub fn of(
        model: &Model,
        mesh: &Mesh,
        seed: u64,
        scores: Vec<Score>,
        regions: usize,
        times: &[f64],
    ) -> Self {
        let (mut contact, mut free) = (Part::default(), Part::default());
        let mut by_region = vec![Part::default(); regions];
        let mut force = [0.0f64; 2];
        let mut ratios = Vec::new();
        let corrections: u64 = scores.iter().map(|score| score.corrections).sum();
        let mut node_errors = vec![0.0f64; mesh.node_count()];
        for score in &scores {
            contact.join(&score.contact);
            free.join(&score.free);
            by_region
                .iter_mut()
                .zip(&score.regions)
                .for_each(|(sum, part)| sum.join(part));
            (0..2).for_each(|k| force[k] += score.force[k]);
            ratios.extend(
                score
                    .estimates
                    .iter()
                    .map(|[estimate, truth]| truth / estimate),
            );
            node_errors
                .iter_mut()
                .zip(&score.nodes)
                .for_each(|(sum, e)| *sum += f64::from(*e));
        }
        let ratio = median(ratios);
        let seen: Vec<&Part> = by_region
            .iter()
            .filter(|part| part.steps >= ENOUGH_STEPS)
            .collect();
        let means: Vec<f64> = seen.iter().map(|part| part.mean(part.mse)).collect();
        let mean = means.iter().sum::<f64>() / means.len().max(1) as f64;
        let worst = means.iter().copied().fold(0.0, f64::max);
        let ms = Sorted::of(times);
        let known = |ms: f64| (!times.is_empty()).then(|| short(ms));
        let stated = &model.manifest;
        let unlearned = stated.reduced.is_none() && stated.upt.is_none();
        let value = json!({
            "format": "upt-certificate", "version": 1,
            "bundle": {"name": stated.name, "nodes": mesh.node_count(), "tetrahedra": mesh.tets.len(), "mesh_sha256": mesh.hash()},
            "tested": {
                "seed": seed, "cases": scores.len(), "against": tissue::simulate::SOLVER_NAME,
                "programmes": scores.iter().map(|score| json!({
                    "scheme": score.scheme, "seed": score.seed, "refused_steps": score.refused, "ended": score.ended,
                    "frames_in_time": score.ended.as_ref().filter(|why| **why == no_time(score.touches.len() + 1)).map(|_| score.touches.len()),
                    "contact": part(&score.contact), "free": part(&score.free),
                })).collect::<Vec<Value>>(),
                "corrections": stated.corrections.as_ref().map_or(0, |entry| entry.recommended),
                "corrections_target_mm": stated.corrections.as_ref().map_or(Value::Null, |entry| short(f64::from(entry.target_mm))),
                "corrections_mean": short(corrections as f64 / contact.steps.max(1) as f64),
                "linear_is": if unlearned { "linear elasticity, static in contact, swinging freely after it" } else { "the bundle without corrections" },
            },
            "contact": part(&contact),
            "free": part(&free),
            "regions": by_region.iter().map(part).collect::<Vec<Value>>(),
            "worst_region_over_mean": if means.is_empty() { Value::Null } else { short(worst / mean.max(f64::MIN_POSITIVE)) },
            "force_error": if force[1] > 0.0 { short((force[0] / force[1]).sqrt()) } else { Value::Null },
            "truth_over_estimate": if ratio.is_nan() { Value::Null } else { short(ratio) },
            "speed": {"threads": 1, "ms_median": known(ms.median()), "ms_p99": known(ms.quantile(0.99)), "steps_in_contact": times.len()},
            "machine": serde_json::to_value(Machine::this()).unwrap_or_default(),
            "envelope": {
                "max_push_mm": stated.envelope.max_push_mm, "contact_area_mm2": stated.envelope.contact_area_mm2,
                "material": stated.material, "laws": stated.laws,
            },
        });
        let steps = contact.steps.max(1) as f64;
        Self {
            value,
            node_errors: node_errors
                .iter()
                .map(|sum| (sum / steps).sqrt() as f32)
                .collect(),
            film: (scores.first().and_then(|score| score.film.as_ref()))
                .map_or(Value::Null, Film::json),
        }
    }

    /// Takes what a stage kept.
    pub fn read([path, errors, film]: &[PathBuf; 3]) -> Result<Self> {
        let text_of_film =
            std::fs::read(film).with_context(|| format!("{}: cannot be read", film.display()))?;
        let text =
            std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
        let bytes = std::fs::read(errors)
            .with_context(|| format!("{}: cannot be read", errors.display()))?;
        Ok(Self {
            value: serde_json::from_slice(&text).with_context(|| format!("{}", path.display()))?,
            node_errors: f32_values(&bytes).collect(),
            film: serde_json::from_slice(&text_of_film)
                .with_context(|| format!("{}", film.display()))?,
        })
    }

    /// Little-endian f32, mm.
    pub fn node_errors_bytes(&self) -> Vec<u8> {
        self.node_errors
            .iter()
            .flat_map(|e| e.to_le_bytes())
            .collect()
    }

    /// What rigid tools came to, a row a programme, and how large they were. Programmes that were `asked` for and have no row had no time.
    pub fn add_tools(&mut self, rows: Value, sizes: &Chosen, asked: &[ToolProgramme]) {
        let has_row = |name: &str| {
            let rows = rows.as_array().into_iter().flatten();
            rows.into_iter().any(|row| row["programme"] == name)
        };
        let left_out: Vec<&str> = (asked.iter().map(|programme| programme.name()))
            .filter(|name| !has_row(name))
            .collect();
        if !left_out.is_empty() {
            self.value["tools_left_out"] = json!(left_out);
        }
        self.value["tools"] = rows;
        self.value["tool_sizes"] = sizes.json();
    }

    /// What was asked for and had no time, a line each.
    pub fn left_out(&self, cases: Option<usize>) -> Vec<String> {
        let mut lines = Vec::new();
        let found = self.value["tested"]["cases"].as_u64().unwrap_or(0);
        if let Some(asked) = cases.filter(|&asked| asked as u64 > found) {
            lines.push(format!(
                "no time for {} of the {asked} --cases; a larger --minutes has it",
                asked as u64 - found
            ));
        }
        let left_out = self.value["tools_left_out"].as_array();
        let names: Vec<&str> = (left_out.into_iter().flatten())
            .filter_map(Value::as_str)
            .collect();
        if !names.is_empty() {
            lines.push(format!(
                "no time for --tools {}; a larger --minutes has it",
                names.join(",")
            ));
        }
        lines
    }

    /// The first case, for the page.
    pub fn film(&self) -> &Value {
        &self.film
    }

    /// The certificate.
    pub fn json(&self) -> &Value {
        &self.value
    }

    /// Mean squared error in contact, mm².
    pub fn mse_in_contact(&self) -> f64 {
        self.value["contact"]["mse_mm2"]
            .as_f64()
            .unwrap_or(f64::NAN)
    }

    /// The largest of that and of the errors of the programmes of tools, mm².
    pub fn worst_mse(&self) -> f64 {
        let rows = self.value["tools"].as_array().into_iter().flatten();
        rows.filter_map(|row| row["mse_mm2"].as_f64())
            .fold(self.mse_in_contact(), f64::max)
    }

    /// Time of a step in contact on one thread, ms.
    pub fn median_step_ms(&self) -> f64 {
        self.value["speed"]["ms_median"]
            .as_f64()
            .unwrap_or(f64::INFINITY)
    }

    /// What the estimated error should be multiplied by once more; none where nothing was corrected.
    pub fn calibration(&self) -> Option<f32> {
        let ratio = self.value["truth_over_estimate"].as_f64()?;
        (ratio.is_finite() && ratio > 0.0).then_some(ratio as f32)
    }

    /// Names the bundle as it is now, and where it came from.
    pub fn finish(&mut self, bundle: &Path, provenance: &Value) -> Result<()> {
        let path = bundle.join("bundle.json");
        let text =
            std::fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
        let digest: String = Sha256::digest(&text)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        self.value["bundle"]["sha256"] = json!(digest);
        self.value["library"] = json!(env!("CARGO_PKG_VERSION"));
        self.value["provenance"] = provenance.clone();
        Ok(())
    }

    /// Writes `certificate.json` and `certificate.html` into the bundle's folder; they are no part of the bundle.
    pub fn write(&self, bundle: &Path, mesh: &Mesh, facts: &[(String, String)]) -> Result<()> {
        let path = bundle.join("certificate.json");
        let text = format!("{:#}\n", self.value);
        write_whole(&path, |file| {
            std::io::Write::write_all(file, text.as_bytes())
        })
        .with_context(|| format!("{}: cannot be written", path.display()))?;
        page::write(
            &bundle.join("certificate.html"),
            &self.value,
            mesh,
            &self.node_errors,
            &self.film,
            facts,
        )
    }

    /// One line.
    pub fn words(&self) -> String {
        let contact = &self.value["contact"];
        format!(
            "{} held-out contacts: {} mm² in contact, {} times less than linear elasticity",
            self.value["tested"]["cases"],
            contact["mse_mm2"],
            contact["share_of_linear"]
                .as_f64()
                .map_or(f64::NAN, |share| (10.0 / share).round() / 10.0),
        )
    }

    /// Adds whether it is good enough.
    pub fn judge(&mut self) {
        self.value["verdict"] = verdict::of(&self.value);
    }

    /// A few lines.
    pub fn text(&self) -> String {
        let v = &self.value;
        let row = |name: &str, part: &Value| {
            format!(
                "{name:14} {:>11} mm²  linear elasticity {:>11}  share {:>10}  largest {} mm",
                part["mse_mm2"].to_string(),
                part["linear_mse_mm2"].to_string(),
                part["share_of_linear"].to_string(),
                part["max_mm"]
            )
        };
        let tools: String = v["tools"]
            .as_array()
            .into_iter()
            .flatten()
            .map(|row| {
                format!(
                    "\ntool {:9} {:>11} mm²  worst of {} {:>11}  force error {}, {} of {} steps inverted, {} mm in a tool at most",
                    row["programme"].as_str().unwrap_or_default(),
                    row["mse_mm2"].to_string(),
                    row["cases"],
                    row["worst_mse_mm2"].to_string(),
                    row["force_error"],
                    row["inverted_steps"],
                    row["steps"],
                    row["deepest_in_a_tool_mm"]
                )
            })
            .collect();
        let sizes = Chosen::stated(v).map_or(String::new(), |sizes| format!("\n{}", sizes.words()));
        let ended: String = v["tested"]["programmes"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|case| {
                let why = case["ended"].as_str()?;
                Some(format!(
                    "\nscheme {}, seed {}: ended early, {why}",
                    case["scheme"].as_str()?,
                    case["seed"]
                ))
            })
            .collect();
        format!(
            "{}\n{}\n{}\n{}{sizes}{tools}{ended}\nworst region over the mean {}, force error {}, {} ms a step (median, 1 thread), p99 {}",
            v["verdict"]["text"].as_str().unwrap_or_default(),
            self.words(),
            row("in contact", &v["contact"]),
            row("after release", &v["free"]),
            v["worst_region_over_mean"],
            v["force_error"],
            v["speed"]["ms_median"],
            v["speed"]["ms_p99"],
        )
    }
}
