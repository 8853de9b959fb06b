//! Regions of the surface that a bundle names: pressures on them.

use upt::ffi::*;
use upt::{Loads, Model, ModelOptions, Pressure, StepInput};

use crate::{BUNDLE, step};
use fixture::host::{Host, message};
use fixture::{bits, copy_of, find_runtime, manifest, plain, scene, write_manifest};

fn folder(regions: serde_json::Value) -> tempfile::TempDir {
    find_runtime();
    let folder = copy_of(BUNDLE);
    let mut manifest = manifest(folder.path());
    manifest["regions"] = regions;
    write_manifest(folder.path(), &mut manifest);
    folder
}

/// A host finds a region by its name, and its nodes are where a pressure acts; regions may overlap.
#[test]
fn a_pressure_acts_on_a_region_that_the_bundle_names() {
    find_runtime();
    let model = Model::open(&fixture::path(BUNDLE), &ModelOptions::default()).unwrap();
    let faces = model.indices(upt::IndexSet::SurfaceFaces).to_vec();
    let (mut bed, mut face) = (faces[..9].to_vec(), faces[..3].to_vec());
    [&mut bed, &mut face].into_iter().for_each(|nodes| {
        nodes.sort_unstable();
        nodes.dedup();
    });
    let folder = folder(serde_json::json!([
        {"name": "bed", "nodes": bed}, {"name": "face", "nodes": face},
    ]));
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    let named: Vec<_> = model.regions().collect();
    assert_eq!(named, [("bed", &bed[..]), ("face", &face[..])]);
    let host = Host::new(folder.path().to_str().unwrap(), crate::awake);
    let (mut nodes, mut needed) = (vec![0u32; bed.len()], 0);
    let mut name = [0 as std::ffi::c_char; 8];
    let read = |at, name: &mut [std::ffi::c_char; 8], nodes: &mut [u32], needed: &mut u64| unsafe {
        let (to, room) = (nodes.as_mut_ptr(), nodes.len() as u64);
        upt_model_read_region(host.model, at, name.as_mut_ptr(), 8, to, room, needed)
    };
    assert_eq!(read(0, &mut name, &mut nodes, &mut needed), UPT_OK);
    assert_eq!(nodes, bed);
    let text = unsafe { std::ffi::CStr::from_ptr(name.as_ptr()) };
    assert_eq!(text.to_str().unwrap(), "bed");
    let refused = read(2, &mut name, &mut nodes, &mut needed);
    assert_eq!(refused, UPT_ERR_ARGUMENT);
    assert!(
        message().contains("region is 2, the bundle has 2"),
        "{}",
        message()
    );
    // SAFETY: zeros are a value of this struct.
    let mut pressed: upt_pressure = unsafe { std::mem::zeroed() };
    pressed.struct_size = size_of::<upt_pressure>() as u32;
    (pressed.pascal, pressed.nodes, pressed.node_count) = (300.0, nodes.as_ptr(), needed);
    let input = upt_input {
        pressures: &pressed,
        pressure_count: 1,
        ..upt_input::NOTHING
    };
    let own = scene(&model, &plain());
    let mut u = vec![0.0; 3 * own.node_count()];
    let loads = Loads {
        pressures: &[Pressure {
            nodes: model.regions().next().unwrap().1,
            pascal: 300.0,
        }],
        ..Loads::default()
    };
    let given = StepInput {
        loads,
        ..StepInput::default()
    };
    for _ in 0..5 {
        own.step(given, Some(&mut u)).unwrap();
        assert_eq!(step(&host, &input), bits(&u));
    }
    assert!(u.iter().any(|x| x.abs() > 1e-4), "nothing is pressed");
}

/// A region that is none.
#[test]
fn a_region_has_a_name_and_a_face() {
    for (regions, text) in [
        (
            serde_json::json!([{"name": "a", "nodes": [0]}]),
            "boundary triangle",
        ),
        (
            serde_json::json!([{"name": "", "nodes": [0, 1, 2]}]),
            "one of its own",
        ),
        (
            serde_json::json!([{"name": "a", "nodes": [2, 1, 0]}]),
            "ascending",
        ),
    ] {
        let folder = folder(regions);
        let Err(error) = Model::open(folder.path(), &ModelOptions::default()) else {
            panic!("{text}");
        };
        let error = error.to_string();
        assert!(
            error.contains("regions[0]") && error.contains(text),
            "{error}"
        );
    }
}
