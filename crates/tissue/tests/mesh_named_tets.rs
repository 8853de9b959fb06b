//! Abaqus, CalculiX (`.inp`) and FEBio (`.feb`) files: what is read, what their sets are called, and what is refused.
#![cfg(feature = "files")]

mod inputs;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use inputs::{CORNERS, TETS};
use tissue::mesh::Mesh;
use tissue::mesh_import::{
    ImportOptions, Region, faces_in, import, nodes_in, read_labels, tets_in,
};

/// Numbers in the files begin at 11, with gaps.
fn number(place: usize) -> usize {
    11 + 3 * place
}

fn inp() -> String {
    let mut text = "** a comment, in 10\u{b0}\n*HEADING\na cube\n*NODE, NSET=all\n".to_owned();
    for (at, [x, y, z]) in CORNERS.into_iter().enumerate() {
        writeln!(text, "{}, {x}, {y:e}, {z:.1}D0", number(at)).unwrap();
    }
    text += "*ELEMENT, type=S3, ELSET=skin\n900, 11, 14, 17\n*ELEMENT, TYPE=C3D4,\n ELSET=body\n";
    for (at, tet) in TETS.into_iter().enumerate() {
        let [a, b, c, d] = tet.map(number);
        writeln!(text, "{}, {a}, {b}, {c}, {d}", at + 1).unwrap();
    }
    text +=
        "*ELSET, ELSET=lower, GENERATE\n1, 3, 1\n*ELSET, ELSET=\"both halves\"\nlower, 4,\n5, 6\n";
    text + "*NSET, NSET=Floor\n11, 14,\n17, 20\n*MATERIAL, NAME=tissue\n*ELASTIC\n3000., 0.49\n"
}

fn feb() -> String {
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<febio_spec version=\"4.0\">\n<Material><material id=\"1\" \
                    name=\"tissue\"/></Material>\n<Mesh>\n<Nodes name=\"all\">\n"
        .to_owned();
    for (at, [x, y, z]) in CORNERS.into_iter().enumerate() {
        writeln!(text, "<node id=\"{}\">{x}, {y:e},{z}</node>", number(at)).unwrap();
    }
    text += "</Nodes>\n<Elements type=\"tri3\" name=\"skin\"><elem id=\"900\">11,14,17</elem></Elements>\n";
    for (name, half) in [("lower", 0..3), ("upper", 3..6)] {
        writeln!(text, "<Elements type=\"tet4\" name=\"{name}\">").unwrap();
        for at in half {
            let [a, b, c, d] = TETS[at].map(number);
            writeln!(text, "<elem id=\"{}\">{a},{b},{c},{d}</elem>", at + 1).unwrap();
        }
        text += "</Elements>\n";
    }
    text + "<NodeSet name=\"Floor\">11, 14,\n17,20</NodeSet>\n<ElementSet name=\"some\"><e id=\"2\"/><e id=\"5\"></e></ElementSet>\n\
            </Mesh>\n</febio_spec>\n"
}

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn read(path: &Path) -> Mesh {
    import(path, &ImportOptions::default()).unwrap().mesh
}

fn open(text: &str, path: &Path) -> tissue::mesh_import::Opened {
    let region: Region = text.parse().unwrap();
    region.open(path, 1.0).unwrap()
}

