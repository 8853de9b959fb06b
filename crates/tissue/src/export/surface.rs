//! The surface of a deformed mesh as PLY or glTF.

use super::gltf;
use super::skin::Skin;
use crate::mesh::Mesh;
use crate::tensors::write_whole;
use ply_rs_bw::ply::{
    DefaultElement, ElementDef, Encoding, Ply, Property, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;
use std::io;
use std::path::Path;

/// Surface files that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceFormat {
    /// Binary PLY in the mesh's own frame: mm, RAS, with the displacement of each vertex.
    Ply,
    /// glTF 2.0 with its buffer inside, in glTF's frame: metres, y up.
    Gltf,
}

impl SurfaceFormat {
    /// By a file's extension, `ply` or `gltf`.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()? {
            "ply" => Some(Self::Ply),
            "gltf" => Some(Self::Gltf),
            _ => None,
        }
    }
}

/// Writes the surface moved by `displacement` `[K, 3]` mm. The file is whole or absent.
///
/// Panics when `displacement` does not have `K` rows.
pub fn write_surface(
    path: &Path,
    format: SurfaceFormat,
    mesh: &Mesh,
    displacement: &[[f32; 3]],
) -> io::Result<()> {
    assert_eq!(displacement.len(), mesh.node_count(), "one row a node");
    let skin = Skin::new(mesh, displacement);
    match format {
        SurfaceFormat::Ply => write_whole(path, |file| {
            Writer::new().write_ply(file, &mut ply(&skin)?).map(|_| ())
        }),
        SurfaceFormat::Gltf => gltf::write(path, &mesh.name, &skin),
    }
}

fn ply(skin: &Skin) -> io::Result<Ply<DefaultElement>> {
    const COLUMNS: [&str; 9] = ["x", "y", "z", "nx", "ny", "nz", "ux", "uy", "uz"];
    let mut file = Ply::<DefaultElement>::new();
    file.header.encoding = Encoding::BinaryLittleEndian;
    file.header
        .comments
        .push("x y z deformed position, mm; u displacement, mm".into());
    let mut vertex = ElementDef::new("vertex".into());
    for name in COLUMNS {
        let kind = PropertyType::Scalar(ScalarType::Float);
        vertex
            .properties
            .insert(name.into(), PropertyDef::new(name.into(), kind));
    }
    let mut face = ElementDef::new("face".into());
    face.properties.insert(
        "vertex_indices".into(),
        PropertyDef::new(
            "vertex_indices".into(),
            PropertyType::List(ScalarType::UChar, ScalarType::Int),
        ),
    );
    file.header.elements.insert("vertex".into(), vertex);
    file.header.elements.insert("face".into(), face);
    let rows = skin
        .positions
        .iter()
        .zip(&skin.normals)
        .zip(&skin.displacement)
        .map(|((position, normal), displacement)| {
            let values = position.iter().chain(normal).chain(displacement);
            COLUMNS
                .iter()
                .zip(values)
                .map(|(&name, &value)| (name.to_string(), Property::Float(value)))
                .collect()
        })
        .collect();
    let faces = skin
        .faces
        .iter()
        .map(|face| {
            let nodes = face.map(|node| node as i32).to_vec();
            [("vertex_indices".to_string(), Property::ListInt(nodes))]
                .into_iter()
                .collect()
        })
        .collect();
    file.payload.insert("vertex".into(), rows);
    file.payload.insert("face".into(), faces);
    file.make_consistent()
        .map_err(|error| io::Error::other(error.to_string()))?;
    Ok(file)
}
