//! three.js as the pages have it. It is packed (`build.rs`), and unpacked once.

use std::io::Read;
use std::sync::OnceLock;

use flate2::read::ZlibDecoder;

static PACKED: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/three.js.z"));

/// The text of the module.
pub fn module() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let mut text = String::new();
        let read = ZlibDecoder::new(PACKED).read_to_string(&mut text);
        read.expect("build.rs has packed a text");
        text
    })
}
