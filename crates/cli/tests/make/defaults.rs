//! What the command proposes for a body.

use super::{command, organ, text};

/// One end of the body is as thick as a brain's, the other thin.
#[test]
fn the_default_push_follows_the_thickness_beneath_the_domain() {
    let folder = tempfile::tempdir().unwrap();
    let surface = folder.path().join("wedge.obj");
    let thin = |[x, y, z]: [f64; 3]| [x, y, z * (0.6 + 0.008 * x)];
    organ(&surface, thin, false);
    let push = |more: &[&str]| -> f64 {
        let held = ["--fixed", "plane:0,-1,0,-25", "--preview"];
        let all = [&held[..], more].concat();
        let output = command(&surface, &surface.with_extension("bundle"), &all)
            .output()
            .unwrap();
        let said = text(&output);
        assert!(output.status.success(), "{said}");
        let words = said.split("made for pushes of up to ").nth(1).unwrap();
        words.split(' ').next().unwrap().parse().unwrap()
    };
    let (thick, flat) = (
        push(&["--domain", "plane:1,0,0,-5"]),
        push(&["--domain", "plane:-1,0,0,-5"]),
    );
    assert!(thick <= 15.0 && flat < 0.75 * thick, "{thick} {flat}");
    assert_eq!(push(&["--domain", "plane:-1,0,0,-5", "--push", "4"]), 4.0);
}
