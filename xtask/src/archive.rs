//! Archives that are the same bytes for the same files: names sorted, no owner, one time, modes of two kinds.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use flate2::{Compression, GzBuilder};
use tar::{Builder, EntryType, Header};

/// Seconds since 1970 that all entries carry: `SOURCE_DATE_EPOCH`, else the commit's time, else 0.
pub fn time(root: &Path) -> u64 {
    let given = std::env::var("SOURCE_DATE_EPOCH").ok();
    let committed = || {
        let output = Command::new("git")
            .current_dir(root)
            .args(["log", "-1", "--format=%ct"])
            .output()
            .ok()?;
        String::from_utf8(output.stdout).ok()
    };
    let text = given.or_else(committed).unwrap_or_default();
    text.trim().parse().unwrap_or(0)
}

/// Packs the folder `name` of `parent` into the gzipped tar `file`.
pub fn pack(parent: &Path, name: &str, file: &Path, time: u64) -> Result<()> {
    let context = || format!("cannot write {}", file.display());
    let out = File::create(file).with_context(context)?;
    // No name and no time in the gzip header either.
    let mut tar = Builder::new(GzBuilder::new().mtime(0).write(out, Compression::default()));
    add(&mut tar, parent, &PathBuf::from(name), time)?;
    tar.into_inner()
        .and_then(flate2::write::GzEncoder::finish)
        .with_context(context)?;
    Ok(())
}

fn add(
    tar: &mut Builder<impl std::io::Write>,
    parent: &Path,
    name: &Path,
    time: u64,
) -> Result<()> {
    let path = parent.join(name);
    let context = || format!("cannot pack {}", path.display());
    let found = fs::symlink_metadata(&path).with_context(context)?;
    let mut header = Header::new_gnu();
    header.set_mtime(time);
    header.set_uid(0);
    header.set_gid(0);
    header.set_mode(if found.is_dir() || is_executable(&found) {
        0o755
    } else {
        0o644
    });
    header.set_size(0);
    if found.is_symlink() {
        header.set_entry_type(EntryType::Symlink);
        let target = fs::read_link(&path).with_context(context)?;
        return tar
            .append_link(&mut header, name, target)
            .with_context(context);
    }
    if found.is_file() {
        header.set_entry_type(EntryType::Regular);
        header.set_size(found.len());
        let content = File::open(&path).with_context(context)?;
        return tar
            .append_data(&mut header, name, content)
            .with_context(context);
    }
    header.set_entry_type(EntryType::Directory);
    tar.append_data(&mut header, name.join(""), std::io::empty())
        .with_context(context)?;
    let mut entries = fs::read_dir(&path)
        .and_then(|entries| {
            entries
                .map(|e| Ok(e?.file_name()))
                .collect::<Result<Vec<_>, _>>()
        })
        .with_context(context)?;
    entries.sort();
    entries
        .iter()
        .try_for_each(|entry| add(tar, parent, &name.join(entry), time))
}

#[cfg(unix)]
fn is_executable(found: &fs::Metadata) -> bool {
    use std::os::unix::fs::PermissionsExt;
    found.permissions().mode() & 0o100 != 0
}

#[cfg(not(unix))]
fn is_executable(_: &fs::Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with files made in this order.
    fn folder(names: &[&str]) -> tempfile::TempDir {
        let made = tempfile::tempdir().unwrap();
        for name in names {
            let path = made.path().join("package").join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, name).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("b.txt", made.path().join("package/link")).unwrap();
        made
    }

    #[test]
    fn the_same_files_give_the_same_bytes() {
        let (a, b) = (
            folder(&["b.txt", "lib/a.so", "lib/z.so"]),
            folder(&["lib/z.so", "lib/a.so", "b.txt"]),
        );
        // Another time, and another mode for the others.
        let file = File::options()
            .write(true)
            .open(b.path().join("package/b.txt"));
        let long_ago = std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000);
        file.unwrap().set_modified(long_ago).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = fs::Permissions::from_mode(0o600);
            fs::set_permissions(b.path().join("package/b.txt"), mode).unwrap();
        }
        let bytes = |folder: &tempfile::TempDir| {
            let file = folder.path().join("out.tar.gz");
            pack(folder.path(), "package", &file, 1_700_000_000).unwrap();
            fs::read(file).unwrap()
        };
        let packed = bytes(&a);
        assert_eq!(packed, bytes(&b));

        let mut tar = tar::Archive::new(flate2::read::GzDecoder::new(packed.as_slice()));
        let names: Vec<String> = tar
            .entries()
            .unwrap()
            .map(|entry| {
                let entry = entry.unwrap();
                let header = entry.header();
                assert_eq!(header.mtime().unwrap(), 1_700_000_000);
                assert_eq!((header.uid().unwrap(), header.gid().unwrap()), (0, 0));
                assert!(matches!(header.username(), Ok(None | Some(""))));
                entry.path().unwrap().display().to_string()
            })
            .filter(|name| name != "package/link")
            .collect();
        let wanted = [
            "package/",
            "package/b.txt",
            "package/lib/",
            "package/lib/a.so",
            "package/lib/z.so",
        ];
        assert_eq!(names, wanted);

        fs::write(a.path().join("package/b.txt"), "other").unwrap();
        assert_ne!(packed, bytes(&a));
    }
}
