//! Parts and sets of Abaqus and FEBio, versions of Gmsh, Medit and TetGen.

use std::path::Path;

use tissue::mesh::Mesh;
use tissue::mesh_import::{Region, faces_in, nodes_in, tets_in};
use tissue::mesh_quality::measure;

use super::{Folder, QUADS, TETS, is_the_box, list, read, refused, rows};

/// The rows and nodes of `group:NAME`.
fn group(mesh: &Mesh, path: &Path, name: &str) -> (Vec<u32>, Vec<u32>, Vec<usize>) {
    let region: Region = format!("group:{name}").parse().unwrap();
    let open = region.open(path, 1.0).unwrap();
    let tets = tets_in(mesh, &open);
    let open = [open];
    (faces_in(mesh, &open), nodes_in(mesh, &open), tets)
}

/// The four nodes of the bottom, and where the name is one of faces both of its triangles.
fn is_the_bottom(mesh: &Mesh, path: &Path, by_faces: bool) {
    let (faces, nodes, _) = group(mesh, path, "bed");
    let name = path.display();
    assert_eq!(nodes.len(), 4, "{name}");
    for &node in &nodes {
        assert_eq!(mesh.positions[node as usize][2], 0.0, "{name}");
    }
    assert!(faces.len() == 2 || !by_faces, "{name}");
}

pub fn node_lines() -> String {
    rows(|at, [x, y, z]| format!("{}, {x}, {y}, {z}\n", at + 1))
}

pub fn tet_lines() -> String {
    (1..)
        .zip(&TETS)
        .map(|(at, tet)| format!("{at}, {}\n", list(tet, 1, ", ")))
        .collect()
}

#[test]
fn parts_and_sets_of_abaqus() {
    let folder = Folder::new();
    let (nodes, tets) = (node_lines(), tet_lines());
    let part = format!(
        "*Heading\n*Part, name=Liver\n*Node\n{nodes}*Element, type=C3D4\n{tets}*Nset, nset=Bed\n 1, 3, 5, 7\n*End Part\n"
    );
    let assembly = |more: &str| {
        format!(
            "{part}*Assembly, name=A\n*Instance, name=Liver-1, part=Liver\n*End Instance\n{more}*End Assembly\n"
        )
    };
    let tool = "*Part, name=Tool\n*Node\n1, 0., 0., 50.\n2, 5., 0., 50.\n3, 0., 5., 50.\n*Element, type=R3D3\n1, 1, 2, 3\n*End Part\n";
    let skin = "101, 1, 3, 7\n102, 1, 7, 5\n";
    let flat = format!("*NODE\n{nodes}*ELEMENT, TYPE=C3D4, ELSET=organ\n{tets}");
    let shells = |kind: &str| format!("*ELEMENT, TYPE={kind}, ELSET=bed\n{skin}{flat}");
    let files = [
        ("part.inp", part.clone()),
        (
            "reference_point.inp",
            assembly("*Node\n 1, 20., 15., 60.\n*Nset, nset=RP, internal\n 1,\n"),
        ),
        (
            "node_of_an_instance.inp",
            assembly("*Nset, nset=Corner\nLiver-1.1, Liver-1.Bed\n"),
        ),
        (
            "set_of_the_assembly.inp",
            assembly("*Nset, nset=Low, instance=Liver-1\n1, 3\n5, 7\n")
                .replace("nset=Bed", "nset=Other")
                .replace("Low", "Bed"),
        ),
        (
            "rigid_tool.inp",
            assembly("").replacen("*Assembly", &format!("{tool}*Assembly"), 1),
        ),
        (
            "later.inp",
            format!(
                "{flat}*NSET, NSET=ALL\nBED, NOWHERE\n*NSET, NSET=Bed\nLOW\n*NSET, NSET=LOW, GENERATE\n1, 7, 2\n"
            ),
        ),
        (
            "normals.inp",
            format!(
                "{}*NSET, NSET=Bed\n1, 3, 5, 7,\n",
                flat.replace("20\n", "20, 0., 0., 1.\n")
            ),
        ),
        ("cps3.inp", shells("CPS3")),
        ("s3.inp", shells("S3")),
        (
            "elset.inp",
            format!("*ELEMENT, TYPE=CPS3\n{skin}{flat}*ELSET, ELSET=Bed\n101, 102\n"),
        ),
        (
            "surface.inp",
            format!(
                "{flat}*ELSET, ELSET=one\n2,\n*SURFACE, NAME=Bed, TYPE=ELEMENT\none, S1\n1, S1\n"
            ),
        ),
        (
            "nodes_of.inp",
            format!("*ELEMENT, TYPE=S3, ELSET=skin\n{skin}{flat}*NSET, NSET=Bed, ELSET=skin\n"),
        ),
    ];
    for (name, text) in files {
        let path = folder.write(name, text);
        let imported = read(&path);
        is_the_box(name, &imported);
        let by_faces = ["cps3.inp", "s3.inp", "elset.inp", "surface.inp"].contains(&name);
        is_the_bottom(&imported.mesh, &path, by_faces);
    }
    // An instance is shifted by 100 and turned by 90 degrees about z.
    let placed = assembly("").replace(
        "part=Liver\n",
        "part=Liver\n100., 0., 0.\n100., 0., 0., 100., 0., 1., 90.\n",
    );
    let mesh = read(&folder.write("placed.inp", placed)).mesh;
    let quality = measure(&mesh);
    let near = |found: [f32; 3], wanted: [f32; 3]| {
        found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-4)
    };
    assert!(
        near(quality.low_mm, [70.0, 0.0, 0.0]),
        "{:?}",
        quality.low_mm
    );
    assert!(
        near(quality.high_mm, [100.0, 40.0, 20.0]),
        "{:?}",
        quality.high_mm
    );
    for (name, text, words) in [
        (
            "more.inp",
            flat.replace("1, 1, 5, 7, 8", "1, 1, 5, 7, 8, 2"),
            ["has 4 nodes, not 5", "line 11"],
        ),
        (
            "system.inp",
            flat.replace("*NODE\n", "*NODE, SYSTEM=C\n"),
            ["SYSTEM=C", "line 1"],
        ),
        (
            "input.inp",
            flat.replace("*NODE\n", "*NODE, INPUT=n.txt\n"),
            ["INPUT=", "line 1"],
        ),
    ] {
        refused(&folder.write(name, text), &words);
    }
}

