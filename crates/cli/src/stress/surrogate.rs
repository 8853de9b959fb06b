//! Stiff and extreme cases for a bundle. Expected: flags when and only when the contact is outside of what the model was
//! trained on, bounded states or a refusal with the last good state kept, and recovery afterwards.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use tissue::contact::{ContactDomain, Patch};
use tissue::mesh::{Boundary, Mesh};
use tissue::schemes::{Programme, Scheme};
use upt::{Contact, Error, Model, ModelOptions, Scene, SceneOptions, StepInput, flag};

use super::{Row, progress};

/// A bundle on the bench.
struct Bench {
    subject: String,
    model: Arc<Model>,
    mesh: Mesh,
    boundary: Boundary,
    domain: ContactDomain,
    max_push: f32,
    bound: f32,
    area: f64,
    quick: bool,
}

/// Nodes and vectors of a step's contact.
type Touch = (Vec<u32>, Vec<f32>);

/// What a run of steps came to.
#[derive(Default)]
struct Run {
    flags: u32,
    largest: f32,
    refused: usize,
    finite: bool,
    other: Option<String>,
}

impl Run {
    fn text(&self) -> String {
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

    fn sound(&self, bound: f32) -> bool {
        self.finite && self.other.is_none() && self.largest <= bound
    }
}

fn names(flags: u32) -> String {
    const NAMES: [(u32, &str); 11] = [
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

fn largest(field: &[f32]) -> f32 {
    field.iter().fold(
        0.0,
        |m, v| if v.is_nan() { f32::NAN } else { m.max(v.abs()) },
    )
}

impl Bench {
    fn open(path: &Path, quick: bool) -> Result<Self> {
        let model = Model::open(
            path,
            &ModelOptions {
                threads: 1,
                ..Default::default()
            },
        )?;
        let text = std::fs::read_to_string(path.join("bundle.json"))?;
        let manifest: serde_json::Value = serde_json::from_str(&text)?;
        let mesh = Mesh::read(&path.join("mesh.safetensors"))?;
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
        Ok(Self {
            subject: manifest["name"].as_str().unwrap_or("bundle").to_string(),
            domain: ContactDomain::new(&mesh, boundary)?,
            max_push: number("/envelope/max_push_mm")? as f32,
            bound: number("/envelope/displacement_bound_mm")? as f32,
            area: 0.4 * (low + high),
            model,
            mesh,
            boundary,
            quick,
        })
    }

    fn scene(&self) -> Result<Scene> {
        Ok(Scene::new(
            Arc::clone(&self.model),
            &SceneOptions::default(),
        )?)
    }

    fn steps(&self, full: usize) -> usize {
        if self.quick {
            (full / 20).max(40)
        } else {
            full
        }
    }

    fn row(&self, case: &str, run: &Run, good: bool) -> Row {
        Row::new(&self.subject, case, run.text(), good)
    }

    fn patch(&self, seed: usize, area: f64) -> Result<Patch> {
        let count = self.domain.face_count();
        for offset in 0..count {
            if let Ok(patch) = self.domain.grow((seed + 7 * offset) % count, area) {
                return Ok(patch);
            }
        }
        anyhow::bail!("no patch of {area:.0} mm² fits into the domain")
    }

    fn central(&self) -> Result<Patch> {
        let centroids = self.domain.centroids();
        let n = centroids.len() as f64;
        let middle = [0, 1, 2].map(|k| centroids.iter().map(|c| c[k]).sum::<f64>() / n);
        let distance = |c: &[f64; 3]| (0..3).map(|k| (c[k] - middle[k]).powi(2)).sum::<f64>();
        let seed = (0..centroids.len())
            .min_by(|&a, &b| distance(&centroids[a]).total_cmp(&distance(&centroids[b])))
            .context("the bundle's mesh has no domain")?;
        self.patch(seed, self.area)
    }

    /// Steps a scene; the guard's refusals count, other errors end the run.
    fn run(&self, scene: &Scene, steps: usize, mut touch: impl FnMut(usize) -> Touch) -> Run {
        let mut run = Run {
            finite: true,
            ..Run::default()
        };
        let mut field = vec![0.0; 3 * self.mesh.node_count()];
        for step in 1..=steps {
            let (nodes, vectors) = touch(step);
            let contact = Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            };
            match scene.step(
                StepInput {
                    displacement: None,
                    contact,
                },
                Some(&mut field),
            ) {
                Ok(()) => {
                    let size = largest(&field);
                    run.finite &= size.is_finite();
                    run.largest = run.largest.max(size);
                    run.flags |= scene.stats().flags;
                }
                Err(Error::Guard(_)) => run.refused += 1,
                Err(error) => {
                    run.other = Some(error.to_string());
                    break;
                }
            }
        }
        run
    }

    /// After any case: without contact the tissue comes back to rest, and a reset scene repeats a fresh one.
    fn recovers(&self, scene: &Scene) -> Result<bool> {
        let run = self.run(scene, 400, |_| (Vec::new(), Vec::new()));
        let mut field = vec![0.0; 3 * self.mesh.node_count()];
        scene.read(&mut field)?;
        Ok(run.finite && run.other.is_none() && largest(&field) < 0.05)
    }
}

fn push(patch: &Patch, direction: [f64; 3], depth: f64) -> Touch {
    let c = direction.map(|v| (v * depth) as f32);
    (
        patch.nodes.clone(),
        patch.nodes.iter().flat_map(|_| c).collect(),
    )
}

/// A depth that rises within ten steps, as slowly as the envelope allows.
fn ramp(step: usize, depth: f64) -> f64 {
    depth * (step as f64 / 10.0).min(1.0)
}

/// All cases of the bundle at `path`.
pub fn rows(path: &Path, quick: bool) -> Result<Vec<Row>> {
    let bench = Bench::open(path, quick)?;
    let bar = progress(6, &bench.subject);
    let mut rows = inside(&bench)?;
    bar.inc(1);
    rows.extend(long_runs(&bench)?);
    bar.inc(2);
    rows.extend(outside(&bench)?);
    bar.inc(1);
    rows.extend(bad_inputs(&bench)?);
    bar.inc(1);
    rows.extend(same_bits(&bench)?);
    bar.finish_and_clear();
    Ok(rows)
}

/// No false alarm on the schemes that the model was trained on.
fn inside(bench: &Bench) -> Result<Vec<Row>> {
    let cases = if bench.quick { 1 } else { 4 };
    let mut worst = Run {
        finite: true,
        ..Run::default()
    };
    for scheme in [Scheme::One, Scheme::Two, Scheme::Three, Scheme::Four] {
        for case in 0..cases {
            let scene = bench.scene()?;
            let programme = Programme::new(scheme, &bench.domain, 9_000 + case)?;
            let run = bench.run(&scene, 160, |step| of_programme(&programme, step));
            worst.flags |= run.flags;
            worst.largest = worst.largest.max(run.largest);
            worst.refused += run.refused;
            worst.finite &= run.finite;
            worst.other = worst.other.or(run.other);
        }
    }
    let alarms = worst.flags & !(flag::CLAMPED | flag::REGULARISED);
    let good = worst.sound(bench.bound) && alarms == 0 && worst.refused == 0;
    Ok(vec![bench.row(
        &format!("schemes 1 to 4, {} new cases: no alarm", 4 * cases),
        &worst,
        good,
    )])
}

fn of_programme(programme: &Programme, step: usize) -> Touch {
    let contact = programme.contact(step);
    (
        contact.iter().map(|c| c.node).collect(),
        contact.iter().flat_map(|c| c.displacement).collect(),
    )
}

fn long_runs(bench: &Bench) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    // Random cases of all schemes, one after another, without a reset.
    let steps = bench.steps(10_000);
    let scene = bench.scene()?;
    let mut first = 0.0f32;
    let mut seed = 0;
    let mut programme = Programme::new(Scheme::One, &bench.domain, seed)?;
    let all = [
        Scheme::One,
        Scheme::Two,
        Scheme::Three,
        Scheme::Four,
        Scheme::Five,
    ];
    let chunk = 160;
    let mut total = Run {
        finite: true,
        ..Run::default()
    };
    for start in (0..steps).step_by(chunk) {
        seed += 1;
        if let Ok(next) = Programme::new(all[seed as usize % 5], &bench.domain, 40_000 + seed) {
            programme = next;
        }
        let run = bench.run(&scene, chunk.min(steps - start), |step| {
            of_programme(&programme, step)
        });
        if start < steps / 4 {
            first = first.max(run.largest);
        }
        total.flags |= run.flags;
        total.largest = total.largest.max(run.largest);
        total.refused += run.refused;
        total.finite &= run.finite;
        total.other = total.other.or(run.other);
    }
    let grown = total.largest > (1.5 * first).max(1.2 * bench.max_push);
    rows.push(bench.row(
        &format!("{steps} random steps of all schemes"),
        &total,
        total.sound(bench.bound) && !grown && total.refused == 0,
    ));

    let patch = bench.central()?;
    let scene = bench.scene()?;
    let depth = 0.7 * f64::from(bench.max_push);
    let mut early = vec![0.0; 3 * bench.mesh.node_count()];
    let mut late = early.clone();
    let hold = bench.steps(12_000);
    let mut run = bench.run(&scene, 100, |step| {
        push(&patch, patch.inward, ramp(step, depth))
    });
    scene.read(&mut early)?;
    let more = bench.run(&scene, hold, |_| push(&patch, patch.inward, depth));
    scene.read(&mut late)?;
    run.largest = run.largest.max(more.largest);
    run.refused += more.refused;
    run.flags |= more.flags;
    let drift = early
        .iter()
        .zip(&late)
        .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    let row = bench.row(
        &format!("hold for {:.0} s", hold as f64 * 0.05),
        &run,
        run.sound(bench.bound) && drift < 0.5,
    );
    rows.push(Row {
        happened: format!("{}, drift {drift:.3} mm", row.happened),
        ..row
    });

    let mut run = Run {
        finite: true,
        ..Run::default()
    };
    let free = bench.run(&scene, 400, |_| (Vec::new(), Vec::new()));
    run.largest = free.largest;
    scene.read(&mut late)?;
    let rest = largest(&late);
    let good = free.sound(bench.bound) && rest == 0.0 && scene.stats().sleeping;
    let row = bench.row("abrupt release, then 20 s", &run, good);
    rows.push(Row {
        happened: format!(
            "{}, {rest:.4} mm left, asleep: {}",
            row.happened,
            scene.stats().sleeping
        ),
        ..row
    });
    Ok(rows)
}

fn outside(bench: &Bench) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let patch = bench.central()?;
    let count = bench.domain.face_count();
    let push_mm = f64::from(bench.max_push);
    let limit = |depth: f64| bench.bound.max(3.0 * depth as f32);
    let mut add = |case: &str,
                   wanted: u32,
                   depth: f64,
                   steps: usize,
                   touch: &mut dyn FnMut(usize) -> Touch|
     -> Result<()> {
        let scene = bench.scene()?;
        let run = bench.run(&scene, steps, touch);
        let back = bench.recovers(&scene)?;
        let seen = wanted == 0 || run.flags & wanted != 0 || run.refused > 0;
        let row = bench.row(case, &run, run.sound(limit(depth)) && seen && back);
        rows.push(Row {
            happened: format!("{}; back to rest after: {back}", row.happened),
            ..row
        });
        Ok(())
    };
    for factor in [2.0, 4.0, 10.0] {
        let depth = factor * push_mm;
        add(
            &format!("push {factor} x beyond training"),
            flag::PUSH,
            depth,
            60,
            &mut |s| push(&patch, patch.inward, ramp(s, depth)),
        )?;
    }
    add("tangential contact", 0, push_mm, 60, &mut |s| {
        push(&patch, patch.tangents[0], ramp(s, 0.7 * push_mm))
    })?;
    add("pulling contact", 0, push_mm, 60, &mut |s| {
        push(&patch, patch.inward.map(|v| -v), ramp(s, 0.7 * push_mm))
    })?;
    let mut sites = Vec::new();
    for k in 0..8 {
        sites.push(bench.patch(k * count / 8, bench.area)?);
    }
    add(
        "teleporting instrument",
        flag::RATE,
        push_mm,
        80,
        &mut |s| {
            let site = &sites[s % sites.len()];
            push(site, site.inward, 0.7 * push_mm)
        },
    )?;
    let far = sites
        .iter()
        .max_by(|a, b| apart(a, &patch).total_cmp(&apart(b, &patch)))
        .context("no site")?;
    let shared = far.nodes.iter().any(|n| patch.nodes.contains(n));
    if shared {
        rows.push(Row::left(
            &bench.subject,
            "contact in two places",
            "the domain is too small for two patches",
        ));
    } else {
        let mut two = |s: usize| {
            let (mut nodes, mut vectors) = push(&patch, patch.inward, ramp(s, 0.6 * push_mm));
            let (more, others) = push(far, far.inward, ramp(s, 0.6 * push_mm));
            nodes.extend(more);
            vectors.extend(others);
            (nodes, vectors)
        };
        let scene = bench.scene()?;
        let run = bench.run(&scene, 60, &mut two);
        let good = run.sound(limit(push_mm)) && (run.flags & flag::SITES != 0 || run.refused > 0);
        rows.push(bench.row("contact in two places", &run, good));
    }
    let scene = bench.scene()?;
    let outsiders = outside_domain(bench, 12);
    let run = bench.run(&scene, 40, |s| {
        let depth = ramp(s, 5.0) as f32;
        (
            outsiders.clone(),
            outsiders.iter().flat_map(|_| [depth, 0.0, 0.0]).collect(),
        )
    });
    let good = run.sound(limit(push_mm)) && (run.flags & flag::SITE != 0 || run.refused > 0);
    rows.push(bench.row("contact outside of the trained domain", &run, good));
    let scene = bench.scene()?;
    let one = vec![patch.nodes[0]];
    let run = bench.run(&scene, 40, |s| {
        let c = patch.inward.map(|v| (v * ramp(s, 0.5 * push_mm)) as f32);
        (one.clone(), c.to_vec())
    });
    let good =
        run.sound(limit(push_mm)) && (run.flags & flag::CONTACT_AREA != 0 || run.refused > 0);
    rows.push(bench.row("one node in contact", &run, good));
    let scene = bench.scene()?;
    let mut everywhere: Vec<u32> = bench.mesh.surface.iter().flatten().copied().collect();
    everywhere.sort_unstable();
    everywhere.dedup();
    let run = bench.run(&scene, 3, |_| {
        (
            everywhere.clone(),
            everywhere.iter().flat_map(|_| [0.5, 0.0, 0.0]).collect(),
        )
    });
    let flagged = run.flags & (flag::CONTACT_AREA | flag::SITE) != 0
        || run.refused > 0
        || run.other.is_some();
    rows.push(bench.row(
        "all surface nodes in contact",
        &run,
        run.finite && flagged && run.largest <= limit(push_mm),
    ));
    Ok(rows)
}

