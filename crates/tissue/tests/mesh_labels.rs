//! Parts that a mesh file names: OBJ materials, PLY colours, physical groups of Gmsh, VTK arrays.
#![cfg(feature = "files")]

mod inputs;

use std::path::Path;

use inputs::{CORNERS, TETS};
use tissue::mesh::Mesh;
use tissue::mesh_import::{
    ImportOptions, Region, Resolution, faces_in, import, nodes_in, read_labels, tets_in,
};

/// Triangles of the cube, outward; the first two are its floor.
const FACES: [[usize; 3]; 12] = [
    [0, 2, 1],
    [0, 3, 2],
    [4, 5, 6],
    [4, 6, 7],
    [0, 1, 5],
    [0, 5, 4],
    [1, 2, 6],
    [1, 6, 5],
    [2, 3, 7],
    [2, 7, 6],
    [3, 0, 4],
    [3, 4, 7],
];

fn filled(path: &Path) -> Mesh {
    let options = ImportOptions {
        resolution: Some(Resolution::Nodes(300)),
        ..ImportOptions::default()
    };
    import(path, &options).unwrap().mesh
}

fn region(text: &str, path: &Path) -> tissue::mesh_import::Opened {
    let region: Region = text.parse().unwrap();
    region.open(path, 1.0).unwrap()
}

/// All faces of the mesh's floor and no others.
fn is_the_floor(mesh: &Mesh, path: &Path, name: &str) {
    let rows = faces_in(mesh, &[region(name, path)]);
    let floor = |row: &u32| {
        let face = mesh.surface[*row as usize];
        face.iter()
            .all(|&node| mesh.positions[node as usize][2] < 0.3)
    };
    assert!(rows.len() > 1 && rows.iter().all(floor), "{name}: {rows:?}");
    let all = (0..mesh.surface.len() as u32).filter(floor).count();
    assert_eq!(rows.len(), all, "{name}");
    let nodes = nodes_in(mesh, &[region(name, path)]);
    assert!(
        nodes
            .iter()
            .all(|&node| mesh.positions[node as usize][2] < 0.3)
    );
    assert!(nodes.len() >= 4, "{nodes:?}");
}

#[test]
fn an_obj_names_its_groups_and_materials_without_a_material_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.obj");
    let mut text = String::from("mtllib not-there.mtl\n");
    for [x, y, z] in CORNERS {
        text += &format!("v {x} {y} {z}\n");
    }
    for (at, [a, b, c]) in FACES.into_iter().enumerate() {
        match at {
            0 => text += "g floor\nusemtl ligament\n",
            2 => text += "g rest\nusemtl capsule\n",
            _ => {}
        }
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    std::fs::write(&path, text).unwrap();
    let mesh = filled(&path);
    is_the_floor(&mesh, &path, "group:floor");
    is_the_floor(&mesh, &path, "group:ligament");
    let names = read_labels(&path).unwrap();
    let error = names.group("tumour", &path, 1.0).err().unwrap().to_string();
    for word in ["tumour", "capsule", "floor", "ligament", "rest"] {
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_ply_names_its_colours() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.ply");
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n",
    );
    for [x, y, z] in CORNERS {
        let colour = if z == 0.0 { "255 0 16" } else { "200 200 200" };
        text += &format!("{x} {y} {z} {colour}\n");
    }
    for [a, b, c] in FACES {
        text += &format!("3 {a} {b} {c}\n");
    }
    std::fs::write(&path, text).unwrap();
    let mesh = filled(&path);
    let nodes = nodes_in(&mesh, &[region("group:#ff0010", &path)]);
    // Each point has the colour of the nearest corner of its triangle: the lower half.
    assert!(
        nodes
            .iter()
            .all(|&node| mesh.positions[node as usize][2] < 7.6)
    );
    let floor =
        (0..mesh.node_count() as u32).filter(|&node| mesh.positions[node as usize][2] < 0.1);
    for node in floor {
        assert!(nodes.contains(&node), "{node}");
    }
}

fn gmsh_2() -> String {
    let mut text = String::from(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"the floor\"\n3 2 \"stiff\"\n3 3 \"soft\"\n$EndPhysicalNames\n$Nodes\n8\n",
    );
    for (at, [x, y, z]) in CORNERS.into_iter().enumerate() {
        text += &format!("{} {x} {y} {z}\n", at + 1);
    }
    text += "$EndNodes\n$Elements\n18\n";
    for (at, face) in FACES.into_iter().enumerate() {
        let [a, b, c] = face.map(|node| node + 1);
        let group = if at < 2 { 1 } else { 0 };
        text += &format!("{} 2 2 {group} 1 {a} {b} {c}\n", at + 1);
    }
    for (at, tet) in TETS.into_iter().enumerate() {
        let [a, b, c, d] = tet.map(|node| node + 1);
        let group = if at < 2 { 2 } else { 3 };
        text += &format!("{} 4 2 {group} 1 {a} {b} {c} {d}\n", at + 13);
    }
    text + "$EndElements\n"
}

