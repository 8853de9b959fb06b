//! A self-contained page with the organ in 3D: what is held, what may be touched, stiffness, quality of the elements, and where
//! there is one the error of a check, and a contact that plays. A click gives coordinates to paste into a command.

use anyhow::{Context, Result, bail};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;
use tissue::mesh::Mesh;
use tissue::mesh_quality::dihedral_angles;

use crate::three;

const PAGE: &str = include_str!("page.html");
const SCRIPT: &str = include_str!("page.js");

/// What a page shows.
pub struct Content<'a> {
    pub mesh: &'a Mesh,
    /// Root mean square error of each node in a check, mm.
    pub node_errors: Option<&'a [f32]>,
    /// Shown next to the picture.
    pub facts: &'a [(String, String)],
    /// What [`Film::json`](crate::Film::json) made, or null.
    pub film: &'a serde_json::Value,
    /// Whether a click gives coordinates.
    pub pick: bool,
}

/// Writes the page.
pub fn write(path: &std::path::Path, content: &Content<'_>) -> Result<()> {
    let text = page(content)?;
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))?;
    }
    tissue::tensors::write_whole(path, |file| {
        std::io::Write::write_all(file, text.as_bytes())
    })
    .with_context(|| format!("{}: cannot be written", path.display()))
}

/// Place of each node among those of the surface, and these.
pub fn surface_nodes(mesh: &Mesh) -> (Vec<u32>, Vec<u32>) {
    let mut place = vec![u32::MAX; mesh.node_count()];
    let mut nodes = Vec::new();
    for &node in mesh.surface.iter().flatten() {
        if place[node as usize] == u32::MAX {
            place[node as usize] = nodes.len() as u32;
            nodes.push(node);
        }
    }
    (place, nodes)
}

/// The page as text.
pub fn page(content: &Content<'_>) -> Result<String> {
    let mesh = content.mesh;
    let (place, nodes) = surface_nodes(mesh);
    let mut held = vec![false; mesh.node_count()];
    mesh.fixed
        .iter()
        .for_each(|&node| held[node as usize] = true);
    let mut touched = vec![0.0f32; mesh.surface.len()];
    mesh.domain
        .iter()
        .for_each(|&row| touched[row as usize] = 1.0);
    let inner = elements_behind(mesh);
    let point = |node: u32| mesh.positions[node as usize].map(f64::from);
    let angle = |row: usize| {
        let angles = dihedral_angles(mesh.tets[inner[row]].map(point));
        angles.iter().copied().fold(180.0, f64::min) as f32
    };
    let floats = |values: &mut dyn Iterator<Item = f32>| -> String {
        STANDARD.encode(values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
    };
    let faces: Vec<u8> = mesh
        .surface
        .iter()
        .flatten()
        .flat_map(|&node| place[node as usize].to_le_bytes())
        .collect();
    let rows = || 0..mesh.surface.len();
    let data = json!({
        "name": mesh.name,
        "facts": content.facts,
        "film": content.film,
        "pick": content.pick,
        "positions": floats(&mut nodes.iter().flat_map(|&node| mesh.positions[node as usize])),
        "faces": STANDARD.encode(faces),
        "held": floats(&mut nodes.iter().map(|&node| f32::from(held[node as usize]))),
        "domain": floats(&mut touched.iter().copied()),
        "stiffness": floats(&mut rows().map(|row| mesh.stiffness_of(inner[row]))),
        "quality": floats(&mut rows().map(angle)),
        "error": content.node_errors.map(|errors| floats(&mut nodes.iter().map(|&node| errors[node as usize]))),
    });
    // A tag's end inside of the data would end the script.
    let data = data.to_string().replace("</", "<\\/");
    Ok(PAGE
        .replace("<!-- three -->", &three_in_page()?)
        .replace("<!-- data -->", &data)
        .replace("<!-- script -->", SCRIPT))
}

/// three.js as one expression that can stand in a page: its exports as an object.
fn three_in_page() -> Result<String> {
    let Some((body, exports)) = three::module()
        .rsplit_once("export{")
        .and_then(|(body, rest)| {
            let (list, _) = rest.split_once('}')?;
            Some((body, list))
        })
    else {
        bail!("three.js has no list of exports; write it again with vendor.sh");
    };
    let names: Vec<String> = exports
        .split(',')
        .filter_map(|pair| pair.split_once(" as "))
        .map(|(inner, outer)| format!("{outer}:{inner}"))
        .collect();
    let body = body.replace("</script", "<\\/script");
    Ok(format!(
        "const three=(()=>{{{body};return{{{}}};}})();",
        names.join(",")
    ))
}

/// The tetrahedron behind each row of the surface.
fn elements_behind(mesh: &Mesh) -> Vec<usize> {
    let key = |mut nodes: [u32; 3]| {
        nodes.sort_unstable();
        nodes
    };
    let mut rows = std::collections::HashMap::new();
    for (row, &face) in mesh.surface.iter().enumerate() {
        rows.insert(key(face), row);
    }
    let mut behind = vec![0; mesh.surface.len()];
    for (tet, &[a, b, c, d]) in mesh.tets.iter().enumerate() {
        for face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
            if let Some(&row) = rows.get(&key(face)) {
                behind[row] = tet;
            }
        }
    }
    behind
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Film;

    #[test]
    fn the_page_holds_all_that_it_needs() {
        let mesh = tissue::mesh::box_phantom([20.0, 20.0, 10.0], [3, 3, 2]).unwrap();
        let errors = vec![0.25; mesh.node_count()];
        let page = page(&Content {
            mesh: &mesh,
            node_errors: Some(&errors),
            facts: &[("a".into(), "</script>".into())],
            film: &Film::new(&mesh, "none".into(), 0.05).json(),
            pick: true,
        })
        .unwrap();
        assert!(!page.contains("src=") && !page.contains("<!-- data"));
        assert_eq!(
            page.matches("</script>").count(),
            page.matches("<script").count()
        );
        assert!(page.contains("WebGLRenderer:") && !page.contains("export{"));
    }
}
