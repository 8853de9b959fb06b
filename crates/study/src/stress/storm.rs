//! A storm for the corrections: thousands of contacts that no hand makes, for several numbers of corrections. Expected: no NaN, no
//! element that stays inside out once nothing touches the tissue, no such element without a flag while something does, and
//! rest afterwards.

use std::sync::Arc;

use anyhow::Result;
use tissue::contact::Patch;
use tissue::schemes::SplitMix;
use upt::{Contact, Corrections, Error, Scene, SceneOptions, flag};

use super::Row;
use crate::bench::{Bench, Touch, largest, names, push};
use yardstick::yard::Yard;

/// Corrections a step.
const COUNTS: [u32; 4] = [1, 3, 5, 10];
/// Steps from a release after which no element may be inside out: the guard's fallback has had its chance.
const CHANCE: usize = 3;
/// Deepest push, mm, whatever the training.
const DEEP_MM: f64 = 40.0;
/// Steps without contact at the end, and how near to rest they must lead, mm.
const REST_STEPS: usize = 400;
const REST_MM: f32 = 0.05;

/// What a storm came to.
#[derive(Default)]
struct Storm {
    steps: usize,
    refused: usize,
    fell_back: usize,
    largest: f32,
    det: f64,
    /// Steps in contact with an element inside out, and those of them without a flag.
    inverted: usize,
    silent: usize,
    /// Longest run of steps without contact with an element inside out.
    stuck: usize,
    not_finite: usize,
    flags: u32,
    other: Option<String>,
}

/// A kind of contact, for some steps.
#[derive(Clone, Copy)]
enum Gust {
    /// A push of up to 40 mm at one site.
    Deep,
    /// Another site each step.
    Teleport,
    /// So many times the push of the training.
    Beyond(f64),
    /// Other nodes of one site each step.
    Flicker,
    /// Each node its own way.
    Noise,
    /// Two sites at once.
    Two,
    /// Nothing touches.
    Calm,
}

const GUSTS: [Gust; 9] = [
    Gust::Deep,
    Gust::Calm,
    Gust::Teleport,
    Gust::Beyond(4.0),
    Gust::Flicker,
    Gust::Calm,
    Gust::Beyond(10.0),
    Gust::Noise,
    Gust::Two,
];

/// A row for each number of corrections.
pub(super) fn rows(bench: &Bench) -> Result<Vec<Row>> {
    let steps = bench.steps(10_000);
    if bench.model.manifest.corrections.is_none() {
        let why = "the bundle has no corrections";
        return Ok(vec![Row::left(&bench.subject, "a storm of contacts", why)]);
    }
    COUNTS.iter().map(|&k| row(bench, k, steps)).collect()
}

