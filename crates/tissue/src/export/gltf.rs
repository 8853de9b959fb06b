//! glTF 2.0, one mesh with positions, normals and indices in an embedded buffer.
//!
//! glTF is in metres with y up and z towards the viewer: (x, y, z) RAS mm becomes
//! (x, z, -y) / 1000, so the brain stands upright and looks away from the viewer.

use super::skin::Skin;
use crate::tensors::write_whole;
use base64::Engine;
use serde_json::json;
use std::io::{self, Write};
use std::path::Path;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

fn turn([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, z, -y]
}

pub(super) fn write(path: &Path, name: &str, skin: &Skin) -> io::Result<()> {
    let positions: Vec<[f32; 3]> = skin
        .positions
        .iter()
        .map(|p| turn(p.map(|x| x * 1e-3)))
        .collect();
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for p in &positions {
        for k in 0..3 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    let floats = |rows: &mut dyn Iterator<Item = [f32; 3]>| -> Vec<u8> {
        rows.flatten().flat_map(f32::to_le_bytes).collect()
    };
    let blocks = [
        floats(&mut positions.iter().copied()),
        floats(&mut skin.normals.iter().copied().map(turn)),
        skin.faces
            .as_flattened()
            .iter()
            .flat_map(|node| node.to_le_bytes())
            .collect(),
    ];
    let mut views = Vec::new();
    let mut offset = 0;
    for (block, target) in blocks
        .iter()
        .zip([ARRAY_BUFFER, ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER])
    {
        views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": block.len(), "target": target,
        }));
        offset += block.len();
    }
    let data = base64::engine::general_purpose::STANDARD.encode(blocks.concat());
    let document = json!({
        "asset": {"version": "2.0", "generator": concat!("libupt ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name}],
        "meshes": [{"name": name, "primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0,
        }]}],
        "materials": [{"name": "tissue", "pbrMetallicRoughness": {
            "baseColorFactor": [0.85, 0.65, 0.6, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6,
        }}],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": positions.len(), "type": "VEC3",
             "min": low, "max": high},
            {"bufferView": 1, "componentType": FLOAT, "count": positions.len(), "type": "VEC3"},
            {"bufferView": 2, "componentType": UNSIGNED_INT, "count": 3 * skin.faces.len(),
             "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{
            "byteLength": offset, "uri": format!("data:application/octet-stream;base64,{data}"),
        }],
    });
    write_whole(path, |file| {
        serde_json::to_writer(&mut *file, &document)?;
        file.write_all(b"\n")
    })
}
