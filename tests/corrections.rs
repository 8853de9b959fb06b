//! Corrections by the elements: what they do to the residual, what they cost a scene without them, and what is refused.

use fixture::Draw;
use fixture::{bits, model, plain, push, rollout, scene, sparse};
use upt::{Contact, Corrections, Error, IndexSet, SceneOptions, flag};

fn with(corrections: Corrections) -> SceneOptions {
    SceneOptions {
        corrections,
        ..plain()
    }
}

/// Largest residual and estimated error of the corrected steps of a rollout.
fn worst(corrections: Corrections) -> (f32, f32) {
    let model = model("tiny-corrected");
    let scene = scene(&model, &with(corrections));
    let (mut residual, mut error) = (0.0f32, 0.0f32);
    for t in 0..18 {
        let contact = push(&model, t);
        scene.step(sparse(&contact), None).unwrap();
        let stats = scene.stats();
        if !contact.0.is_empty() {
            residual = residual.max(stats.residual);
            error = error.max(stats.error_mm);
            assert!(stats.corrections > 0 && stats.evaluations > stats.corrections);
            assert!(stats.min_det > 0.0, "step {t}: det F {}", stats.min_det);
        }
    }
    (residual, error)
}

/// Verifies REQ-037.
#[test]
fn more_corrections_leave_less_residual_and_a_smaller_estimate() {
    let few = worst(Corrections::Fixed(2));
    let more = worst(Corrections::Fixed(8));
    let many = worst(Corrections::Fixed(24));
    assert!(more.0 < 0.5 * few.0, "{more:?} after {few:?}");
    assert!(many.0 < 0.1 * few.0 && many.0 < 0.1, "{many:?}");
    // What a step of this length leaves out stays in the estimate.
    assert!(many.1 < 0.25 * few.1, "{many:?} after {few:?}");
}

#[test]
fn the_bundle_recommends_and_none_is_the_bundle_without_them() {
    let model = model("tiny-corrected");
    let recommended = scene(&model, &plain());
    let asked = scene(&model, &with(Corrections::Fixed(3)));
    assert_eq!(
        bits(&rollout(&recommended, 12).concat()),
        bits(&rollout(&asked, 12).concat())
    );
    assert_eq!(recommended.stats().corrections, 0, "step 11 has no contact");
    let none = scene(&model, &with(Corrections::None));
    let without = scene(&fixture::model("tiny-reduced"), &plain());
    assert_eq!(
        bits(&rollout(&none, 18).concat()),
        bits(&rollout(&without, 18).concat())
    );
    let (with_them, without_them) = (recommended.stats(), none.stats());
    assert!(with_them.memory_bytes > without_them.memory_bytes + 50_000);
}

#[test]
fn a_target_stops_early_and_a_budget_leaves_one() {
    let model = model("tiny-corrected");
    let made = |corrections| {
        let scene = scene(&model, &with(corrections));
        let counts = (0..6).map(|t| {
            scene.step(sparse(&push(&model, t)), None).unwrap();
            scene.stats().corrections
        });
        counts.collect::<Vec<_>>()
    };
    let target = |target_mm| Corrections::Auto {
        most: 64,
        target_mm,
        budget_us: 0,
    };
    let (loose, tight) = (made(target(0.05)), made(target(1e-4)));
    assert!(loose.iter().zip(&tight).all(|(a, b)| a <= b));
    assert!(
        loose.iter().sum::<u32>() < tight.iter().sum(),
        "{loose:?} {tight:?}"
    );
    // A microsecond is over before the first ends: one is made all the same.
    let capped = made(Corrections::Auto {
        most: 2,
        target_mm: 1e-4,
        budget_us: 0,
    });
    let most: Vec<u32> = tight.iter().map(|count| (*count).min(2)).collect();
    assert_eq!(capped, most, "{tight:?}");
    let hurried = made(Corrections::Auto {
        most: 64,
        target_mm: 0.0,
        budget_us: 1,
    });
    assert_eq!(hurried, [1; 6]);
    // The bundle's own count and target, in that time.
    let recommended = made(Corrections::RecommendedWithin { budget_us: 1 });
    assert_eq!(recommended, [1; 6]);
    let unhurried = made(Corrections::RecommendedWithin { budget_us: 0 });
    assert_eq!(unhurried, made(Corrections::Recommended));
    assert!(unhurried.iter().sum::<u32>() > 6, "{unhurried:?}");
}

#[test]
fn what_cannot_be_is_refused() {
    let corrected = model("tiny-corrected");
    let create =
        |name: &str, options: &SceneOptions| upt::Scene::new(model(name), options).map(|_| ());
    for count in [0, 65] {
        let error = create("tiny-corrected", &with(Corrections::Fixed(count)));
        assert!(
            matches!(error, Err(Error::Argument(_))),
            "{count}: {error:?}"
        );
    }
    for (most, target_mm, budget_us) in [
        (64, 0.0, 0),
        (64, -1.0, 5),
        (64, f32::NAN, 5),
        (0, 0.1, 0),
        (65, 0.1, 0),
    ] {
        let options = with(Corrections::Auto {
            most,
            target_mm,
            budget_us,
        });
        let error = create("tiny-corrected", &options);
        assert!(matches!(error, Err(Error::Argument(_))), "{error:?}");
    }
    for (name, what) in [
        ("tiny-reduced", "coarse space"),
        ("tiny-upt", "linear response"),
    ] {
        let error = create(name, &with(Corrections::Fixed(3))).unwrap_err();
        assert!(matches!(error, Error::Unsupported(_)), "{name}: {error:?}");
        assert!(error.to_string().contains(what), "{error}");
    }
    let limit = SceneOptions {
        error_limit_mm: f32::NAN,
        ..plain()
    };
    assert!(upt::Scene::new(corrected, &limit).is_err());
}