fn row(bench: &Bench, k: u32, steps: usize) -> Result<Row> {
    let options = SceneOptions {
        corrections: Corrections::Fixed(k),
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(&bench.model), &options)?;
    let yard = Yard::new(&bench.mesh, bench.boundary);
    let faces = bench.domain.face_count();
    let sites = (0..16).map(|at| bench.patch(at * faces / 16, bench.area));
    let sites = sites.collect::<Result<Vec<_>>>()?;
    let mut random = SplitMix(u64::from(k));
    let mut storm = Storm {
        det: 1.0,
        ..Storm::default()
    };
    let mut field = vec![[0.0f32; 3]; bench.mesh.node_count()];
    let mut inverted_for = 0;
    while storm.steps < steps && storm.other.is_none() {
        let gust = GUSTS[(random.unit() * GUSTS.len() as f64) as usize];
        let length = 1 + (random.unit() * 12.0) as usize;
        let site = &sites[(random.unit() * sites.len() as f64) as usize];
        let deep = DEEP_MM * random.unit();
        for step in 1..=length.min(steps - storm.steps) {
            let part = step as f64 / length as f64;
            let (nodes, vectors) = touch(bench, gust, &sites, site, deep * part, &mut random);
            storm.steps += 1;
            let contact = Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            };
            match scene.step(contact, Some(field.as_flattened_mut())) {
                Ok(()) => {}
                Err(Error::Guard(_)) => {
                    storm.refused += 1;
                    continue;
                }
                Err(error) => {
                    storm.other = Some(error.to_string());
                    break;
                }
            }
            let flags = scene.stats().flags;
            storm.flags |= flags;
            storm.fell_back += usize::from(flags & flag::FELL_BACK != 0);
            let size = largest(field.as_flattened());
            storm.not_finite += usize::from(!size.is_finite());
            storm.largest = storm.largest.max(size);
            let det = yard.smallest_det(&field);
            storm.det = storm.det.min(det);
            let is_inverted = det <= 0.0;
            if !nodes.is_empty() {
                inverted_for = 0;
                let told = flags & (flag::INVERTED | flag::FELL_BACK | flag::GROWTH) != 0;
                storm.inverted += usize::from(is_inverted);
                storm.silent += usize::from(is_inverted && !told);
            } else {
                inverted_for = if is_inverted { inverted_for + 1 } else { 0 };
                storm.stuck = storm.stuck.max(inverted_for);
            }
        }
    }
    for _ in 0..REST_STEPS {
        if let Err(error) = scene.step(Contact::None, Some(field.as_flattened_mut())) {
            storm.other.get_or_insert(format!("afterwards: {error}"));
        }
    }
    let left = largest(field.as_flattened());
    let good = storm.other.is_none()
        && storm.not_finite == 0
        && storm.silent == 0
        && storm.stuck <= CHANCE
        && left < REST_MM;
    let case = format!("a storm of {} contacts, {k} corrections", storm.steps);
    let text = format!("{}; {left:.3} mm left 20 s after", storm.text());
    Ok(Row::new(&bench.subject, &case, text, good))
}

impl Storm {
    fn text(&self) -> String {
        let mut text = format!(
            "|u| at most {:.1} mm, det F from {:.2}, inside out in contact {} ({} without a flag), at most {} steps in a row without contact, fell back {}, refused {}, not finite {}, flags {}",
            self.largest,
            self.det,
            self.inverted,
            self.silent,
            self.stuck,
            self.fell_back,
            self.refused,
            self.not_finite,
            names(self.flags)
        );
        if let Some(error) = &self.other {
            text += &format!("; error: {error}");
        }
        text
    }
}

/// Nodes and vectors of one step; `depth` in mm.
fn touch(
    bench: &Bench,
    gust: Gust,
    sites: &[Patch],
    site: &Patch,
    depth: f64,
    random: &mut SplitMix,
) -> Touch {
    let mut pick = |list: &[Patch]| (random.unit() * list.len() as f64) as usize;
    match gust {
        Gust::Calm => (Vec::new(), Vec::new()),
        Gust::Deep => push(site, site.inward, depth),
        Gust::Teleport => {
            let site = &sites[pick(sites)];
            push(site, site.inward, 0.5 * depth)
        }
        Gust::Beyond(factor) => {
            // As far as the number says, over the steps of the gust.
            let way = factor * f64::from(bench.max_push) * depth / DEEP_MM;
            push(site, site.inward, way)
        }
        Gust::Two => {
            let other = &sites[pick(sites)];
            let (mut nodes, mut vectors) = push(site, site.inward, 0.4 * depth);
            let (more, others) = push(other, other.inward, 0.3 * depth);
            for (node, vector) in more.into_iter().zip(others.chunks(3)) {
                if !nodes.contains(&node) {
                    nodes.push(node);
                    vectors.extend(vector);
                }
            }
            (nodes, vectors)
        }
        Gust::Flicker => {
            let (mut nodes, mut vectors) = (Vec::new(), Vec::new());
            let c = site.inward.map(|v| (0.5 * v * depth) as f32);
            for &node in &site.nodes {
                if random.unit() < 0.5 {
                    nodes.push(node);
                    vectors.extend(c);
                }
            }
            (nodes, vectors)
        }
        Gust::Noise => {
            let nodes = site.nodes.clone();
            let vectors = nodes
                .iter()
                .flat_map(|_| [0, 1, 2].map(|_| (0.5 * depth * (2.0 * random.unit() - 1.0)) as f32))
                .collect();
            (nodes, vectors)
        }
    }
}
