//! Fields of a manifest that are wrong, each by its name.

use super::{open, with_manifest};
use fixture::{copy_of, find_runtime};

/// Verifies REQ-001.
#[test]
fn manifest_errors_name_the_field() {
    let set = |pointer: &'static str, value: serde_json::Value| {
        move |manifest: &mut serde_json::Value| {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            manifest.pointer_mut(parent).unwrap()[key] = value.clone()
        }
    };
    for (bundle, pointer, value, field) in [
        ("tiny-upt", "/format", "zip".into(), "format"),
        ("tiny-upt", "/dt_s", serde_json::json!(-1), "dt_s"),
        ("tiny-upt", "/dt_s", serde_json::json!(1e18), "dt_s"),
        (
            "tiny-upt",
            "/material/young_pa",
            serde_json::json!(1e308),
            "material.young_pa",
        ),
        (
            "tiny-upt",
            "/material/density_kg_m3",
            serde_json::json!(0),
            "material.density_kg_m3",
        ),
        (
            "tiny-upt",
            "/material/damping_per_s",
            serde_json::json!(-1),
            "material.damping_per_s",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "mooney-rivlin", "c01_share": 1.5}),
            "material.law.c01_share",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "yeoh", "c2_over_c1": -0.5, "c3_over_c1": 0}),
            "material.law.c2_over_c1",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "veronda-westmann", "beta": 0.1}),
            "material.law.beta",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "ogden"}),
            "terms",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "fung"}),
            "fung",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "fibres", "k1_over_mu": -5, "k2": 2, "matrix": {"name": "neo-hookean"}}),
            "material.law.k1_over_mu",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "ogden", "terms": [{"mu_pa": 157, "alpha": -18.7}]}),
            "material.law.terms[0].mu_pa",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "ogden", "terms": [{"mu_pa": -0.157, "alpha": -18.7}]}),
            "in Pa, not kPa",
        ),
        (
            "tiny-upt",
            "/material/law",
            serde_json::json!({"name": "ogden", "terms": [{"mu_pa": -157, "alpha": -18.7}]}),
            "material.young_pa",
        ),
        (
            "tiny-upt",
            "/material/relaxation",
            serde_json::json!([{"share": 0.6, "tau_s": 1}, {"share": 0.5, "tau_s": 9}]),
            "material.relaxation",
        ),
        (
            "tiny-upt",
            "/material/relaxation",
            serde_json::json!([{"share": 0.6, "tau_s": 0}]),
            "material.relaxation[0].tau_s",
        ),
        (
            "tiny-upt",
            "/material/relaxation",
            serde_json::json!([{"share": 0.6, "tau": 1}]),
            "tau",
        ),
        (
            "tiny-upt",
            "/gravity_at_rest_m_s2",
            serde_json::json!([0, -9810, 0]),
            "gravity_at_rest_m_s2",
        ),
        (
            "tiny-upt",
            "/precisions",
            serde_json::json!([]),
            "precisions",
        ),
        (
            "tiny-upt",
            "/precisions",
            serde_json::json!(["f32", "f8"]),
            "precisions",
        ),
        (
            "tiny-upt",
            "/rest_displacement_mm",
            serde_json::json!(-0.1),
            "rest_displacement_mm",
        ),
        (
            "tiny-upt",
            "/envelope/max_push_mm",
            serde_json::json!(1e30),
            "envelope.max_push_mm",
        ),
        (
            "tiny-corrected",
            "/envelope/tools",
            serde_json::json!({"corrections": 0, "size_mm": [2, 4], "depth_mm": 9, "speed_mm_s": 50, "max_tools": 1}),
            "envelope.tools.corrections",
        ),
        (
            "tiny-corrected",
            "/envelope/tools",
            serde_json::json!({"corrections": 3, "size_mm": [4, 2], "depth_mm": 9, "speed_mm_s": 50, "max_tools": 1}),
            "envelope.tools.size_mm",
        ),
        (
            "tiny-corrected",
            "/envelope/tools",
            serde_json::json!({"corrections": 3, "size_mm": [2, 4], "depth_mm": 0, "speed_mm_s": 50, "max_tools": 1}),
            "envelope.tools.depth_mm",
        ),
        (
            "tiny-corrected",
            "/envelope/tools",
            serde_json::json!({"corrections": 3, "size_mm": [2, 4], "depth_mm": 9, "speed_mm_s": 1e30, "max_tools": 1}),
            "envelope.tools.speed_mm_s",
        ),
        (
            "tiny-corrected",
            "/envelope/tools",
            serde_json::json!({"corrections": 3, "size_mm": [2, 4], "depth_mm": 9, "speed_mm_s": 50, "max_tools": 0}),
            "envelope.tools.max_tools",
        ),
        (
            "tiny-corrected",
            "/envelope/tools",
            serde_json::json!({"corrections": 3, "size_mm": [2, 4], "depth_mm": 9, "speed_mm_s": 50}),
            "max_tools",
        ),
        (
            "tiny-corrected",
            "/corrections/frame_step_s",
            serde_json::json!(0.005),
            "corrections.frame_step_s",
        ),
        (
            "tiny-corrected",
            "/corrections/frame_step_s",
            serde_json::json!(0.06),
            "corrections.frame_step_s",
        ),
        (
            "tiny-upt",
            "/upt/coordinates/scale",
            serde_json::json!(0),
            "upt.coordinates.scale",
        ),
        (
            "tiny-upt",
            "/requires",
            serde_json::json!("anchors"),
            "requires",
        ),
        ("tiny-upt", "/length_unit", "m".into(), "length_unit"),
        ("tiny-upt", "/kind", "other".into(), "kind"),
        ("tiny-upt", "/boundary", "free".into(), "boundary"),
        (
            "tiny-upt",
            "/mesh/nodes",
            serde_json::json!(211),
            "mesh.nodes",
        ),
        (
            "tiny-upt",
            "/mesh/mesh_sha256",
            "00".into(),
            "mesh.mesh_sha256",
        ),
        (
            "tiny-upt",
            "/mesh/file",
            "../mesh.safetensors".into(),
            "mesh.file",
        ),
        (
            "tiny-upt",
            "/upt/graph/radius_mm",
            serde_json::json!("x"),
            "upt.graph.radius_mm",
        ),
        (
            "tiny-upt",
            "/upt/graph/max_degree",
            serde_json::json!(0),
            "upt.graph.max_degree",
        ),
        (
            "tiny-upt",
            "/upt/normalisation/std",
            serde_json::json!([1, 0, 1]),
            "upt.normalisation.std",
        ),
        (
            "tiny-upt",
            "/upt/dims/query",
            serde_json::json!(31),
            "upt.dims.query",
        ),
        (
            "tiny-upt",
            "/upt/features",
            serde_json::json!(["prior"]),
            "prior",
        ),
        (
            "tiny-upt",
            "/upt/weights",
            "none.safetensors".into(),
            "upt.weights",
        ),
        (
            "tiny-upt-prior",
            "/prior/vibration",
            "none.safetensors".into(),
            "prior.vibration",
        ),
        (
            "tiny-upt-prior",
            "/upt/anchors",
            "none.safetensors".into(),
            "upt.anchors",
        ),
        (
            "tiny-reduced",
            "/prior/vibration",
            "latent.onnx".into(),
            "prior.vibration",
        ),
        (
            "tiny-upt-prior",
            "/prior/release",
            "none.safetensors".into(),
            "prior.release",
        ),
        (
            "tiny-upt-prior",
            "/prior/release",
            "vibration.safetensors".into(),
            "prior.release",
        ),
        (
            "tiny-reduced",
            "/prior/release",
            "latent.onnx".into(),
            "prior.release",
        ),
        (
            "tiny-upt",
            "/envelope/max_push_mm",
            serde_json::json!(0),
            "envelope.max_push_mm",
        ),
        (
            "tiny-reduced",
            "/reduced/bound/decay",
            serde_json::json!(1),
            "reduced.bound.decay",
        ),
        (
            "tiny-reduced",
            "/reduced/fade/end_push_mm",
            serde_json::json!(1),
            "reduced.fade",
        ),
        (
            "tiny-reduced",
            "/reduced/inputs",
            serde_json::json!(["q"]),
            "reduced.inputs",
        ),
        (
            "tiny-reduced",
            "/material/poisson",
            serde_json::json!(0.5),
            "material.poisson",
        ),
    ] {
        let error = with_manifest(bundle, set(pointer, value));
        assert_eq!(error.status(), -31, "{pointer}: {error}");
        let text = error.to_string();
        assert!(
            text.contains("bundle.json") && text.contains(field),
            "{pointer}: {text}"
        );
    }
    let uncorrected = with_manifest("tiny-corrected", |manifest| {
        manifest["corrections"]["recommended"] = 0.into();
        manifest["corrections"]["frame_step_s"] = 0.02.into();
    });
    assert!(
        uncorrected
            .to_string()
            .contains("`corrections.frame_step_s`")
    );
    // The law is known: what is missing lies in the mesh.
    let fibres = serde_json::json!({"name": "fibres", "k1_over_mu": 5, "k2": 2, "matrix": {"name": "neo-hookean"}});
    let undirected = with_manifest("tiny-upt", set("/material/law", fibres)).to_string();
    let wanted = "mesh.safetensors: material: number of directions in `fibre` is 0";
    assert!(undirected.contains(wanted), "{undirected}");
    let missing = with_manifest("tiny-reduced", |manifest| {
        manifest.as_object_mut().unwrap().remove("reduced");
    });
    assert!(missing.to_string().contains("`reduced`"));
    assert_eq!(
        with_manifest("tiny-upt", set("/version", serde_json::json!(2))).status(),
        -32
    );
}