fn apart(a: &Patch, b: &Patch) -> f64 {
    (0..3).map(|k| (a.site[k] - b.site[k]).powi(2)).sum()
}

/// Free surface nodes far from the domain, near each other.
fn outside_domain(bench: &Bench, count: usize) -> Vec<u32> {
    let held = bench.mesh.held_nodes(bench.boundary);
    let centroids = bench.domain.centroids();
    let distance = |node: u32| {
        let p = bench.mesh.positions[node as usize];
        centroids
            .iter()
            .map(|c| {
                (0..3)
                    .map(|k| (c[k] - f64::from(p[k])).powi(2))
                    .sum::<f64>()
            })
            .fold(f64::INFINITY, f64::min)
    };
    let mut nodes: Vec<u32> = bench
        .mesh
        .surface
        .iter()
        .flatten()
        .copied()
        .filter(|n| held.binary_search(n).is_err())
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    let Some(&centre) = nodes
        .iter()
        .max_by(|a, b| distance(**a).total_cmp(&distance(**b)))
    else {
        return Vec::new();
    };
    let p = bench.mesh.positions[centre as usize];
    let near = |n: &u32| {
        let q = bench.mesh.positions[*n as usize];
        (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f32>()
    };
    nodes.sort_by(|a, b| near(a).total_cmp(&near(b)));
    nodes.truncate(count);
    nodes.sort_unstable();
    nodes
}

fn bad_inputs(bench: &Bench) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let patch = bench.central()?;
    let k = 3 * bench.mesh.node_count();
    for (name, value) in [
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("1e30", 1e30),
    ] {
        let scene = bench.scene()?;
        bench.run(&scene, 20, |s| push(&patch, patch.inward, ramp(s, 5.0)));
        let (mut before, mut after) = (vec![0.0; k], vec![0.0; k]);
        scene.read(&mut before)?;
        let (nodes, mut vectors) = push(&patch, patch.inward, 5.0);
        vectors[1] = value;
        let in_contact = scene.step(
            StepInput {
                displacement: None,
                contact: Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                },
            },
            None,
        );
        let mut dense = vec![0.0; k];
        dense[4] = value;
        let in_field = scene.step(
            StepInput {
                displacement: Some(&dense),
                contact: Contact::None,
            },
            None,
        );
        scene.read(&mut after)?;
        let told = |r: &upt::Result<()>| {
            r.as_ref()
                .err()
                .map_or("accepted".to_string(), ToString::to_string)
        };
        let good = in_contact.is_err() && in_field.is_err() && before == after;
        let text = format!(
            "contact: {}; displacement: {}; state unchanged: {}",
            told(&in_contact),
            told(&in_field),
            before == after
        );
        rows.push(Row::new(
            &bench.subject,
            &format!("{name} in each input"),
            text,
            good,
        ));
    }
    let scene = bench.scene()?;
    let run = bench.run(&scene, 20, |_| {
        let (nodes, mut vectors) = push(&patch, patch.inward, 1.0);
        vectors.iter_mut().for_each(|v| *v *= 1e-41);
        (nodes, vectors)
    });
    rows.push(bench.row("denormals as contact", &run, run.sound(0.1)));

    // The host's own state: with noise of 0.1 mm, and 20 mm off.
    for (name, amplitude, offset) in [
        ("noise of 0.1 mm on the displacement input", 0.1, 0.0),
        ("displacement input off by 20 mm", 0.0, 20.0),
    ] {
        let scene = bench.scene()?;
        let mut field = vec![0.0f32; k];
        let mut run = Run {
            finite: true,
            ..Run::default()
        };
        let mut state = 1u64;
        for step in 1..=100 {
            let mut given = field.clone();
            for u in &mut given {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                *u += amplitude * ((state >> 40) as f32 / (1u64 << 23) as f32 - 1.0);
            }
            if offset != 0.0 && step == 30 {
                given.iter_mut().step_by(3).for_each(|u| *u += offset);
            }
            let (nodes, vectors) = push(
                &patch,
                patch.inward,
                ramp(step, 0.6 * f64::from(bench.max_push)),
            );
            let contact = Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            };
            match scene.step(
                StepInput {
                    displacement: Some(&given),
                    contact,
                },
                Some(&mut field),
            ) {
                Ok(()) => {
                    run.largest = run.largest.max(largest(&field));
                    run.finite &= largest(&field).is_finite();
                    run.flags |= scene.stats().flags;
                }
                Err(Error::Guard(_)) => run.refused += 1,
                Err(error) => run.other = Some(error.to_string()),
            }
        }
        let end = largest(&field);
        let row = bench.row(
            name,
            &run,
            run.sound(bench.bound.max(60.0)) && end < 2.0 * bench.max_push,
        );
        rows.push(Row {
            happened: format!("{}, {end:.2} mm at the end", row.happened),
            ..row
        });
    }
    rows.push(Row::left(
        &bench.subject,
        "float16 overflow",
        "float16 arithmetic runs on GPU providers only; tables in float16 hold at most 65,504",
    ));
    Ok(rows)
}

