//! Contact patches and the schemes that move them.

use tissue::contact::{ContactDomain, ContactError, FACE_AREA_MM2};
use tissue::mesh::{Boundary, FaceAdjacency, box_phantom, ellipsoid_phantom};
use tissue::schemes::{Draw, FRAMES, Group, Programme, Scheme};

#[test]
fn a_patch_is_connected_centred_and_as_large_as_asked() {
    let mesh = ellipsoid_phantom([60.0, 50.0, 40.0], 14).unwrap();
    let domain = ContactDomain::new(&mesh, Boundary::Supported).unwrap();
    let area = 50.0 * FACE_AREA_MM2;
    let mut grown = 0;
    for seed in (0..domain.face_count()).step_by(7) {
        let Ok(patch) = domain.grow(seed, area) else {
            continue;
        };
        grown += 1;
        let largest_face = 40.0;
        assert!(patch.area_mm2 >= area && patch.area_mm2 < area + largest_face);
        assert_eq!(patch.faces[0] as usize, seed);
        let faces: Vec<[u32; 3]> = mesh
            .domain
            .iter()
            .map(|row| mesh.surface[*row as usize])
            .collect();
        let adjacency = FaceAdjacency::new(&faces);
        for (i, face) in patch.faces.iter().enumerate().skip(1) {
            assert!(
                patch.faces[..i]
                    .iter()
                    .any(|earlier| adjacency.of(*face as usize).contains(earlier)),
                "face {face} touches none that came before it"
            );
        }
        let distance = |face: usize| -> f64 {
            let (a, b) = (domain.centroids()[face], patch.site);
            (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
        };
        let radius = patch
            .faces
            .iter()
            .map(|f| distance(*f as usize))
            .fold(0.0, f64::max);
        assert!(radius < 3.0 * (area / std::f64::consts::PI).sqrt());
        for node in &patch.nodes {
            assert!(mesh.fixed.binary_search(node).is_err());
            assert!(mesh.supported.binary_search(node).is_err());
        }
        let length: f64 = patch.direction(0.7, 2.0).iter().map(|v| v * v).sum();
        assert!((length - 1.0).abs() < 1e-12);
        assert_eq!(patch.direction(0.0, 1.0), patch.inward);
        assert!(patch.inward[2] < 0.0, "into the top cap");
    }
    assert!(grown > 5);
}

#[test]
fn a_load_larger_than_the_domain_is_refused() {
    let mesh = box_phantom([20.0; 3], [4; 3]).unwrap();
    let domain = ContactDomain::new(&mesh, Boundary::Fixed).unwrap();
    let error = domain.grow(0, 500.0).unwrap_err();
    assert!(
        matches!(error, ContactError::DomainTooSmall { reached_mm2, .. } if (reached_mm2 - 400.0).abs() < 1e-3)
    );
    assert!(domain.grow(10_000, 10.0).is_err());
}

#[test]
fn scheme_three_is_the_papers() {
    let draw = Draw {
        depth: 0.5,
        size: 0.5,
        angle: 0.5,
    };
    let scheme = Scheme::Three;
    assert_eq!(scheme.magnitude_mm(draw), 13.0);
    assert!((scheme.pose(3.0, draw).phi - std::f64::consts::PI / 8.0).abs() < 1e-12);
    assert!((scheme.pose(6.5, draw).theta - 2.0 * std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(scheme.pose(6.45, draw).push, 1.0);
    assert_eq!(scheme.pose(6.5, draw).push, 0.0);
}

#[test]
fn every_scheme_stays_in_its_bounds_and_jumps_only_where_it_says() {
    for scheme in Scheme::NUMBERED {
        let draw = Draw {
            depth: 0.0,
            size: 0.0,
            angle: 0.0,
        };
        assert!((10.0..=15.0).contains(&scheme.magnitude_mm(draw)));
        assert!((25.0..=100.0).contains(&scheme.face_count(draw)));
        let mut jumps = 0;
        let mut deepest: f64 = 0.0;
        for i in 0..8000 {
            let (a, b) = (
                scheme.pose(i as f64 * 1e-3, draw),
                scheme.pose((i + 1) as f64 * 1e-3, draw),
            );
            deepest = deepest.max(b.push);
            assert!((0.0..=1.0).contains(&b.push) && b.phi.abs() < 1.0);
            assert!((b.phi - a.phi).abs() < 0.01 && (b.theta - a.theta).abs() < 0.01);
            jumps += usize::from((b.push - a.push).abs() > 0.02);
        }
        assert!(deepest > 0.95, "{}: {deepest}", scheme.name());
        let lifted = matches!(scheme, Scheme::Three | Scheme::Five);
        assert_eq!(jumps, usize::from(lifted), "{}", scheme.name());
    }
}

#[test]
fn programmes_follow_their_seed_and_hard_regimes_do_what_their_names_say() {
    let mesh = box_phantom([80.0, 80.0, 40.0], [16, 16, 6]).unwrap();
    let domain = ContactDomain::new(&mesh, Boundary::Fixed).unwrap();
    for scheme in Scheme::NUMBERED.into_iter().chain(Scheme::of(Group::Hard)) {
        let frames = |seed: u64| -> Vec<_> {
            let programme = Programme::new(scheme, &domain, seed).unwrap();
            (0..FRAMES).map(|frame| programme.contact(frame)).collect()
        };
        let (first, again, other) = (frames(4), frames(4), frames(5));
        assert_eq!(first, again);
        assert_ne!(first, other, "{}", scheme.name());
        assert!(first[0].is_empty());
        let length = |c: &tissue::solver::ContactNode| {
            c.displacement.iter().map(|v| v * v).sum::<f32>().sqrt()
        };
        let deepest = first.iter().flatten().map(length).fold(0.0, f32::max);
        match scheme {
            Scheme::HardDeep => assert!((20.0..=40.0).contains(&deepest)),
            Scheme::HardFast => {
                let soon = first[1]
                    .iter()
                    .chain(&first[2])
                    .map(length)
                    .fold(0.0, f32::max);
                assert!(soon >= 0.99 * deepest, "full depth within two frames");
            }
            Scheme::HardSlide => {
                let nodes = |f: usize| first[f].iter().map(|c| c.node).collect::<Vec<_>>();
                let (early, late) = (nodes(20), nodes(120));
                let stayed = early.iter().filter(|n| late.contains(n)).count();
                assert!(
                    2 * stayed < early.len(),
                    "{stayed} of {} nodes",
                    early.len()
                );
            }
            Scheme::HardTwo => {
                let one = Programme::new(Scheme::One, &domain, 4).unwrap();
                assert!(first[60].len() > one.contact(60).len() / 2);
            }
            _ => assert!(deepest <= 15.001),
        }
        for row in &first {
            assert!(row.windows(2).all(|w| w[0].node < w[1].node));
        }
    }
}

#[test]
fn a_probe_visits_five_sites_and_lets_go_of_each() {
    let mesh = box_phantom([80.0, 80.0, 40.0], [16, 16, 6]).unwrap();
    let domain = ContactDomain::new(&mesh, Boundary::Fixed).unwrap();
    let programme = Programme::new(Scheme::Probe, &domain, 4).unwrap();
    let length = |frame: usize| {
        let contact = programme.contact(frame);
        let nodes: Vec<u32> = contact.iter().map(|c| c.node).collect();
        let squared = contact
            .first()
            .map_or(0.0, |c| c.displacement.iter().map(|v| v * v).sum::<f32>());
        (nodes, squared.sqrt())
    };
    let mut sites = std::collections::HashSet::new();
    for start in (0..160).step_by(32) {
        assert!(
            programme.contact(start).is_empty(),
            "rest before site {start}"
        );
        let (nodes, first) = length(start + 1);
        let (same, deepest) = length(start + 15);
        assert_eq!(nodes, same, "one site while it is pushed");
        assert!(first > 0.0 && first < 2.0, "{first} mm in the first frame");
        assert!((8.0..=15.001).contains(&deepest), "{deepest} mm");
        for frame in start + 16..start + 32 {
            assert!(programme.contact(frame).is_empty(), "free at frame {frame}");
        }
        sites.insert(nodes);
    }
    assert_eq!(sites.len(), 5);
}

#[test]
fn scheme_lists_parse() {
    let names = |text: &str| {
        Scheme::parse_list(text).map(|s| s.into_iter().map(Scheme::name).collect::<Vec<_>>())
    };
    assert_eq!(names("1-4").unwrap(), ["1", "2", "3", "4"]);
    assert_eq!(names("5").unwrap(), ["5"]);
    assert_eq!(names("1,3").unwrap(), ["1", "3"]);
    assert_eq!(names("hard").unwrap().len(), 5);
    assert_eq!(names("hard-two").unwrap(), ["hard-two"]);
    assert_eq!(names("probe").unwrap(), ["probe"]);
    assert!(names("6").is_err() && names("4-1").is_err() && names("").is_err());
}
