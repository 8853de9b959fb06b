//! Names the shared library for the linker: soname `libupt.so.0` (the ABI's major version), so that a host that was
//! linked against one version finds any compatible one. Exported symbols need no version script of ours: rustc writes
//! one that keeps everything local but `#[no_mangle]` functions, and a second one is an error for GNU ld; the test
//! `symbols` in `tests/c` holds the result.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let system = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    match system.as_str() {
        "linux" | "android" => println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libupt.so.0"),
        "macos" | "ios" => {
            println!("cargo:rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libupt.0.dylib")
        }
        _ => {}
    }
}