/// Regions that change each step, thread counts, reset: the same bits.
fn same_bits(bench: &Bench) -> Result<Vec<Row>> {
    let patch = bench.central()?;
    let k = 3 * bench.mesh.node_count();
    let depth = 0.7 * f64::from(bench.max_push);
    let mut fields = Vec::new();
    for threads in [1, 2, 4] {
        let scene = Scene::new(
            Arc::clone(&bench.model),
            &SceneOptions {
                threads,
                ..Default::default()
            },
        )?;
        bench.run(&scene, 30, |s| push(&patch, patch.inward, ramp(s, depth)));
        let mut field = vec![0.0f32; k];
        scene.read(&mut field)?;
        fields.push(field);
    }
    let equal = fields.iter().all(|f| f == &fields[0]);
    let mut rows = vec![Row::new(
        &bench.subject,
        "1, 2 and 4 threads",
        format!("the same bits: {equal}"),
        equal,
    )];

    let scene = bench.scene()?;
    for step in 1..=30 {
        let nodes: Vec<u32> = (0..bench.mesh.node_count() as u32)
            .filter(|n| n % 7 == step % 7)
            .collect();
        scene.set_region(if step % 3 == 0 { None } else { Some(&nodes) })?;
        let (nodes, vectors) = push(&patch, patch.inward, ramp(step as usize, depth));
        scene.step(
            StepInput {
                displacement: None,
                contact: Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                },
            },
            None,
        )?;
    }
    scene.set_region(None)?;
    let mut field = vec![0.0f32; k];
    scene.read(&mut field)?;
    let equal = field == fields[0];
    rows.push(Row::new(
        &bench.subject,
        "another region each step",
        format!("the same bits as all nodes: {equal}"),
        equal,
    ));

    scene.reset()?;
    bench.run(&scene, 30, |s| push(&patch, patch.inward, ramp(s, depth)));
    scene.read(&mut field)?;
    let equal = field == fields[0];
    rows.push(Row::new(
        &bench.subject,
        "reset, then again",
        format!("the same bits as a fresh scene: {equal}"),
        equal,
    ));
    Ok(rows)
}
