//! A half space under a pressure on a disc (Boussinesq 1885, Love 1929) and under a ball (Hertz 1882), in closed form and by equilibria of a body of
//! revolution.
//!
//! The same kind of body is held against the solver's tetrahedra: a cylinder between plates that hold its ends. Cells grow outwards to 1,000 contact radii, where the body is held. Strains are so small that every law is linear.

use anyhow::{Context, Result};
use elements::{Law, Material};
use std::f64::consts::PI;
use tissue::axisymmetric::{Axis, Equilibrium, Obstacle, Section as Plane, Shape, halved};

use super::closed_forms::squeezed_both;
use super::section::Section;
use crate::fit::specimen::limit;
use crate::materials;

/// Cells in the radius of contact, and how much larger each next one is from [`EVEN`] of them on.
const WITHIN: usize = 4;
const EVEN: usize = 7;
const GROWTH: f64 = 1.35;
/// Radius of the body, in radii of contact, which is 1 mm.
const REACH: f64 = 1e3;
/// Pressure over Young's modulus.
const PRESSURE: f64 = 1e-4;
/// Radius of the ball, mm, and its depth: they touch along 1 mm.
const BALL: f64 = 1000.0;
const DEPTH: f64 = 1.0 / BALL;
/// What the ball presses with, over Young's modulus, 1/mm: a two-thousandth of its depth lies inside.
const STIFFNESS: f64 = 1000.0;

/// A case, in closed form and as found with cells and with their halves.
struct Case {
    name: &'static str,
    unit: &'static str,
    closed: f64,
    found: [f64; 2],
}

/// Distances from the place of contact, each cell halved so many times.
fn lines(halvings: usize) -> Vec<f64> {
    let mut out = vec![0.0];
    let mut cell = 1.0 / WITHIN as f64;
    while let Some(last) = out.last().copied().filter(|last| *last < REACH) {
        if out.len() > EVEN {
            cell *= GROWTH;
        }
        out.push(last + cell);
    }
    halved(out, halvings)
}

/// Its top at 0, below it the rest; with the nodes of the top.
fn body(material: &Material, halvings: usize) -> (Equilibrium, Vec<usize>) {
    let across = lines(halvings);
    let along: Vec<f64> = across.iter().rev().map(|z| -z).collect();
    let last = across.len() - 1;
    let plane = Plane::grid(&across, &along);
    let (top, far) = (
        plane.level(last),
        [plane.level(0), plane.side(last)].concat(),
    );
    let mut body = Equilibrium::new(plane, material);
    for axis in [Axis::Across, Axis::Along] {
        body.hold(&far, axis, 0.0);
    }
    (body, top)
}

/// How far the surface sinks in the middle of the disc and at its edge, mm.
fn pressed(material: &Material, halvings: usize) -> Result<[f64; 2]> {
    let (mut body, top) = body(material, halvings);
    body.press(&top, 1.0, PRESSURE * material.young_pa);
    body.advance(1.0)
        .context("a disc of pressure on a half space")?;
    let edge = WITHIN << halvings;
    Ok([top[0], top[edge]].map(|node| -body.displacement(node, Axis::Along)))
}

/// What holds the ball at its depth, mN.
fn ball(material: &Material, halvings: usize) -> Result<f64> {
    let (mut body, top) = body(material, halvings);
    let near = (top.iter()).take_while(|node| body.section().place(**node)[0] < 3.0);
    let chain = near.copied().collect();
    let obstacle = Obstacle {
        shape: Shape::Ball(BALL),
        low: 0.0,
        motion: -DEPTH,
        stiffness: STIFFNESS * material.young_pa,
    };
    body.meet(obstacle, chain);
    body.advance(1.0).context("a ball on a half space")?;
    Ok(body.push())
}

fn cases(material: &Material) -> Result<Vec<Case>> {
    let plane = material.young_pa / (1.0 - material.poisson * material.poisson);
    let sunk = [pressed(material, 0)?, pressed(material, 1)?];
    let push = [ball(material, 0)?, ball(material, 1)?];
    let pressure = PRESSURE * material.young_pa;
    let names = [
        ("pressure on a disc: middle", 2.0 * pressure / plane),
        ("pressure on a disc: its edge", 4.0 / PI * pressure / plane),
    ];
    let discs = names
        .into_iter()
        .enumerate()
        .map(|(k, (name, closed))| Case {
            name,
            unit: "µm",
            closed: 1e3 * closed,
            found: sunk.map(|sunk| 1e3 * sunk[k]),
        });
    let hertz = Case {
        name: "ball: force",
        unit: "mN",
        closed: 4.0 / 3.0 * 1e-3 * plane * BALL.sqrt() * DEPTH.powf(1.5),
        found: push,
    };
    Ok(discs.chain([hertz]).collect())
}

pub fn section() -> Result<Section> {
    let mut text = String::from(
        "| half space, neo-Hookean | cells in the radius of contact | found | closed form | off |\n|---|---:|---:|---:|---:|\n",
    );
    for case in cases(&Material::default())? {
        let [coarse, fine] = case.found;
        let meshes = [WITHIN, WITHIN << 1].map(|cells| cells.to_string());
        let [few, many] = meshes;
        let both = limit(coarse, fine);
        for (cells, got) in [(few, coarse), (many, fine), ("limit of both".into(), both)] {
            text += &format!(
                "| {} | {cells} | {got:.5} {} | {:.5} {1} | {:.2} % |\n",
                case.name,
                case.unit,
                case.closed,
                100.0 * (got / case.closed - 1.0).abs()
            );
        }
    }
    text += "\n| cylinder of radius 5 mm and length 10 mm between plates that hold its ends, pressed by 10 % | law | solver's tetrahedra, in the limit, mN | body of revolution, in the limit, mN | apart |\n|---|---|---:|---:|---:|\n";
    let cortex = materials::law("cortex").map_err(anyhow::Error::msg)?;
    // Linear tetrahedra of one pressure lock the more, the less tissue changes its volume: the last row is for those that do not.
    let neo_hookean = ("neo-Hookean", Law::default());
    for ((name, law), poisson) in [
        (neo_hookean, 0.49),
        (("cortex", cortex), 0.49),
        (neo_hookean, 0.3),
    ] {
        let material = Material {
            poisson,
            ..Material::default()
        };
        let [solid, turned] = squeezed_both(&material.with_law(law))?;
        text += &format!(
            "| Poisson's ratio {poisson} | {name} | {solid:.3} | {turned:.3} | {:.2} % |\n",
            100.0 * (solid / turned - 1.0).abs()
        );
    }
    Ok(Section {
        name: "half space",
        text,
        plots: Vec::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::{ball, pressed};
    use elements::Material;

    #[test]
    fn coarse_half_spaces_sink_as_they_should() {
        let material = Material::default();
        let plane = material.young_pa / (1.0 - material.poisson * material.poisson);
        let [middle, edge] = pressed(&material, 0).unwrap();
        let of = |sunk: f64| sunk * plane / (super::PRESSURE * material.young_pa);
        for (found, wanted) in [(middle, 2.0), (edge, 1.273)] {
            assert!(
                (of(found) / wanted - 1.0).abs() < 0.04,
                "{} {wanted}",
                of(found)
            );
        }
        let hertz = 4.0 / 3.0 * 1e-3 * plane * 1e-3;
        let force = ball(&material, 0).unwrap();
        assert!((force / hertz - 1.0).abs() < 0.06, "{force} {hertz}");
    }
}
