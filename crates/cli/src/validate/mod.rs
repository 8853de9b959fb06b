//! `upt validate`: laws and solver against what has been measured, and against closed forms, as a page.
//!
//! The data of others stay where they are: `--data FOLDER` names a folder with `brain.csv` and `silicone.csv`, whose columns
//! `docs/reference/formats.md` describes. Without it the closed forms and the relaxation alone are run.

mod between_plates;
mod brain;
mod closed_forms;
mod equilibrium;
mod glued;
mod half_space;
mod relaxing_rod;
mod relaxing_shear;
mod section;
mod silicone;
mod specimens;
mod torsion;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;

use crate::marks::replace_between;
use section::Section;

#[derive(Args)]
#[command(after_help = "Examples:
  upt validate
  upt validate --data measured --markdown page.md
  upt validate --data measured --only brain,specimens")]
pub struct Options {
    /// Folder with brain.csv and silicone.csv.
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Page whose parts between markers are replaced; plots go into the folder `images` beside it.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Sections that are run, all without it: brain, specimens, silicone, between plates, relaxation, relaxation by steps, closed forms, half space.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
}

/// Sections by their name, with the file that they read.
type Measured = (&'static str, &'static str, fn(&Path) -> Result<Section>);
const MEASURED: [Measured; 4] = [
    ("brain", "brain.csv", brain::section),
    ("specimens", "brain.csv", specimens::section),
    ("silicone", "silicone.csv", silicone::section),
    ("between plates", "silicone.csv", between_plates::section),
];
/// Those without data.
type Own = (&'static str, fn() -> Result<Section>);
const OWN: [Own; 4] = [
    ("relaxation", relaxing_rod::section),
    ("relaxation by steps", relaxing_shear::section),
    ("closed forms", closed_forms::section),
    ("half space", half_space::section),
];

impl Options {
    /// Refuses names of no section, and those that need data where there are none.
    fn check(&self) -> Result<()> {
        for name in &self.only {
            let needs_data = MEASURED.iter().any(|(own, ..)| own == name);
            if !needs_data && !OWN.iter().any(|(own, _)| own == name) {
                let names = MEASURED.iter().map(|(own, ..)| *own);
                let names: Vec<&str> = names.chain(OWN.map(|(own, _)| own)).collect();
                bail!("--only `{name}` is no section: use {}", names.join(", "));
            }
            if needs_data && self.data.is_none() {
                bail!("--only `{name}` is about measured data: name their folder by --data");
            }
        }
        Ok(())
    }

    fn wants(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|own| own == name)
    }
}

pub fn run(options: &Options) -> Result<ExitCode> {
    options.check()?;
    let mut sections = Vec::new();
    if let Some(folder) = &options.data {
        for (name, file, section) in MEASURED {
            if options.wants(name) {
                sections.push(section(&folder.join(file))?);
            }
        }
    }
    for (name, section) in OWN {
        if options.wants(name) {
            sections.push(section()?);
        }
    }
    for section in &sections {
        println!("{}\n", section.text);
        if let Some(page) = &options.markdown {
            write(page, section)?;
        }
    }
    if options.data.is_none() && options.only.is_empty() {
        println!("--data FOLDER adds the measured tissues");
    }
    Ok(ExitCode::SUCCESS)
}

fn write(page: &Path, section: &Section) -> Result<()> {
    let name = format!("upt validate {}", section.name);
    replace_between(page, &name, &format!("\n{}", section.text))?;
    let images = page.parent().unwrap_or(Path::new(".")).join("images");
    for (file, picture) in &section.plots {
        let path = images.join(file);
        std::fs::create_dir_all(&images)
            .and_then(|()| std::fs::write(&path, picture))
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{MEASURED, OWN, Options};

    #[test]
    fn sections_that_are_asked_for_are_known_and_have_their_data() {
        let options = |only: &[&str], data: Option<&str>| Options {
            data: data.map(Into::into),
            markdown: None,
            only: only.iter().map(|name| (*name).to_owned()).collect(),
        };
        assert!(options(&["closed forms"], None).check().is_ok());
        assert!(options(&["specimens"], Some("x")).check().is_ok());
        for (only, words) in [
            (
                "closed",
                "--only `closed` is no section: use brain, specimens",
            ),
            ("brain", "name their folder by --data"),
        ] {
            let error = options(&[only], None).check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let own = options(&["half space"], None);
        let wanted = MEASURED.iter().map(|(name, ..)| *name);
        let wanted = wanted.chain(OWN.map(|(name, _)| name));
        assert_eq!(wanted.filter(|name| own.wants(name)).count(), 1);
    }
}
