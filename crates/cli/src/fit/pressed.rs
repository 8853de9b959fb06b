//! A specimen that was pressed: force by displacement, and what a law gives for it by equilibria of a mesh ([`super::specimen`]).
//!
//! A law is solved at a few displacements on a coarse mesh; between them the logarithm of the force over that of a small press is a parabola. Stiffnesses
//! cost nothing, since a force is linear in them. Near the law that was found a finer mesh says by what part the force in the limit differs, and the fit
//! goes on with that.

use std::cell::RefCell;
use std::path::Path;

use anyhow::{Context, Result, bail};
use elements::{Law, Ogden};

use super::curve::Scaled;
use super::data::{SAMPLES, Table};
use super::least_squares::{Cost, Test};
use super::specimen::{SHEAR_PA, Specimen, limit};

/// Names of the columns, with what makes mN of a force.
const DISPLACEMENT: &str = "displacement_mm";
const FORCES: [(&str, f64); 2] = [("force_n", 1e3), ("force_mn", 1.0)];
/// Displacements that are solved.
const LEVELS: usize = 6;
/// Points of a test at least.
const LEAST: usize = 3;
/// Fits at most after a finer mesh was looked at, and the change of the force in the limit from which on there is another.
const ROUNDS: usize = 3;
const SETTLED: f64 = 1e-3;
/// Terms of a law that differ by less, relative, are one.
const SAME: f64 = 1e-12;

/// By level, from 1 on.
type Row = [f64; LEVELS];

/// A test and its specimen.
pub struct Pressed {
    pub name: String,
    pub specimen: Specimen,
    /// Displacement, mm, and force, mN.
    pub points: Vec<[f64; 2]>,
    solved: RefCell<Solved>,
}

/// What is known of laws.
struct Solved {
    /// Forces of laws with a shear modulus of [`SHEAR_PA`] on the coarse mesh, mN; none where there is no equilibrium.
    rows: Vec<(Law, Option<Row>)>,
    /// The force in the limit over that of the coarse mesh.
    finer: Row,
    rounds: usize,
}

/// The law with a shear modulus of [`SHEAR_PA`].
fn normalised(scaled: Scaled) -> Law {
    match scaled.law {
        Law::Ogden(own) => {
            let part = SHEAR_PA / own.shear_pa();
            let terms = own.terms.iter().map(|term| [part * term.mu_pa, term.alpha]);
            let terms: Vec<[f64; 2]> = terms.collect();
            Ogden::new(&terms).map_or(scaled.law, Law::Ogden)
        }
        law => law,
    }
}

fn is_same(a: &Law, b: &Law) -> bool {
    let near = |x: f64, y: f64| (x - y).abs() <= SAME * x.abs();
    match (a, b) {
        (Law::Ogden(a), Law::Ogden(b)) => {
            let mut pairs = a.terms.iter().zip(b.terms.iter());
            a.terms.len() == b.terms.len()
                && pairs.all(|(a, b)| near(a.mu_pa, b.mu_pa) && near(a.alpha, b.alpha))
        }
        _ => a == b,
    }
}

impl Pressed {
    /// Reads a file with the columns `displacement_mm` and `force_n` or `force_mn`, and of several specimens that of the name.
    pub fn read(path: &Path, specimen: Specimen, sample: Option<&str>) -> Result<Self> {
        let whose = path.display();
        let table = Table::read(path)?;
        let displacement = table.needed(&[DISPLACEMENT])?;
        let force = table.needed(&FORCES.map(|(name, _)| name))?;
        let unit = table.unit(force, &FORCES).unwrap_or(1.0);
        let samples = table.column(&SAMPLES);
        let mut names: Vec<&str> = Vec::new();
        let mut points = Vec::new();
        for row in table.rows() {
            let name = samples.map_or("", |column| row[column].as_str());
            if !names.contains(&name) {
                names.push(name);
            }
            if sample.is_some_and(|asked| asked != name) {
                continue;
            }
            let [x, y] = [
                table.number(row, displacement)?,
                unit * table.number(row, force)?,
            ];
            if x < 0.0 {
                bail!(
                    "{whose}: line {}: {DISPLACEMENT} is {x}: it is how far the press went from where it first touched, 0 or more",
                    row.line
                );
            }
            if let Err(error) = specimen.reaches(x) {
                bail!("{whose}: line {}: {error}", row.line);
            }
            points.push([x, y]);
        }
        let name = match sample {
            Some(name) if !names.contains(&name) => {
                bail!("no specimen `{name}`; the file holds {}", names.join(", "))
            }
            Some(name) => name,
            None if names.len() > 1 => bail!(
                "the file holds {}; choose one by --sample",
                names.join(", ")
            ),
            None => names.first().copied().unwrap_or_default(),
        };
        let own = Self::new(name.to_owned(), specimen, points);
        own.check().with_context(|| format!("{whose}"))?;
        Ok(own)
    }

