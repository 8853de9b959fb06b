//! What the guard refuses, what each policy does then, and when the envelope's flags are set.

use fixture::{BUNDLES, bits, copy_of, find_runtime, model, plain, push, rollout, scene, sparse};
use upt::{
    Contact, Error, GuardPolicy, IndexSet, Model, ModelOptions, SceneOptions, StepInput, flag,
};

fn with_policy(guard_policy: GuardPolicy) -> SceneOptions {
    SceneOptions {
        guard_policy,
        ..SceneOptions::default()
    }
}

/// A bundle whose bound is below what a push gives.
fn tight(name: &str) -> (tempfile::TempDir, std::sync::Arc<Model>) {
    bounded(name, 2.5)
}

fn bounded(name: &str, bound_mm: f32) -> (tempfile::TempDir, std::sync::Arc<Model>) {
    find_runtime();
    let folder = copy_of(name);
    let mut manifest = fixture::manifest(folder.path());
    manifest["envelope"]["displacement_bound_mm"] = bound_mm.into();
    fixture::write_manifest(folder.path(), &mut manifest);
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    (folder, model)
}

/// Verifies REQ-020.
#[test]
fn hold_keeps_the_last_good_state() {
    for name in BUNDLES {
        let (_folder, model) = tight(name);
        let scene = scene(&model, &with_policy(GuardPolicy::Hold));
        rollout(&scene, 4);
        let mut good = vec![0.0; 3 * scene.node_count()];
        scene.read(&mut good).unwrap();
        let snapshot = scene.save().unwrap();
        let mut far = push(&model, 4);
        far.1.iter_mut().for_each(|c| *c *= 4.0);
        let mut out = vec![7.0; good.len()];
        let error = scene.step(sparse(&far), Some(&mut out)).unwrap_err();
        assert_eq!(error.status(), -40);
        assert!(
            out.iter().all(|&u| u == 7.0),
            "outputs are written only on success"
        );
        assert_ne!(scene.stats().flags & flag::BOUND, 0);
        let mut after = vec![0.0; good.len()];
        scene.read(&mut after).unwrap();
        assert_eq!(bits(&good), bits(&after));
        assert_eq!(snapshot, scene.save().unwrap(), "rollback is exact");
        // And the scene goes on.
        scene.step(sparse(&push(&model, 4)), None).unwrap();
    }
}

#[test]
fn report_publishes_and_flags() {
    for name in BUNDLES {
        let (_folder, model) = tight(name);
        let scene = scene(&model, &with_policy(GuardPolicy::Report));
        let mut far = push(&model, 4);
        far.1.iter_mut().for_each(|c| *c *= 4.0);
        scene.step(sparse(&far), None).unwrap();
        assert_ne!(scene.stats().flags & flag::BOUND, 0);
        assert!(scene.stats().max_displacement_mm > 2.5);
    }
}

#[test]
fn blend_stays_within_the_bound_and_recovers() {
    for name in BUNDLES {
        let (_folder, model) = tight(name);
        let scene = scene(&model, &with_policy(GuardPolicy::Blend));
        rollout(&scene, 3);
        let mut far = push(&model, 4);
        far.1.iter_mut().for_each(|c| *c *= 40.0);
        for _ in 0..5 {
            scene.step(sparse(&far), None).unwrap();
            assert_ne!(scene.stats().flags & flag::BOUND, 0);
            assert!(scene.stats().max_displacement_mm <= 2.5);
        }
        // A snapshot and a region of a blended state work too.
        let snapshot = scene.save().unwrap();
        scene.restore(&snapshot).unwrap();
        scene.set_region(Some(&[0, 5, 100])).unwrap();
        scene.step(sparse(&push(&model, 0)), None).unwrap();
        assert_eq!(scene.stats().flags & flag::BOUND, 0);
    }
}