#[test]
fn second_order_tetrahedra_of_abaqus_go_on_in_the_next_line() {
    let folder = Folder::new();
    let text = "*NODE\n1,0,0,0\n2,9,0,0\n3,0,9,0\n4,0,0,9\n5,4,0,0\n6,4,4,0\n7,0,4,0\n8,0,0,4\n9,4,0,4\n10,0,4,4\n*ELEMENT, TYPE=C3D10M\n\
                1, 1, 2, 3, 4, 5, 6,\n7, 8, 9, 10\n";
    let imported = read(&folder.write("c3d10.inp", text));
    assert_eq!(
        (imported.mesh.node_count(), imported.mesh.tets.len()),
        (4, 1)
    );
    assert!(imported.repairs[0].what.contains("higher order"));
    refused(
        &folder.write("cut.inp", text.replace("7, 8, 9, 10\n", "")),
        &["has 6 nodes", "cut off"],
    );
}

#[test]
fn sets_and_versions_of_febio() {
    let folder = Folder::new();
    let nodes = rows(|at, [x, y, z]| format!("<node id=\"{}\">{x},{y},{z}</node>", at + 1));
    let elements: String = (1..)
        .zip(&TETS)
        .map(|(at, tet)| format!("<elem id=\"{at}\">{}</elem>", list(tet, 1, ",")))
        .collect();
    let file = |sets: &str| {
        format!(
            "<?xml version=\"1.0\"?>\n<febio_spec version=\"4.0\">\n<Mesh>\n<Nodes name=\"all\">{nodes}</Nodes>\n\
                 <Elements type=\"tet4\" name=\"organ\">{elements}</Elements>\n{sets}\n</Mesh>\n</febio_spec>\n"
        )
    };
    let facets = "<tri3 id=\"1\">1,3,7</tri3><tri3 id=\"2\">1,7,5</tri3>";
    let files = [
        (
            "numbers.feb",
            file("<NodeSet name=\"bed\">1,3,5,7</NodeSet>"),
        ),
        ("range.feb", file("<NodeSet name=\"bed\">1:7:2</NodeSet>")),
        (
            "tags.feb",
            file(
                "<NodeSet name=\"bed\"><node id=\"1\"></node><n id=\"3\"/><node id=\"5\"></node><node id=\"7\"/></NodeSet>",
            ),
        ),
        (
            "nested.feb",
            file(
                "<NodeSet name=\"bed\"><NodeSet node_set=\"low\"/></NodeSet><NodeSet name=\"low\">1,3,5,7</NodeSet>",
            ),
        ),
        (
            "surface.feb",
            file(&format!(
                "<Surface name=\"bed\">{facets}</Surface><NodeSet name=\"held\">@surface:bed</NodeSet>"
            )),
        ),
        (
            "held.feb",
            file(&format!(
                "<Surface name=\"low\">{facets}</Surface><NodeSet name=\"bed\">@surface:low</NodeSet>"
            )),
        ),
        (
            "shells.feb",
            file(&format!(
                "<Elements type=\"tri3\" name=\"bed\">{}</Elements>",
                facets
                    .replace("tri3 id=\"", "elem id=\"10")
                    .replace("tri3", "elem")
            )),
        ),
    ];
    for (name, text) in files {
        let path = folder.write(name, text);
        let imported = read(&path);
        is_the_box(name, &imported);
        is_the_bottom(
            &imported.mesh,
            &path,
            ["surface.feb", "shells.feb"].contains(&name),
        );
        assert_eq!(group(&imported.mesh, &path, "organ").2.len(), 6, "{name}");
    }
    let old: String = (1..)
        .zip(&TETS)
        .map(|(at, tet)| {
            format!(
                "<tet4 id=\"{at}\" mat=\"{}\">{}</tet4>",
                1 + at / 4,
                list(tet, 1, ",")
            )
        })
        .collect();
    let old = format!(
        "<febio_spec version=\"1.2\">\n<Geometry>\n<Nodes>{nodes}</Nodes>\n<Elements>{old}</Elements></Geometry></febio_spec>"
    );
    let path = folder.write("old.feb", old);
    let imported = read(&path);
    is_the_box("old.feb", &imported);
    assert_eq!(group(&imported.mesh, &path, "2").2, [3, 4, 5]);
    refused(
        &folder.write(
            "from.feb",
            "<febio_spec version=\"3.0\">\n<Mesh from=\"organ_mesh.feb\"/>\n</febio_spec>\n",
        ),
        &["line 2", "the mesh is in organ_mesh.feb"],
    );
}

