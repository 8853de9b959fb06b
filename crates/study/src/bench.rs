//! A bundle on the bench of `upt-study stress`, `upt-study compare` and `upt-study soak`: its scenes, contact patches, and runs of steps with what they
//! came to.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use tissue::contact::{ContactDomain, Patch};
use tissue::mesh::{Boundary, Mesh};
use upt::{Contact, Corrections, Error, Model, ModelOptions, Scene, SceneOptions, StepInput, flag};

/// A bundle on the bench.
pub(crate) struct Bench {
    pub(crate) subject: String,
    pub(crate) model: Arc<Model>,
    pub(crate) mesh: Mesh,
    pub(crate) boundary: Boundary,
    pub(crate) domain: ContactDomain,
    pub(crate) max_push: f32,
    pub(crate) bound: f32,
    pub(crate) area: f64,
    /// Patches at once that the bundle was trained on.
    pub(crate) max_sites: usize,
    pub(crate) quick: bool,
    /// Of the scenes.
    pub(crate) corrections: Corrections,
}

/// Nodes and vectors of a step's contact.
pub(crate) type Touch = (Vec<u32>, Vec<f32>);

/// What a run of steps came to.
#[derive(Default)]
pub(crate) struct Run {
    pub(crate) flags: u32,
    pub(crate) largest: f32,
    pub(crate) refused: usize,
    pub(crate) finite: bool,
    pub(crate) other: Option<String>,
}

impl Run {
    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "|u| at most {:.2} mm, flags {}",
            self.largest,
            names(self.flags)
        );
        if self.refused > 0 {
            text += &format!(", {} steps refused by the guard", self.refused);
        }
        if let Some(error) = &self.other {
            text += &format!("; error: {error}");
        }
        text
    }

    /// Flags that say that the contact is outside the envelope, or that the guard refused a state.
    pub(crate) fn alarms(&self) -> u32 {
        self.flags & !(flag::CLAMPED | flag::REGULARISED)
    }

    pub(crate) fn sound(&self, bound: f32) -> bool {
        self.finite && self.other.is_none() && self.largest <= bound
    }
}

pub(crate) fn names(flags: u32) -> String {
    const NAMES: [(u32, &str); 16] = [
        (flag::PUSH, "push"),
        (flag::CONTACT_AREA, "area"),
        (flag::SITE, "site"),
        (flag::RATE, "rate"),
        (flag::SITES, "sites"),
        (flag::BOUND, "bound"),
        (flag::NON_FINITE, "non-finite"),
        (flag::INVERTED, "inverted"),
        (flag::GROWTH, "growth"),
        (flag::CLAMPED, "clamped"),
        (flag::REGULARISED, "regularised"),
        (flag::FELL_BACK, "fell-back"),
        (flag::ERROR, "error"),
        (flag::DEEP, "deep"),
        (flag::UNSOLVED, "unsolved"),
        (flag::ELASTIC, "elastic"),
    ];
    let set: Vec<&str> = NAMES
        .iter()
        .filter(|(bit, _)| flags & bit != 0)
        .map(|(_, n)| *n)
        .collect();
    if set.is_empty() {
        "none".into()
    } else {
        set.join("+")
    }
}

pub(crate) fn largest(field: &[f32]) -> f32 {
    field.iter().fold(
        0.0,
        |m, v| if v.is_nan() { f32::NAN } else { m.max(v.abs()) },
    )
}

impl Bench {
    pub(crate) fn open(path: &Path, quick: bool) -> Result<Self> {
        let model = Model::open(
            path,
            &ModelOptions {
                threads: 1,
                ..Default::default()
            },
        )?;
        let text = std::fs::read_to_string(path.join("bundle.json"))?;
        let manifest: serde_json::Value = serde_json::from_str(&text)?;
        let body = manifest["body"].as_str();
        let mesh = Mesh::read(&upt::bundle::file_of(path, body, "mesh.safetensors"))?;
        let boundary = match manifest["boundary"].as_str() {
            Some("supported") => Boundary::Supported,
            _ => Boundary::Fixed,
        };
        let number = |pointer: &str| {
            manifest
                .pointer(pointer)
                .and_then(serde_json::Value::as_f64)
                .with_context(|| {
                    format!(
                        "{}: field `{pointer}` is missing",
                        path.join("bundle.json").display()
                    )
                })
        };
        let (low, high) = (
            number("/envelope/contact_area_mm2/0")?,
            number("/envelope/contact_area_mm2/1")?,
        );
        let mut bench = Self {
            subject: manifest["name"].as_str().unwrap_or("bundle").to_string(),
            domain: ContactDomain::new(&mesh, boundary)?,
            max_push: number("/envelope/max_push_mm")? as f32,
            bound: number("/envelope/displacement_bound_mm")? as f32,
            area: 0.4 * (low + high),
            max_sites: number("/envelope/max_sites")? as usize,
            model,
            mesh,
            boundary,
            quick,
            corrections: Corrections::Recommended,
        };
        // The envelope counts the area around the nodes, which on a coarse mesh is well above that of the faces.
        while bench.area_of(&bench.central()?) > 0.9 * high && bench.area > 0.1 * low {
            bench.area *= 0.9;
        }
        Ok(bench)
    }

