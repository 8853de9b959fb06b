//! Archives that are the same bytes for the same files: names sorted, no owner, one time, modes of two kinds.

use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result};
use flate2::{Compression, GzBuilder};
use tar::{Builder, Header, HeaderMode};
use walkdir::WalkDir;

use crate::process::output;
use crate::workspace::Workspace;

/// Seconds since 1970 that all entries carry: `SOURCE_DATE_EPOCH`, else the commit's time, else 0.
pub fn time(workspace: &Workspace) -> u64 {
    let committed = || output(&mut workspace.command("git", "log -1 --format=%ct")).ok();
    let text = std::env::var("SOURCE_DATE_EPOCH").ok().or_else(committed);
    text.and_then(|text| text.trim().parse().ok()).unwrap_or(0)
}

/// Packs the folder `name` of `parent` into the gzipped tar `file`.
pub fn pack(parent: &Path, name: &str, file: &Path, time: u64) -> Result<()> {
    let out = File::create(file).with_context(|| format!("cannot write {}", file.display()))?;
    // No name and no time in the gzip header either.
    let mut tar = Builder::new(GzBuilder::new().mtime(0).write(out, Compression::default()));
    for entry in WalkDir::new(parent.join(name)).sort_by_file_name() {
        let entry = entry?;
        let (path, found) = (entry.path(), entry.metadata()?);
        let inside = path.strip_prefix(parent)?;
        let mut header = Header::new_gnu();
        header.set_metadata_in_mode(&found, HeaderMode::Deterministic);
        header.set_mtime(time);
        if found.is_symlink() {
            tar.append_link(&mut header, inside, std::fs::read_link(path)?)?;
        } else if found.is_dir() {
            tar.append_data(&mut header, inside.join(""), std::io::empty())?;
        } else {
            let content =
                File::open(path).with_context(|| format!("cannot pack {}", path.display()))?;
            tar.append_data(&mut header, inside, content)?;
        }
    }
    tar.into_inner()?.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_files_give_the_same_bytes() {
        let pack_of = |names: &[&str], age: u64| {
            let made = tempfile::tempdir().unwrap();
            std::fs::create_dir_all(made.path().join("package/lib")).unwrap();
            for name in names {
                let path = made.path().join("package").join(name);
                std::fs::write(&path, name).unwrap();
                let file = File::options().write(true).open(&path).unwrap();
                let old = std::time::UNIX_EPOCH + std::time::Duration::from_secs(age);
                file.set_modified(old).unwrap();
                #[cfg(unix)]
                {
                    use std::os::unix::fs::PermissionsExt;
                    let mode = if age > 1_000_000 { 0o600 } else { 0o644 };
                    std::fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
                }
            }
            #[cfg(unix)]
            std::os::unix::fs::symlink("b.txt", made.path().join("package/link")).unwrap();
            let file = made.path().join("out.tar.gz");
            pack(made.path(), "package", &file, 1_700_000_000).unwrap();
            std::fs::read(file).unwrap()
        };
        let packed = pack_of(&["b.txt", "lib/a.so", "lib/z.so"], 1_000_000);
        let later = pack_of(&["lib/z.so", "lib/a.so", "b.txt"], 2_000_000);
        assert_eq!(packed, later);
        let other = pack_of(&["b.txt", "lib/a.so", "lib/y.so"], 1_000_000);
        assert_ne!(packed, other);

        let mut tar = tar::Archive::new(flate2::read::GzDecoder::new(packed.as_slice()));
        for entry in tar.entries().unwrap() {
            let header = entry.unwrap().header().clone();
            assert_eq!(header.mtime().unwrap(), 1_700_000_000);
            assert_eq!((header.uid().unwrap(), header.gid().unwrap()), (0, 0));
        }
    }
}
