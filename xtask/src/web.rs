//! `cargo xtask package --platform web` and `cargo xtask site`: libupt in WebAssembly, its npm package, and a static site that shows organs;
//! and the stage that tests them.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use flate2::{Compression, GzBuilder};
use serde_json::{Value, json};

use crate::counts::{self, Outcome};
use crate::process::{output, run_checked};
use crate::workspace::{Workspace, copy};
use crate::{archive, venv};

const TARGET: &str = "wasm32-unknown-unknown";
const VIEW: &str = "crates/cli/src/view/page";
/// The bundle of the package's first program.
const BLOCK: &str = "examples/block";
/// What that page takes from beside it.
const THREE: [&str; 2] = ["three.js", "three.LICENSE"];

/// An organ of the site.
struct Organ {
    /// Its folder there.
    name: &'static str,
    title: &'static str,
    /// The bundle's folder; one below `target/` is made of the mesh first, by the command `upt make`.
    bundle: &'static str,
    mesh: Option<&'static str>,
}

/// The first is shown first. Bundles with a network are not among them: the module cannot run it.
const ORGANS: [Organ; 3] = [
    Organ {
        name: "liver",
        title: "liver",
        bundle: "onnx/liver-coarse",
        mesh: None,
    },
    Organ {
        name: "brain",
        title: "brain, coarse",
        bundle: "target/web/brain-coarse",
        mesh: Some("onnx/meshes/brain-coarse.mesh.safetensors"),
    },
    Organ {
        name: "brain-fine",
        title: "brain, fine (20 MB)",
        bundle: "onnx/brain",
        mesh: None,
    },
];

/// The module with the library's features, by a profile of `Cargo.toml`: `web` is what is shipped. Rust's standard library for it comes by rustup,
/// where it is missing.
///
/// # Errors
/// Where it cannot be had, or something does not compile.
fn module(workspace: &Workspace, profile: &str, features: &str) -> Result<PathBuf> {
    ensure!(
        has_target(workspace),
        "Rust's standard library for {TARGET} is missing: rustup target add {TARGET}"
    );
    let words = format!(
        "rustc --profile {profile} --lib --crate-type cdylib --target {TARGET} -p libupt --no-default-features --features {features}"
    );
    run_checked(
        workspace,
        "cargo build for the web",
        &mut workspace.cargo(&words),
    )?;
    let target = workspace.release.with_file_name("");
    let made = target.join(TARGET).join(profile).join("upt.wasm");
    let bare = made.with_file_name("upt.bare.wasm");
    let bytes = std::fs::read(&made).with_context(|| made.display().to_string())?;
    std::fs::write(
        &bare,
        without_names(&bytes).context("the module's sections")?,
    )?;
    Ok(bare)
}

/// A module without its custom sections: the names of its functions, 5 % of it, which the linker leaves there. `None` where a section's length is no number.
fn without_names(module: &[u8]) -> Option<Vec<u8>> {
    let (head, mut rest) = module.split_at_checked(8)?;
    let mut bare = head.to_vec();
    while let Some((&kind, after)) = rest.split_first() {
        let digits = 1 + after.iter().position(|byte| byte & 0x80 == 0)?;
        let number = after[..digits].iter().rev();
        let length = number.fold(0, |sum, byte| sum << 7 | usize::from(byte & 0x7f));
        let (section, next) = rest.split_at_checked(1 + digits + length)?;
        if kind != 0 {
            bare.extend_from_slice(section);
        }
        rest = next;
    }
    Some(bare)
}

fn has_target(workspace: &Workspace) -> bool {
    let words = format!("--print target-libdir --target {TARGET}");
    let is_there = || {
        let folder = output(&mut workspace.command("rustc", &words));
        folder.is_ok_and(|folder| Path::new(folder.trim()).is_dir())
    };
    let add = format!("target add {TARGET}");
    is_there() || (output(&mut workspace.command("rustup", &add)).is_ok() && is_there())
}

