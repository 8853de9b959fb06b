//! Human brain as it was tested: cubes of 5 mm whose ends are glued to plates, so that they barrel and waist; laws fitted inversely.
//!
//! Equilibria of the elements give the nominal stress of a specimen over that of a homogeneous bar or shear of the same law, at half and all of each curve's
//! strain. Linear in the strain between, it turns the data into what a homogeneous specimen would have shown, to which the law is fitted; then anew with
//! that law. Linear tetrahedra lock where ends are glued, so a factor is the limit of two meshes whose error falls with the square of the element.

use std::path::Path;

use anyhow::Result;
use elements::{Law, Material, Ogden};
use gauge::median;
use tissue::mesh::regular_box;
use tissue::statics::relax;

use super::equilibrium::{ends, forces};
use super::section::{Section, verdict};
use crate::fit::curve::{Curve, Mode, nominal_stress};
use crate::fit::data::{self, Sample};
use crate::fit::stretches::{Exponents, best};

/// Side of a specimen, mm.
const SIDE: f32 = 5.0;
/// Cells along a side, the second twice the first.
const CELLS: [usize; 2] = [5, 10];
/// Rounds of fit and equilibrium.
const ROUNDS: usize = 2;
/// R² of every curve that is promised.
const BAR: f64 = 0.90;

/// Factors at half and all of a curve's strain, and that strain.
#[derive(Clone, Copy)]
struct Shape {
    half: f64,
    whole: f64,
    strain: f64,
}

impl Shape {
    /// At a stretch or amount of shear.
    fn at(&self, mode: Mode, x: f64) -> f64 {
        let part = strain(mode, x) / self.strain;
        self.half + (2.0 * part - 1.0) * (self.whole - self.half)
    }
}

fn strain(mode: Mode, x: f64) -> f64 {
    if mode == Mode::Shear { x } else { x - 1.0 }
}

/// Nominal stress of a specimen, Pa.
fn glued(law: &Ogden, mode: Mode, x: f64, cells: usize) -> Result<f64> {
    let mesh = regular_box([SIDE; 3], [cells; 3])?;
    let material = Material::default().with_law(Law::Ogden(*law));
    let held = ends(&mesh, SIDE);
    let by = strain(mode, x) as f32;
    let axis = if mode == Mode::Shear { 0 } else { 2 };
    let start: Vec<[f32; 3]> = (mesh.positions.iter())
        .map(|p| {
            let mut u = [0.0; 3];
            u[axis] = by * p[2];
            u
        })
        .collect();
    let u = relax(&mesh, &held.concat(), &material, &start)?;
    let forces = forces(&mesh, &material, &u);
    let pull: f64 = held[1]
        .iter()
        .map(|node| forces[*node as usize][axis])
        .sum();
    Ok(1e3 * pull / f64::from(SIDE * SIDE))
}

/// The stress of a specimen over that of a homogeneous one.
fn shape(law: &Ogden, curve: &Curve) -> Result<Shape> {
    let strains = curve.points.iter().map(|[x, _]| strain(curve.mode, *x));
    let most = strains.fold(0.0f64, |m, e| if e.abs() > m.abs() { e } else { m });
    let factor = |e: f64| -> Result<f64> {
        let x = if curve.mode == Mode::Shear {
            e
        } else {
            1.0 + e
        };
        let coarse = glued(law, curve.mode, x, CELLS[0])?;
        let fine = glued(law, curve.mode, x, CELLS[1])?;
        Ok((fine + (fine - coarse) / 3.0) / nominal_stress(law, curve.mode, x))
    };
    Ok(Shape {
        half: factor(0.5 * most)?,
        whole: factor(most)?,
        strain: most,
    })
}

/// A law, the factors of its curves, and R² of each as a specimen.
struct Fit {
    law: Ogden,
    shapes: Vec<Shape>,
    r2: Vec<f64>,
}

/// `1 - sum (y - f)² / sum (y - mean)²` of a specimen.
fn r2(curve: &Curve, law: &Ogden, shape: &Shape) -> f64 {
    let as_homogeneous = Curve {
        mode: curve.mode,
        points: (curve.points.iter())
            .map(|[x, _]| {
                let stress = shape.at(curve.mode, *x) * nominal_stress(law, curve.mode, *x);
                [*x, stress]
            })
            .collect(),
    };
    let count = curve.points.len() as f64;
    let mean = curve.points.iter().map(|[_, y]| y).sum::<f64>() / count;
    let pairs = curve.points.iter().zip(&as_homogeneous.points);
    let left: f64 = pairs.map(|([_, y], [_, f])| (y - f).powi(2)).sum();
    let whole: f64 = curve.points.iter().map(|[_, y]| (y - mean).powi(2)).sum();
    1.0 - left / whole
}

