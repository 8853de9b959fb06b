//! What is tested where its strains are not those of a bar: a cylinder under a plate or a ball, by equilibria of a body of revolution.
//!
//! Plates hold the ends, whose sides may roll onto them (half of the cylinder is solved); under a ball, which slides, the bottom is held and the side free.
//! A force is linear in the modulus, so that all equilibria have a shear modulus of 1 kPa. What two meshes give tends to a limit ([`limit`]).

use std::fmt;
use std::str::FromStr;

use anyhow::{Result, bail};
use elements::{Law, Material};
use tissue::axisymmetric::{Axis, Equilibrium, NoEquilibrium, Obstacle, Section, Shape, halved};

/// Shear modulus of the equilibria, Pa.
pub const SHEAR_PA: f64 = 1000.0;
/// How much closer lines between plates lie to the edge.
const GRADING: f64 = 1.5;
/// What a plate presses the side with, over the shear modulus, 1/mm.
const PLATE: f64 = 50.0;
/// What a ball presses with, over the shear modulus, times its depth: a thousandth of that lies inside of it.
const BALL: f64 = 1000.0;
/// Cells across half of a cylinder between plates, and in the radius of a ball's contact.
const ACROSS: usize = 10;
const WITHIN: usize = 3;
/// How far cells stay as small beside a ball, in radii of contact, and how much larger each next one is.
const EVEN: f64 = 1.4;
const GROWTH: f64 = 1.4;
/// How far a test may go, over the height.
const DEEPEST: f64 = 0.6;

/// A cylinder, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    pub radius: f64,
    pub height: f64,
}

/// What presses it from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Press {
    /// It holds the end, as the plate below does.
    Plate,
    /// Of a radius in mm, on the axis, without friction.
    Ball(f64),
}

/// A length in mm.
fn length(text: &str, what: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(length) if (1e-3..=1e4).contains(&length) => Ok(length),
        _ => Err(format!(
            "{what} is `{text}`: it is a length in mm, from 0.001 to 10000"
        )),
    }
}

impl FromStr for Cylinder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let own = text.strip_prefix("cylinder:");
        let Some((radius, height)) = own.and_then(|own| own.split_once(',')) else {
            return Err(format!(
                "`{text}` is no specimen: use cylinder:RADIUS,HEIGHT in mm"
            ));
        };
        Ok(Self {
            radius: length(radius, "the radius of the cylinder")?,
            height: length(height, "the height of the cylinder")?,
        })
    }
}

impl FromStr for Press {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            None if text == "plate" => Ok(Self::Plate),
            Some(("ball", radius)) => Ok(Self::Ball(length(radius, "the radius of the ball")?)),
            _ => Err(format!(
                "`{text}` presses nothing: use plate or ball:RADIUS in mm"
            )),
        }
    }
}

impl fmt::Display for Press {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plate => f.write_str("plates that hold the ends"),
            Self::Ball(radius) => write!(f, "a ball of {radius} mm without friction"),
        }
    }
}

/// A cylinder and what presses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    pub cylinder: Cylinder,
    pub press: Press,
}

impl Specimen {
    /// Refuses a test that goes deeper than equilibria are known to.
    ///
    /// # Errors
    /// The largest displacement (mm) is beyond a part of the height, or beyond the ball.
    pub fn reaches(&self, displacement: f64) -> Result<()> {
        let height = self.cylinder.height;
        if displacement > DEEPEST * height {
            bail!(
                "a displacement of {displacement} mm is more than {:.0} % of the cylinder's height of {height} mm: check --specimen, or leave the rows beyond out",
                100.0 * DEEPEST
            );
        }
        match self.press {
            Press::Ball(radius) if displacement > radius => bail!(
                "a displacement of {displacement} mm is more than the ball's radius of {radius} mm: check --press, or leave the rows beyond out"
            ),
            _ => Ok(()),
        }
    }

    /// The power of the displacement that the force of a small press goes with.
    pub fn power(&self) -> f64 {
        match self.press {
            Press::Plate => 1.0,
            Press::Ball(_) => 1.5,
        }
    }

    /// Forces at `most k / levels` (mm), `k` from 1 on, mN, of a law with a shear modulus of [`SHEAR_PA`]; each cell of the mesh is halved so many times.
    ///
    /// # Errors
    /// [`NoEquilibrium`] of a law that is not stable, or under which a mesh folds.
    pub fn forces(
        &self,
        law: Law,
        most: f64,
        levels: usize,
        halvings: usize,
    ) -> Result<Vec<f64>, NoEquilibrium> {
        let base = Material::default();
        let material = Material {
            young_pa: 2.0 * (1.0 + base.poisson) * SHEAR_PA,
            ..base
        }
        .with_law(law);
        let Cylinder { radius, height } = self.cylinder;
        match self.press {
            Press::Plate => {
                let half = 0.5 * height;
                let along = (ACROSS as f64 * half / radius).clamp(6.0, 30.0) as usize;
                let cells = [ACROSS, along].map(|cells| cells << halvings);
                held([radius, half], &material, most / height, levels, cells)
            }
            Press::Ball(ball) => pressed(
                self.cylinder,
                Ball {
                    radius: ball,
                    depth: most,
                },
                &material,
                levels,
                halvings,
            ),
        }
    }
}

/// Lines of a length, close to each other at its end.
fn lines(count: usize, length: f64) -> Vec<f64> {
    let part = |k: usize| 1.0 - (1.0 - k as f64 / count as f64).powf(GRADING);
    (0..=count).map(|k| length * part(k)).collect()
}