/// The npm package.
pub fn package(workspace: &Workspace, out: &Path) -> Result<PathBuf> {
    let root = out.join("web/package");
    unpacked(workspace, &module(workspace, "web", "instruments")?, &root)?;
    let words = "tests/style/licences.py --write";
    let mut licences = workspace.python(words);
    run_checked(workspace, words, licences.arg(root.join("THIRD-PARTY.txt")))?;
    let file = out.join(format!("libupt-{}.tgz", env!("CARGO_PKG_VERSION")));
    archive::pack(&out.join("web"), "package", &file, archive::time(workspace))?;
    Ok(file)
}

/// The package's folder, but for the notice of what the module links.
fn unpacked(workspace: &Workspace, wasm: &Path, root: &Path) -> Result<()> {
    std::fs::remove_dir_all(root).ok();
    modules(workspace, wasm, root)?;
    for name in ["package.json", "README.md"] {
        copy(&workspace.path("web").join(name), &root.join(name))?;
    }
    for name in ["LICENSE-APACHE", "LICENSE-MIT"] {
        copy(&workspace.path(name), &root.join(name))?;
    }
    for (name, place) in Workspace::bundle_files(&workspace.path(BLOCK))? {
        copy(&place, &root.join("block").join(name))?;
    }
    Ok(())
}

/// The JavaScript of the package with the module.
fn modules(workspace: &Workspace, wasm: &Path, to: &Path) -> Result<()> {
    copy(&workspace.path("web/src"), to)?;
    copy(wasm, &to.join("upt.wasm"))
}

/// `cargo xtask site`.
pub fn site(workspace: &Workspace, out: &Path) -> Result<bool> {
    let out = workspace.root.join(out);
    let wasm = module(workspace, "web", "instruments")?;
    make_bundles(workspace)?;
    write_site(workspace, &wasm, &ORGANS, &out)?;
    venv::install(workspace, venv::DOCS)?;
    let mut book = workspace.command(workspace.venv_program("mdbook"), "build docs --dest-dir");
    run_checked(workspace, "mdbook", book.arg(out.join("docs")))?;
    println!("{}", out.join("index.html").display());
    Ok(true)
}

/// The page of `upt view` over a worker. What is large comes compressed, whatever the host does.
fn write_site(workspace: &Workspace, wasm: &Path, organs: &[Organ], out: &Path) -> Result<()> {
    std::fs::remove_dir_all(out).ok();
    copy(&workspace.path(VIEW), out)?;
    for name in THREE {
        copy(
            &workspace.path("crates/page/src").join(name),
            &out.join(name),
        )?;
    }
    copy(&workspace.path("web/site"), out)?;
    copy(&workspace.path("web/src"), &out.join("libupt"))?;
    for name in ["NOTICE", "LICENSE-APACHE", "LICENSE-MIT"] {
        copy(&workspace.path(name), &out.join(name))?;
    }
    compress(wasm, &out.join("libupt/upt.wasm"))?;
    for organ in organs {
        let to = out.join("bundles").join(organ.name);
        write_bundle(&workspace.path(organ.bundle), &to).context(organ.bundle)?;
    }
    let entries = organs.iter();
    let entries = entries.map(|organ| json!({"name": organ.name, "title": organ.title}));
    let list: Vec<Value> = entries.collect();
    std::fs::write(out.join("bundles.json"), serde_json::to_string(&list)?)?;
    Ok(())
}

/// The bundles that are not committed, made once: minutes each.
fn make_bundles(workspace: &Workspace) -> Result<()> {
    for organ in &ORGANS {
        let folder = workspace.path(organ.bundle);
        let Some(mesh) = organ.mesh.filter(|_| !folder.join("bundle.json").is_file()) else {
            continue;
        };
        workspace.build()?;
        println!("making {}: some minutes, once", organ.bundle);
        let words = format!("make {mesh} --minutes 6 --out");
        let mut make = workspace.command(workspace.upt(), &words);
        run_checked(workspace, "upt make", make.arg(&folder))?;
    }
    Ok(())
}

