//! `upt make --emit`: job scripts for a cluster, in place of a run here: this command for the bundle, `upt dataset` in shards for
//! trajectories, and the training of a learned part from them.
//!
//! SLURM: `submit.sh` submits three jobs that wait for one another. Ray: `run.py` is the same on a Ray cluster (or on one machine).

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use make::Options;

const RAY: &str = include_str!("emit_ray.py");
/// Cases of the trajectories, and shards that make them.
const CASES: usize = 400;
const SHARDS: usize = 20;
const CORES: usize = 8;

/// A word of a shell's command line.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// This run's own arguments without `--emit` and its two values.
fn arguments() -> Vec<String> {
    let mut kept: Vec<String> = std::env::args().skip(1).collect();
    if let Some(at) = kept.iter().position(|argument| argument == "--emit") {
        kept.drain(at..(at + 3).min(kept.len()));
    }
    kept
}

/// Writes the scripts for `slurm` or `ray` into the folder; returns the one to start.
pub fn write(options: &Options, cluster: &str, folder: &Path) -> Result<PathBuf> {
    if !["slurm", "ray"].contains(&cluster) {
        bail!("--emit {cluster}: write --emit slurm DIR or --emit ray DIR");
    }
    let here = std::env::current_dir()?.display().to_string();
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be made", folder.display()))?;
    let work = options.work_folder();
    let mesh = work.join("mesh.safetensors").display().to_string();
    let columns = work.join("columns.safetensors").display().to_string();
    let data = work.join("data").display().to_string();
    let learned = format!("{}-learned", options.out.display());
    let training = work.join("training").display().to_string();
    let material = options.material()?;
    let make: Vec<String> = std::iter::once("upt".to_owned())
        .chain(arguments())
        .collect();
    let numbers = [
        ("--young", material.young_pa),
        ("--poisson", material.poisson),
        ("--density", material.density_kg_m3),
        ("--damping", material.damping_per_s),
    ];
    let mut simulate: Vec<String> = ["upt", "dataset", "--mesh", &mesh, "--schemes", "probe,1-4"]
        .map(str::to_owned)
        .to_vec();
    simulate.extend(["--out".into(), data.clone(), "--half".into()]);
    simulate.extend(
        numbers
            .iter()
            .flat_map(|(name, value)| [(*name).to_owned(), value.to_string()]),
    );
    simulate.extend(["--law".to_owned(), material.law.to_string()]);
    if !material.relaxation.is_empty() {
        simulate.extend(["--relaxation".to_owned(), material.relaxation.to_string()]);
    }
    let train: Vec<String> = [
        "python",
        "-m",
        "upt_training.reduced",
        "build",
        "--mesh",
        &mesh,
        "--columns",
        &columns,
        "--data",
        &data,
        "--out",
        &learned,
        "--work",
        &training,
        "--name",
        &learned,
    ]
    .map(str::to_owned)
    .to_vec();
    let save = |name: &str, text: String| -> Result<PathBuf> {
        let path = folder.join(name);
        std::fs::write(&path, text)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        Ok(path)
    };
    match cluster {
        "slurm" => {
            let line = |words: &[String]| {
                words
                    .iter()
                    .map(|word| quoted(word))
                    .collect::<Vec<_>>()
                    .join(" ")
            };
            let job = |name: &str, head: &str, command: String| {
                save(
                    &format!("{name}.sbatch"),
                    format!(
                        "#!/bin/bash\n#SBATCH --job-name=upt-{name}\n{head}set -euo pipefail\ncd {}\n{command}\n",
                        quoted(&here)
                    ),
                )
            };
            let cores = format!("#SBATCH --cpus-per-task={CORES}\n");
            job("bundle", &cores, line(&make))?;
            job(
                "data",
                &format!("{cores}#SBATCH --array=0-{}\n", SHARDS - 1),
                format!(
                    "{} --count {CASES} --jobs \"$SLURM_CPUS_PER_TASK\" --shard \"$SLURM_ARRAY_TASK_ID/{SHARDS}\"",
                    line(&simulate)
                ),
            )?;
            job(
                "train",
                &cores,
                format!("{} --count {CASES}\n{}", line(&simulate), line(&train)),
            )?;
            save(
                "submit.sh",
                "#!/bin/bash\nset -euo pipefail\ncd \"$(dirname \"$0\")\"\nbundle=$(sbatch --parsable bundle.sbatch)\n\
                 data=$(sbatch --parsable --dependency=\"afterok:$bundle\" data.sbatch)\n\
                 train=$(sbatch --parsable --dependency=\"afterok:$data\" train.sbatch)\n\
                 echo \"$bundle $data $train\"\n"
                    .to_owned(),
            )
        }
        _ => {
            let mut program = RAY.to_owned();
            for (name, words) in [
                ("@FOLDER@", serde_json::to_string(&here)?),
                ("@MAKE@", serde_json::to_string(&make)?),
                ("@SIMULATE@", serde_json::to_string(&simulate)?),
                ("@TRAIN@", serde_json::to_string(&train)?),
                ("@CORES@", CORES.to_string()),
                ("@SHARDS@", SHARDS.to_string()),
                ("@CASES@", CASES.to_string()),
            ] {
                program = program.replace(name, &words);
            }
            save("run.py", program)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn words_with_blanks_and_quotes_survive_a_shell() {
        assert_eq!(quoted("plane:0,0,-1,-10"), "plane:0,0,-1,-10");
        assert_eq!(quoted("my liver.obj"), "'my liver.obj'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
