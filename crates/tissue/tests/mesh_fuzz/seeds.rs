//! A small whole file of each format.

use std::path::Path;

/// A file and those that must lie beside it.
pub struct Seed {
    pub name: String,
    pub bytes: Vec<u8>,
    pub beside: Vec<(String, Vec<u8>)>,
}

/// Files of `fixtures/import`, which other programs wrote.
const FIXTURES: [&str; 22] = [
    "box.stl",
    "box-text.stl",
    "box.obj",
    "box.ply",
    "box-text.ply",
    "box-22-text.msh",
    "box-22-binary.msh",
    "box-41-text.msh",
    "box-41-binary.msh",
    "box-second-order.msh",
    "box.vtk",
    "box-binary.vtk",
    "box.vtu",
    "box-raw-zlib.vtu",
    "vtk9-grid-51-text.vtk",
    "vtk9-grid-42-binary.vtk",
    "vtk9-surface-51-binary.vtk",
    "vtk9-inline-zlib.vtp",
    "vtk9-inline-lzma.vtu",
    "vtk9-raw-lz4.vtu",
    "vtk9-appended-base64.vtp",
    "vtk9-arrays-zlib.vtu",
];

const MSH_1: &str = "$NOD\n5\n1 0 0 0\n2 10 0 0\n30 0 10 0\n4 0 0 10\n5 10 10 10\n$ENDNOD\n$ELM\n3\n1 2 7 1 3 1 2 30\n2 4 8 1 4 1 2 30 4\n\
                     3 4 0 1 4 2 5 30 4\n$ENDELM\n";

const OBJ: &str = "mtllib a.mtl\no body\nv 0 0 0\nv 9 0 0 # x\nv 0 9 0\nv 0 0 9\ng floor first\nusemtl skin\nf 1//1 3 2\nf \\\n-4 -3 -1\n\
                   g rest\nf 1/2/3 4 3\nf 2 3 4\n";

const OFF: &str = "OFF\n# a box\n8 6 0\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n0 0 9\n9 0 9\n9 9 9\n0 9 9\n4 0 3 2 1\n4 4 5 6 7 255 0 0\n4 0 1 5 4\n\
                   4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

const MEDIT: &str = "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 1\n9 0 0 1\n0 9 0 2\n0 0 9 2\n9 9 9 0\nEdges\n1\n1 2 0\n\
                     Triangles\n1\n1 3 2 7\nTetrahedra\n2\n1 2 3 4 5\n2 5 3 4 6\nCorners\n2\n1\n2\nEnd\n";

const NODE: &str =
    "# nodes\n5 3 1 1\n1 0 0 0 0.5 1\n2 9 0 0 0.5 1\n3 0 9 0 0.5 0\n4 0 0 9 0.5 0\n5 9 9 9 0.5 0\n";
const ELE: &str = "2 4 1\n1 1 2 3 4 7\n2 2 5 3 4 8\n";

const INP: &str = "** parts\n*Heading\n*Part, name=Liver\n*Node, nset=all\n1, 0., 0., 0.\n2, 9., 0., 0.\n3, 0., 9., 0.\n4, 0., 0., 9.\n\
                   5, 9., 9., 9.\n*Element, type=C3D4, elset=body\n1, 1, 2, 3, 4\n2, 2, 5, 3, 4\n*Element, type=S3, elset=skin\n9, 1, 3, 2\n\
                   *Nset, nset=Low, generate\n1, 3, 1\n*Elset, elset=both\nbody, skin\n*End Part\n*Part, name=Tool\n*Node\n1, 0, 0, 50\n\
                   2, 5, 0, 50\n3, 0, 5, 50\n*Element, type=R3D3\n1, 1, 2, 3\n*End Part\n*Assembly, name=A\n*Instance, name=L1, part=Liver\n\
                   1., 2., 3.\n0., 0., 0., 0., 0., 1., 90.\n*End Instance\n*Instance, name=T1, part=Tool\n*End Instance\n*Node\n1, 1, 1, 60\n\
                   *Nset, nset=RP\n1,\n*Nset, nset=Bed, instance=L1\n1, 2\n*Nset, nset=More\nBed, L1.3, Later\n*Nset, nset=Later\nBed\n\
                   *Elset, elset=_S1, instance=L1\n1,\n*Surface, type=ELEMENT, name=Top\n_S1, S2\n*End Assembly\n";

const FEB: &str = "<?xml version=\"1.0\"?>\n<febio_spec version=\"4.0\">\n<Mesh>\n<Nodes name=\"all\">\n<node id=\"1\">0,0,0</node>\n\
                   <node id=\"2\">9,0,0</node>\n<node id=\"3\">0,9,0</node>\n<node id=\"4\">0,0,9</node>\n<node id=\"5\">9,9,9</node>\n</Nodes>\n\
                   <Elements type=\"tet4\" name=\"body\">\n<elem id=\"1\">1,2,3,4</elem>\n<elem id=\"2\">2,5,3,4</elem>\n</Elements>\n\
                   <Elements type=\"tri3\" name=\"skin\"><elem id=\"9\">1,3,2</elem></Elements>\n<NodeSet name=\"low\">1,2:3:1</NodeSet>\n\
                   <Surface name=\"bed\"><tri3 id=\"1\">1,3,2</tri3></Surface>\n<NodeSet name=\"held\">@surface:bed</NodeSet>\n\
                   <NodeSet name=\"two\"><n id=\"1\"/><NodeSet node_set=\"low\"/></NodeSet>\n<ElementSet name=\"some\"><e id=\"2\"></e></ElementSet>\n\
                   </Mesh>\n</febio_spec>\n";

/// One of each.
pub fn all() -> Vec<Seed> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/import");
    let fixture = |name: &&str| Seed {
        name: (*name).to_owned(),
        bytes: std::fs::read(folder.join(name)).unwrap(),
        beside: Vec::new(),
    };
    let text = |name: &str, text: &str| Seed {
        name: name.to_owned(),
        bytes: text.as_bytes().to_vec(),
        beside: Vec::new(),
    };
    let mut out: Vec<Seed> = FIXTURES.iter().map(fixture).collect();
    out.push(text("version-1.msh", MSH_1));
    out.push(text("names.obj", OBJ));
    out.push(text("box.off", OFF));
    out.push(text("two.mesh", MEDIT));
    out.push(text("assembly.inp", INP));
    out.push(text("sets.feb", FEB));
    for (name, own, other, beside) in [
        ("two.node", NODE, "two.ele", ELE),
        ("three.ele", ELE, "three.node", NODE),
    ] {
        out.push(Seed {
            beside: vec![(other.to_owned(), beside.as_bytes().to_vec())],
            ..text(name, own)
        });
    }
    out
}
