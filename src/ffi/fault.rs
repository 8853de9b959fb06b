//! Fault injection for the C tests (feature `fault`, never in a release): a call that panics.

use super::constants::upt_status;
use super::registry::call_scene;
use super::structs::upt_scene;

/// Panics inside a call on the scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_test_panic(scene: *mut upt_scene) -> upt_status {
    call_scene("upt_test_panic", scene, |_| panic!("asked for by the test"))
}
