//! The solver's elements against closed forms: a rod in tension and compression, a cylinder in torsion.
//!
//! Equilibria of the elements in f64 ([`tissue::statics::relax`]), which the explicit solver reaches at the end of a long hold.

use anyhow::{Context, Result};
use elements::{Deformation, Law, Material, Moduli, Ogden, stress};
use tissue::mesh::{Mesh, regular_box};
use tissue::statics::relax;

use super::equilibrium::{ends, forces};
use super::section::Section;
use super::torsion::torsion;
use crate::fit::specimen::{held, limit};
use crate::materials;

/// Length and side of the rod, mm.
const ROD: [f32; 3] = [10.0, 10.0, 30.0];
/// Radius and length of the cylinder, mm, and its twist, 1/mm: a shear of 0.2 at its side.
const RADIUS: f64 = 5.0;
const LENGTH: f64 = 10.0;
const TWIST: f64 = 0.04;
/// Strain of the cylinder between plates.
const SQUEEZE: f64 = 0.1;
/// Cells across the cylinder, the second twice the first.
const CELLS: [usize; 2] = [10, 20];

/// Stress along a bar and its stretch across, free at its sides, from the law with its own compressibility.
fn bar(moduli: Moduli, stretch: f64) -> [f64; 2] {
    let of = |across: f64| {
        let f = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, stretch]];
        stress(&Deformation::of(f), moduli)
    };
    let (mut low, mut high) = (0.5, 2.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if of(middle)[0][0] < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    [of(low)[2][2], low]
}

/// Stress of the rod by the elements and in closed form, Pa.
fn rod(material: &Material, stretch: f64) -> Result<[f64; 2]> {
    let mesh = regular_box(ROD, [5, 5, 15])?;
    let [wanted, across] = bar(material.moduli(), stretch);
    let held = ends(&mesh, ROD[2]);
    // The ends where they belong, the inside a straight rod that has not contracted.
    let start: Vec<[f32; 3]> = (mesh.positions.iter().enumerate())
        .map(|(node, p)| {
            let end = held.iter().flatten().any(|h| *h as usize == node);
            let side = if end { (across - 1.0) as f32 } else { 0.0 };
            [side * p[0], side * p[1], (stretch - 1.0) as f32 * p[2]]
        })
        .collect();
    let u = relax(&mesh, &held.concat(), material, &start)?;
    let forces = forces(&mesh, material, &u);
    let pull: f64 = held[1].iter().map(|node| forces[*node as usize][2]).sum();
    Ok([1e3 * pull / f64::from(ROD[0] * ROD[1]), wanted])
}

/// A cylinder along z from a grid whose squares become circles.
fn cylinder(cells: usize) -> Result<Mesh> {
    let side = 2.0 * RADIUS as f32;
    let mut mesh = regular_box([side, side, LENGTH as f32], [cells; 3])?;
    for p in &mut mesh.positions {
        let (x, y) = (p[0] - RADIUS as f32, p[1] - RADIUS as f32);
        let part = x.abs().max(y.abs()) / x.hypot(y).max(1e-6);
        [p[0], p[1]] = [x * part, y * part];
    }
    mesh.validate()?;
    Ok(mesh)
}

/// Torque (mN mm) and normal force (mN) of the twisted cylinder by the elements, its ends glued to turning plates.
fn twisted(material: &Material, cells: usize) -> Result<[f64; 2]> {
    let mesh = cylinder(cells)?;
    let held = ends(&mesh, LENGTH as f32);
    let start: Vec<[f32; 3]> = (mesh.positions.iter())
        .map(|p| {
            let (s, c) = (TWIST as f32 * p[2]).sin_cos();
            [c * p[0] - s * p[1] - p[0], s * p[0] + c * p[1] - p[1], 0.0]
        })
        .collect();
    let u = relax(&mesh, &held.concat(), material, &start)?;
    let forces = forces(&mesh, material, &u);
    let (mut torque, mut normal) = (0.0, 0.0);
    for node in &held[1] {
        let (p, u, f) = (
            mesh.positions[*node as usize].map(f64::from),
            u[*node as usize],
            forces[*node as usize],
        );
        torque += (p[0] + u[0]) * f[1] - (p[1] + u[1]) * f[0];
        normal += f[2];
    }
    Ok([torque, normal])
}

/// Force that presses the cylinder by a tenth of its length between plates that hold its ends, mN.
fn squeezed(material: &Material, cells: usize) -> Result<f64> {
    let mesh = cylinder(cells)?;
    let held = ends(&mesh, LENGTH as f32);
    let start: Vec<[f32; 3]> = (mesh.positions.iter())
        .map(|p| [0.0, 0.0, -SQUEEZE as f32 * p[2]])
        .collect();
    let u = relax(&mesh, &held.concat(), material, &start)?;
    let forces = forces(&mesh, material, &u);
    Ok(held[0].iter().map(|node| forces[*node as usize][2]).sum())
}

/// The same by the tetrahedra and by the body of revolution, both in the limit of two meshes.
pub fn squeezed_both(material: &Material) -> Result<[f64; 2]> {
    let [coarse, fine] = CELLS.map(|cells| squeezed(material, cells));
    let turned =
        [[10, 10], [20, 20]].map(|cells| held([RADIUS, 0.5 * LENGTH], material, SQUEEZE, 1, cells));
    let [few, many] = turned;
    Ok([limit(coarse?, fine?), limit(few?[0], many?[0])])
}

pub fn section() -> Result<Section> {
    let cortex = materials::law("cortex").map_err(anyhow::Error::msg)?;
    let laws = [("neo-Hookean", Law::default()), ("cortex", cortex)];
    let mut text =
        String::from("| case | law | solver | closed form | off |\n|---|---|---:|---:|---:|\n");
    let mut row = |case: &str, law: &str, unit: &str, [got, want]: [f64; 2]| {
        text += &format!(
            "| {case} | {law} | {got:.5} {unit} | {want:.5} {unit} | {:.2} % |\n",
            100.0 * (got / want - 1.0).abs()
        );
    };
    for (name, law) in laws {
        let material = Material::default().with_law(law);
        for stretch in [1.1, 0.9] {
            let case = format!("rod, stretch {stretch}");
            row(&case, name, "Pa", rod(&material, stretch)?);
        }
        // In terms, neo-Hookean too.
        let terms = match law {
            Law::Ogden(terms) => terms,
            _ => Ogden::new(&[[material.shear_pa(), 2.0]]).context("one term")?,
        };
        let want = torsion(&terms, RADIUS, TWIST);
        let [coarse, fine] = CELLS;
        let (coarse, fine) = (twisted(&material, coarse)?, twisted(&material, fine)?);
        let both = [0, 1].map(|k| limit(coarse[k], fine[k]));
        let [few, many] = CELLS.map(|cells| format!("{cells} elements across"));
        for (got, mesh) in [
            (coarse, few),
            (fine, many),
            (both, "both, in the limit".into()),
        ] {
            row(
                &format!("cylinder, {mesh}: torque"),
                name,
                "mN mm",
                [got[0], want[0]],
            );
            row(
                &format!("cylinder, {mesh}: normal force"),
                name,
                "mN",
                [got[1], want[1]],
            );
        }
    }
    Ok(Section {
        name: "closed forms",
        text,
        plots: Vec::new(),
    })
}
