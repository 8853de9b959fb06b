//! `upt validate`: laws and solver against what has been measured, and against closed forms, as a page.
//!
//! The data of others stay where they are: `--data FOLDER` names a folder with `brain.csv` and `silicone.csv`, whose columns
//! `docs/reference/formats.md` describes. Without it the closed forms and the relaxation alone are run.

mod between_plates;
mod brain;
mod closed_forms;
mod equilibrium;
mod half_space;
mod relaxing_rod;
mod relaxing_shear;
mod section;
mod silicone;
mod specimens;
mod torsion;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;

use crate::marks::replace_between;
use section::Section;

#[derive(Args)]
#[command(after_help = "Examples:
  upt validate
  upt validate --data measured --markdown page.md")]
pub struct Options {
    /// Folder with brain.csv and silicone.csv.
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Page whose parts between markers are replaced; plots go into the folder `images` beside it.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let mut sections = Vec::new();
    if let Some(folder) = &options.data {
        sections.push(brain::section(&folder.join("brain.csv"))?);
        sections.push(specimens::section(&folder.join("brain.csv"))?);
        sections.push(silicone::section(&folder.join("silicone.csv"))?);
        sections.push(between_plates::section(&folder.join("silicone.csv"))?);
    }
    sections.push(relaxing_rod::section()?);
    sections.push(relaxing_shear::section()?);
    sections.push(closed_forms::section()?);
    sections.push(half_space::section()?);
    for section in &sections {
        println!("{}\n", section.text);
        if let Some(page) = &options.markdown {
            write(page, section)?;
        }
    }
    if options.data.is_none() {
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
