//! Wavefront OBJ: `v`, `f`, and the names that `g`, `o` and `usemtl` give to the faces below them. Everything else is skipped.
//!
//! Numbers of corners count from 1, or backwards from -1. A line that ends with `\` goes on in the next; `#` begins a comment.

use super::super::error::{Fault, fault};
use super::super::labels::{Labels, Part};
use super::super::polygons;
use super::super::words::{real, short, text};

/// The triangles of a file with their names.
#[derive(Default)]
pub struct Obj {
    pub positions: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    /// For each face the group, the object and the material that held when it came, as rows of `statements`; 0 for none.
    state_of_face: Vec<[u32; 3]>,
    statements: Vec<String>,
}

/// Reads the file.
pub fn parse(bytes: &[u8]) -> Result<Obj, Fault> {
    let text = text(bytes);
    let mut out = Obj {
        statements: vec![String::new()],
        ..Obj::default()
    };
    let mut state = [0u32; 3];
    // The highest number of a vertex, and its line.
    let mut highest = (0, 0);
    let mut lines = text.lines().zip(1..);
    let mut joined = String::new();
    while let Some((line, at)) = lines.next() {
        let mut line = without_comment(line);
        if line.ends_with('\\') {
            joined.clear();
            while let Some(part) = line.strip_suffix('\\') {
                joined += part;
                joined.push(' ');
                line = lines.next().map_or("", |(more, _)| without_comment(more));
            }
            joined += line;
            line = joined.as_str().trim();
        }
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let kind = match key {
            "v" => {
                out.positions.push(vertex(rest, at)?);
                continue;
            }
            "f" | "fo" => {
                let polygon = corners(rest, out.positions.len(), at)?;
                let most = polygon.iter().max().copied().unwrap_or(0);
                highest = highest.max((most, at));
                let faces = polygons::triangles(&polygon, &out.positions);
                out.state_of_face.extend(faces.iter().map(|_| state));
                out.faces.extend(faces);
                continue;
            }
            "g" => 0,
            "o" => 1,
            "usemtl" => 2,
            _ => continue,
        };
        state[kind] = match rest.trim() {
            "" => 0,
            name => {
                out.statements.push(name.to_owned());
                out.statements.len() as u32 - 1
            }
        };
    }
    if !out.faces.is_empty() && highest.0 as usize >= out.positions.len() {
        return fault(format!(
            "line {}: a face names vertex {}, but there are {}",
            highest.1,
            u64::from(highest.0) + 1,
            out.positions.len()
        ));
    }
    Ok(out)
}

/// A `#` inside a word is a part of a name.
fn without_comment(line: &str) -> &str {
    let is_start = |&(at, _): &(usize, &str)| at == 0 || line[..at].ends_with([' ', '\t']);
    let end = line.match_indices('#').find(is_start);
    line[..end.map_or(line.len(), |(at, _)| at)].trim()
}

fn vertex(rest: &str, at: usize) -> Result<[f64; 3], Fault> {
    let mut words = rest.split_ascii_whitespace();
    let mut coordinate = || match words.next() {
        Some(word) => real(word, at),
        None => fault(format!("line {at}: a vertex has three coordinates")),
    };
    // A weight or a colour may follow.
    Ok([coordinate()?, coordinate()?, coordinate()?])
}

/// The corners of a face by the part before a `/`.
fn corners(rest: &str, count: usize, at: usize) -> Result<Vec<u32>, Fault> {
    let mut out = Vec::new();
    for word in rest.split_ascii_whitespace() {
        let number = word.split('/').next().unwrap_or_default();
        let Ok(number) = number.parse::<i64>() else {
            return fault(format!(
                "line {at}: `{}` is not the number of a vertex",
                short(word)
            ));
        };
        let place = match number {
            1.. => number - 1,
            _ => (count as i64).saturating_add(number),
        };
        // A vertex may come after the face that names it: what is out of range is found at the end.
        match u32::try_from(place) {
            Ok(place) if number != 0 => out.push(place),
            _ => {
                return fault(format!(
                    "line {at}: a face names vertex {number}, but there are {count} above it"
                ));
            }
        }
    }
    if out.len() < 3 {
        return fault(format!(
            "line {at}: a face has {} corners, must have three or more",
            out.len()
        ));
    }
    Ok(out)
}

impl Obj {
    /// Each face has the whole name of its statements and each of their words.
    pub fn labels(self, bytes: usize) -> Result<Labels, Fault> {
        let mut labels = Labels::of_file(bytes);
        let mut names_of: Vec<Vec<usize>> = vec![Vec::new(); self.statements.len()];
        for (index, state) in self.state_of_face.iter().enumerate() {
            for &row in state {
                let (row, text) = (row as usize, &self.statements[row as usize]);
                if names_of[row].is_empty() && !text.is_empty() {
                    let whole = std::iter::once(text.as_str());
                    let words = text.split_whitespace().filter(|word| word != text);
                    names_of[row] = whole.chain(words).map(|name| labels.name(name)).collect();
                    names_of[row].sort_unstable();
                    names_of[row].dedup();
                }
                for &name in &names_of[row] {
                    labels.add(name, Part::Face(index))?;
                }
            }
        }
        labels.positions = self.positions;
        labels.faces = self.faces;
        Ok(labels)
    }
}
