//! The checks that every mesh passes before the solver sees it.

use super::{Mesh, MeshError, boundary_faces, tet_volume};
use std::collections::HashSet;

impl Mesh {
    /// Checks indices, coordinates, volumes, stiffness, the surface and the named sets.
    ///
    /// The first fault is returned, naming the element. `O(K + T)`.
    pub fn validate(&self) -> Result<(), MeshError> {
        let count = self.node_count();
        if count == 0 {
            return Err(MeshError::Empty { what: "nodes" });
        }
        if self.tets.is_empty() {
            return Err(MeshError::Empty { what: "tetrahedra" });
        }
        if let Some(node) = self
            .positions
            .iter()
            .position(|p| p.iter().any(|v| !v.is_finite()))
        {
            return Err(MeshError::NonFinite { node });
        }
        check_range("tets", self.tets.iter().map(|t| &t[..]), count)?;
        check_range("surface", self.surface.iter().map(|t| &t[..]), count)?;
        check_range("fixed", self.fixed.iter().map(std::slice::from_ref), count)?;
        check_range(
            "supported",
            self.supported.iter().map(std::slice::from_ref),
            count,
        )?;
        self.check_tets()?;
        self.check_stiffness()?;
        self.laws().check(self.tets.len())?;
        self.check_references()?;
        self.check_surface()?;
        self.check_sets()
    }

    fn check_tets(&self) -> Result<(), MeshError> {
        for (tet, nodes) in self.tets.iter().enumerate() {
            for k in 1..4 {
                if nodes[..k].contains(&nodes[k]) {
                    return Err(MeshError::RepeatedNode {
                        tet,
                        node: nodes[k],
                    });
                }
            }
            let volume_mm3 = tet_volume(&self.positions, *nodes);
            let scale = self.longest_edge(*nodes).powi(3);
            if volume_mm3.abs() <= 1e-6 * scale {
                return Err(MeshError::DegenerateTet { tet, volume_mm3 });
            }
            if volume_mm3 < 0.0 {
                return Err(MeshError::InvertedTet { tet, volume_mm3 });
            }
        }
        Ok(())
    }

    fn check_stiffness(&self) -> Result<(), MeshError> {
        if !self.stiffness.is_empty() && self.stiffness.len() != self.tets.len() {
            return Err(MeshError::StiffnessCount {
                expected: self.tets.len(),
                found: self.stiffness.len(),
            });
        }
        match self
            .stiffness
            .iter()
            .position(|s| !(s.is_finite() && *s > 0.0))
        {
            None => Ok(()),
            Some(tet) => Err(MeshError::Stiffness {
                tet,
                value: self.stiffness[tet],
            }),
        }
    }

    fn longest_edge(&self, nodes: [u32; 4]) -> f64 {
        let mut longest: f64 = 0.0;
        for (i, a) in nodes.iter().enumerate() {
            for b in &nodes[i + 1..] {
                let (p, q) = (self.positions[*a as usize], self.positions[*b as usize]);
                let squared: f64 = (0..3).map(|k| f64::from(p[k] - q[k]).powi(2)).sum();
                longest = longest.max(squared);
            }
        }
        longest.sqrt()
    }

    fn check_references(&self) -> Result<(), MeshError> {
        let mut used = vec![false; self.node_count()];
        for node in self.tets.iter().flatten() {
            used[*node as usize] = true;
        }
        match used.iter().position(|u| !u) {
            None => Ok(()),
            Some(node) => Err(MeshError::UnreferencedNode {
                node,
                count: used.iter().filter(|u| !**u).count(),
            }),
        }
    }

    fn check_surface(&self) -> Result<(), MeshError> {
        let rotate = |face: [u32; 3]| {
            let lowest = (0..3).min_by_key(|k| face[*k]).unwrap_or(0);
            [face[lowest], face[(lowest + 1) % 3], face[(lowest + 2) % 3]]
        };
        let expected: HashSet<[u32; 3]> = boundary_faces(&self.tets)?
            .into_iter()
            .map(rotate)
            .collect();
        for (row, nodes) in self.surface.iter().enumerate() {
            if !expected.contains(&rotate(*nodes)) {
                return Err(MeshError::NotBoundary { row, nodes: *nodes });
            }
        }
        let found: HashSet<[u32; 3]> = self.surface.iter().map(|f| rotate(*f)).collect();
        if found.len() != expected.len() || self.surface.len() != expected.len() {
            return Err(MeshError::SurfaceCount {
                expected: expected.len(),
                found: self.surface.len(),
            });
        }
        Ok(())
    }

    fn check_sets(&self) -> Result<(), MeshError> {
        for (index, row) in self.domain.iter().enumerate() {
            if *row as usize >= self.surface.len() {
                return Err(MeshError::DomainOutOfRange {
                    index,
                    row: *row,
                    count: self.surface.len(),
                });
            }
        }
        for (field, set) in [("fixed", &self.fixed), ("supported", &self.supported)] {
            for index in 1..set.len() {
                if set[index] <= set[index - 1] {
                    return Err(MeshError::NotAscending {
                        field,
                        index,
                        value: set[index],
                    });
                }
            }
        }
        match self
            .supported
            .iter()
            .find(|node| self.fixed.binary_search(node).is_ok())
        {
            Some(node) => Err(MeshError::NotDisjoint { node: *node }),
            None => Ok(()),
        }
    }
}

fn check_range<'a>(
    field: &'static str,
    rows: impl Iterator<Item = &'a [u32]>,
    count: usize,
) -> Result<(), MeshError> {
    for (row, nodes) in rows.enumerate() {
        if let Some(node) = nodes.iter().find(|node| **node as usize >= count) {
            return Err(MeshError::NodeOutOfRange {
                field,
                row,
                node: *node,
                count,
            });
        }
    }
    Ok(())
}