#[test]
fn both_become_the_same_cube_and_keep_their_sets() {
    let folder = tempfile::tempdir().unwrap();
    let files = [("cube.inp", inp()), ("cube.feb", feb())];
    for (name, text) in files {
        let path = write(folder.path(), name, &text);
        let mesh = read(&path);
        let corners: Vec<[f32; 3]> = CORNERS.iter().map(|p| p.map(|x| x as f32)).collect();
        assert_eq!(mesh.positions, corners, "{name}");
        let tets: Vec<[u32; 4]> = TETS.iter().map(|t| t.map(|n| n as u32)).collect();
        assert_eq!(mesh.tets, tets, "{name}");
        assert_eq!(
            nodes_in(&mesh, &[open("group:floor", &path)]),
            [0, 1, 2, 3],
            "{name}"
        );
        assert_eq!(
            tets_in(&mesh, &open("group:lower", &path)),
            [0, 1, 2],
            "{name}"
        );
    }
    let named = |name: &str| -> Vec<String> {
        let labels = read_labels(&folder.path().join(name)).unwrap();
        labels.names().into_iter().map(str::to_owned).collect()
    };
    assert_eq!(
        named("cube.inp"),
        ["Floor", "all", "body", "both halves", "lower", "skin"]
    );
    assert_eq!(
        named("cube.feb"),
        ["Floor", "all", "lower", "skin", "some", "upper"]
    );
    let path = folder.path().join("cube.inp");
    let mesh = read(&path);
    assert_eq!(tets_in(&mesh, &open("group:both halves", &path)).len(), 6);
    // A set of tetrahedra has their nodes and the faces of the surface that are theirs.
    let half = TETS[..3].iter().flatten();
    let mut nodes: Vec<u32> = half.map(|&node| node as u32).collect();
    nodes.sort_unstable();
    nodes.dedup();
    assert_eq!(nodes_in(&mesh, &[open("group:lower", &path)]), nodes);
    let lower = faces_in(&mesh, &[open("group:lower", &path)]);
    let upper = faces_in(&mesh, &[open("not:group:lower", &path)]);
    assert_eq!((lower.len(), upper.len()), (6, 6));
    let path = folder.path().join("cube.feb");
    assert_eq!(tets_in(&mesh, &open("group:some", &path)), [1, 4]);
}

#[test]
fn a_set_that_announces_more_than_the_file_can_hold_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let said = |name: &str, text: &str| {
        let path = write(folder.path(), name, text);
        let error = import(&path, &ImportOptions::default()).unwrap_err();
        let groups = read_labels(&path).err().unwrap();
        assert_eq!(error.to_string(), groups.to_string());
        error.to_string()
    };
    let inp = inp();
    // Of a set's first members, below its keyword.
    let line = inp.lines().count() + 2;
    for (range, count) in [
        ("1, 4000000000", "4000000000"),
        ("0, 18446744073709551615, 1", "18446744073709551615"),
        ("1, 4000000000, 2", "2000000000"),
    ] {
        let said = said(
            "range.inp",
            &format!("{inp}*NSET, NSET=Wall, GENERATE\n{range}\n"),
        );
        let words = format!("range.inp: line {line}: set `Wall` announces {count} members");
        assert!(said.contains(&words), "{said}");
    }
    // Each set names the last ten times: 4 members, 40, ...; the seventh has too many.
    let mut powers = format!("{inp}*ELSET, ELSET=A0\n1, 2, 3, 4\n");
    for level in 1..12 {
        let ten = format!("A{}\n", level - 1).repeat(10);
        powers += &format!("*ELSET, ELSET=A{level}\n{ten}");
    }
    let text = said("powers.inp", &powers);
    let seventh = line + 2 + 5 * 11;
    let words = format!("line {seventh}: set `A6` announces 4000000 members");
    assert!(text.contains(&words), "{text}");
    let feb = feb().replace("11, 14,\n17,20<", "11:4000000000<");
    let text = said("range.feb", &feb);
    assert!(text.contains("set `Floor` announces 3999999990"), "{text}");
    // Ranges that reach over gaps, sets that name each other, and a few repeats are sound.
    let sound = "*NSET, NSET=all of them, GENERATE\n1, 99999\n*NSET, NSET=X\nY, Y, Floor\n*NSET, NSET=Y\nX, Floor, Floor\n";
    let path = write(folder.path(), "sound.inp", &format!("{inp}{sound}"));
    assert_eq!(
        nodes_in(&read(&path), &[open("group:all of them", &path)]).len(),
        8
    );
}