#[test]
fn an_error_names_the_tool_that_made_the_bundle() {
    for (bundle, command) in [
        ("tiny-upt", None),
        ("tiny-reduced", None),
        ("tiny-reduced", Some("upt make")),
    ] {
        let wanted = command.unwrap_or(match bundle {
            "tiny-upt" => "python -m upt_training export",
            _ => "python -m upt_training.reduced",
        });
        // In the manifest, and in a file that it lists.
        for (field, value) in [("dt_s", serde_json::json!("a word")), ("", true.into())] {
            let error = with_manifest(bundle, |manifest| {
                if let Some(command) = command {
                    manifest["provenance"]["command"] = command.into();
                }
                match field {
                    "" => manifest["mesh"]["mesh_sha256"] = "0".repeat(64).into(),
                    field => manifest[field] = value.clone(),
                }
            });
            let text = error.to_string();
            assert!(text.contains(&format!("made with `{wanted}`")), "{text}");
        }
    }
}

#[test]
fn a_digest_that_is_null_is_refused_and_a_missing_one_is_not() {
    find_runtime();
    let folder = copy_of("tiny-upt");
    let path = folder.path().join("bundle.json");
    let mut manifest = fixture::manifest(folder.path());
    manifest["manifest_sha256"] = serde_json::Value::Null;
    std::fs::write(&path, manifest.to_string()).unwrap();
    let text = open(folder.path()).unwrap_err().to_string();
    assert!(text.contains("`manifest_sha256`"), "{text}");
    manifest.as_object_mut().unwrap().remove("manifest_sha256");
    std::fs::write(&path, manifest.to_string()).unwrap();
    open(folder.path()).unwrap();
}
