//! The reaction at the contact nodes: which method, whose numbers, and that it belongs to the published contact.
#![cfg(feature = "instruments")]

use fixture::{BUNDLES, bits, model, path, plain, push, scene, sparse};
use safetensors::SafeTensors;
use upt::forces::ReactionForces;
use upt::{Error, GuardPolicy, IndexSet, Model, Scene, SceneOptions, StepInput, flag};

const WITH_PRIOR: [&str; 2] = ["tiny-reduced", "tiny-upt-prior"];

/// A bundle's columns and `[3D,3D]` compliance, as stored.
struct Compliance {
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Compliance {
    fn read(bundle: &str) -> Compliance {
        let bytes = std::fs::read(path(bundle).join("prior.safetensors")).unwrap();
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let words = |name: &str| {
            file.tensor(name)
                .unwrap()
                .data()
                .as_chunks::<4>()
                .0
                .to_vec()
        };
        Compliance {
            columns: (words("contact_nodes").iter())
                .map(|b| u32::from_le_bytes(*b))
                .collect(),
            values: (words("compliance").iter())
                .map(|b| f64::from(f32::from_le_bytes(*b)))
                .collect(),
        }
    }

    /// `A_CC^-1 c` by Gauss-Jordan, for columns in any order.
    fn forces(&self, columns: &[usize], c: &[f32]) -> Vec<f64> {
        let order = 3 * self.columns.len();
        let dofs: Vec<usize> = columns
            .iter()
            .flat_map(|i| [0, 1, 2].map(|k| 3 * i + k))
            .collect();
        let mut rows: Vec<Vec<f64>> = (dofs.iter().zip(c))
            .map(|(&i, &c)| {
                let row = dofs.iter().map(|&j| self.values[i * order + j]);
                row.chain([f64::from(c)]).collect()
            })
            .collect();
        for k in 0..rows.len() {
            let pivot = rows[k].clone();
            for (i, row) in rows.iter_mut().enumerate() {
                let factor = if i == k {
                    1.0 - 1.0 / pivot[k]
                } else {
                    row[k] / pivot[k]
                };
                row.iter_mut()
                    .zip(&pivot)
                    .for_each(|(x, p)| *x -= factor * p);
            }
        }
        rows.into_iter().map(|row| row[dofs.len()]).collect()
    }

    fn column(&self, node: u32) -> Option<usize> {
        self.columns.binary_search(&node).ok()
    }

    /// Squared distance of a node to column `i`'s, mm².
    fn distance(&self, model: &Model, node: u32, i: usize) -> f64 {
        let [a, b] = [node, self.columns[i]].map(|n| model.mesh.position(n));
        (0..3)
            .map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2))
            .sum()
    }

    /// The column whose node is nearest, the smallest of equals.
    fn nearest(&self, model: &Model, node: u32) -> usize {
        let distance = |&i: &usize| self.distance(model, node, i);
        (0..self.columns.len())
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap()
    }
}

fn touch(scene: &Scene, nodes: &[u32], vectors: &[f32]) -> upt::Result<()> {
    scene.step(sparse(&(nodes.to_vec(), vectors.to_vec())), None)
}

fn force(scene: &Scene, count: usize) -> Vec<f32> {
    let mut out = vec![f32::NAN; 3 * count];
    scene.contact_force(&mut out).unwrap();
    out
}

fn assert_close(got: &[f32], want: &[f64]) {
    let size = want.iter().map(|f| f.abs()).fold(0.0, f64::max);
    assert!(size > 0.1, "a force that can be wrong: {size} mN");
    for (i, (&got, want)) in got.iter().zip(want).enumerate() {
        let error = (f64::from(got) - want).abs();
        assert!(error <= 1e-5 * size, "{i}: {got} {want} of {size}");
    }
}

#[test]
fn with_a_prior_it_is_minus_the_contact_forces_in_the_hosts_order() {
    for name in WITH_PRIOR {
        let model = model(name);
        let table = Compliance::read(name);
        let scene = scene(&model, &plain());
        assert!(scene.stats().prior_forces);
        for t in [1, 4, 8] {
            let (mut nodes, mut vectors) = push(&model, t);
            nodes.swap(0, 2);
            vectors[4] += 0.3;
            touch(&scene, &nodes, &vectors).unwrap();
            let columns: Vec<usize> = nodes.iter().map(|&n| table.column(n).unwrap()).collect();
            let want: Vec<f64> = table
                .forces(&columns, &vectors)
                .iter()
                .map(|f| -f)
                .collect();
            let got = force(&scene, nodes.len());
            assert_close(&got, &want);
            assert!(
                got.iter().skip(2).step_by(3).sum::<f32>() > 0.0,
                "it resists a push"
            );
        }
    }
}

#[test]
fn borrowers_share_and_nodes_that_the_response_leaves_out_get_nothing() {
    for name in WITH_PRIOR {
        let model = model(name);
        let table = Compliance::read(name);
        let held = model.indices(IndexSet::HeldNodes);
        let mut borrowers = vec![Vec::new(); table.columns.len()];
        for &node in model.indices(IndexSet::SurfaceNodes) {
            if table.column(node).is_none() && held.binary_search(&node).is_err() {
                borrowers[table.nearest(&model, node)].push(node);
            }
        }
        let column = (0..borrowers.len())
            .find(|&i| borrowers[i].len() > 1)
            .unwrap();
        let near = &mut borrowers[column];
        let distance = |node: u32| table.distance(&model, node, column);
        near.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let (a, b) = (near[0], near[1]);
        let scene = scene(&model, &plain());
        let vectors = [0.0, 0.2, -1.0, 1.0, 0.0, -3.0, 0.5, 0.5, 0.5];
        touch(&scene, &[b, a, held[0]], &vectors).unwrap();
        let whole = table.forces(&[column], &[0.5, 0.1, -2.0]);
        let half: Vec<f64> = whole.iter().map(|f| -0.5 * f).collect();
        let got = force(&scene, 3);
        assert_close(&got[..3], &half);
        assert_eq!(bits(&got[..3]), bits(&got[3..6]));
        assert_eq!(got[6..], [0.0; 3]);
        // The column's own node speaks for it.
        let own = table.columns[column];
        touch(&scene, &[a, own], &vectors[..6]).unwrap();
        let got = force(&scene, 2);
        assert_eq!(got[..3], [0.0; 3]);
        let want: Vec<f64> = table
            .forces(&[column], &vectors[3..6])
            .iter()
            .map(|f| -f)
            .collect();
        assert_close(&got[3..], &want);
    }
}