    pub fn new(name: String, specimen: Specimen, points: Vec<[f64; 2]>) -> Self {
        Self {
            name,
            specimen,
            points,
            solved: RefCell::new(Solved {
                rows: Vec::new(),
                finer: [1.0; LEVELS],
                rounds: 0,
            }),
        }
    }

    /// Refuses tests that no law can be fitted to.
    fn check(&self) -> Result<()> {
        let moved = self.points.iter().filter(|[x, _]| *x > 0.0);
        let (mut count, mut wrong) = (0, 0);
        for [_, y] in moved {
            count += 1;
            wrong += usize::from(*y <= 0.0);
        }
        if count < LEAST {
            bail!("{count} points with a {DISPLACEMENT} above 0; at least {LEAST}");
        }
        if 2 * wrong > count {
            bail!(
                "{wrong} of {count} forces are not above 0: the force of a press is positive; take off the offset of the sensor, or turn the sign"
            );
        }
        Ok(())
    }

    /// The largest displacement, mm.
    pub fn most(&self) -> f64 {
        self.points.iter().fold(0.0, |most, [x, _]| most.max(*x))
    }

    fn largest(&self) -> f64 {
        self.points
            .iter()
            .fold(0.0, |most, [_, y]| y.abs().max(most))
    }

    /// Forces by level of a law, on a mesh.
    fn row(&self, law: Law, halvings: usize) -> Result<Row> {
        let forces = self
            .specimen
            .forces(law, self.most(), LEVELS, halvings)
            .with_context(|| {
                format!(
                    "no equilibrium of `{law:.4}` up to {} mm on a mesh of {} parts: fit a shorter part of the test",
                    self.most(),
                    1 << halvings
                )
            })?;
        let mut row = [0.0; LEVELS];
        row.copy_from_slice(&forces);
        match row.iter().all(|force| *force > 0.0) {
            true => Ok(row),
            false => bail!("`{law:.4}` does not resist"),
        }
    }

    /// The same on the coarse mesh, if it was not found before.
    fn coarse(&self, law: Law) -> Option<Row> {
        let solved = self.solved.borrow();
        let known = solved.rows.iter().find(|(own, _)| is_same(own, &law));
        if let Some((_, row)) = known {
            return *row;
        }
        drop(solved);
        let row = self.row(law, 0).ok();
        self.solved.borrow_mut().rows.push((law, row));
        row
    }

    /// What a law gives at a displacement (mm), mN; none where it has no equilibrium.
    pub fn force(&self, scaled: Scaled, displacement: f64) -> Option<f64> {
        let row = self.coarse(normalised(scaled))?;
        let finer = self.solved.borrow().finer;
        let power = self.specimen.power();
        let value =
            |level: usize| (row[level - 1] * finer[level - 1]).ln() - power * (level as f64).ln();
        let x = displacement / self.most() * LEVELS as f64;
        // The parabola through the level that is nearest and its neighbours.
        let middle = (x.round() as usize).clamp(2, LEVELS - 1);
        let [low, own, high] = [middle - 1, middle, middle + 1].map(value);
        let t = x - middle as f64;
        let log = own + 0.5 * t * (high - low) + 0.5 * t * t * (high - 2.0 * own + low);
        Some(scaled.shear_pa / SHEAR_PA * x.powf(power) * log.exp())
    }

    /// By what the mesh is off at the largest displacement, before the limit is taken.
    pub fn mesh_error(&self) -> f64 {
        1.0 / self.solved.borrow().finer[LEVELS - 1] - 1.0
    }

    /// `1 - sum (y - f)² / sum (y - mean)²`; none where the law has no equilibrium.
    pub fn r2(&self, scaled: Scaled) -> Option<f64> {
        let mean = self.points.iter().map(|[_, y]| y).sum::<f64>() / self.points.len() as f64;
        let (mut left, mut whole) = (0.0, 0.0);
        for [x, y] in &self.points {
            left += (y - self.force(scaled, *x)?).powi(2);
            whole += (y - mean).powi(2);
        }
        Some(1.0 - left / whole)
    }
}

impl<L: Copy + Into<Scaled>> Test<L> for Pressed {
    fn unit(&self) -> f64 {
        let radius = self.specimen.cylinder.radius;
        1e3 * self.largest() / (std::f64::consts::PI * radius * radius)
    }

    fn count(&self) -> usize {
        self.points.len()
    }

    fn compare(&self, law: &L, mut point: impl FnMut([f64; 2])) -> bool {
        let (law, scale): (Scaled, f64) = ((*law).into(), 1.0 / self.largest());
        for [x, y] in &self.points {
            let Some(force) = self.force(law, *x) else {
                return false;
            };
            point([scale * force, scale * y]);
        }
        true
    }

    fn cost(&self) -> Cost {
        Cost::Large
    }

