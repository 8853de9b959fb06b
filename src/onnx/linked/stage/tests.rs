use super::make::configure;
use super::*;
use crate::onnx::linked::memory::round_trip;
use crate::onnx::linked::wish::Wish;
use crate::onnx::{ProviderPlan, StageOptions, Tensors};

const FILE: &str = "latent.onnx";

fn runtime() -> &'static Runtime {
    Runtime::get(None).expect("ONNX Runtime: set ORT_DYLIB_PATH or run `cargo xtask ort`")
}

fn stage(memory: Memory) -> Stage {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/tiny-reduced/");
    let manifest = std::fs::read(format!("{folder}bundle.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let bytes = std::fs::read(format!("{folder}{FILE}")).unwrap();
    let options = StageOptions {
        threads: 1,
        plan: ProviderPlan::cpu(),
    };
    let session = configure(runtime(), &options, Wish::Cpu)
        .unwrap()
        .commit_from_memory(&bytes)
        .unwrap();
    let width = |outlet: &ort::value::Outlet| {
        let ort::value::ValueType::Tensor { shape, .. } = outlet.dtype() else {
            panic!("not a tensor")
        };
        shape[1] as usize
    };
    let (n, r) = (
        width(&session.inputs()[0]),
        manifest["reduced"]["modes"].as_u64().unwrap() as usize,
    );
    let tensors = Tensors {
        inputs: &[("state", &[1, n])],
        outputs: &[("b_next", &[1, r])],
        ..Tensors::default()
    };
    let choice = ProviderChoice::cpu();
    Stage::bind(runtime(), FILE, &tensors, Arc::new(session), memory, choice).unwrap()
}

fn outputs(stage: &mut Stage) -> Vec<u32> {
    let mut bits = Vec::new();
    for t in 0..4 {
        for (i, x) in stage.input(0).iter_mut().enumerate() {
            *x = ((i + 7 * t) as f32 * 0.37).sin();
        }
        stage.run().unwrap();
        bits.extend(stage.output(0).iter().map(|x| x.to_bits()));
    }
    bits
}

/// The copies of a device's path, with both sides in the host's memory.
#[test]
fn staged_and_rebound_tensors_give_the_bits_of_bound_ones() {
    round_trip(runtime(), &Memory::staged_on_the_host()).unwrap();
    let want = outputs(&mut stage(Memory::Host));
    assert!(want.iter().any(|&bits| f32::from_bits(bits).abs() > 1e-3));
    assert_eq!(outputs(&mut stage(Memory::staged_on_the_host())), want);
    assert_eq!(outputs(&mut stage(Memory::Rebound)), want);
}

#[test]
fn a_copy_into_another_shape_is_an_error() {
    let host = Memory::Host;
    let (four, _) = host.pair(&[4]).unwrap();
    let (mut six, _) = host.pair(&[2, 3]).unwrap();
    let error = copy(runtime(), &four, &mut six).unwrap_err();
    assert!(error.contains("[4]"), "{error}");
}
