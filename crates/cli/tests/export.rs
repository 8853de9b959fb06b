//! `upt export` as a user calls it; its surfaces are read by readers that this project did not write. VTK reads its frames in
//! `training/tests/test_vtk_export.py`.

use std::path::{Path, PathBuf};
use std::process::Output;

use fixture::{program, root};
use tissue::mesh::Mesh;
use tissue::trajectory::Trajectory;

const MESH: &str = "tests/fixtures/box.mesh.safetensors";

fn upt(arguments: &[&str]) -> Output {
    program(env!("CARGO_BIN_EXE_upt"), arguments)
        .output()
        .unwrap()
}

/// A simulated contact on the box, and a folder for what is exported.
struct Case {
    folder: tempfile::TempDir,
    mesh: Mesh,
    trajectory: Trajectory,
}

impl Case {
    fn new() -> Case {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("push.trajectory.safetensors");
        let file = file.to_str().unwrap();
        let output = upt(&["simulate", "--mesh", MESH, "--scheme", "1", "--out", file]);
        assert!(output.status.success(), "{output:?}");
        Case {
            mesh: Mesh::read(&root().join(MESH)).unwrap(),
            trajectory: Trajectory::read(Path::new(file)).unwrap(),
            folder,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn export(&self, mesh: &str, arguments: &[&str]) -> Output {
        let trajectory = self.path("push.trajectory.safetensors");
        let trajectory = trajectory.to_str().unwrap();
        upt(&[&["export", trajectory, "--mesh", mesh], arguments].concat())
    }

    /// The surface of frame 80 in a new file.
    fn surface(&self, name: &str) -> PathBuf {
        let path = self.path(name);
        let output = self.export(
            MESH,
            &["--surface", path.to_str().unwrap(), "--frame", "80"],
        );
        assert!(output.status.success(), "{output:?}");
        path
    }

    fn moved(&self, frame: usize) -> Vec<[f32; 3]> {
        self.mesh
            .positions
            .iter()
            .zip(self.trajectory.frame(frame))
            .map(|(p, u)| [0, 1, 2].map(|k| p[k] + u[k]))
            .collect()
    }
}

#[test]
fn a_surface_is_deformed_in_ply_and_in_gltf() {
    let case = Case::new();
    let moved = case.moved(80);
    let surface = case.mesh.surface.as_flattened();
    let high = |axis: usize| {
        let values = surface.iter().map(|&node| moved[node as usize][axis]);
        values.fold(f32::NEG_INFINITY, f32::max)
    };
    let file = std::fs::File::open(case.surface("skin.ply")).unwrap();
    let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
    let ply = parser.read_ply(&mut std::io::BufReader::new(file)).unwrap();
    assert_eq!(ply.payload["face"].len(), case.mesh.surface.len());
    let value = |vertex: &ply_rs_bw::ply::DefaultElement, name: &str| match vertex[name] {
        ply_rs_bw::ply::Property::Float(value) => value,
        ref other => panic!("{name} is {other:?}"),
    };
    let highest = |name: &str| {
        let values = ply.payload["vertex"].iter().map(|v| value(v, name));
        values.fold(f32::NEG_INFINITY, f32::max)
    };
    assert_eq!([highest("x"), highest("z")], [high(0), high(2)]);
    let largest = (case.trajectory.frame(80).as_flattened().iter()).fold(0.0f32, |a, &u| a.max(u));
    assert!(largest > 0.1, "frame 80 is being pushed: {largest} mm");

    let gltf = gltf::Gltf::open(case.surface("skin.gltf")).unwrap();
    let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(primitive.indices().unwrap().count(), surface.len());
    // Metres, y up: z of the mesh is y of the file.
    assert!((primitive.bounding_box().max[1] - 1e-3 * high(2)).abs() < 1e-6);
}

#[test]
fn what_cannot_be_exported_is_said() {
    let case = Case::new();
    let other = "onnx/meshes/brain-coarse.mesh.safetensors";
    let out = case.path("out");
    let out = out.to_str().unwrap();
    let bad = case.path("skin.stl");
    let bad = bad.to_str().unwrap();
    let good = case.path("skin.ply");
    let good = good.to_str().unwrap();
    for (mesh, arguments, wanted) in [
        (other, vec!["--out", out], "was made on the mesh"),
        (
            MESH,
            vec!["--surface", bad, "--frame", "1"],
            ".ply or .gltf",
        ),
        (MESH, vec!["--surface", good, "--frame", "999"], "frame 999"),
        (MESH, vec!["--out", out, "--every", "0"], "--every"),
        (MESH, vec![], "--out"),
    ] {
        let output = case.export(mesh, &arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{arguments:?}");
        assert!(message.contains(wanted), "{arguments:?}: {message}");
    }
    assert!(!Path::new(out).exists() && !Path::new(good).exists());
}