    fn refine(&self, found: &L) -> Result<bool> {
        let law = normalised((*found).into());
        if self.solved.borrow().rounds == ROUNDS {
            return Ok(false);
        }
        let (coarse, fine) = (self.row(law, 0)?, self.row(law, 1)?);
        let mut solved = self.solved.borrow_mut();
        solved.rounds += 1;
        let mut change: f64 = 0.0;
        for (finer, (coarse, fine)) in solved.finer.iter_mut().zip(coarse.iter().zip(fine)) {
            let next = limit(*coarse, fine) / coarse;
            change = change.max((next / *finer - 1.0).abs());
            *finer = next;
        }
        Ok(change > SETTLED)
    }
}

#[cfg(test)]
mod tests {
    use super::{LEVELS, Pressed};
    use crate::fit::specimen::{SHEAR_PA, Specimen, limit};
    use crate::fit::wanted::{Asked, Wanted};
    use elements::{Law, Ogden};

    fn specimen(press: &str) -> Specimen {
        Specimen {
            cylinder: "cylinder:25,30".parse().unwrap(),
            press: press.parse().unwrap(),
        }
    }

    /// A test of an Ogden law of one exponent, at other displacements than a fit solves.
    fn made(alpha: f64, shear_pa: f64, press: &str, most: f64, levels: usize) -> Pressed {
        let specimen = specimen(press);
        let law = Law::Ogden(Ogden::new(&[[2.0 * SHEAR_PA / alpha, alpha]]).unwrap());
        let [coarse, fine] =
            [0, 1].map(|halvings| specimen.forces(law, most, levels, halvings).unwrap());
        let both = coarse.into_iter().zip(fine).enumerate();
        let points = both.map(|(k, (coarse, fine))| {
            let part = (k + 1) as f64 / levels as f64;
            [part * most, shear_pa / SHEAR_PA * limit(coarse, fine)]
        });
        Pressed::new(String::new(), specimen, points.collect())
    }

    #[test]
    fn a_law_is_found_again_from_a_press() {
        let shear_pa = 640.0;
        for (press, alpha, most, levels, given) in [
            ("plate", -8.0, 6.0, LEVELS + 2, &[][..]),
            ("ball:6", -12.0, 2.0, LEVELS - 2, &[-12.0]),
        ] {
            let test = made(alpha, shear_pa, press, most, levels);
            let asked = Asked::Stretches(Wanted::Ogden(1));
            let found = asked.fit(&test, given).unwrap();
            let term = *found.terms.as_ref().unwrap().terms.iter().next().unwrap();
            assert!((term.alpha / alpha - 1.0).abs() < 0.02, "{press}: {term:?}");
            let off = found.scaled.shear_pa / shear_pa - 1.0;
            assert!(off.abs() < 0.01, "{press}: {off}");
            let r2 = test.r2(found.scaled).unwrap();
            assert!(r2 > 0.9999, "{press}: {r2}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("press.csv");
        let head = "displacement_mm,force_n\n";
        let rows = "0,0\n1,2\n2,5\n3,9\n";
        for (text, sample, words) in [
            (
                "displacement_mm\n1\n".to_owned(),
                None,
                "no column force_n or force_mn",
            ),
            (
                "depth,force_n\n1,2\n".to_owned(),
                None,
                "no column displacement_mm",
            ),
            (
                format!("{head}0,0\n1,2\n2,5\n"),
                None,
                "2 points with a displacement_mm above 0",
            ),
            (format!("{head}{rows}4\n"), None, "line 6 has 1 fields"),
            (format!("{head}{rows}4,x\n"), None, "line 6: force_n is `x`"),
            (
                format!("{head}{rows}4,nan\n"),
                None,
                "line 6: force_n is NaN",
            ),
            (
                format!("{head}{rows}-1,3\n"),
                None,
                "line 6: displacement_mm is -1",
            ),
            (
                format!("{head}{rows}20,3\n"),
                None,
                "line 6: a displacement of 20 mm is more than 60 %",
            ),
            (
                format!("{head}1,-2\n2,-5\n3,-9\n"),
                None,
                "3 of 3 forces are not above 0",
            ),
            (
                "sample,displacement_mm,force_n\na,1,2\nb,1,2\n".to_owned(),
                None,
                "the file holds a, b",
            ),
            (format!("{head}{rows}"), Some("c"), "no specimen `c`"),
        ] {
            std::fs::write(&path, text).unwrap();
            let read = Pressed::read(&path, specimen("plate"), sample);
            let error = format!("{:#}", read.err().unwrap());
            assert!(error.contains(words), "{error}");
        }
        std::fs::write(&path, format!("{head}{rows}")).unwrap();
        let test = Pressed::read(&path, specimen("plate"), None).unwrap();
        assert_eq!(test.points[1], [1.0, 2000.0]);
        let error = Asked::Stretches(Wanted::NeoHookean).fit(&test, &[2.0]);
        let error = error.err().unwrap().to_string();
        assert!(error.contains("--exponents goes with"), "{error}");
    }
}
