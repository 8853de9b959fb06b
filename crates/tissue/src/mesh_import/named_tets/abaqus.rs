//! Tetrahedra of an Abaqus or CalculiX input file (`.inp`), with its sets.
//!
//! Keywords begin with `*`, comments with `**`; a keyword line that ends with a comma goes on in the next. Read are `*NODE` (number, x,
//! y, z), `*ELEMENT` of type C3D4 (number, four nodes), `*NSET` and `*ELSET` (numbers, names of sets, or ranges with `GENERATE`).
//! Elements of other volumes are an error; shells, beams, springs and everything that is no mesh are skipped.

use super::{NamedTets, Wrong, wrong};

/// What the data lines below a keyword are.
enum Block {
    Nodes { set: Option<String> },
    Tets { set: Option<String> },
    NodeSet { name: String, ranges: bool },
    ElementSet { name: String, ranges: bool },
    Skipped,
}

/// Reads the file.
pub(super) fn parse(text: &str) -> Result<NamedTets, Wrong> {
    let mut out = NamedTets::default();
    let mut block = Block::Skipped;
    let mut parts = 0;
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line.trim()));
    while let Some((at, line)) = lines.next() {
        if line.is_empty() || line.starts_with("**") {
            continue;
        }
        if !line.starts_with('*') {
            data(&mut out, &block, at, line)?;
            continue;
        }
        let mut keyword = line.to_owned();
        while keyword.ends_with(',') {
            match lines.next() {
                Some((_, more)) => keyword += more,
                None => return wrong(format!("line {at}: the file ends inside a keyword")),
            }
        }
        parts += usize::from(name_of(&keyword) == "PART");
        if parts > 1 {
            return wrong(format!(
                "line {at}: a second *PART; a file may hold only one part, so export each part by itself"
            ));
        }
        block = begin(&keyword, at)?;
    }
    Ok(out)
}

fn name_of(keyword: &str) -> String {
    let name = keyword.split(',').next().unwrap_or_default();
    name.trim_start_matches('*').trim().to_uppercase()
}

/// The value of a parameter; empty for one without a value.
fn parameter(keyword: &str, wanted: &str) -> Option<String> {
    keyword.split(',').skip(1).find_map(|part| {
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        let value = value.trim().trim_matches('"');
        name.trim()
            .eq_ignore_ascii_case(wanted)
            .then(|| value.to_owned())
    })
}

fn begin(keyword: &str, at: usize) -> Result<Block, Wrong> {
    let ranges = parameter(keyword, "GENERATE").is_some();
    let named = |parameter: Option<String>, name: &str| match parameter {
        Some(found) => Ok(found),
        None => wrong(format!("line {at}: {name} has no name")),
    };
    Ok(match name_of(keyword).as_str() {
        "NODE" => Block::Nodes {
            set: parameter(keyword, "NSET"),
        },
        "ELEMENT" => {
            let Some(kind) = parameter(keyword, "TYPE") else {
                return wrong(format!("line {at}: *ELEMENT has no TYPE"));
            };
            let upper = kind.to_uppercase();
            if let Some(more) = upper.strip_prefix("C3D4")
                && !more.starts_with(|c: char| c.is_ascii_digit())
            {
                Block::Tets {
                    set: parameter(keyword, "ELSET"),
                }
            } else if ["C3D", "CC3D", "DC3D", "AC3D", "CSS", "SC"]
                .iter()
                .any(|volume| upper.starts_with(volume))
            {
                return Err(Wrong::Kind {
                    element: at,
                    kind: format!("{kind} (line {at})"),
                });
            } else {
                Block::Skipped
            }
        }
        "NSET" => Block::NodeSet {
            name: named(parameter(keyword, "NSET"), "*NSET")?,
            ranges,
        },
        "ELSET" => Block::ElementSet {
            name: named(parameter(keyword, "ELSET"), "*ELSET")?,
            ranges,
        },
        "INCLUDE" => {
            return wrong(format!(
                "line {at}: *INCLUDE is not followed; put nodes and elements into one file"
            ));
        }
        _ => Block::Skipped,
    })
}

fn data(out: &mut NamedTets, block: &Block, at: usize, line: &str) -> Result<(), Wrong> {
    let words: Vec<&str> = (line.split(',').map(str::trim))
        .filter(|word| !word.is_empty())
        .collect();
    match block {
        Block::Nodes { set } => {
            let [number, x, y, z] = words[..] else {
                return wrong(format!(
                    "line {at}: a node is a number and three coordinates, not `{line}`: is the file cut off?"
                ));
            };
            let number = whole(number, at)?;
            out.node(number, [real(x, at)?, real(y, at)?, real(z, at)?])?;
            if let Some(set) = set {
                out.nodes(set, vec![number]);
            }
        }
        Block::Tets { set } => {
            let [number, a, b, c, d] = words[..] else {
                return wrong(format!(
                    "line {at}: a C3D4 is a number and four nodes, not `{line}`: is the file cut off?"
                ));
            };
            let number = whole(number, at)?;
            let nodes = [whole(a, at)?, whole(b, at)?, whole(c, at)?, whole(d, at)?];
            out.tet(number, nodes)?;
            if let Some(set) = set {
                out.elements(set, vec![number]);
            }
        }
        Block::NodeSet { name, ranges } => {
            let found = members(&words, *ranges, at, &|set| out.nodes_of(set))?;
            out.nodes(name, found);
        }
        Block::ElementSet { name, ranges } => {
            let found = members(&words, *ranges, at, &|set| out.elements_of(set))?;
            out.elements(name, found);
        }
        Block::Skipped => {}
    }
    Ok(())
}

/// Members of a data line of a set.
fn members(
    words: &[&str],
    ranges: bool,
    at: usize,
    of_set: &dyn Fn(&str) -> Option<Vec<u64>>,
) -> Result<Vec<u64>, Wrong> {
    if ranges {
        let (first, last, step) = match *words {
            [first, last] => (first, last, "1"),
            [first, last, step] => (first, last, step),
            _ => return wrong(format!("line {at}: a range is first, last and step")),
        };
        let step = whole(step, at)?.max(1);
        return Ok((whole(first, at)?..=whole(last, at)?)
            .step_by(step as usize)
            .collect());
    }
    let mut found = Vec::with_capacity(words.len());
    for word in words {
        match (word.parse(), of_set(word.trim_matches('"'))) {
            (Ok(number), _) => found.push(number),
            (Err(_), Some(numbers)) => found.extend(numbers),
            (Err(_), None) => {
                return wrong(format!("line {at}: there is no set `{word}` above it"));
            }
        }
    }
    Ok(found)
}

fn whole(word: &str, at: usize) -> Result<u64, Wrong> {
    match word.parse() {
        Ok(number) => Ok(number),
        Err(_) => wrong(format!("line {at}: `{word}` is not a whole number")),
    }
}

fn real(word: &str, at: usize) -> Result<f64, Wrong> {
    // Fortran writes exponents with D.
    match word.replace(['D', 'd'], "e").parse() {
        Ok(number) => Ok(number),
        Err(_) => wrong(format!("line {at}: `{word}` is not a number")),
    }
}