#[test]
fn a_contact_of_more_nodes_than_columns_and_a_displacement_of_the_host() {
    for name in WITH_PRIOR {
        let model = model(name);
        let table = Compliance::read(name);
        let scene = scene(&model, &plain());
        let nodes = model.indices(IndexSet::SurfaceNodes).to_vec();
        assert!(nodes.len() > table.columns.len());
        let vectors: Vec<f32> = (nodes.iter())
            .flat_map(|&n| [0.1, 0.0, -0.5 - 0.01 * model.mesh.position(n)[0]])
            .collect();
        touch(&scene, &nodes, &vectors).unwrap();
        assert_eq!(scene.stats().flags & flag::REGULARISED, 0);
        let own = |i: usize| nodes.binary_search(&table.columns[i]).unwrap();
        let columns: Vec<usize> = (0..table.columns.len()).collect();
        let c: Vec<f32> = (columns.iter())
            .flat_map(|&i| [0, 1, 2].map(|k| vectors[3 * own(i) + k]))
            .collect();
        let mut want = vec![0.0; vectors.len()];
        for (&i, f) in columns.iter().zip(table.forces(&columns, &c).chunks(3)) {
            (0..3).for_each(|k| want[3 * own(i) + k] = -f[k]);
        }
        let got = force(&scene, nodes.len());
        assert_close(&got, &want);
        // The contact decides, not the state that it is pressed into.
        let given = vec![0.25; 3 * scene.node_count()];
        let contact = (nodes, vectors);
        let input = StepInput {
            displacement: Some(&given),
            ..sparse(&contact)
        };
        scene.step(input, None).unwrap();
        assert_eq!(bits(&force(&scene, contact.0.len())), bits(&got));
    }
}

#[test]
fn without_a_prior_it_is_the_elements_force_at_the_last_state() {
    let model = model("tiny-upt");
    let scene = scene(&model, &plain());
    assert!(!scene.stats().prior_forces);
    let contact = push(&model, 3);
    let mut field = vec![0.0; 3 * scene.node_count()];
    scene.step(sparse(&contact), Some(&mut field)).unwrap();
    let (mesh, material) = (&model.mesh, &model.manifest.material);
    let mut forces = ReactionForces::new(mesh.tetrahedra(), &contact.0, material.moduli()).unwrap();
    let mut want = vec![0.0; contact.1.len()];
    forces.reaction(&field, &contact.0, &mut want).unwrap();
    assert!(want.iter().any(|f| f.abs() > 0.1));
    assert_eq!(bits(&force(&scene, contact.0.len())), bits(&want));
    // A region changes what a step decodes, not the force.
    scene.set_region(Some(&contact.0)).unwrap();
    assert_eq!(bits(&force(&scene, contact.0.len())), bits(&want));
}

#[test]
fn it_is_that_of_the_published_contact() {
    for name in BUNDLES {
        let model = model(name);
        let options = SceneOptions {
            guard_policy: GuardPolicy::Hold,
            ..plain()
        };
        let scene = scene(&model, &options);
        assert!(
            force(&scene, 0).is_empty(),
            "no contact before the first step"
        );
        let (nodes, vectors) = push(&model, 2);
        touch(&scene, &nodes, &vectors).unwrap();
        let want = force(&scene, nodes.len());
        let (others, far) = (&push(&model, 7).0, [0.0, 0.0, -5e4].repeat(4));
        assert!(matches!(touch(&scene, others, &far), Err(Error::Guard(_))));
        assert_eq!(bits(&force(&scene, nodes.len())), bits(&want), "{name}");
        let mut short = vec![0.0; 3];
        assert!(matches!(
            scene.contact_force(&mut short),
            Err(Error::Argument(_))
        ));
        touch(&scene, &[], &[]).unwrap();
        assert!(force(&scene, 0).is_empty(), "a free step has no reaction");
    }
}

#[test]
fn it_survives_a_snapshot_and_asking_changes_no_step() {
    for name in BUNDLES {
        let model = model(name);
        let [asked, silent, restored] = [0; 3].map(|_| scene(&model, &plain()));
        for t in 0..9 {
            for scene in [&asked, &silent] {
                scene.step(sparse(&push(&model, t)), None).unwrap();
            }
            let want = force(&asked, 4);
            restored.restore(&silent.save().unwrap()).unwrap();
            assert_eq!(bits(&force(&restored, 4)), bits(&want), "{name} step {t}");
            assert_eq!(restored.stats().prior_forces, asked.stats().prior_forces);
        }
        let next = push(&model, 9);
        let states = [&asked, &silent, &restored].map(|scene| {
            let mut out = vec![0.0; 3 * scene.node_count()];
            scene.step(sparse(&next), Some(&mut out)).unwrap();
            bits(&out)
        });
        assert!(states[0] == states[1] && states[1] == states[2], "{name}");
    }
}