/// A bundle's files, compressed, without its certificate and what the page does not read.
fn write_bundle(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    let path = from.join("bundle.json");
    let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
    let mut manifest = serde_json::from_slice(&bytes)?;
    let left_out = without_release(&mut manifest);
    for (name, place) in Workspace::bundle_files(from)? {
        if name == "bundle.json" {
            pack(&serde_json::to_vec(&manifest)?, &to.join(name))?;
        } else if left_out.as_ref() != Some(&name) {
            compress(&place, &to.join(name))?;
        }
    }
    Ok(())
}

/// Takes what was learned about releases out of a manifest, and gives its file: steps of another length than the bundle's, as the page's are, do not read it.
fn without_release(manifest: &mut Value) -> Option<String> {
    let step = &manifest["corrections"]["frame_step_s"];
    if step.is_null() || *step == manifest["dt_s"] {
        return None;
    }
    let release = manifest["prior"].as_object_mut()?.remove("release")?;
    let name = release.as_str()?.to_owned();
    manifest["files"].as_object_mut()?.remove(&name);
    let requires = manifest["requires"].as_array_mut()?;
    requires.retain(|word| word != "release");
    // Of the whole manifest; one without it is taken.
    manifest.as_object_mut()?.remove("manifest_sha256");
    Some(name)
}

/// A file as `NAME.gz`.
fn compress(from: &Path, to: &Path) -> Result<()> {
    let bytes = std::fs::read(from).with_context(|| format!("cannot read {}", from.display()))?;
    pack(&bytes, to)
}

fn pack(bytes: &[u8], to: &Path) -> Result<()> {
    let mut name = to.as_os_str().to_owned();
    name.push(".gz");
    let file = std::fs::File::create(&name)?;
    let mut packed = GzBuilder::new().mtime(0).write(file, Compression::best());
    packed.write_all(bytes)?;
    packed.finish()?;
    Ok(())
}

/// `cargo xtask test --only web`.
pub fn stage(workspace: &Workspace) -> Result<Outcome> {
    if !has_target(workspace) {
        return Ok(Outcome::skipped(&format!(
            "needs rustup target add {TARGET}"
        )));
    }
    // Optimising the module as a whole is half of its build, and changes no bit of what it computes. What its build runs, such as macros, is there from
    // the stage `build` in one of them.
    let profile = match workspace.is_nightly() {
        true => "web",
        false => "release",
    };
    // With the call that panics.
    let wasm = module(workspace, profile, "instruments,fault")?;
    let site = workspace.path("target/web/site");
    write_site(workspace, &wasm, &ORGANS[..1], &site)?;
    let npm = workspace.path("target/web/npm");
    unpacked(workspace, &wasm, &npm)?;
    let environment = [
        ("UPT_WASM", &*wasm),
        ("UPT_SITE", &*site),
        ("UPT_NPM", &*npm),
    ];
    counts::script(workspace, "web", "tests/web/run.sh", &environment)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn custom_sections_are_left_out() {
        let head = [0, 97, 115, 109, 1, 0, 0, 0];
        let long = [&[0u8, 0x82, 0x01][..], &[7; 130]].concat(); // custom, of 130 bytes
        let types = [1u8, 4, 1, 0x60, 0, 0];
        let whole = [&head[..], &long, &types, &[0, 1, 0]].concat();
        assert_eq!(without_names(&whole), Some([&head[..], &types].concat()));
        assert_eq!(without_names(&whole[..20]), None);
    }

    #[test]
    fn the_page_loads_no_release_that_its_steps_do_not_read() {
        let mut manifest = json!({
            "dt_s": 0.05, "requires": ["release", "vibration"], "corrections": {"frame_step_s": 0.02},
            "prior": {"file": "prior.st", "release": "release.st"},
            "files": {"prior.st": {}, "release.st": {}}, "manifest_sha256": "0",
        });
        let mut same_step = manifest.clone();
        same_step["dt_s"] = json!(0.02);
        assert_eq!(without_release(&mut same_step), None);
        let name = without_release(&mut manifest);
        assert_eq!(name.as_deref(), Some("release.st"));
        let wanted = json!({
            "dt_s": 0.05, "requires": ["vibration"], "corrections": {"frame_step_s": 0.02},
            "prior": {"file": "prior.st"}, "files": {"prior.st": {}},
        });
        assert_eq!(manifest, wanted);
    }
}