/// Held, a step without contact would be made and refused again for ever.
#[test]
fn a_refused_step_without_contact_is_replaced_under_every_policy() {
    for name in BUNDLES {
        // Not one state of these networks is as close to rest as that.
        let (_folder, model) = bounded(name, 1e-4);
        let report = scene(&model, &with_policy(GuardPolicy::Report));
        report.step(sparse(&push(&model, 4)), None).unwrap();
        let far = report.save().unwrap();
        for policy in [GuardPolicy::Hold, GuardPolicy::Blend] {
            let scene = scene(&model, &with_policy(policy));
            scene.restore(&far).unwrap();
            let mut out = vec![0.0; 3 * scene.node_count()];
            let mut replaced = 0;
            for _ in 0..5 {
                scene
                    .step(sparse(&(Vec::new(), Vec::new())), Some(&mut out))
                    .unwrap();
                replaced += usize::from(scene.stats().flags & flag::BOUND != 0);
                assert!(
                    out.iter().all(|u| u.abs() <= 1e-4),
                    "{name}: within the bound"
                );
            }
            assert!(replaced > 0, "{name}: nothing was refused");
        }
        // A displacement of the host's is the host's to change: held.
        let held = scene(&model, &with_policy(GuardPolicy::Hold));
        let given = vec![1.0; 3 * held.node_count()];
        let input = StepInput {
            displacement: Some(&given),
            ..StepInput::default()
        };
        assert!(matches!(held.step(input, None), Err(Error::Guard(_))));
    }
}

/// Verifies REQ-021.
#[test]
fn inputs_that_are_not_numbers_are_refused_and_nothing_changes() {
    for name in BUNDLES {
        let model = model(name);
        let scene = scene(&model, &with_policy(GuardPolicy::Report));
        rollout(&scene, 5);
        let before = scene.save().unwrap();
        let count = scene.node_count();
        for (bad, status) in [
            (f32::NAN, -6),
            (f32::INFINITY, -6),
            (f32::NEG_INFINITY, -6),
            (1e30, -2),
        ] {
            let mut field = vec![0.0; 3 * count];
            field[17] = bad;
            for (displacement, contact) in [
                (Some(field.as_slice()), Contact::None),
                (None, Contact::Dense(&field)),
                (
                    None,
                    Contact::Sparse {
                        nodes: &[3],
                        vectors: &[0.0, bad, 0.0],
                    },
                ),
            ] {
                let error = scene
                    .step(
                        StepInput {
                            displacement,
                            contact,
                            ..StepInput::default()
                        },
                        None,
                    )
                    .unwrap_err();
                assert_eq!(error.status(), status, "{error}");
            }
        }
        for len in [0, 3 * count - 1, 3 * count + 3] {
            let field = vec![0.0; len];
            let input = StepInput {
                displacement: Some(&field),
                ..StepInput::default()
            };
            assert_eq!(scene.step(input, None).unwrap_err().status(), -2);
        }
        let mut short = vec![0.0; 3];
        assert!(matches!(
            scene.step(sparse(&push(&model, 1)), Some(&mut short)),
            Err(Error::Argument(_))
        ));
        assert!(matches!(
            scene.set_region(Some(&[count as u32])),
            Err(Error::Argument(_))
        ));
        // Denormals are numbers.
        let mut field = vec![1e-42f32; 3 * count];
        field[5] = 1e-44;
        assert_eq!(before, scene.save().unwrap());
        let input = StepInput {
            displacement: Some(&field),
            contact: Contact::Dense(&field),
            ..StepInput::default()
        };
        let wide = fixture::scene(&model, &with_policy(GuardPolicy::Report));
        wide.step(input, None).unwrap();
    }
}