fn fit(sample: &Sample) -> Result<Fit> {
    let mut law = best(&sample.curves[..], &Exponents::Free(1))?;
    let shapes = |law: &Ogden| -> Result<Vec<Shape>> {
        sample
            .curves
            .iter()
            .map(|curve| shape(law, curve))
            .collect()
    };
    let mut own = shapes(&law)?;
    for _ in 0..ROUNDS {
        let freed: Vec<Curve> = (sample.curves.iter().zip(&own))
            .map(|(curve, shape)| Curve {
                mode: curve.mode,
                points: (curve.points.iter())
                    .map(|[x, y]| [*x, y / shape.at(curve.mode, *x)])
                    .collect(),
            })
            .collect();
        law = best(&freed[..], &Exponents::Free(1))?;
        own = shapes(&law)?;
    }
    let curves = sample.curves.iter().zip(&own);
    Ok(Fit {
        r2: curves
            .map(|(curve, shape)| r2(curve, &law, shape))
            .collect(),
        shapes: own,
        law,
    })
}

pub fn section(path: &Path) -> Result<Section> {
    let samples = data::read(path)?;
    let modes: Vec<&str> = samples[0].curves.iter().map(|c| c.mode.as_str()).collect();
    let mut text = format!(
        "| region | shear modulus, kPa: homogeneous | glued | alpha: homogeneous | glued | R² glued: {} | stress over homogeneous: {} |\n|---|---:|---:|---:|---:|{}\n",
        modes.join(" | "),
        modes.join(" | "),
        "---:|".repeat(2 * modes.len())
    );
    let mut all = Vec::new();
    for sample in &samples {
        let plain = best(&sample.curves[..], &Exponents::Free(1))?;
        let found = fit(sample)?;
        let alpha = |law: &Ogden| law.terms.iter().next().map_or(0.0, |term| term.alpha);
        let list = |values: Vec<f64>| -> String {
            let cells: Vec<String> = values.iter().map(|v| format!("{v:.3}")).collect();
            cells.join(" | ")
        };
        text += &format!(
            "| {} | {:.2} | {:.2} | {:.1} | {:.1} | {} | {} |\n",
            sample.name,
            1e-3 * plain.shear_pa(),
            1e-3 * found.law.shear_pa(),
            alpha(&plain),
            alpha(&found.law),
            list(found.r2.clone()),
            list(found.shapes.iter().map(|shape| shape.whole).collect()),
        );
        all.extend(found.r2);
    }
    let worst = all.iter().copied().fold(f64::INFINITY, f64::min);
    text += &format!(
        "\n| glued specimens, Ogden, 1 term | R² of all curves, worst | median | bar 0.90 |\n|---|---:|---:|---|\n| {} curves | {worst:.3} | {:.3} | {} |\n",
        all.len(),
        median(&all),
        verdict(worst >= BAR)
    );
    Ok(Section {
        name: "specimens",
        text,
        plots: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::{Shape, r2, shape};
    use crate::fit::curve::{Curve, Mode, nominal_stress};
    use elements::Ogden;

    /// Glued ends stiffen a neo-Hookean cube in compression, and a cube between plates bends as it is sheared: beyond `1 / (6/5 + 1/3)` = 0.65, what
    /// Timoshenko's beam has whose ends may warp.
    #[test]
    fn glued_ends_stiffen_a_cube_and_leave_its_shear_softer() {
        let law = Ogden::new(&[[1000.0, 2.0]]).unwrap();
        let of = |mode, x: f64| {
            let points = vec![[x, nominal_stress(&law, mode, x)]];
            shape(&law, &Curve { mode, points }).unwrap()
        };
        let pressed = of(Mode::Compression, 0.95);
        assert!((1.1..1.5).contains(&pressed.whole), "{}", pressed.whole);
        let sheared = of(Mode::Shear, 0.1);
        assert!((0.65..0.95).contains(&sheared.whole), "{}", sheared.whole);
    }

    #[test]
    fn a_specimen_of_the_law_is_fitted_wholly() {
        let law = Ogden::new(&[[1000.0, 2.0]]).unwrap();
        let own = Shape {
            half: 1.2,
            whole: 1.3,
            strain: -0.1,
        };
        let points = [1.0, 0.97, 0.95, 0.9].map(|x| {
            let stress = own.at(Mode::Compression, x) * nominal_stress(&law, Mode::Compression, x);
            [x, stress]
        });
        let curve = Curve {
            mode: Mode::Compression,
            points: points.to_vec(),
        };
        assert!((own.at(Mode::Compression, 0.9) - 1.3).abs() < 1e-12);
        assert!((r2(&curve, &law, &own) - 1.0).abs() < 1e-12);
    }
}
