//! What a run of the tests came to, at which commit and where: `target/xtask-logs/evidence.json`, which `cargo xtask soup` takes over.

use anyhow::Result;
use serde_json::{Map, Value, json};

use crate::process::output;
use crate::stages::STAGES;
use crate::workspace::Workspace;

const FILE: &str = "target/xtask-logs/evidence.json";

/// The state of the tree before the tests began.
pub struct Tree {
    commit: String,
    /// Files differ from the commit's.
    changed: bool,
}

impl Tree {
    pub fn now(workspace: &Workspace) -> Self {
        let git = |words: &str| output(&mut workspace.command("git", words)).unwrap_or_default();
        Self {
            commit: git("rev-parse HEAD").trim().to_owned(),
            changed: !git("status --porcelain").trim().is_empty(),
        }
    }

    /// Of one commit, without changes: then runs of some stages add up to one of all.
    fn is_that_of(&self, old: &Value) -> bool {
        !self.changed && old["changed"] == json!(false) && old["commit"] == json!(self.commit)
    }
}

/// Stages by name, each with what it counted.
pub fn write(workspace: &Workspace, tree: &Tree, stages: Map<String, Value>) -> Result<()> {
    let path = workspace.path(FILE);
    let old = std::fs::read(&path).ok();
    let old = old.and_then(|text| serde_json::from_slice::<Value>(&text).ok());
    let kept = old.filter(|old| tree.is_that_of(old));
    let mut all = match kept {
        Some(Value::Object(mut fields)) => match fields.remove("stages") {
            Some(Value::Object(stages)) => stages,
            _ => Map::new(),
        },
        _ => Map::new(),
    };
    all.extend(stages);
    let now = std::time::UNIX_EPOCH.elapsed()?.as_secs();
    let rustc = output(&mut workspace.command("rustc", "-V")).unwrap_or_default();
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = cpu.lines().find_map(|line| line.strip_prefix("model name"));
    let evidence = json!({
        "commit": tree.commit,
        "changed": tree.changed,
        "ended_unix_s": now,
        "rustc": rustc.trim(),
        "machine": {
            "system": std::env::consts::OS,
            "architecture": std::env::consts::ARCH,
            "cpu": cpu.map(|text| text.trim_start_matches([' ', '\t', ':'])),
            "cores": std::thread::available_parallelism().map_or(0, usize::from),
        },
        "stages": all,
        // Those that a whole run has: `soup` says which were left out.
        "of": STAGES.iter().copied().flatten().copied().flatten().map(|stage| stage.name).collect::<Vec<_>>(),
    });
    std::fs::create_dir_all(path.with_file_name(""))?;
    std::fs::write(path, serde_json::to_string_pretty(&evidence)? + "\n")?;
    Ok(())
}
