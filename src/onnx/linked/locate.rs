//! Where ONNX Runtime's shared library may be: next to libupt, `ORT_DYLIB_PATH`, then the system.
//!
//! A copy next to libupt is the one that was shipped with it, so it comes before what a machine
//! happens to have. A host that names a path means that file: where it cannot be loaded nothing
//! else is tried, since a silent second choice would be another version with other bits.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Platform's name of the library without a version.
pub fn plain_name() -> &'static str {
    if cfg!(windows) {
        "onnxruntime.dll"
    } else if cfg!(target_os = "macos") {
        "libonnxruntime.dylib"
    } else {
        "libonnxruntime.so"
    }
}

/// Candidates in the order in which they are tried, each with why it is one.
///
/// An explicit path is the only candidate. All but the system's are absolute.
pub fn candidates(explicit: Option<&Path>) -> Vec<(PathBuf, &'static str)> {
    if let Some(path) = explicit {
        return vec![(absolute(path), "onnxruntime_path of the options")];
    }
    let mut found = Vec::new();
    if let Some(folder) = own_folder() {
        // Where none is there, the plain name goes into the list all the same: the message about a
        // failed search then says that this folder was looked into.
        let mut beside = libraries_in(&folder);
        if beside.is_empty() {
            beside.push(folder.join(plain_name()));
        }
        found.extend(beside.into_iter().map(|path| (path, "next to libupt")));
    }
    if let Some(path) = std::env::var_os("ORT_DYLIB_PATH").filter(|value| !value.is_empty()) {
        found.push((absolute(Path::new(&path)), "ORT_DYLIB_PATH"));
    }
    found.push((PathBuf::from(plain_name()), "the system's search path"));
    if cfg!(target_os = "linux") {
        found.push((
            PathBuf::from("libonnxruntime.so.1"),
            "the system's search path",
        ));
    }
    found
}

/// The path seen from the working folder of this moment; the file need not exist, and links are not
/// followed.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// Libraries of any version in a folder, the newest name last in the alphabet first.
///
/// "Newest" is by the alphabet, so that `.so.1.9` comes before `.so.1.10`. In the folder of one
/// package the longest name comes first, which is the file that the shorter ones link to.
fn libraries_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let stem = plain_name();
    let mut names: Vec<OsString> = entries
        .flatten()
        .map(|entry| entry.file_name())
        .filter(|name| {
            let name = name.to_string_lossy();
            name == stem || (cfg!(target_os = "linux") && name.starts_with("libonnxruntime.so."))
        })
        .collect();
    names.sort_by(|a, b| b.cmp(a));
    names.into_iter().map(|name| folder.join(name)).collect()
}

/// Folder of the shared object or executable that holds this code.
///
/// Asked of the loader by an address in this code, since the executable's own folder is another
/// where libupt is a shared library in a game engine or in Python.
#[cfg(unix)]
pub fn own_folder() -> Option<PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    let mut info = std::mem::MaybeUninit::<libc::Dl_info>::zeroed();
    let address = own_folder as *const () as *const libc::c_void;
    // SAFETY: `address` is a code address of this object; `info` is written before it is read, as the result says.
    let name = unsafe {
        if libc::dladdr(address, info.as_mut_ptr()) == 0 {
            return None;
        }
        let name = info.assume_init().dli_fname;
        if name.is_null() {
            return None;
        }
        std::ffi::CStr::from_ptr(name)
    };
    let path = Path::new(std::ffi::OsStr::from_bytes(name.to_bytes()));
    absolute(path).parent().map(Path::to_owned)
}

/// Folder of the module that holds this code.
#[cfg(windows)]
pub fn own_folder() -> Option<PathBuf> {
    use std::os::windows::ffi::OsStringExt;
    #[link(name = "kernel32")]
    unsafe extern "system" {
        fn GetModuleHandleExW(
            flags: u32,
            address: *const u16,
            module: *mut *mut core::ffi::c_void,
        ) -> i32;
        fn GetModuleFileNameW(module: *mut core::ffi::c_void, name: *mut u16, size: u32) -> u32;
    }
    // FROM_ADDRESS, and UNCHANGED_REFCOUNT: no handle that would have to be given back.
    const FROM_ADDRESS_UNCHANGED: u32 = 0x4 | 0x2;
    let mut module = std::ptr::null_mut();
    let mut name = [0u16; 4096];
    // SAFETY: both calls get valid addresses and the buffer's length.
    let length = unsafe {
        if GetModuleHandleExW(
            FROM_ADDRESS_UNCHANGED,
            own_folder as *const () as *const u16,
            &mut module,
        ) == 0
        {
            return None;
        }
        GetModuleFileNameW(module, name.as_mut_ptr(), name.len() as u32)
    };
    let path = PathBuf::from(OsString::from_wide(&name[..length as usize]));
    path.parent().map(Path::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_explicit_path_is_the_only_candidate_and_absolute() {
        let found = candidates(Some(Path::new("some/libonnxruntime.so")));
        assert_eq!(found.len(), 1);
        assert!(found[0].0.is_absolute());
    }

    #[test]
    fn the_own_folder_comes_before_the_system() {
        let folder = own_folder().unwrap();
        let found = candidates(None);
        assert!(found[0].0.starts_with(&folder));
        assert_eq!(found.last().unwrap().1, "the system's search path");
    }
}