/// Force of a cylinder between plates that hold its ends by strain, mN, at `most k / steps`, from 1 on.
///
/// # Errors
/// [`NoEquilibrium`].
pub fn held(
    [radius, half]: [f64; 2],
    material: &Material,
    most: f64,
    steps: usize,
    [across, along]: [usize; 2],
) -> Result<Vec<f64>, NoEquilibrium> {
    let plane = Section::grid(&lines(across, radius), &lines(along, half));
    let (middle, plate, side) = (plane.level(0), plane.level(along), plane.side(across));
    let mut body = Equilibrium::new(plane, material);
    body.hold(&middle, Axis::Along, 0.0);
    body.hold(&plate, Axis::Across, 0.0);
    body.hold(&plate, Axis::Along, -most * half);
    let obstacle = Obstacle {
        shape: Shape::Plate,
        low: half,
        motion: -most * half,
        stiffness: PLATE * material.shear_pa(),
    };
    body.meet(obstacle, side);
    (1..=steps)
        .map(|k| {
            body.advance(k as f64 / steps as f64)?;
            Ok(body.reaction(&middle, Axis::Along))
        })
        .collect()
}

/// A ball and how deep it goes, mm.
#[derive(Clone, Copy)]
struct Ball {
    radius: f64,
    depth: f64,
}

impl Ball {
    /// Distances up to a length from where it touches, the first 0: small in its contact, growing beyond, each cell halved so many times.
    fn lines(self, length: f64, halvings: usize) -> Vec<f64> {
        let contact = (self.radius * self.depth).sqrt().min(length);
        let mut cell = contact / WITHIN as f64;
        let mut out = vec![0.0];
        let mut last = 0.0;
        // The last cell takes what would be less than half of one.
        while last + 1.5 * cell < length {
            last += cell;
            out.push(last);
            if last > EVEN * contact {
                cell *= GROWTH;
            }
        }
        out.push(length);
        halved(out, halvings)
    }
}

/// Force of a ball on a cylinder that stands on what holds it, mN.
fn pressed(
    cylinder: Cylinder,
    ball: Ball,
    material: &Material,
    levels: usize,
    halvings: usize,
) -> Result<Vec<f64>, NoEquilibrium> {
    let across = ball.lines(cylinder.radius, halvings);
    let along: Vec<f64> = (ball.lines(cylinder.height, halvings).iter().rev())
        .map(|z| -z)
        .collect();
    let plane = Section::grid(&across, &along);
    let (top, bottom) = (plane.level(along.len() - 1), plane.level(0));
    let mut body = Equilibrium::new(plane, material);
    for axis in [Axis::Across, Axis::Along] {
        body.hold(&bottom, axis, 0.0);
    }
    let obstacle = Obstacle {
        shape: Shape::Ball(ball.radius),
        low: 0.0,
        motion: -ball.depth,
        stiffness: BALL / ball.depth * material.shear_pa(),
    };
    body.meet(obstacle, top);
    (1..=levels)
        .map(|k| {
            body.advance(k as f64 / levels as f64)?;
            Ok(body.push())
        })
        .collect()
}

/// Of elements whose error falls with the square of their size.
pub fn limit(coarse: f64, fine: f64) -> f64 {
    fine + (fine - coarse) / 3.0
}

#[cfg(test)]
mod tests {
    use super::{Cylinder, Press, SHEAR_PA, Specimen, limit};
    use elements::{Law, Material};

    /// Hertz (1882): `F = 4/3 E / (1 - nu²) R^(1/2) d^(3/2)` of a ball that goes in by little of its radius, far from the ends.
    #[test]
    fn a_small_press_of_a_ball_is_hertz() {
        let (ball, depth) = (4.0, 0.02);
        let specimen = Specimen {
            cylinder: Cylinder {
                radius: 25.0,
                height: 30.0,
            },
            press: Press::Ball(ball),
        };
        let [coarse, fine] =
            [0, 1].map(|halvings| specimen.forces(Law::default(), depth, 2, halvings).unwrap());
        let poisson = Material::default().poisson;
        let plane = 2.0 * SHEAR_PA / (1.0 - poisson);
        for (k, depth) in [0.5 * depth, depth].into_iter().enumerate() {
            let hertz = 4.0 / 3.0 * 1e-3 * plane * f64::sqrt(ball) * depth.powf(1.5);
            let force = limit(coarse[k], fine[k]);
            assert!((force / hertz - 1.0).abs() < 0.02, "{force} for {hertz}");
            assert!(
                (fine[k] / hertz - 1.0).abs() < 0.04,
                "{} for {hertz}",
                fine[k]
            );
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, words) in [
            ("box:1,2", "`box:1,2` is no specimen"),
            ("cylinder:4", "cylinder:RADIUS,HEIGHT"),
            ("cylinder:x,2", "radius of the cylinder is `x`"),
            ("cylinder:2,0", "height of the cylinder is `0`"),
            ("cylinder:2,NaN", "height of the cylinder is `NaN`"),
        ] {
            let error = text.parse::<Cylinder>().unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        for (text, words) in [
            ("cone", "use plate or ball:RADIUS"),
            ("ball:-1", "radius of the ball is `-1`"),
        ] {
            let error = text.parse::<Press>().unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        let cylinder: Cylinder = "cylinder:25,30".parse().unwrap();
        for (press, displacement, words) in [
            ("plate", 19.0, "60 % of the cylinder's height of 30 mm"),
            ("ball:3", 3.5, "ball's radius of 3 mm"),
        ] {
            let press = press.parse().unwrap();
            let error = Specimen { cylinder, press }.reaches(displacement);
            let error = error.unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
