//! OFF (Geomview, CGAL, MeshLab), text: counts of vertices, faces and edges, then the coordinates and the polygons. Colours and
//! normals that follow on a row are skipped.

use super::super::RawSurface;
use super::super::error::{Fault, fault};
use super::super::polygons;
use super::super::words::{real, short, text, whole};

/// Reads the polygons.
pub fn parse(bytes: &[u8]) -> Result<RawSurface, Fault> {
    let text = text(bytes);
    let mut rows = (1..).zip(text.lines()).filter_map(|(at, line)| {
        let line = line.split('#').next().unwrap_or_default().trim();
        (!line.is_empty()).then_some((at, line))
    });
    let due = |row: Option<(usize, &'_ str)>| match row {
        Some((at, line)) => Ok((at, line.to_owned())),
        None => fault("the file ends too early: is it cut off?"),
    };
    let (mut at, mut line) = due(rows.next())?;
    // COFF, NOFF and STOFF have colours, normals and textures behind the coordinates.
    let word = line.split_ascii_whitespace().next().unwrap_or_default();
    if let Some(before) = word.strip_suffix("OFF") {
        if before.contains(['4', 'n']) || line.contains("BINARY") {
            return fault(format!(
                "line {at}: {} is not read; save as OFF in text and three dimensions",
                short(&line)
            ));
        }
        line = line[word.len()..].trim().to_owned();
        if line.is_empty() {
            (at, line) = due(rows.next())?;
        }
    }
    let mut counts = line.split_ascii_whitespace();
    let mut count = |what: &str| match counts.next() {
        Some(word) => whole(word, at),
        None => fault(format!("line {at}: the count of {what} is missing")),
    };
    let (vertices, faces) = (count("vertices")?, count("faces")?);
    let mut out = RawSurface::default();
    for _ in 0..vertices {
        let (at, line) = due(rows.next())?;
        let mut words = line.split_ascii_whitespace();
        let mut coordinate = || match words.next() {
            Some(word) => real(word, at),
            None => fault(format!("line {at}: a vertex has three coordinates")),
        };
        out.positions
            .push([coordinate()?, coordinate()?, coordinate()?]);
    }
    for _ in 0..faces {
        let (at, line) = due(rows.next())?;
        let mut words = line.split_ascii_whitespace();
        let size = whole(words.next().unwrap_or_default(), at)?;
        let size = usize::try_from(size).unwrap_or(usize::MAX);
        let polygon: Vec<u32> = words
            .take(size)
            .map(|word| whole(word, at).map(|node| u32::try_from(node).unwrap_or(u32::MAX)))
            .collect::<Result<_, _>>()?;
        if polygon.len() < size || size < 3 {
            return fault(format!(
                "line {at}: a face of {size} corners lists {}",
                polygon.len()
            ));
        }
        let cut = polygons::triangles(&polygon, &out.positions);
        out.faces.extend(cut);
    }
    Ok(out)
}
