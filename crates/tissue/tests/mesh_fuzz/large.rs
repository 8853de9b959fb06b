//! Files below two megabytes whose lists refer to each other: readers that take them word by word take hours or all memory.

use std::fmt::Write;

const TET: &str = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\n";
const FACES: &str = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const ONE: &str = "*NODE\n1,0,0,0\n2,9,0,0\n3,0,9,0\n4,0,0,9\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n";

fn many(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect()
}

/// A row of tetrahedra, 15,000 of them.
fn row() -> String {
    let mut text = String::from("*NODE\n");
    for i in 1..20_000 {
        writeln!(text, "{i},{},{},{}", i % 97, i % 89, i % 83).unwrap();
    }
    text += "*ELEMENT,TYPE=C3D4\n";
    for i in 1..15_000 {
        writeln!(text, "{i},{i},{},{},{}", i + 1, i + 2, i + 3).unwrap();
    }
    text
}

/// Names and contents.
pub fn all() -> Vec<(&'static str, String)> {
    let words = many(150_000, |i| format!("a{i} "));
    let attributes = many(100_000, |i| format!("a{i}=\"1\" "));
    let squared = |level: usize| {
        format!("*NSET,NSET=A{level}\n") + &format!("A{}\n", level.wrapping_sub(1)).repeat(10)
    };
    let part = format!("*PART,NAME=P\n{}*END PART\n*ASSEMBLY,NAME=A\n", row());
    let instance = |i: usize| format!("*INSTANCE,NAME=I{i},PART=P\n*END INSTANCE\n");
    vec![
        ("materials.obj", format!("{TET}{}{FACES}", many(120_000, |i| format!("usemtl m{i}\n")))),
        ("used.obj", format!("{TET}{}{FACES}", many(60_000, |i| format!("usemtl m{i}\nf 1 3 2\n")))),
        ("words.obj", format!("{TET}g {words}\n{}", FACES.repeat(100))),
        ("libraries.obj", format!("{TET}{}{}{FACES}", "mtllib a\n".repeat(6000), many(6000, |i| format!("usemtl m{i}\n")))),
        ("polygon.obj", format!("{TET}f {}\n", "1 2 3 4 ".repeat(100_000))),
        ("edge.obj", many(20_000, |i| format!("v {} {} {}\n", i % 37, i % 41, i % 43)) + &many(60_000, |i| format!("f 1 2 {}\n", i % 20_000 + 1))),
        ("attributes.vtu", format!("<VTKFile type=\"UnstructuredGrid\" {attributes}></VTKFile>")),
        ("attributes.feb", format!("<febio_spec><Mesh {attributes}></Mesh></febio_spec>")),
        ("deep.vtu", format!("<VTKFile type=\"PolyData\">{}", "<a>".repeat(300_000))),
        ("deep.feb", format!("<febio_spec><Mesh>{}", "<a>".repeat(300_000))),
        ("range.inp", format!("{ONE}*NSET,NSET=A,GENERATE\n1,18446744073709551615,1\n")),
        ("ranges.inp", format!("{}*NSET,NSET=A,GENERATE\n{}", row(), "1,20000\n".repeat(30_000))),
        ("sets.inp", row() + &many(9000, |i| format!("*NSET,NSET=A{i},GENERATE\n1,20000\n"))),
        ("squared.inp", format!("{ONE}*NSET,NSET=A0\n{}{}", "1,2,3,4\n".repeat(1000), many(30, |i| squared(i + 1)))),
        ("chain.inp", format!("{ONE}{}", many(40_000, |i| format!("*NSET,NSET=A{i}\nA{}\n", i + 1)))),
        ("itself.inp", format!("{ONE}*NSET,NSET=A\nB\n*NSET,NSET=B\nA\n")),
        ("instances.inp", part + &many(8000, instance)),
        ("group.msh", format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"{}", "a ".repeat(400_000))),
        ("ranges.feb", format!("<febio_spec><Mesh><NodeSet name=\"a\">{}</NodeSet></Mesh></febio_spec>", "1:4000000000,".repeat(60_000))),
        ("nothing.ply", "ply\nformat ascii 1.0\nelement vertex 4000000000\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 0 0\n".to_owned()),
        ("count.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n400000000\n0 0 0 1\n".to_owned()),
        ("spike.obj", format!("v 0 0 3000000000\n{}", &TET[8..]) + FACES),
    ]
}
