//! Where a bundle is fetched from: a folder, an address, or the history of a clone. A file is read up to the size that it should have.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

pub(super) enum Source {
    /// Holds `NAME/FILE`.
    Folder(PathBuf),
    /// The same, behind an address.
    Address(String),
    /// `onnx/NAME/FILE` of a commit of a clone.
    History { clone: PathBuf, commit: String },
}

impl Source {
    /// What `--from` names.
    pub(super) fn of(place: &str) -> Source {
        match place.starts_with("http://") || place.starts_with("https://") {
            true => Source::Address(place.trim_end_matches('/').to_owned()),
            false => Source::Folder(place.into()),
        }
    }

    /// The commit, in the clone at hand or in the one that this program was built in.
    ///
    /// # Errors
    /// Where neither has it: says what to do.
    pub(super) fn history(commit: &str) -> Result<Source> {
        let exe = std::env::current_exe().ok();
        let built = exe.as_ref().and_then(|exe| exe.ancestors().nth(3));
        let places = [Some(Path::new(".")), built];
        for clone in places.into_iter().flatten() {
            let spec = format!("{commit}^{{commit}}");
            let found = git(clone, &["cat-file", "-e", &spec])
                .stderr(Stdio::null())
                .status();
            if found.is_ok_and(|status| status.success()) {
                return Ok(Source::History {
                    clone: clone.to_owned(),
                    commit: commit.to_owned(),
                });
            }
        }
        bail!(
            "no clone of libupt with commit {commit} is here: give --from, a folder or an address; or, in a shallow clone, `git fetch --depth 1 origin {commit}` first"
        )
    }

    /// A file of at most `most` bytes.
    pub(super) fn read(&self, bundle: &str, file: &str, most: u64) -> Result<Vec<u8>> {
        let (what, bytes) = match self {
            Source::Folder(folder) => {
                let path = folder.join(bundle).join(file);
                let what = path.display().to_string();
                let found = std::fs::metadata(&path).with_context(|| what.clone())?;
                ensure!(found.is_file(), "{what}: is not a regular file");
                let stream = File::open(&path).with_context(|| what.clone())?;
                let mut bytes = Vec::new();
                stream
                    .take(most + 1)
                    .read_to_end(&mut bytes)
                    .with_context(|| what.clone())?;
                (what, bytes)
            }
            Source::Address(address) => {
                let what = format!("{address}/{bundle}/{file}");
                let mut curl = Command::new("curl");
                curl.args([
                    "--fail",
                    "--silent",
                    "--show-error",
                    "--location",
                    "--proto",
                ]);
                curl.args(["=http,https", "--max-filesize", &most.to_string(), &what]);
                let bytes = output(&mut curl, &what, most)
                    .context("addresses are fetched by the program `curl`")?;
                (what, bytes)
            }
            Source::History { clone, commit } => {
                let what = format!("{commit}:onnx/{bundle}/{file}");
                let bytes = output(&mut git(clone, &["cat-file", "blob", &what]), &what, most)?;
                (what, bytes)
            }
        };
        ensure!(
            bytes.len() as u64 <= most,
            "{what}: is larger than the {most} bytes that it should have"
        );
        Ok(bytes)
    }
}

fn git(clone: &Path, words: &[&str]) -> Command {
    let mut command = Command::new("git");
    command.arg("-C").arg(clone).args(words);
    command
}

/// The first `most + 1` bytes that a program writes.
fn output(command: &mut Command, what: &str, most: u64) -> Result<Vec<u8>> {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let program = command.get_program().to_string_lossy().into_owned();
    let mut child = command
        .spawn()
        .with_context(|| format!("{program} cannot be started"))?;
    let mut bytes = Vec::new();
    if let Some(stream) = child.stdout.take() {
        stream.take(most + 1).read_to_end(&mut bytes)?;
    }
    let mut said = String::new();
    if let Some(mut stream) = child.stderr.take() {
        stream.read_to_string(&mut said).ok();
    }
    let ended = child.wait()?;
    // Whoever is read no further may end in a broken pipe: what it wrote is too long anyway.
    ensure!(
        ended.success() || bytes.len() as u64 > most,
        "{what}: {program}: {}",
        said.trim()
    );
    Ok(bytes)
}
