//! What holds an organ, and where pressure acts on it: regions, of which those with a name are support groups and surface regions of the bundle.

use std::collections::HashSet;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use tissue::mesh_import::Region;

/// The support groups and the surface regions, in the work folder.
pub const SUPPORTS: &str = "supports.json";
pub const REGIONS: &str = "regions.json";

/// `[NAME=]REGION`.
#[derive(Clone, Debug, PartialEq)]
pub struct Fixed {
    pub name: Option<String>,
    pub region: Region,
}

impl FromStr for Fixed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // A region may hold an equals sign itself, behind its kind.
        let named = text.split_once('=').filter(|(name, _)| !name.contains(':'));
        let (name, region) = match named {
            Some((name, _)) if name.trim().is_empty() => {
                return Err(format!("`{text}` has no name before its equals sign"));
            }
            Some((name, region)) => (Some(name.trim().to_owned()), region),
            None => (None, text),
        };
        Ok(Fixed {
            name,
            region: region.parse()?,
        })
    }
}

impl fmt::Display for Fixed {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => write!(to, "{name}={}", self.region),
            None => write!(to, "{}", self.region),
        }
    }
}

/// A support group or a region as `bundle.json` has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Group {
    pub name: String,
    /// Ascending.
    pub nodes: Vec<u32>,
}

/// The groups of regions that hold these nodes; regions of one name are one group.
pub fn groups(fixed: &[Fixed], held: &[Vec<u32>]) -> Result<Vec<Group>> {
    let mut groups: Vec<Group> = Vec::new();
    let mut taken = HashSet::new();
    for (fixed, nodes) in fixed.iter().zip(held) {
        let Some(name) = &fixed.name else {
            continue;
        };
        let own = nodes.iter().copied().filter(|node| taken.insert(*node));
        match groups.iter_mut().find(|group| group.name == *name) {
            Some(group) => group.nodes.extend(own),
            None => groups.push(Group {
                name: name.clone(),
                nodes: own.collect(),
            }),
        }
    }
    for group in &mut groups {
        group.nodes.sort_unstable();
        if group.nodes.is_empty() {
            bail!(
                "no node lies in the region of --fixed {}= alone",
                group.name
            );
        }
    }
    Ok(groups)
}

/// The named regions of a surface `[F]`: the nodes of its triangles whose corners are all among those of a region; regions of one name are one.
pub fn regions(
    pressure: &[Fixed],
    inside: &[Vec<u32>],
    surface: &[[u32; 3]],
) -> Result<Vec<Group>> {
    let mut regions: Vec<Group> = Vec::new();
    for (pressure, nodes) in pressure.iter().zip(inside) {
        let Some(name) = &pressure.name else {
            bail!("--pressure {pressure} has no name; write --pressure NAME={pressure}");
        };
        let is_in = |node: &u32| nodes.binary_search(node).is_ok();
        let faces = surface.iter().filter(|face| face.iter().all(is_in));
        let own: Vec<u32> = faces.flatten().copied().collect();
        if own.is_empty() {
            bail!(
                "no boundary triangle has all three corners in the region of --pressure {pressure}"
            );
        }
        match regions.iter_mut().find(|region| region.name == *name) {
            Some(region) => region.nodes.extend(own),
            None => regions.push(Group {
                name: name.clone(),
                nodes: own,
            }),
        }
    }
    for region in &mut regions {
        region.nodes.sort_unstable();
        region.nodes.dedup();
    }
    Ok(regions)
}

/// Writes groups or regions to the folder of a stage.
pub fn write(groups: &[Group], folder: &Path, file: &str) -> Result<()> {
    let path = folder.join(file);
    std::fs::write(&path, serde_json::to_vec(groups)?)
        .with_context(|| format!("{}: cannot be written", path.display()))
}

/// Those of a work folder.
pub fn read(folder: &Path, file: &str) -> Result<Vec<Group>> {
    let path = folder.join(file);
    let text =
        std::fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
    serde_json::from_slice(&text).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_before_a_region() {
        for text in [
            "ligament=ball:0,0,0,5",
            "ball:0,0,0,5",
            "inside:a=b.stl",
            "bed=not:all",
        ] {
            let fixed: Fixed = text.parse().unwrap();
            assert_eq!(fixed.to_string(), text);
            assert_eq!(
                fixed.name.is_some(),
                text.starts_with("ligament") || text.starts_with("bed")
            );
        }
        let pressure = ["a=all", "b=all", "a=all"].map(|text| text.parse().unwrap());
        let inside = [vec![0, 1, 2, 9], vec![1, 2, 3, 4], vec![2, 3, 4]];
        let surface = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [4, 5, 6]];
        let found = regions(&pressure, &inside, &surface).unwrap();
        assert_eq!(found[0].nodes, [0, 1, 2, 3, 4]);
        assert_eq!(found[1].nodes, [1, 2, 3, 4]);
        let none = regions(&pressure, &[vec![0, 1]], &surface).unwrap_err();
        assert!(none.to_string().contains("no boundary triangle"));
        let nameless = regions(&["all".parse().unwrap()], &inside, &surface).unwrap_err();
        assert!(nameless.to_string().contains("NAME=all"));
        assert!("=all".parse::<Fixed>().unwrap_err().contains("no name"));
    }

    #[test]
    fn a_node_is_of_the_first_group_that_has_it() {
        let fixed = ["a=all", "all", "b=all", "a=all"].map(|text| text.parse().unwrap());
        let held = [vec![1, 4], vec![7], vec![4, 5], vec![0]];
        let found = groups(&fixed, &held).unwrap();
        let lists: Vec<_> = found
            .iter()
            .map(|group| (group.name.as_str(), group.nodes.as_slice()))
            .collect();
        assert_eq!(lists, [("a", &[0, 1, 4][..]), ("b", &[5][..])]);
        assert!(
            groups(&fixed[..3], &[vec![1], vec![], vec![1]])
                .unwrap_err()
                .to_string()
                .contains("b=")
        );
    }
}
