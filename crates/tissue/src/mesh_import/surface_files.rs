//! Closed surfaces from STL, OBJ and PLY files. Polygons are cut into fans of triangles; points
//! with exactly the same coordinates become one, as these formats repeat them.

use super::labels::Labels;
use super::{ImportError, RawSurface};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Reads a surface; `extension` is `stl`, `obj` or `ply`.
pub fn read(path: &Path, extension: &str) -> Result<RawSurface, ImportError> {
    let surface = match extension {
        "stl" => stl(path)?,
        "obj" => obj(path)?,
        _ => ply(path)?,
    };
    if surface.faces.is_empty() {
        return Err(format(path, "the file holds no faces"));
    }
    Ok(merge_points(surface))
}

fn format(path: &Path, reason: impl ToString) -> ImportError {
    ImportError::Format {
        path: path.into(),
        reason: reason.to_string(),
    }
}

fn open(path: &Path) -> Result<BufReader<File>, ImportError> {
    let file = File::open(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    Ok(BufReader::new(file))
}

fn stl(path: &Path) -> Result<RawSurface, ImportError> {
    let mesh = stl_io::read_stl(&mut open(path)?).map_err(|error| format(path, error))?;
    Ok(RawSurface {
        positions: mesh
            .vertices
            .iter()
            .map(|vertex| [0, 1, 2].map(|k| f64::from(vertex[k])))
            .collect(),
        faces: mesh
            .faces
            .iter()
            .map(|face| face.vertices.map(|node| node as u32))
            .collect(),
    })
}

fn obj(path: &Path) -> Result<RawSurface, ImportError> {
    let labels = obj_labels(path)?;
    Ok(RawSurface {
        positions: labels.positions,
        faces: labels.faces,
    })
}

/// The triangles with the names of their groups, objects and materials.
pub(super) fn obj_labels(path: &Path) -> Result<Labels, ImportError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let text = std::fs::read(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    // A material's name alone matters, so the .mtl file need not be there: every name that is used is known.
    let mut materials: Vec<String> = Vec::new();
    for line in text.split(|&byte| byte == b'\n') {
        let line = String::from_utf8_lossy(line);
        if let Some(name) = line.trim().strip_prefix("usemtl ").map(str::trim)
            && !materials.iter().any(|known| known == name)
        {
            materials.push(name.to_owned());
        }
    }
    let known: HashMap<String, usize> = materials.iter().cloned().zip(0..).collect();
    let head: &[u8] = b"mtllib names\n";
    let mut reader = BufReader::new(std::io::Read::chain(head, text.as_slice()));
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, |_| {
        let blank = vec![tobj::Material::default(); known.len()];
        Ok((blank, known.clone()))
    })
    .map_err(|error| format(path, error))?;
    let mut labels = Labels::default();
    for model in models {
        let first = labels.positions.len() as u32;
        let (points, _) = model.mesh.positions.as_chunks::<3>();
        let (faces, _) = model.mesh.indices.as_chunks::<3>();
        // Each `mtllib` of the file gives all the names again.
        let id = model.mesh.material_id.map(|id| id % materials.len().max(1));
        let material = id.and_then(|id| materials.get(id));
        let names: Vec<String> = std::iter::once(&model.name)
            .chain(material)
            .flat_map(|name| std::iter::once(name.as_str()).chain(name.split_whitespace()))
            .map(str::to_owned)
            .collect();
        labels
            .positions
            .extend(points.iter().map(|p| p.map(f64::from)));
        for face in faces {
            labels.faces.push(face.map(|node| first + node));
            labels.of_face.push(names.clone());
        }
    }
    Ok(labels)
}

/// The triangles with the colour of each point as a name, `#rrggbb`.
pub(super) fn ply_labels(path: &Path) -> Result<Labels, ImportError> {
    let surface = ply(path)?;
    let file = Parser::<DefaultElement>::new()
        .read_ply(&mut open(path)?)
        .map_err(|error| format(path, error))?;
    let colour = |vertex: &DefaultElement| -> Option<String> {
        let parts = ["red", "green", "blue"].map(|name| match vertex.get(name) {
            Some(Property::UChar(value)) => Some(*value),
            Some(other) => other
                .to_f32_lossy()
                .map(|x| (255.0 * x.clamp(0.0, 1.0)).round() as u8),
            None => None,
        });
        let [Some(r), Some(g), Some(b)] = parts else {
            return None;
        };
        Some(format!("#{r:02x}{g:02x}{b:02x}"))
    };
    let vertices = file.payload.get("vertex");
    Ok(Labels {
        positions: surface.positions,
        faces: surface.faces,
        of_point: vertices
            .into_iter()
            .flatten()
            .map(|vertex| colour(vertex).into_iter().collect())
            .collect(),
        ..Labels::default()
    })
}

fn ply(path: &Path) -> Result<RawSurface, ImportError> {
    let file = Parser::<DefaultElement>::new()
        .read_ply(&mut open(path)?)
        .map_err(|error| format(path, error))?;
    let elements = |name: &str| {
        file.payload
            .get(name)
            .ok_or_else(|| format(path, format_args!("the file has no element `{name}`")))
    };
    let mut surface = RawSurface::default();
    for (index, vertex) in elements("vertex")?.iter().enumerate() {
        let mut point = [0.0; 3];
        for (value, name) in point.iter_mut().zip(["x", "y", "z"]) {
            *value = match vertex.get(name) {
                Some(Property::Double(value)) => *value,
                Some(other) => other.to_f32_lossy().map(f64::from).ok_or_else(|| {
                    format(
                        path,
                        format_args!("vertex {index}: `{name}` is not a number"),
                    )
                })?,
                None => {
                    return Err(format(path, format_args!("vertex {index} has no `{name}`")));
                }
            };
        }
        surface.positions.push(point);
    }
    for (index, face) in elements("face")?.iter().enumerate() {
        let nodes = ["vertex_indices", "vertex_index"]
            .iter()
            .find_map(|name| face.get(*name))
            .and_then(Property::to_u32_list)
            .filter(|nodes| nodes.len() >= 3)
            .ok_or_else(|| {
                format(
                    path,
                    format_args!("face {index} has no list `vertex_indices` of three or more"),
                )
            })?;
        for side in 1..nodes.len() - 1 {
            surface.faces.push([nodes[0], nodes[side], nodes[side + 1]]);
        }
    }
    Ok(surface)
}

/// Makes points with the same coordinates one; nodes out of range are left for the checks.
pub(super) fn merge_points(surface: RawSurface) -> RawSurface {
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::new();
    let mut positions = Vec::new();
    let merged: Vec<u32> = surface
        .positions
        .iter()
        .map(|point| {
            // Adding zero makes -0 and 0 the same key.
            let key = point.map(|x| (x + 0.0).to_bits());
            *first_at.entry(key).or_insert_with(|| {
                positions.push(*point);
                positions.len() as u32 - 1
            })
        })
        .collect();
    let renumber = |node: u32| merged.get(node as usize).copied().unwrap_or(u32::MAX);
    RawSurface {
        faces: surface
            .faces
            .iter()
            .map(|face| face.map(renumber))
            .collect(),
        positions,
    }
}
