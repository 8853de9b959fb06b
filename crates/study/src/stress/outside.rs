//! Contacts outside of what a bundle was trained on: flagged, bounded or refused, and recovered from.

use anyhow::{Context, Result};
use tissue::contact::Patch;
use upt::flag;

use super::Row;
use crate::bench::{Bench, Touch, push, ramp};

pub(super) fn rows(bench: &Bench) -> Result<Vec<Row>> {
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
        let seen = match wanted {
            0 => run.alarms() == 0 && run.refused == 0,
            _ => run.flags & wanted != 0 || run.refused > 0,
        };
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
    add("tangential contact: no alarm", 0, push_mm, 60, &mut |s| {
        push(&patch, patch.tangents[0], ramp(s, 0.7 * push_mm))
    })?;
    add("pulling contact: no alarm", 0, push_mm, 60, &mut |s| {
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
        // A bundle that knows two instruments must raise no alarm.
        let seen = match bench.max_sites {
            1 => run.flags & flag::SITES != 0 || run.refused > 0,
            _ => run.alarms() == 0 && run.refused == 0,
        };
        let good = run.sound(limit(push_mm)) && seen;
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