#[test]
fn what_is_wrong_with_a_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, text: String, words: &[&str]| {
        let path = write(folder.path(), name, &text);
        let error = import(&path, &ImportOptions::default()).unwrap_err();
        let said = error.to_string();
        for word in words.iter().chain([&name]) {
            assert!(said.contains(word), "`{word}` is not in: {said}");
        }
    };
    let (inp, feb) = (inp(), feb());
    // Another kind of volume, alone or among tetrahedra.
    refused(
        "kind.inp",
        inp.replace("TYPE=C3D4", "TYPE=C3D8"),
        &["C3D8", "line 15", "only tetrahedra"],
    );
    refused(
        "mixed.inp",
        format!("{inp}*ELEMENT, TYPE=C3D8R\n901, 11, 14, 17, 20, 23, 26, 29, 32\n"),
        &["C3D8R", "only tetrahedra"],
    );
    refused(
        "kind.feb",
        feb.replacen("type=\"tet4\"", "type=\"hex8\"", 1),
        &["hex8", "lower", "only tetrahedra"],
    );
    let hexes = "<Elements type=\"hex8\" name=\"bone\"><elem id=\"901\">11,14,17,20,23,26,29,32</elem></Elements></Mesh>";
    refused(
        "mixed.feb",
        feb.replace("</Mesh>", hexes),
        &["hex8", "bone"],
    );
    // No volume at all.
    refused(
        "skin.inp",
        inp.replace("TYPE=C3D4", "TYPE=S4"),
        &["holds no tetrahedra"],
    );
    refused(
        "skin.feb",
        feb.replace("tet4", "quad4"),
        &["holds no tetrahedra"],
    );
    refused("empty.inp", String::new(), &["holds no tetrahedra"]);
    refused(
        "empty.feb",
        String::new(),
        &["neither <Mesh> nor <Geometry>"],
    );
    // Cut off within nodes, within elements, and between lines so that nodes are missing.
    let before =
        |text: &str, words: &str, more: usize| text[..text.find(words).unwrap() + more].to_owned();
    refused(
        "nodes.inp",
        before(&inp, "\n32, 0", 5),
        &["line 12", "cut off"],
    );
    refused(
        "elements.inp",
        before(&inp, "\n4, 11", 9),
        &["line 20", "cut off"],
    );
    let missing = inp.replace(
        &inp[inp.find("\n32, 0").unwrap()..inp.find("\n*ELEMENT").unwrap()],
        "",
    );
    refused("missing.inp", missing, &["names node 32", "does not exist"]);
    refused(
        "nodes.feb",
        before(&feb, "<node id=\"32\"", 9),
        &["cut off"],
    );
    refused(
        "elements.feb",
        before(&feb, "<elem id=\"4\"", 16),
        &["cut off"],
    );
    refused(
        "between.feb",
        before(&feb, "</Elements>\n<NodeSet", 11),
        &["inside <Mesh>", "cut off"],
    );
    // Numbers that are none, lists of another length, the same number twice.
    refused(
        "word.inp",
        inp.replace("11, 0, 0e0", "11, 0, zero"),
        &["line 5", "`zero` is not a number"],
    );
    refused(
        "word.feb",
        feb.replace("id=\"14\">10", "id=\"14\">ten"),
        &["`ten` is not a number"],
    );
    refused(
        "short.feb",
        feb.replace("<elem id=\"1\">11,", "<elem id=\"1\">"),
        &["element 1", "has 3 nodes"],
    );
    refused(
        "twice.inp",
        inp.replace("\n14, ", "\n11, "),
        &["node 11 appears twice"],
    );
    refused(
        "twice.feb",
        feb.replace("<elem id=\"2\"", "<elem id=\"1\""),
        &["element 1 appears twice"],
    );
    refused(
        "include.inp",
        format!("*INCLUDE, INPUT=mesh.inp\n{inp}"),
        &["*INCLUDE is not followed"],
    );
    // Elements turned inside out are found after reading, as in every file.
    let path = write(
        folder.path(),
        "turned.inp",
        &inp.replace("\n1, 11, 14,", "\n1, 14, 11,"),
    );
    assert!(
        import(&path, &ImportOptions::default())
            .unwrap_err()
            .to_string()
            .contains("tet 0 is inverted")
    );
    let repaired = ImportOptions {
        repair: true,
        ..ImportOptions::default()
    };
    assert_eq!(import(&path, &repaired).unwrap().repairs.len(), 1);
}