#[test]
fn versions_of_gmsh_medit_and_tetgen() {
    let folder = Folder::new();
    let nodes = rows(|at, [x, y, z]| format!("{} {x} {y} {z}\n", at + 1));
    let tets: String = (1..)
        .zip(&TETS)
        .map(|(at, tet)| format!("{at} 4 2 1 1 {}\n", list(tet, 1, " ")))
        .collect();
    for version in ["2", "2.0", "2.1", "2.2"] {
        let text = format!(
            "$MeshFormat\n{version} 0 8\n$EndMeshFormat\n$Nodes\n8\n{nodes}$EndNodes\n$Elements\n6\n{tets}$EndElements\n"
        );
        is_the_box(version, &read(&folder.write("box.msh", text)));
    }
    let vertices = rows(|at, [x, y, z]| format!("{x} {y} {z} {}\n", at % 2));
    let tets: String = TETS
        .iter()
        .map(|tet| format!("{} 7\n", list(tet, 1, " ")))
        .collect();
    let head = format!("MeshVersionFormatted 2\nDimension\n3\n\nVertices\n8\n{vertices}");
    let medit = format!("{head}Edges 1\n1 2 0\nTetrahedra\n6\n{tets}Corners\n1\n1\nEnd\n");
    let path = folder.write("box.mesh", &medit);
    let imported = read(&path);
    is_the_box("box.mesh", &imported);
    assert_eq!(group(&imported.mesh, &path, "ref=7").2.len(), 6);
    assert_eq!(group(&imported.mesh, &path, "ref=0").1, [0, 2, 4, 6]);
    let quads: String = QUADS
        .iter()
        .map(|quad| format!("{} 1\n", list(quad, 1, " ")))
        .collect();
    is_the_box(
        "skin.mesh",
        &read(&folder.write(
            "skin.mesh",
            format!("{head}Quadrilaterals\n6\n{quads}End\n"),
        )),
    );
    refused(
        &folder.write("cut.mesh", &medit[..80]),
        &["line", "cut off"],
    );
    refused(
        &folder.write("many.mesh", medit.replace("\n8\n", "\n8000000\n")),
        &["8000000 vertices", "too short"],
    );
    for first in [0, 1] {
        let nodes = rows(|at, [x, y, z]| format!("{} {x} {y} {z} {}\n", at + first, at % 2));
        folder.write("box.node", format!("# nodes\n8 3 0 1\n{nodes}"));
        let tets: String = (first..)
            .zip(&TETS)
            .map(|(at, tet)| format!("{at} {} 2\n", list(tet, first, " ")))
            .collect();
        let path = folder.write("box.ele", format!("6 4 1\n{tets}# made by a program\n"));
        for path in [path.clone(), path.with_extension("node")] {
            let imported = read(&path);
            is_the_box("box.ele", &imported);
            assert_eq!(group(&imported.mesh, &path, "region=2").2.len(), 6);
            assert_eq!(group(&imported.mesh, &path, "marker=0").1, [0, 2, 4, 6]);
        }
    }
    let alone = folder.write("alone.ele", "6 4 0\n");
    refused(&alone, &["alone.node"]);
}