fn gmsh_4() -> String {
    let mut text = String::from(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"the floor\"\n3 2 \"stiff\"\n$EndPhysicalNames\n\
         $Entities\n0 0 2 2\n1 0 0 0 10 10 0 1 1 0\n2 0 0 0 10 10 10 0 0\n1 0 0 0 10 10 10 1 2 2 1 2\n2 0 0 0 10 10 10 0 0\n$EndEntities\n\
         $Nodes\n1 8 1 8\n3 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n",
    );
    for [x, y, z] in CORNERS {
        text += &format!("{x} {y} {z}\n");
    }
    text += "$EndNodes\n$Elements\n4 18 1 18\n";
    let mut tag = 0;
    let mut block = |head: &str, rows: &[Vec<usize>]| {
        text += &format!("{head} {}\n", rows.len());
        for row in rows {
            tag += 1;
            let nodes: Vec<String> = row.iter().map(|node| (node + 1).to_string()).collect();
            text += &format!("{tag} {}\n", nodes.join(" "));
        }
    };
    let faces: Vec<Vec<usize>> = FACES.iter().map(|face| face.to_vec()).collect();
    let tets: Vec<Vec<usize>> = TETS.iter().map(|tet| tet.to_vec()).collect();
    block("2 1 2", &faces[..2]);
    block("2 2 2", &faces[2..]);
    block("3 1 4", &tets[..2]);
    block("3 2 4", &tets[2..]);
    text + "$EndElements\n"
}

#[test]
fn gmsh_names_faces_and_tetrahedra_by_physical_groups() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("two.msh", gmsh_2()), ("four.msh", gmsh_4())] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let mesh = import(&path, &ImportOptions::default()).unwrap().mesh;
        is_the_floor(&mesh, &path, "group:the floor");
        is_the_floor(&mesh, &path, "group:1");
        assert_eq!(tets_in(&mesh, &region("group:stiff", &path)), [0, 1]);
        assert_eq!(tets_in(&mesh, &region("not:group:stiff", &path)).len(), 4);
    }
}

#[test]
fn vtk_arrays_of_whole_numbers_are_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.vtk");
    let mut text = String::from(
        "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n",
    );
    for [x, y, z] in CORNERS {
        text += &format!("{x} {y} {z}\n");
    }
    text += "CELLS 6 30\n";
    for [a, b, c, d] in TETS {
        text += &format!("4 {a} {b} {c} {d}\n");
    }
    text += "CELL_TYPES 6\n10\n10\n10\n10\n10\n10\n";
    text += "POINT_DATA 8\nSCALARS held int 1\nLOOKUP_TABLE default\n1\n1\n1\n1\n0\n0\n0\n0\n";
    text += "CELL_DATA 6\nSCALARS tissue int 1\nLOOKUP_TABLE default\n7\n7\n7\n2\n2\n2\n";
    std::fs::write(&path, text).unwrap();
    let mesh = import(&path, &ImportOptions::default()).unwrap().mesh;
    assert_eq!(tets_in(&mesh, &region("group:tissue=7", &path)), [0, 1, 2]);
    assert_eq!(
        nodes_in(&mesh, &[region("group:held=1", &path)]),
        [0, 1, 2, 3]
    );
}

/// An OBJ of the cube, moved by `by`.
fn cube_obj(head: &str, by: [f64; 3]) -> String {
    let mut text = format!("{head}\n");
    for corner in CORNERS {
        let [x, y, z] = std::array::from_fn(|k| corner[k] + by[k]);
        text += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c] in FACES {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    text
}

#[test]
fn a_surface_is_turned_where_both_files_name_another_space() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let lps = "# 3D Slicer output. SPACE=LPS";
    let ras = "# 3D Slicer output. SPACE=RAS";
    for (body, inside, is_turned) in [
        (ras, lps, true),
        (lps, ras, true),
        (lps, lps, false),
        (ras, "", false),
        ("", lps, false),
    ] {
        let body = write("body.obj", cube_obj(body, [0.0; 3]));
        let mesh = filled(&body);
        // The half of the cube with x over 5, or where that would be after half a turn.
        let by = match is_turned {
            true => [-15.0, -10.0, 0.0],
            false => [5.0, 0.0, 0.0],
        };
        let other = write("inside.obj", cube_obj(inside, by));
        let text = format!("inside:{}", other.display());
        let rows = tets_in(&mesh, &region(&text, &body));
        assert!(rows.len() * 3 > mesh.tets.len(), "{}", rows.len());
        for row in rows {
            let x = mesh.tets[row].map(|node| mesh.positions[node as usize][0]);
            assert!(x.iter().sum::<f32>() / 4.0 > 4.99);
        }
    }
}
