//! `upt materials`: tissues by name, each a law with its source, for every option that takes a law.
//!
//! The table is `tissues.csv` beside this file: a row a tissue, with the law in the form of `--law`, the stretches that its data reach
//! (beyond them a law extrapolates) and the DOI of the data.

use std::process::ExitCode;

use anyhow::Context;
use clap::Args;
use elements::{Law, Relaxation};
use serde_json::json;

/// `name, tissue, law, relaxation, data, doi, source`, with a head line.
const TABLE: &str = include_str!("tissues.csv");

#[derive(Args)]
#[command(after_help = "Examples:
  upt materials
  upt materials --json
  upt simulate --mesh onnx/meshes/brain-coarse.mesh.safetensors --law corona-radiata --out press.safetensors --tool press")]
pub struct Options {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// One tissue of the table.
#[derive(Clone, Copy, Debug)]
pub struct Tissue<'a> {
    /// What `--law` calls it.
    pub name: &'a str,
    pub tissue: &'a str,
    /// As `--law` has it.
    pub law: &'a str,
    /// As `--relaxation` has it; empty where none was measured.
    pub relaxation: &'a str,
    /// What the measured stretches and shears reach.
    pub data: &'a str,
    pub doi: &'a str,
    pub source: &'a str,
}

/// All rows.
pub fn tissues() -> Vec<Tissue<'static>> {
    TABLE
        .lines()
        .skip(1)
        .filter_map(|line| {
            let mut fields = line.split(';').map(str::trim);
            let mut next = || fields.next();
            Some(Tissue {
                name: next()?,
                tissue: next()?,
                law: next()?,
                relaxation: next()?,
                data: next()?,
                doi: next()?,
                source: next()?,
            })
        })
        .collect()
}

/// A Prony series, that of a tissue, one as a manifest has it, or none; what clap calls for `--relaxation`.
pub fn relaxation(text: &str) -> Result<Relaxation, String> {
    if text.starts_with('[') {
        return serde_json::from_str(text).map_err(|error| format!("`{text}`: {error}"));
    }
    let tissue = tissues().into_iter().find(|tissue| tissue.name == text);
    match tissue.map(|tissue| tissue.relaxation) {
        Some("") => Err(format!(
            "no relaxation of `{text}` was measured; `upt materials` lists those of other tissues"
        )),
        Some(measured) => Relaxation::parse(measured),
        None if text.is_empty() => Ok(Relaxation::default()),
        None => Relaxation::parse(text),
    }
}

/// Where a tissue's law comes from; empty for a law that is no tissue's.
pub fn source_of(law: &Law) -> String {
    let own = law.matrix().to_string();
    let found = tissues().into_iter().find(|tissue| tissue.law == own);
    let part = law
        .fibres()
        .map_or("", |_| ", the matrix without its fibres");
    found.map_or_else(String::new, |tissue| {
        format!("{} ({}{part})", tissue.doi, tissue.tissue)
    })
}

/// A law by its formula, by the name of a tissue or as a manifest has it; what clap calls for `--law`.
pub fn law(text: &str) -> Result<Law, String> {
    if text.starts_with('{') {
        let law: Law = serde_json::from_str(text).map_err(|error| format!("`{text}`: {error}"))?;
        // Its formula is checked as one that is typed.
        return law.to_string().parse();
    }
    let named = |name: &str| tissues().into_iter().find(|tissue| tissue.name == name);
    // Fibres in a tissue as their matrix.
    if let Some((name, fibres)) = text.split_once("+fibres:")
        && let Some(matrix) = named(name)
    {
        return format!("{}+fibres:{fibres}", matrix.law).parse();
    }
    match named(text) {
        Some(tissue) => tissue.law.parse(),
        None => text.parse().map_err(|error: String| {
            if text.contains(':') {
                error
            } else {
                format!("{error}; or a tissue that `upt materials` lists")
            }
        }),
    }
}

pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    let mut rows = Vec::new();
    for tissue in tissues() {
        let law: Law = (tissue.law.parse())
            .map_err(anyhow::Error::msg)
            .with_context(|| format!("tissues.csv: {}", tissue.name))?;
        let shear = law.young_pa(0.5).map(|young| young / 3.0);
        rows.push((tissue, shear));
    }
    if options.json {
        let list: Vec<_> = rows
            .iter()
            .map(|(tissue, shear)| {
                json!({"name": tissue.name, "tissue": tissue.tissue, "law": tissue.law, "relaxation": tissue.relaxation, "shear_modulus_pa": shear,
                    "data": tissue.data, "doi": tissue.doi, "source": tissue.source})
            })
            .collect();
        println!("{}", serde_json::to_string_pretty(&list)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!(
        "{:20}{:>10}  {:24}{:30}tissue",
        "name", "G, Pa", "law", "DOI of the data"
    );
    for (tissue, shear) in &rows {
        let shear = shear.map_or_else(String::new, |g| format!("{g:.0}"));
        let relaxation = match tissue.relaxation {
            "" => String::new(),
            text => format!("; --relaxation {text}"),
        };
        println!(
            "{:20}{:>10}  {:24}{:30}{} ({}{relaxation})",
            tissue.name, shear, tissue.law, tissue.doi, tissue.tissue, tissue.data
        );
    }
    println!("\nSources:");
    let mut sources: Vec<&str> = rows.iter().map(|(tissue, _)| tissue.source).collect();
    sources.dedup();
    for source in sources {
        println!("  {source}");
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::{law, relaxation, tissues};

    #[test]
    fn every_tissue_is_a_law_with_a_doi_and_a_source() {
        let all = tissues();
        assert!(all.len() >= 4);
        for tissue in &all {
            let law = law(tissue.name).unwrap();
            assert_eq!(law.to_string(), tissue.law, "{}", tissue.name);
            assert!(law.young_pa(0.49).unwrap() > 0.0);
            assert!(tissue.doi.starts_with("10."), "{}", tissue.doi);
            assert!(!tissue.source.is_empty() && !tissue.data.is_empty());
            // As a manifest has it, by which `cargo xtask demo` simulates for a bundle.
            let written = serde_json::to_string(&law).unwrap();
            assert_eq!(super::law(&written).unwrap().to_string(), tissue.law);
            let relaxes = !tissue.relaxation.is_empty();
            if let Ok(series) = relaxation(tissue.name) {
                let written = serde_json::to_string(&series).unwrap();
                assert_eq!(
                    relaxation(&written).unwrap().to_string(),
                    series.to_string()
                );
            }
            assert_eq!(relaxation(tissue.name).is_ok(), relaxes, "{}", tissue.name);
            assert_eq!(
                all.iter().filter(|other| other.name == tissue.name).count(),
                1
            );
        }
    }

    #[test]
    fn a_name_that_is_none_leads_to_the_list() {
        assert!(law("spleen").unwrap_err().contains("upt materials"));
        // Falls with stretch.
        assert!(law(r#"{"name":"yeoh","c2_over_c1":-1.0,"c3_over_c1":0.0}"#).is_err());
        assert!(!law("ogden:1,2,3").unwrap_err().contains("upt materials"));
    }
}