/// Verifies REQ-022.
#[test]
fn envelope_flags_are_set_when_and_only_when_outside() {
    for name in BUNDLES {
        let model = model(name);
        let flags = |steps: &[(Vec<u32>, Vec<f32>)]| {
            let scene = scene(&model, &with_policy(GuardPolicy::Report));
            for step in steps {
                scene.step(sparse(step), None).unwrap();
            }
            let stats = scene.stats();
            let outside = flag::PUSH | flag::RATE | flag::SITE | flag::SITES;
            (stats.flags & outside, stats.indicator)
        };
        let at = |nodes: &[u32], depth: f32| -> (Vec<u32>, Vec<f32>) {
            (
                nodes.to_vec(),
                nodes.iter().flat_map(|_| [0.0, 0.0, -depth]).collect(),
            )
        };
        let (patch, _) = push(&model, 0);
        let gentle: Vec<_> = (1..=10)
            .map(|t| at(&patch, 1.5 * t as f32 - 0.01))
            .collect();
        assert_eq!(flags(&gentle).0, 0);
        let mut deep = gentle.clone();
        deep.push(at(&patch, 15.5));
        let (set, indicator) = flags(&deep);
        assert_eq!(set, flag::PUSH);
        assert!(indicator >= 15.5 / 15.0, "{indicator}");
        assert_eq!(flags(&[at(&patch, 2.0), at(&patch, 5.5)]).0, flag::RATE);
        assert_eq!(
            flags(&[at(&patch, 5.5)]).0,
            flag::RATE,
            "a jump from nothing"
        );
        let domain = model.indices(IndexSet::DomainNodes);
        let held = model.indices(IndexSet::HeldNodes);
        let outside = (0..model.info().node_count as u32)
            .find(|n| domain.binary_search(n).is_err() && held.binary_search(n).is_err())
            .unwrap();
        assert_ne!(flags(&[at(&[outside], 1.0)]).0 & flag::SITE, 0);
        // Two patches far apart.
        let p = model.positions();
        let distance = |a: u32, b: u32| {
            (0..3)
                .map(|k| (p[3 * a as usize + k] - p[3 * b as usize + k]).powi(2))
                .sum::<f32>()
        };
        let far = *domain
            .iter()
            .filter(|n| held.binary_search(n).is_err())
            .max_by(|a, b| distance(**a, patch[0]).total_cmp(&distance(**b, patch[0])))
            .unwrap();
        let mut two = patch.clone();
        two.push(far);
        assert_ne!(flags(&[at(&two, 1.0)]).0 & flag::SITES, 0);
    }
}

#[test]
fn held_nodes_stay_and_contact_nodes_end_at_c() {
    for name in BUNDLES {
        let model = model(name);
        let scene = scene(&model, &with_policy(GuardPolicy::Report));
        let held = model.indices(IndexSet::HeldNodes);
        let (mut nodes, mut vectors) = push(&model, 2);
        nodes.push(held[0]);
        vectors.extend([0.0, 0.0, -3.0]);
        let mut out = vec![0.0; 3 * scene.node_count()];
        scene
            .step(sparse(&(nodes.clone(), vectors.clone())), Some(&mut out))
            .unwrap();
        for (i, &node) in nodes[..nodes.len() - 1].iter().enumerate() {
            assert_eq!(
                out[3 * node as usize..3 * node as usize + 3],
                vectors[3 * i..3 * i + 3]
            );
        }
        for &node in held {
            assert_eq!(out[3 * node as usize..3 * node as usize + 3], [0.0; 3]);
        }
        let free = fixture::scene(
            &model,
            &SceneOptions {
                boundary: false,
                ..with_policy(GuardPolicy::Report)
            },
        );
        let mut raw = out.clone();
        free.step(sparse(&(nodes, vectors)), Some(&mut raw))
            .unwrap();
        assert!(raw.iter().all(|u| u.is_finite()));
        assert_ne!(
            bits(&raw),
            bits(&out),
            "the boundary is not enforced when the host says so"
        );
    }
}

/// Verifies REQ-023.
#[test]
fn an_inverted_element_is_refused_where_asked() {
    let model = model("tiny-upt");
    let scene = scene(
        &model,
        &SceneOptions {
            check_inversion: true,
            ..with_policy(GuardPolicy::Hold)
        },
    );
    let (nodes, _) = push(&model, 0);
    // One node pushed through its neighbours.
    let vectors = [0.0, 0.0, -25.0];
    let error = scene
        .step(sparse(&(vec![nodes[0]], vectors.to_vec())), None)
        .unwrap_err();
    assert_eq!(error.status(), -40);
    assert_ne!(scene.stats().flags & flag::INVERTED, 0);
}

/// Verifies REQ-023.
#[test]
fn an_element_inside_out_at_the_contact_is_told_of_without_being_asked() {
    let model = model("tiny-reduced");
    let scene = scene(&model, &plain());
    let node = model.indices(IndexSet::DomainNodes)[0];
    let pushed = |depth: f32| {
        let vectors = [0.0, 0.0, -depth];
        let contact = Contact::Sparse {
            nodes: &[node],
            vectors: &vectors,
        };
        scene.step(contact, None).unwrap();
        let stats = scene.stats();
        (stats.min_det, stats.flags & flag::INVERTED != 0)
    };
    let (gentle, raised) = pushed(0.5);
    assert!(gentle > 0.5 && gentle < 1.0 && !raised, "{gentle}");
    let (hard, raised) = pushed(40.0);
    assert!(hard < 0.0 && raised, "{hard}");
}
