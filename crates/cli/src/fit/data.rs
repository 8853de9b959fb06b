//! A test's file: CSV with a head line. `docs/reference/formats.md`, "Tests of a material", describes it.
//!
//! Columns by name, in any order: `mode` (tension, compression, shear or torsion); `stretch` or `stretch_or_shear` or, for shear alone, `shear` (the
//! stretch is 1 at rest, the amount of shear 0); `nominal_stress_pa` or `nominal_stress_kpa` (force over the area at rest, negative
//! under compression); and if a file holds several specimens, their name in `sample`, `region` or `phantom`.

use std::ops::Index;
use std::path::Path;

use anyhow::{Context, Result, bail};

use super::curve::{Curve, Mode};

/// Names of the column of specimens.
pub const SAMPLES: [&str; 3] = ["sample", "region", "phantom"];
/// Names of the column of stretches and shears.
const STRETCHES: [&str; 3] = ["stretch", "stretch_or_shear", "shear"];
/// Names of the column of stresses, with their unit in Pa.
const STRESSES: [(&str, f64); 4] = [
    ("nominal_stress_pa", 1.0),
    ("nominal_stress_kpa", 1e3),
    ("stress_pa", 1.0),
    ("stress_kpa", 1e3),
];

/// One specimen's curves.
#[derive(Clone, Debug)]
pub struct Sample {
    pub name: String,
    pub curves: Vec<Curve>,
}

/// A line of a table.
pub struct Row {
    /// Its number in the file, from 1 on.
    pub line: usize,
    fields: Vec<String>,
}

impl Index<usize> for Row {
    type Output = String;

    fn index(&self, column: usize) -> &String {
        &self.fields[column]
    }
}

/// A table of text: its head and its rows.
pub struct Table {
    head: Vec<String>,
    rows: Vec<Row>,
    path: String,
}

impl Table {
    /// Reads a file; every row must have as many fields as the head.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        let split = |line: &str| {
            line.split(',')
                .map(|f| f.trim().to_owned())
                .collect::<Vec<_>>()
        };
        let mut lines = (text.lines().enumerate())
            .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        let Some((_, head)) = lines.next() else {
            bail!(
                "{}: is empty; a head line names the columns",
                path.display()
            );
        };
        let head = split(head.trim_start_matches('\u{feff}'));
        let mut rows = Vec::new();
        for (number, line) in lines {
            let (line, fields) = (number + 1, split(line));
            if fields.len() != head.len() {
                bail!(
                    "{}: line {line} has {} fields where the head has {}",
                    path.display(),
                    fields.len(),
                    head.len()
                );
            }
            rows.push(Row { line, fields });
        }
        Ok(Self {
            head,
            rows,
            path: path.display().to_string(),
        })
    }

    /// Where the first of some columns is.
    pub fn column(&self, names: &[&str]) -> Option<usize> {
        names
            .iter()
            .find_map(|name| self.head.iter().position(|h| h == name))
    }

    /// The same, or an error.
    pub fn needed(&self, names: &[&str]) -> Result<usize> {
        let found = self.column(names);
        found.with_context(|| format!("{}: has no column {}", self.path, names.join(" or ")))
    }

    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// A number of a row.
    pub fn number(&self, row: &Row, column: usize) -> Result<f64> {
        let (path, line, name) = (&self.path, row.line, &self.head[column]);
        let value: f64 = (row[column].parse())
            .with_context(|| format!("{path}: line {line}: {name} is `{}`", row[column]))?;
        if value.is_finite() {
            Ok(value)
        } else {
            bail!("{path}: line {line}: {name} is {value}")
        }
    }

    /// The unit of a column, by its name in a list.
    pub fn unit<T: Copy>(&self, column: usize, units: &[(&str, T)]) -> Option<T> {
        let own = units.iter().find(|(name, _)| self.head[column] == *name);
        own.map(|(_, unit)| *unit)
    }
}

/// All specimens of a file, in its order.
pub fn read(path: &Path) -> Result<Vec<Sample>> {
    let table = Table::read(path)?;
    let mode = table.needed(&["mode"])?;
    let stretch = table.needed(&STRETCHES)?;
    let stress = table.needed(&STRESSES.map(|(name, _)| name))?;
    let unit = table.unit(stress, &STRESSES).unwrap_or(1.0);
    let sample = table.column(&SAMPLES);
    let mut samples: Vec<Sample> = Vec::new();
    for row in table.rows() {
        let name = sample.map_or("", |column| row[column].as_str());
        let mode: Mode = (row[mode].parse())
            .map_err(anyhow::Error::msg)
            .with_context(|| format!("{}", path.display()))?;
        let (x, y) = (
            table.number(row, stretch)?,
            table.number(row, stress)? * unit,
        );
        if !mode.is_shear() && x <= 0.0 {
            bail!(
                "{}: a stretch of {x} in {}; it is length over length at rest, above 0",
                path.display(),
                mode.as_str()
            );
        }
        let at = samples.iter().position(|s| s.name == name);
        let at = at.unwrap_or_else(|| {
            samples.push(Sample {
                name: name.to_owned(),
                curves: Vec::new(),
            });
            samples.len() - 1
        });
        let curves = &mut samples[at].curves;
        match curves.iter_mut().find(|curve| curve.mode == mode) {
            Some(curve) => curve.points.push([x, y]),
            None => curves.push(Curve {
                mode,
                points: vec![[x, y]],
            }),
        }
    }
    if samples.is_empty() {
        bail!("{}: has no rows below its head", path.display());
    }
    for sample in &samples {
        for curve in &sample.curves {
            curve.check(&format!("{}: {}", path.display(), sample.name))?;
        }
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    use super::read;

    fn of(text: &str) -> anyhow::Result<Vec<super::Sample>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.csv");
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn curves_come_by_specimen_and_in_pascal() {
        let samples = of("# a comment\nnominal_stress_kpa, mode, stretch, sample\n\
             0,tension,1,a\n0.1,tension,1.05,a\n0.25,tension,1.1,a\n\
             0,compression,1,b\n-0.1,compression,0.95,b\n-0.3,compression,0.9,b\n")
        .unwrap();
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].curves[0].points[2], [1.1, 250.0]);
        assert_eq!(samples[1].curves[0].points[1], [0.95, -100.0]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let head = "mode,stretch,stress_pa\n";
        let rows = "tension,1,0\ntension,1.1,1\n";
        for (text, words) in [
            (String::new(), "is empty"),
            ("mode,stretch\n".to_owned(), "no column nominal_stress_pa"),
            (head.to_owned(), "no rows"),
            (format!("{head}{rows}"), "at least 3"),
            (format!("{head}{rows}tension,1.2\n"), "line 4 has 2 fields"),
            (
                format!("{head}{rows}tension,1.2,x\n"),
                "line 4: stress_pa is `x`",
            ),
            (format!("{head}{rows}tension,1.2,inf\n"), "stress_pa is inf"),
            (format!("{head}{rows}bending,1.2,1\n"), "mode `bending`"),
            (format!("{head}{rows}tension,0,1\n"), "stretch of 0"),
            (
                format!("{head}compression,0.9,2\ncompression,0.8,3\ncompression,0.7,4\n"),
                "opposite signs",
            ),
        ] {
            let error = format!("{:#}", of(&text).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