    /// Area around the nodes of a patch, mm², as the envelope has it.
    fn area_of(&self, patch: &Patch) -> f64 {
        let areas = &self.model.mesh.surface.node_area;
        let nodes = patch.nodes.iter();
        nodes.map(|node| f64::from(areas[*node as usize])).sum()
    }

    pub(crate) fn scene(&self) -> Result<Scene> {
        let options = SceneOptions {
            corrections: self.corrections,
            ..SceneOptions::default()
        };
        Ok(Scene::new(Arc::clone(&self.model), &options)?)
    }

    pub(crate) fn steps(&self, full: usize) -> usize {
        if self.quick {
            (full / 20).max(40)
        } else {
            full
        }
    }

    pub(crate) fn patch(&self, seed: usize, area: f64) -> Result<Patch> {
        let count = self.domain.face_count();
        for offset in 0..count {
            if let Ok(patch) = self.domain.grow((seed + 7 * offset) % count, area) {
                return Ok(patch);
            }
        }
        anyhow::bail!("no patch of {area:.0} mm² fits into the domain")
    }

    pub(crate) fn central(&self) -> Result<Patch> {
        let centroids = self.domain.centroids();
        let n = centroids.len() as f64;
        let middle = [0, 1, 2].map(|k| centroids.iter().map(|c| c[k]).sum::<f64>() / n);
        let distance = |c: &[f64; 3]| (0..3).map(|k| (c[k] - middle[k]).powi(2)).sum::<f64>();
        let seed = (0..centroids.len())
            .min_by(|&a, &b| distance(&centroids[a]).total_cmp(&distance(&centroids[b])))
            .context("the bundle's mesh has no domain")?;
        self.patch(seed, self.area)
    }

    /// Steps a scene; the guard's refusals count, other errors end the run, and so does a refusal that changes the state.
    pub(crate) fn run(
        &self,
        scene: &Scene,
        steps: usize,
        mut touch: impl FnMut(usize) -> Touch,
    ) -> Run {
        let mut run = Run {
            finite: true,
            ..Run::default()
        };
        let mut field = vec![0.0; 3 * self.mesh.node_count()];
        let mut kept = field.clone();
        if let Err(error) = scene.read(&mut field) {
            run.other = Some(error.to_string());
            return run;
        }
        for step in 1..=steps {
            let (nodes, vectors) = touch(step);
            let contact = Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            };
            match scene.step(StepInput::from(contact), Some(&mut field)) {
                Ok(()) => {
                    let size = largest(&field);
                    run.finite &= size.is_finite();
                    run.largest = run.largest.max(size);
                    run.flags |= scene.stats().flags;
                }
                Err(Error::Guard(_)) => {
                    run.refused += 1;
                    if scene.read(&mut kept).is_err() || kept != field {
                        run.other = Some("a refused step changed the state".into());
                        break;
                    }
                }
                Err(error) => {
                    run.other = Some(error.to_string());
                    break;
                }
            }
        }
        run
    }

    /// After any case: without contact the tissue comes back to rest, and a reset scene repeats a fresh one.
    pub(crate) fn recovers(&self, scene: &Scene) -> Result<bool> {
        let run = self.run(scene, 400, |_| (Vec::new(), Vec::new()));
        let mut field = vec![0.0; 3 * self.mesh.node_count()];
        scene.read(&mut field)?;
        Ok(run.finite && run.other.is_none() && largest(&field) < 0.05)
    }
}

pub(crate) fn push(patch: &Patch, direction: [f64; 3], depth: f64) -> Touch {
    let c = direction.map(|v| (v * depth) as f32);
    (
        patch.nodes.clone(),
        patch.nodes.iter().flat_map(|_| c).collect(),
    )
}

/// A depth that rises within ten steps, as slowly as the envelope allows.
pub(crate) fn ramp(step: usize, depth: f64) -> f64 {
    depth * (step as f64 / 10.0).min(1.0)
}
