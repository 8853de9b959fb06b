//! Habits of STL, OBJ and OFF.

use super::{Folder, QUADS, is_the_box, list, points, read, refused, rows};

fn triangles() -> Vec<[[f64; 3]; 3]> {
    let points = points();
    let halves = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    QUADS
        .into_iter()
        .flat_map(halves)
        .map(|three| three.map(|node| points[node]))
        .collect()
}

fn stl(name: &str, normal: &str, end: &str) -> String {
    let mut text = format!("solid{name}\n");
    for triangle in triangles() {
        text += &format!("facet normal {normal}\n outer loop\n");
        for [x, y, z] in triangle {
            text += &format!("  vertex {x:e} {y:e} {z:e}\n");
        }
        text += " endloop\nendfacet\n";
    }
    text + end
}

fn binary_stl(head: &[u8], count: u32) -> Vec<u8> {
    let mut bytes = head.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    for triangle in triangles() {
        bytes.extend([0; 12]);
        let numbers = triangle.into_iter().flatten();
        bytes.extend(numbers.flat_map(|x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_of_every_habit_is_the_box() {
    let folder = Folder::new();
    let plain = stl(" organ", "0 0 0", "endsolid organ\n");
    let texts = [
        ("plain", plain.clone()),
        ("no_name", stl("", "0 0 0", "endsolid\n")),
        (
            "vertex_in_name",
            stl(" vertex 1", "0 0 0", "endsolid vertex 1\n"),
        ),
        ("blank_first_line", format!("\n \n{plain}")),
        ("byte_order_mark", format!("\u{feff}{plain}")),
        ("capitals", plain.to_uppercase()),
        ("end_solid", stl("", "0 0 0", "end solid organ\n")),
        ("no_endsolid", stl("", "0 0 0", "")),
        ("normal_nan", stl("", "nan -nan(ind) 1.#QNAN", "endsolid\n")),
        ("no_normal", stl("", "", "endsolid\n")),
        ("carriage_returns", plain.replace('\n', "\r\n")),
        ("macintosh", plain.replace('\n', "\r")),
        ("tabs", plain.replace(' ', "\t")),
        (
            "one_line",
            plain
                .replace(['\n'], " ")
                .replacen("solid organ ", "solid organ\n", 1),
        ),
    ];
    for (name, text) in texts {
        is_the_box(name, &read(&folder.write(&format!("{name}.stl"), text)));
    }
    let mut longer = binary_stl(b"solid", 12);
    longer.extend(b"made by a program");
    let binaries = [
        ("binary", binary_stl(b"binary", 12)),
        ("solid_in_head", binary_stl(b"solid organ", 12)),
        ("count_zero", binary_stl(b"stream", 0)),
        ("more_behind", longer),
    ];
    for (name, bytes) in binaries {
        is_the_box(name, &read(&folder.write(&format!("{name}.stl"), bytes)));
    }
    // All solids count: each of these bounds a half.
    let text = stl(" a", "0 0 0", "endsolid a\n");
    let half = text.len() / 2;
    let half = half + text[half..].find("facet normal").unwrap();
    let two = format!("{}endsolid a\nsolid b\n{}", &text[..half], &text[half..]);
    is_the_box("two_solids", &read(&folder.write("two_solids.stl", two)));
    refused(
        &folder.write("cut.stl", &binary_stl(b"x", 12)[..300]),
        &["announces 12 triangles", "cut off"],
    );
    refused(
        &folder.write("facet.stl", &plain[..plain.len() - 40]),
        &["cut off", "line"],
    );
    refused(
        &folder.write("word.stl", plain.replacen("4e1", "4x1", 1)),
        &["`4x1` is not a number", "line 18"],
    );
}

pub fn vertices() -> String {
    rows(|_, [x, y, z]| format!("v {x} {y} {z}\n"))
}

pub fn faces() -> String {
    QUADS
        .iter()
        .map(|quad| format!("f {}\n", list(quad, 1, " ")))
        .collect()
}

#[test]
fn obj_of_every_habit_is_the_box_and_errors_name_the_line() {
    let folder = Folder::new();
    let (vertices, faces) = (vertices(), faces());
    let backwards: String = (QUADS.iter())
        .map(|quad| {
            format!(
                "f {}\n",
                quad.map(|node| format!("{}", node as i64 - 8)).join(" ")
            )
        })
        .collect();
    let texts: [(&str, Vec<u8>); 11] = [
        (
            "material_without_name",
            format!("{vertices}usemtl\n{faces}").into(),
        ),
        (
            "material_after_tab",
            format!("{vertices}usemtl\tskin\n{faces}").into(),
        ),
        (
            "comment_behind",
            format!("{vertices}{faces}")
                .replace('\n', " # here\n")
                .into(),
        ),
        (
            "line_continued",
            format!("{vertices}{}", faces.replacen(' ', " \\\n", 3)).into(),
        ),
        (
            "byte_order_mark",
            format!("\u{feff}{vertices}{faces}").into(),
        ),
        ("backwards", format!("{vertices}{backwards}").into()),
        ("faces_first", format!("{faces}{vertices}").into()),
        (
            "colours",
            vertices
                .replace('\n', " 0.5 0.5 0.5\n")
                .into_bytes()
                .into_iter()
                .chain(faces.bytes())
                .collect(),
        ),
        (
            "textures",
            format!(
                "vt 0 0\nvn 0 0 1\n{vertices}{}",
                faces.replace('3', "3/1/1")
            )
            .into(),
        ),
        (
            "carriage_returns",
            format!("{vertices}l 1 2\np 1\n{faces}")
                .replace('\n', "\r\n")
                .into(),
        ),
        (
            "latin1",
            [b"g Gef\xe4\xdf\n", vertices.as_bytes(), faces.as_bytes()].concat(),
        ),
    ];
    for (name, bytes) in texts {
        is_the_box(name, &read(&folder.write(&format!("{name}.obj"), bytes)));
    }
    let wrong = [
        ("f 1 2 x\n", "`x` is not the number"),
        ("f 1 2\n", "a face has 2 corners"),
        ("f 1 2 90\n", "vertex 90, but there are 8"),
        ("f 1 2 -9\n", "vertex -9, but there are 8"),
        ("f 1 2 0\n", "vertex 0"),
        ("v 1 2\n", "three coordinates"),
        ("v 1 2 1,5\n", "`1,5` is not a number"),
    ];
    for (line, words) in wrong {
        let path = folder.write("wrong.obj", format!("{vertices}{line}{faces}"));
        refused(&path, &["line 9", words]);
    }
}

#[test]
fn polygons_that_are_not_convex_are_cut_without_overlap() {
    let folder = Folder::new();
    // An L, 24 ml: a fan from its first corner would leave it.
    let outline = [(40, 20), (20, 20), (20, 40), (0, 40), (0, 0), (40, 0)];
    let mut text = String::from("OFF\n12 8 0\n");
    for z in [0, 20] {
        outline
            .iter()
            .for_each(|(x, y)| text += &format!("{x} {y} {z}\n"));
    }
    text += "6 5 4 3 2 1 0\n6 6 7 8 9 10 11 255 0 0\n";
    for i in 0..6 {
        let next = (i + 1) % 6;
        text += &format!("4 {i} {next} {} {}\n", next + 6, i + 6);
    }
    is_the_box("l.off", &read(&folder.write("l.off", &text)));
    refused(
        &folder.write("cut.off", &text[..60]),
        &["three coordinates"],
    );
    refused(
        &folder.write("word.off", text.replace("6 5 4", "6 5 x")),
        &["line 15", "`x`"],
    );
}