/// Verifies REQ-037.
#[test]
fn the_limit_of_the_error_raises_a_flag() {
    let model = model("tiny-corrected");
    let raised = |error_limit_mm| {
        let options = SceneOptions {
            error_limit_mm,
            ..with(Corrections::Fixed(2))
        };
        let scene = scene(&model, &options);
        scene.step(sparse(&push(&model, 0)), None).unwrap();
        scene.stats().flags & flag::ERROR != 0
    };
    assert!(raised(1e-9));
    assert!(!raised(1e3));
    assert!(!raised(0.0));
}

#[test]
fn wild_contacts_stay_finite_and_the_tissue_comes_back() {
    let model = model("tiny-corrected");
    let domain: Vec<u32> = model.indices(IndexSet::DomainNodes).to_vec();
    for count in [1, 3, 5, 10] {
        let scene = scene(&model, &with(Corrections::Fixed(count)));
        let mut draw = Draw(7 + u64::from(count));
        let mut unit = || draw.unit();
        let mut out = vec![0.0; 3 * scene.node_count()];
        for _ in 0..300 {
            let first = (unit() * (domain.len() - 4) as f32) as usize;
            let size = 1 + (unit() * 3.0) as usize;
            let nodes = &domain[first..first + size];
            // Four times beyond the training, and another direction each step.
            let depth = 60.0 * unit();
            let c = [unit() - 0.5, unit() - 0.5, -unit()].map(|x| depth * x);
            let vectors: Vec<f32> = nodes.iter().flat_map(|_| c).collect();
            let contact = Contact::Sparse {
                nodes,
                vectors: &vectors,
            };
            scene.step(contact, Some(&mut out)).unwrap();
            assert!(out.iter().all(|u| u.is_finite() && u.abs() < 1e3));
            let stats = scene.stats();
            assert!(stats.min_det > 0.0 || stats.flags & flag::FELL_BACK != 0);
        }
        for _ in 0..200 {
            scene
                .step(sparse(&(Vec::new(), Vec::new())), Some(&mut out))
                .unwrap();
        }
        let left = out.iter().fold(0.0f32, |most, u| most.max(u.abs()));
        assert!(left < 0.05, "k = {count}: {left} mm after ten seconds");
    }
}

#[cfg(feature = "instruments")]
#[test]
fn the_contact_force_is_the_works_derivative() {
    // The virtual work of the contact forces on a small change of depth is the change of the strain energy, at rest: a slow push, held.
    let model = model("tiny-corrected");
    let nodes: Vec<u32> = push(&model, 0).0;
    let force_at = |depth: f32| {
        let scene = scene(&model, &with(Corrections::Fixed(24)));
        let vectors: Vec<f32> = nodes.iter().flat_map(|_| [0.0, 0.0, -depth]).collect();
        let contact = (nodes.clone(), vectors);
        for _ in 0..60 {
            scene.step(sparse(&contact), None).unwrap();
        }
        let mut force = vec![0.0; 3 * nodes.len()];
        scene.contact_force(&mut force).unwrap();
        let mut u = vec![0.0; 3 * scene.node_count()];
        scene.read(&mut u).unwrap();
        (force, energy(&model, &u))
    };
    let (low, energy_low) = force_at(1.9);
    let (high, energy_high) = force_at(2.1);
    // mN mm is µJ; energies are in nJ.
    let along = |force: &[f32]| {
        force
            .iter()
            .skip(2)
            .step_by(3)
            .map(|f| f64::from(-f))
            .sum::<f64>()
    };
    let work = 0.5 * (along(&low) + along(&high)) * 0.2 * -1e3;
    let gained = energy_high - energy_low;
    assert!(
        (work - gained).abs() < 0.02 * gained,
        "{work} nJ for {gained} nJ"
    );
}

/// Strain energy, nJ.
#[cfg(feature = "instruments")]
fn energy(model: &upt::Model, u: &[f32]) -> f64 {
    let mesh = &model.mesh;
    let moduli = model.manifest.material.moduli();
    let row =
        |values: &[f32], node: u32| [0, 1, 2].map(|k| f64::from(values[3 * node as usize + k]));
    mesh.tets
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&corners| {
            let rest = corners.map(|node| row(&mesh.positions, node));
            let tet = elements::Tetrahedron::new(corners, rest, 1.0);
            let state = tet.deformation(corners.map(|node| row(u, node)));
            tet.volume * elements::energy_density(&state, moduli)
        })
        .sum()
}
