//! What only the library can see of a step: the floating-point exceptions that it meets.

use super::*;
use crate::kernels::flush::RAISED;
use crate::options::{GuardPolicy, ModelOptions};

/// MXCSR: an invalid operation.
const INVALID: u64 = 1;

#[test]
fn a_step_makes_no_invalid_operation() {
    for name in ["tiny-reduced", "tiny-upt", "tiny-upt-prior"] {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/");
        let path = std::path::PathBuf::from(path).join(name);
        let model = Model::open(&path, &ModelOptions::default()).unwrap();
        let options = SceneOptions {
            guard_policy: GuardPolicy::Report,
            sleep: false,
            ..SceneOptions::default()
        };
        let scene = Scene::new(Arc::clone(&model), &options).unwrap();
        let nodes = &model.indices(crate::IndexSet::DomainNodes)[..4];
        RAISED.with(|raised| raised.set(0));
        for t in 0..20 {
            let vectors = [0.1, 0.0, -0.3 * t as f32].repeat(4);
            let contact = match t {
                0..12 => Contact::Sparse {
                    nodes,
                    vectors: &vectors,
                },
                _ => Contact::None,
            };
            scene.step(contact, None).unwrap();
        }
        let raised = RAISED.with(std::cell::Cell::get);
        assert_ne!(raised, 0, "{name}: results are inexact");
        assert_eq!(raised & INVALID, 0, "{name}: met exceptions {raised:#x}");
    }
}
