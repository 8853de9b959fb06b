//! What a report compares: the bundles that fit the cases, their mesh, and every configuration asked for.

use std::path::PathBuf;

use anyhow::{Result, bail};
use tissue::mesh::Mesh;

use super::cases::Cases;
use super::method::Method;
use super::{Options, Region, paper_split, same_body};
use host::Effort;
use yardstick::bundle_folder::BundleFolder;
use yardstick::prior_alone::PriorAlone;

/// The bundles whose mesh, boundary and tissue are the cases'; the others are named in `notes`.
pub fn fitting_bundles(
    options: &Options,
    cases: &Cases,
    notes: &mut Vec<String>,
) -> Result<Vec<BundleFolder>> {
    let paths = if options.bundles.is_empty() {
        upt_cli::doctor::bundles_below("onnx".as_ref())
    } else {
        options.bundles.clone()
    };
    let mut fitting = Vec::new();
    for path in &paths {
        let bundle = BundleFolder::read(path)?;
        match bundle.misfit(&cases.list[0].trajectory.header) {
            Some(reason) => notes.push(reason),
            None => fitting.push(bundle),
        }
    }
    Ok(fitting)
}

/// The cases' mesh: out of a fitting bundle, or of onnx/meshes.
pub fn mesh_of(cases: &Cases, bundles: &[BundleFolder]) -> Result<Mesh> {
    let mut candidates: Vec<PathBuf> = bundles
        .iter()
        .map(|bundle| bundle.mesh_file.clone())
        .collect();
    if let Ok(entries) = std::fs::read_dir("onnx/meshes") {
        candidates.extend(entries.filter_map(|entry| entry.ok().map(|entry| entry.path())));
    }
    for path in candidates {
        if path
            .extension()
            .is_some_and(|extension| extension == "safetensors")
        {
            let mesh = Mesh::read(&path)?;
            if mesh.hash() == cases.mesh_sha256 {
                return Ok(mesh);
            }
        }
    }
    bail!(
        "no bundle and no file of onnx/meshes has the cases' mesh ({}); name a bundle with --bundle",
        cases.mesh_sha256
    )
}

/// The curve of error against run time that a bundle with corrections is.
const FRONTIER: [u32; 5] = [0, 1, 3, 5, 10];

/// Corrections a step that a bundle is measured with: those asked for; else none and as many as it recommends, and the frontier
/// in the configuration whose field is whole and has the most threads.
fn corrections(
    options: &Options,
    bundle: &BundleFolder,
    region: Region,
    threads: u32,
) -> Vec<Effort> {
    let most = options.threads.iter().max() == Some(&threads);
    let mut counts = match bundle.corrections {
        None => vec![Effort::NONE],
        Some(_) if !options.corrections.is_empty() => options.corrections.clone(),
        Some(recommended) if region == Region::All && most => {
            [FRONTIER.map(Effort::fixed).as_slice(), &[recommended]].concat()
        }
        Some(recommended) => vec![Effort::NONE, recommended],
    };
    counts.sort_by(|a, b| a.partial_cmp(b).expect("targets are numbers"));
    counts.dedup();
    counts
}

/// Every configuration asked for.
pub fn methods(
    options: &Options,
    cases: &Cases,
    bundles: &[BundleFolder],
    notes: &mut Vec<String>,
) -> Result<Vec<Method>> {
    let mut methods = Vec::new();
    for bundle in bundles {
        for provider in &options.provider {
            let precisions = if options.precision.is_empty() {
                &bundle.precisions
            } else {
                &options.precision
            };
            for precision in precisions {
                for region in &options.region {
                    for threads in &options.threads {
                        let counts = corrections(options, bundle, *region, *threads);
                        methods.extend(counts.into_iter().map(|count| Method::Surrogate {
                            bundle: bundle.clone(),
                            provider: *provider,
                            precision: *precision,
                            region: *region,
                            threads: *threads,
                            corrections: count,
                        }));
                    }
                }
            }
        }
    }
    for plain in &options.plain {
        match plain.as_str() {
            "zero" => methods.push(Method::Zero),
            #[cfg(not(feature = "linear"))]
            "linear" => bail!(
                "--plain linear: this build leaves out the feature `linear`; --plain prior computes the same from a bundle's tables"
            ),
            #[cfg(feature = "linear")]
            "linear" => methods.push(Method::Linear {
                threads: options.threads.iter().copied().max().unwrap_or(1),
                decay: cases.release_decay(),
            }),
            "prior" => {
                // Bundles of one mesh and boundary share it: the first that has one.
                if let Some(bundle) = bundles.iter().find(|one| PriorAlone::available(one)) {
                    methods.extend(options.threads.iter().map(|threads| Method::Prior {
                        bundle: bundle.clone(),
                        threads: *threads,
                        decay: cases.release_decay(),
                    }));
                }
            }
            "coarse" if options.coarse_mesh.is_file() => {
                let coarse = Mesh::read(&options.coarse_mesh)?;
                if coarse.hash() == cases.mesh_sha256 {
                    notes.push("coarse TLED: the cases are on the coarse mesh themselves".into());
                    continue;
                }
                if let Some(reason) = same_body::difference(&coarse, &mesh_of(cases, bundles)?) {
                    notes.push(format!(
                        "coarse TLED: {} is another body than the cases' ({reason}); name a coarse mesh of theirs with --coarse-mesh",
                        options.coarse_mesh.display()
                    ));
                    continue;
                }
                methods.extend(options.threads.iter().map(|threads| Method::CoarseTled {
                    mesh: options.coarse_mesh.clone(),
                    threads: *threads,
                }));
            }
            "coarse" => notes.push(format!(
                "coarse TLED: {} does not exist",
                options.coarse_mesh.display()
            )),
            "tled" => methods.extend(
                options
                    .threads
                    .iter()
                    .map(|threads| Method::Tled { threads: *threads }),
            ),
            "paper" => {
                let with_split = bundles
                    .iter()
                    .filter(|bundle| paper_split::available(bundle));
                for bundle in with_split {
                    methods.extend(options.threads.iter().map(|threads| Method::PaperSplit {
                        bundle: bundle.clone(),
                        threads: *threads,
                    }));
                }
            }
            "none" => {}
            other => {
                bail!(
                    "--plain {other} is unknown; use zero, linear, prior, coarse, tled, paper or none"
                )
            }
        }
    }
    Ok(methods)
}
